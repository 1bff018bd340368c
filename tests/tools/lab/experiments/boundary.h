// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>

#include "core/stability/sampled_spring.h"
#include "tests/support/swept_work.h"

namespace tendon::lab {

/// Returns the maximum K (N/m) at which a SimulatedDevice without a hand comes to rest on a sampled and held spring;
/// above it, 1 mm grows over 60 periods. By bisection to 0.5 %. No Coulomb friction or encoder counts.
double simulated_stiffness_limit(const SampledSpring& spring);

struct BoundaryOptions {
  double mass = 0.075;                         ///< kg
  double viscous = 0.26;                       ///< N·s/m
  std::optional<std::filesystem::path> out{};  ///< folder for boundary.csv and the figure
  std::string command{};                       ///< repeats the run
  bool json = false;
  Part part{};  ///< the units are the rows of the table (0 to 17)
};

/// Stability limit of a spring over delay and rate, simulated and in closed form.
void boundary(const BoundaryOptions& options, std::ostream& out);

}  // namespace tendon::lab
