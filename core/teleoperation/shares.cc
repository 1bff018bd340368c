// SPDX-License-Identifier: Apache-2.0
#include "core/teleoperation/shares.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

Shares::Shares(std::span<const double> shares) : count_(shares.size()) {
  expect(count_ >= 1 && count_ <= kMost, "leaders", static_cast<double>(count_), "1 to 4");
  double sum = 0;
  for (std::size_t i = 0; i < count_; ++i) {
    expect(shares[i] >= 0 && shares[i] <= 1, "share", shares[i], "0 to 1");
    now_[i] = goal_[i] = shares[i];
    sum += shares[i];
  }
  expect(std::abs(sum - 1) <= kRounding, "share", sum, "shares whose sum is 1");
}

void Shares::set(std::size_t leader, double share) noexcept {
  if (leader >= count_ || count_ == 1 || !(share >= 0 && share <= 1)) return;
  double others = 0;
  for (std::size_t i = 0; i < count_; ++i) others += i == leader ? 0 : goal_[i];
  for (std::size_t i = 0; i < count_; ++i) {
    const double part = others > 0 ? goal_[i] / others : 1 / static_cast<double>(count_ - 1);
    goal_[i] = i == leader ? share : (1 - share) * part;
  }
  left_ = kHandOver;
}

void Shares::advance(Duration elapsed) noexcept {
  if (left_ == Duration::zero()) return;
  const Duration step = std::clamp(elapsed, Duration::zero(), left_);
  const double part = seconds(step) / seconds(left_);  // exactly 1 at the end
  for (std::size_t i = 0; i < count_; ++i) now_[i] = part == 1 ? goal_[i] : now_[i] + part * (goal_[i] - now_[i]);
  left_ -= step;
}

}  // namespace tendon
