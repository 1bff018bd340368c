// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "protocol/messages.h"

namespace tendon {

/// Saves and restores the state of an engine. Leave both empty if the force depends only on the position.
struct SavedState {
  std::function<void()> save{};
  std::function<void()> restore{};  ///< to the last saved state; may be called repeatedly
};

struct FdStiffness {
  Mat3 stiffness = Mat3::Zero();  ///< N/m, symmetric: (D + Dᵀ)/2, as the server requires
  /// N/m, max |D_ij − D_ji|/2, the part that symmetrization removes. Nonzero if the force is not a gradient
  /// (friction, asymmetric engine) or is noisy.
  double asymmetry = 0;
  /// N/m, max |F_i(x + h·e_j) + F_i(x − h·e_j) − 2·F_i(x)|/2h, half the difference of the one-sided stiffnesses. It
  /// reveals a surface within h: at the edge of a wall of stiffness K it is K/2.
  double kink = 0;
};

/// Computes the stiffness of a force by central differences, for engines without an analytic derivative:
///
///     D_ij = −[F_i(x + h·e_j) − F_i(x − h·e_j)] / 2h          N/m, with error h²/6·F''' + (noise of F)/h
///
/// Calls `force` (N, acting on the hand, at a position in m) seven times with h = `step` (m). With `state`, saves the
/// engine once and restores it before each call and at the end, even after an exception. Returns nullopt if a force
/// is not finite. Throws std::invalid_argument if `step` is not a number > 0 or only one function of `state` is set.
/// Exceptions of `force` propagate.
std::optional<FdStiffness> fd_stiffness(const std::function<Vec3(const Vec3& position)>& force, const Vec3& at,
                                        double step, const SavedState& state = {});

}  // namespace tendon
