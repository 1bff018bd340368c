// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "tests/tools/lab/experiments/experiment.h"

namespace tendon::lab {

// Lower bounds for any law, with motion and object known in advance.

/// The constraint that makes a held force passive. E is the account, ℓ that of core/ledger/output_bound.h.
enum class Passive : std::uint8_t {
  kOnThisMotion,   ///< E(n) ≥ 0, for this motion only
  kWhateverComes,  ///< ℓ(F) ≤ E, for every next motion; the constraint of unconditionally passive laws
  kAccelerating,   ///< ℓ(F) ≤ E with the travel possible under bounded acceleration
};

struct FloorProblem {
  std::vector<double> dx{};     ///< m, the distance while force k is held
  std::vector<double> truth{};  ///< N, on the hand. It must have the same size as dx.
  Friction friction{};          ///< of the device; viscous > 0
  Duration period{};            ///< T, of each hold
  double max_force = 0;         ///< N
  double acceleration = 300;    ///< m/s², for kAccelerating
};

struct Floor {
  double error = 0;  ///< rms of F − truth over rms of truth, of the forces found
  /// Lower bound of the error of all forces (duality gap of the barrier). 0 if the last barrier did not converge.
  double at_least = 0;
  std::vector<double> force;  ///< N
};

/// The forces with the least error that satisfy the passivity constraint: the convex program
///
///     minimise Σ (F_k − t_k)²   subject to   E_(k+1) = E_k − F_k Δx_k + f_c |Δx_k| + b Δx_k²/T,   |F_k| ≤ F_max
///
/// and the constraint of `sense`, by an interior point method: a logarithmic barrier, and Newton steps by a Riccati
/// recursion, because E is the only state. E₀ = 1 µJ. Before the first period the hand is at rest.
///
/// Throws std::invalid_argument if the sizes differ, all true forces are zero, or a value is invalid.
///
/// Source: Boyd and Vandenberghe, Convex Optimization, 2004, 11.3 (barrier, gap m/t); the recursion: Wright, J. Optim.
/// Theory Appl. 77(1), 1993.
Floor floor_of(const FloorProblem& problem, Passive sense);

/// Returns the bound for a recorded motion along x; nullopt for another motion or if all true forces are zero.
std::optional<double> floor_of(const std::vector<Moment>& record, const Friction& friction, Duration period,
                               double max_force, Passive sense);

/// Of a hand of `compare` on an ideal spring without sampling (N/m): 2 s, T = 1 ms.
FloorProblem on_perfect_spring(double stiffness, const Friction& friction, bool firm);

struct FloorOptions {
  std::optional<std::filesystem::path> out{};  ///< folder for floor.csv
  std::string command{};                       ///< repeats the run
  bool json = false;
};

void floors(const FloorOptions& options, std::ostream& out);

}  // namespace tendon::lab
