// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/touch/pushes.h"

#include <algorithm>
#include <cstddef>
#include <utility>

namespace tendon::softbody {
namespace {

/// First, all wrong nodes change at once, which may lead to a cycle. Then only the worst one changes, so that the
/// energy decreases and the search ends (Lawson & Hanson 1974).
constexpr int kQuickRounds = 20;
constexpr int kMostSweeps = 1000;

}  // namespace

Pushes least_pushes(const MatrixXd& table, const VectorXd& depth, std::vector<bool>& active) {
  const auto count = depth.size();
  if (std::ranges::find(active, true) == active.end()) active.assign(active.size(), true);
  const double nothing = 1e-12 * depth.maxCoeff();
  Pushes found;
  auto& [set, push, factor] = found;
  for (int round = 0; round < kMostSweeps; ++round) {
    set.clear();
    for (Eigen::Index i = 0; i < count; ++i) {
      if (active[static_cast<std::size_t>(i)]) set.push_back(i);
    }
    factor.compute(table(set, set));
    push = factor.solve(depth(set));
    // A node is wrong if it pulls, or if it is inside the tool.
    const VectorXd left = depth - table(Eigen::all, set) * push;
    std::vector<std::pair<double, std::size_t>> wrong;
    for (std::size_t k = 0; k < set.size(); ++k) {
      const double pull = -push[static_cast<Eigen::Index>(k)] * table(set[k], set[k]);
      if (pull > nothing) wrong.emplace_back(pull, static_cast<std::size_t>(set[k]));
    }
    for (std::size_t i = 0; i < active.size(); ++i) {
      const double inside_by = left[static_cast<Eigen::Index>(i)];
      if (!active[i] && inside_by > nothing) wrong.emplace_back(inside_by, i);
    }
    if (wrong.empty()) break;
    if (round >= kQuickRounds) wrong = {*std::ranges::max_element(wrong)};
    for (const auto& [amount, i] : wrong) active[i] = !active[i];
  }
  return found;
}

}  // namespace tendon::softbody
