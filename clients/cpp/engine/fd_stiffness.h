// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>

#include "protocol/messages.h"

namespace tendon {

/// How to put an engine with state back to where it was. Both empty: it has no state, its force is a function of the
/// position alone.
struct SavedState {
  std::function<void()> save{};
  std::function<void()> restore{};  ///< to what was saved last, as often as it is called
};

/// A stiffness found by differences, and two measures of its error.
struct FdStiffness {
  Mat3 stiffness = Mat3::Zero();  ///< N/m, symmetric: (D + Dᵀ)/2, as the server takes it
  /// N/m, the largest |D_ij − D_ji|/2, which the symmetric part leaves out. Not 0 where the force is not a gradient
  /// (friction, an asymmetric engine) or is noisy.
  double asymmetry = 0;
  /// N/m, the largest |F_i(x + h·e_j) + F_i(x − h·e_j) − 2·F_i(x)|/2h: half the difference between
  /// the stiffness ahead and the stiffness behind. A surface within h shows here: a wall's edge has K/2.
  double kink = 0;
};

/// The stiffness of a force by central differences, for engines that know no derivative:
///
///     D_ij = −[F_i(x + h·e_j) − F_i(x − h·e_j)] / 2h          N/m, with an error of h²/6·F''' + (noise of F)/h
///
/// Seven calls of `force` (N, on the hand, at a position in m), with h = `step` (m). With `state` the engine is saved
/// once, put back before each call, and once more at the end, whatever happens. Empty where a force was not finite.
/// Throws std::invalid_argument when `step` is not a number > 0, or only one half of `state` is there; what `force`
/// throws passes through.
std::optional<FdStiffness> fd_stiffness(const std::function<Vec3(const Vec3& position)>& force, const Vec3& at,
                                        double step, const SavedState& state = {});

}  // namespace tendon
