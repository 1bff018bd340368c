// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <ostream>
#include <vector>

#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab {

// What any law could do at best on a given motion: knowing it, and the object, in advance. What a law is above its
// floor, it may still win; below it no cleverness leads.

/// In which sense a force has to be safe while it is held. E is the account, ℓ of core/ledger/output_bound.h.
enum class Passive : std::uint8_t {
  kOnThisMotion,   ///< E(n) ≥ 0: for this one motion only
  kWhateverComes,  ///< ℓ(F) ≤ E: whatever the next motion is. What "unconditional" laws keep
  kAccelerating,   ///< ℓ(F) ≤ E with the travel that a bounded acceleration leaves
};

/// A motion along one axis, and the force that would be true on it.
struct FloorProblem {
  std::vector<double> dx{};     ///< m, [k]: the travel while force k is held
  std::vector<double> truth{};  ///< N, on the hand; as many
  Friction friction{};          ///< of the device; viscous > 0
  Duration period{};            ///< T, of each hold
  double max_force = 0;         ///< N
  double acceleration = 300;    ///< m/s², of kAccelerating
};

struct Floor {
  double error = 0;  ///< rms of F less truth, over rms of truth: of the forces found
  /// No forces have less: the floor itself is between the two (gap of the barrier). 0 when the last barrier was not
  /// centred, and nothing is known.
  double at_least = 0;
  std::vector<double> force;  ///< N
};

/// The least error of any forces that are passive in this sense. It solves the convex programme
///
///     minimise Σ (F_k − t_k)²   subject to   E_(k+1) = E_k − F_k Δx_k + f_c |Δx_k| + b Δx_k²/T,   |F_k| ≤ F_max
///
/// and the constraint of the sense, by an interior point method: a logarithmic barrier, Newton's step by a Riccati
/// recursion because the only state is E. E₀ = 1 µJ.
///
/// Throws std::invalid_argument when the sizes differ, no force is true, or a value is impossible. Before the first
/// period the hand is at rest.
///
/// Source: Boyd and Vandenberghe, Convex Optimization, 2004, 11.3 (barrier, gap m/t); the recursion: Wright, J. Optim.
/// Theory Appl. 77(1), 1993.
Floor floor_of(const FloorProblem& problem, Passive sense);

/// The floor on the motion of a record that lies along x; empty when it does not, or when nothing is true on it.
std::optional<double> floor_of(const std::vector<Moment>& record, const Friction& friction, Duration period,
                               double max_force, Passive sense);

/// The motion of a hand of `compare` on the perfect spring, which shows −stiffness · x (N/m) at once: 2 s, T = 1 ms.
FloorProblem on_perfect_spring(double stiffness, const Friction& friction, bool firm);

struct FloorOptions {
  std::optional<std::filesystem::path> out{};  ///< folder for floor.csv
  bool json = false;
};

/// `tendon-lab floor`: the floors of the hands of `compare` on perfect springs.
void floors(const FloorOptions& options, std::ostream& out);

}  // namespace tendon::lab
