// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "core/motion.h"

namespace tendon {

/// The remote environment near one position, linearised, so that the device loop can follow the hand
/// between two remote forces:
///
///     F(x) = force − stiffness · (x − at)          N, with stiffness = −∂F/∂x in N/m
///
/// A spring has a positive stiffness; a wall with normal n has k·n·nᵀ.
struct LocalModel {
  Vec3 at = Vec3::Zero();         ///< m, the position the force was computed for
  Mat3 stiffness = Mat3::Zero();  ///< N/m
};

/// What a remote physics engine wants the hand to feel.
///
/// **Sign, everywhere in Tendon:** a force is what the device exerts *on the hand*, so a wall that
/// resists motion along +x sends −x. (The reflective force f of Lee & Lee 2009 is its negative.)
struct RemoteForce {
  std::uint64_t sequence = 0;      ///< strictly increasing per session; 0 means "none yet"
  std::uint64_t answers_tick = 0;  ///< the haptic step whose motion this force answers
  LocalTime answers{};             ///< when that motion was sampled; now − answers = the loop's age
  LocalTime received{};            ///< when it reached us
  Vec3 force = Vec3::Zero();       ///< N, on the hand
  std::optional<LocalModel> model;
  Duration valid_for{};      ///< counted from `received`; older than this it is no longer fresh
  std::uint32_t source = 0;  ///< who sent it: the forces of another engine are ramped in
};

}  // namespace tendon
