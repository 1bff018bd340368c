// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <span>

#include "core/base/time.h"

namespace tendon {

/// The shares of several leaders of one follower: α_i ∈ [0, 1] and Σ α_i = 1 in each period. A share changes linearly
/// to its new value within kHandOver. The other shares change at the same time, in proportion to their target values,
/// or equally if these are 0. A new value during a change starts a new line at the current values. The share of a
/// leader does not change if it is not engaged. Thread-safe: no. Realtime-safe: yes, except the constructor.
class Shares {
 public:
  static constexpr std::size_t kMost = 4;
  static constexpr Duration kHandOver = std::chrono::milliseconds(500);
  static constexpr double kRounding = 1e-9;  ///< tolerance of the sum in the constructor

  /// Requires 1 … kMost shares. Throws std::invalid_argument with the field, its value and the expected value.
  explicit Shares(std::span<const double> shares);

  /// Does nothing if the leader does not exist or is the only one, or if `share` is not in [0, 1].
  void set(std::size_t leader, double share) noexcept;
  void advance(Duration elapsed) noexcept;

  double operator[](std::size_t leader) const noexcept { return now_[leader]; }

 private:
  std::size_t count_;
  std::array<double, kMost> now_{};
  std::array<double, kMost> goal_{};
  Duration left_{};  ///< until `goal_` is reached
};

}  // namespace tendon
