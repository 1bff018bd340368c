// SPDX-License-Identifier: Apache-2.0
#include "server/recording/datagram_filter.h"

namespace tendon {

DatagramFilter::Verdict DatagramFilter::judge(LocalTime now, Sender sender, std::size_t size) noexcept {
  if (now >= second_ends_) {
    second_ends_ = now + std::chrono::seconds(1);
    unauthenticated_ = 0;
    bytes_ = 0;
  }
  if (sender == Sender::kUnauthenticated && unauthenticated_ >= config_.unauthenticated_per_s)
    return Verdict::kUnauthenticated;
  if (size > config_.bytes_per_s - bytes_) return Verdict::kOverBudget;
  bytes_ += size;
  if (sender == Sender::kUnauthenticated) ++unauthenticated_;
  return Verdict::kRecord;
}

}  // namespace tendon
