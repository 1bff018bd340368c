// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/base/motion.h"
#include "core/field/field.h"

namespace tendon {

/// A request of an engine to use a field in a channel (core/field/README.md). If `field` is null, the channel stops using
/// the field of `source`.
struct FieldUse {
  const field::Field* field = nullptr;  ///< valid (Field::expect_valid); not owned, and not changed while it is in use
  std::uint32_t generation = 0;  ///< > 0; chosen by the engine, and contained in its true forces (RemoteForce::field)
  std::uint32_t source = 0;      ///< as in RemoteForce
};

/// The state of the fields in a haptic step. If several channels use fields, the force and the energies are sums. The
/// other values are those of the first channel with contact, or of the first channel if there is no contact.
struct FieldStep {
  std::uint32_t generation = 0;
  std::uint8_t channel = 0;
  bool swapping = false;      ///< true for a short time after a field was used or replaced
  double depth = 0;           ///< m, distance between proxy and hand, or 0 if there is no contact
  Vec3 proxy = Vec3::Zero();  ///< m, base frame
  Vec3 force = Vec3::Zero();  ///< N, on the hand; already included in Step::wanted
  double stored = 0;          ///< H, J
  double refused = 0;         ///< J that the gates refused in this step
  double credit = 0;          ///< J from the tanks, credited to the account before the force was bounded
};

}  // namespace tendon
