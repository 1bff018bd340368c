// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <ostream>

namespace tendon::lab {

struct CostOptions {
  int batches = 200;
  std::optional<std::filesystem::path> out{};  ///< folder for the figure
  bool json = false;
};

/// `tendon-lab cost`: nanoseconds (and instructions, where the kernel lets us count them) in one step of each law, each
/// part of AOL+, each model of the output estimator and each form and order of its least squares in float32 and
/// float64, beside the force error that is left with it. The floor is the same loop with nothing in it, in the same
/// run; it is not taken off.
void cost(const CostOptions& options, std::ostream& out);

}  // namespace tendon::lab
