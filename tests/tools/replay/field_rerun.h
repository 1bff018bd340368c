// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <list>
#include <optional>
#include <vector>

#include "core/field/brick_field.h"
#include "core/field/field.h"
#include "core/haptic_controller.h"
#include "core/remote/force_channels.h"
#include "server/recording/records.h"

namespace tendon::replay {

/// Renders the recorded fields of a device again, from their data, poses and true forces and the recorded motion and
/// account. All numbers are identical to the last bit, except if several channels have the rule kPriority, because
/// their weights also depend on forces that are not recorded.
///
/// Thread-safe: no. Realtime-safe: no.
class FieldRerun {
 public:
  /// Throws as HapticController does. If the part `field` is not listed, `step` returns nothing.
  explicit FieldRerun(const HapticController::Config& control);

  /// Throws std::runtime_error if the data are not valid.
  void take(const FieldData& data);
  /// Must be called before the step with the same tick. Throws std::runtime_error if the field of a kUse has no data.
  void take(const FieldInput& input);

  /// Returns StepRecord::field.
  std::optional<FieldStep> step(const StepRecord& recorded);

 private:
  struct Built {
    std::uint32_t channel = 0;
    std::uint32_t source = 0;
    std::uint32_t generation = 0;
    field::Field field;
  };
  struct Shape {
    std::vector<std::byte> manifest;
    field::BrickField bricks;
  };

  void use(const FieldInput& input);
  const field::BrickField* bricks_of(const FieldData& data);
  void forget_shapes();

  double max_stiffness_;
  ForceChannels channels_;
  std::list<Shape> shapes_;  ///< those of `built_`, and some older ones
  std::list<Built> built_;   ///< if a field is used, all older fields of the channel are removed
};

}  // namespace tendon::replay
