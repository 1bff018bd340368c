// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "protocol/messages.h"

namespace tendon {

/// The physics engine's answer to one device state.
struct Touch {
  Touch() = default;
  /// Implicit, so that a callback may simply return a Vec3.
  Touch(const Vec3& f) : force(f) {}  // NOLINT(google-explicit-constructor)

  Vec3 force = Vec3::Zero();  ///< N, on the hand: a wall that resists motion along +x sends −x
  // The rest lets the device loop follow the hand until the next answer (core/remote/answer.h). The engine gives as
  // much of it as it knows; the server uses it when both have agreed to `kFeatureLocalModel`.
  std::optional<Mat3> stiffness{};  ///< N/m, −∂force/∂position at the state's position; a wall with normal n: k·n·nᵀ
  double valid_radius = std::numeric_limits<double>::infinity();  ///< m, how far from there the stiffness holds
  std::optional<Contact> contact{};  ///< the surface, with the force at other depths in a table where that is known
  /// The body has been cut or torn since the previous answer: the server then uses neither answer's stiffness or table.
  bool topology_changed = false;
  std::optional<double> error{};  ///< N, the engine's own estimate of the error of `force`; recorded with it
  /// Which of Config::ways has answered, from 1 on; 0: not said. It is left out where there is none of that number
  /// (Stats::left_out), and of a server that does not know `kFeatureWays`.
  std::uint32_t way = 0;
  // For a device whose handle has more motors than those of its position (ForceClient::handle()), of a server that
  // knows `kFeatureHandle`; another one is sent `force` without these (Stats::left_out).
  std::optional<Vec3> torque{};  ///< N·m, on the hand, base frame axes, about the handle's position
  /// N·m/rad, −∂torque/∂θ at the state's orientation: with it the device loop follows the turning hand. Symmetric; a
  /// spring is positive. Only in answer to a state with an orientation.
  std::optional<Mat3> angular_stiffness{};
  std::optional<double> grip_force{};  ///< N, on the fingers of the gripper; > 0 opens them
  /// How long the server may take this answer as fresh, for an engine that knows it: cut to 1 µs … limits::kMaxValidFor.
  /// Empty: Config::valid_for.
  std::optional<Duration> valid_for{};
  /// The engine knows no force: nothing is sent, because a zero would look known. The rest does not matter.
  bool unknown = false;
};

/// All of `touch` as an answer to `hand`. `sequence`, `valid_for`, `device` and `channel` are the caller's to set.
/// Angular stiffness without Turning in `hand` cannot be said and is left out.
ForceCommand to_command(const Touch& touch, const DeviceState& hand);

/// What `command` says of the force, as an answer to the state that it was made for.
Touch to_touch(const ForceCommand& command);

}  // namespace tendon
