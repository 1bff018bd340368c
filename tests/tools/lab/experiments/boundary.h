// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>

#include "core/stability/sampled_spring.h"
#include "tests/support/swept_work.h"

namespace tendon::lab {

/// The K (N/m) from which SimulatedDevice, without a hand, does not come to rest on a spring that is sampled and held:
/// 1 mm off, its amplitude grows over 60 of its own periods. Found by bisection to 0.5 %. Mass, b, T and d as in
/// `spring`; neither Coulomb friction nor counts.
double simulated_stiffness_limit(const SampledSpring& spring);

struct BoundaryOptions {
  double mass = 0.075;                         ///< kg
  double viscous = 0.26;                       ///< N·s/m
  std::optional<std::filesystem::path> out{};  ///< folder for the figure
  bool json = false;
  Part part{};  ///< its units are the rows of the table, 0 to 17
};

/// `tendon-lab boundary`: how stiff a spring may be over delay and over rate, simulated beside the closed forms.
void boundary(const BoundaryOptions& options, std::ostream& out);

}  // namespace tendon::lab
