// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/base/time.h"

namespace tendon {

/// How much each of several leaders of one follower counts: α_i ∈ [0, 1], Σ α_i = 1 in every period.
///
/// A share that is set is reached on a straight line within kHandOver. The others share what is left in the proportion
/// in which they are to count already, equally when that is nothing; they arrive at the same time. A share that is set
/// meanwhile begins a new line where the old one stands.
///
/// A leader that is not engaged keeps its share: the others do not grow by it.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class Shares {
 public:
  static constexpr std::size_t kMost = 4;
  static constexpr Duration kHandOver = std::chrono::milliseconds(500);
  static constexpr double kRounding = 1e-9;  ///< by which the sum that the constructor is given may be off

  /// 1 … kMost of them. Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Shares(std::span<const double> shares);

  /// Nothing happens when there is no such leader, when it is the only one, or when `share` is not in [0, 1].
  void set(std::size_t leader, double share) noexcept;
  void advance(Duration elapsed) noexcept;

  double operator[](std::size_t leader) const noexcept { return now_[leader]; }

 private:
  std::size_t count_;
  std::array<double, kMost> now_{};
  std::array<double, kMost> goal_{};
  Duration left_{};  ///< until the goal is reached
};

}  // namespace tendon
