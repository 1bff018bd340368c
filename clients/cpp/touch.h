// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "protocol/messages.h"

namespace tendon {

/// The answer of a physics engine to one device state.
struct Touch {
  Touch() = default;
  /// Implicit so that a callback can return a Vec3.
  Touch(const Vec3& f) : force(f) {}  // NOLINT(google-explicit-constructor)
  /// The true force of a field (ForceClient::use) at the state. It is not rendered, but corrects the field.
  static Touch truth(const Vec3& f) {
    Touch touch(f);
    touch.is_truth = true;
    return touch;
  }

  Vec3 force = Vec3::Zero();  ///< N, acting on the hand: a wall that resists motion along +x pushes along −x
  // The optional fields below allow the device loop to extrapolate the force until the next answer
  // (core/remote/answer.h). The server uses them if `kFeatureLocalModel` is negotiated.
  std::optional<Mat3> stiffness{};  ///< N/m, −∂force/∂position at the state's position; a wall with normal n: k·n·nᵀ
  double valid_radius = std::numeric_limits<double>::infinity();  ///< m, range of the stiffness
  std::optional<Contact> contact{};  ///< the contact surface, optionally with a table of force over depth
  /// The body was cut or torn since the previous answer. The server discards the stiffness and table of both answers.
  bool topology_changed = false;
  std::optional<double> error{};  ///< N, the engine's estimate of the error of `force`; for recordings
  /// Index into Config::ways of the method that computed this answer, starting at 1; 0: unspecified. It is not sent
  /// if the index is invalid (Stats::left_out) or the server does not support `kFeatureWays`.
  std::uint32_t way = 0;
  // For more actuators (ForceClient::handle()), with `kFeatureHandle`; else only `force` is sent (Stats::left_out).
  std::optional<Vec3> torque{};  ///< N·m, acting on the hand, in base frame axes, about the position of the handle
  /// N·m/rad, −∂torque/∂θ at the state's orientation, which must exist; symmetric, positive definite for a spring.
  std::optional<Mat3> angular_stiffness{};
  std::optional<double> grip_force{};   ///< N, on the fingers in the gripper; > 0 opens them
  std::optional<Duration> valid_for{};  ///< clamped to 1 µs … limits::kMaxValidFor; empty: Config::valid_for
  bool is_truth = false;                ///< not sent without a field; the stiffness is ignored
  bool unknown = false;                 ///< no force for this state: nothing is sent and the other fields are ignored
};

/// Converts `touch` to a command that answers `hand`. The caller must set `sequence`, `valid_for`, `device` and
/// `channel`. The angular stiffness is omitted if `hand` has no Turning.
ForceCommand to_command(const Touch& touch, const DeviceState& hand);

Touch to_touch(const ForceCommand& command);  ///< the result answers the state of `command`

}  // namespace tendon
