// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>
#include <string>

namespace tendon::lab {

struct CostOptions {
  int batches = 200;
  std::optional<std::filesystem::path> out{};  ///< folder for cost.csv and the figure
  std::string command{};                       ///< repeats the run
  bool json = false;
};

/// Time (and instructions, if the kernel counts them) per step of each law, part of AOL+, model of the output
/// estimator, and order of its least squares in float32 and float64, with the remaining force error. The baseline, an
/// empty loop in the same run, is not subtracted.
void cost(const CostOptions& options, std::ostream& out);

}  // namespace tendon::lab
