// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/hold_bound.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

HoldBound::HoldBound(Duration longest_hold, const Follow& follow) : follow_(follow), longest_hold_(longest_hold) {
  expect_above_zero(seconds(longest_hold), "longest_hold");
  expect_not_negative(follow.margin, "follow_holds.margin");
  expect_above_zero(seconds(follow.memory), "follow_holds.memory");
  expect(follow.most >= 1 && std::isfinite(follow.most), "follow_holds.most", follow.most,
         "a finite number of 1 or more");
}

void HoldBound::observe(Duration held) noexcept {
  if (held <= Duration::zero()) return;
  if (held > in_force()) {
    // The product is rounded up, because the bound must still cover `held` if the margin is 0.
    const double seen = std::ceil((1 + follow_.margin) * static_cast<double>(held.count()));
    const double most = follow_.most * static_cast<double>(longest_hold_.count());
    excess_ = std::max(excess_, Duration(static_cast<Duration::rep>(std::min(seen, most))) - longest_hold_);
  } else if (excess_ > Duration::zero()) {
    const double share = seconds(held) / seconds(follow_.memory);
    const Duration back(static_cast<Duration::rep>(static_cast<double>(excess_.count()) * std::min(share, 1.0)));
    excess_ = std::max(Duration::zero(), excess_ - std::max(back, Duration(1)));
  }
}

}  // namespace tendon
