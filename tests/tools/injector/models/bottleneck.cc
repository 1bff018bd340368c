// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/bottleneck.h"

#include <algorithm>

#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {
namespace {

constexpr std::uint64_t kBytesPerOpportunity = 1500;  // mm-link's MTU

}  // namespace

BottleneckQueue::BottleneckQueue(Bottleneck bottleneck, LocalTime start)
    : bottleneck_(std::move(bottleneck)),
      start_(start),
      last_arrival_(start),
      free_(start),
      bytes_left_(kBytesPerOpportunity) {}

std::optional<LocalTime> BottleneckQueue::pass(LocalTime arrival, std::uint32_t size) {
  arrival = last_arrival_ = std::max(arrival, last_arrival_);
  while (!waiting_.empty() && waiting_.front().first <= arrival) {
    bytes_waiting_ -= waiting_.front().second;
    waiting_.pop_front();
  }
  const std::uint64_t bytes = std::uint64_t{size} + bottleneck_.overhead;
  const bool room =
      bottleneck_.queue_in_bytes ? bytes_waiting_ + bytes <= bottleneck_.queue : waiting_.size() < bottleneck_.queue;
  if (!room) return std::nullopt;
  free_ = bottleneck_.bits_per_second > 0 ? sent_at_rate(arrival, bytes) : sent_at_opportunities(arrival, bytes);
  waiting_.emplace_back(free_, bytes);
  bytes_waiting_ += bytes;
  return free_;
}

LocalTime BottleneckQueue::sent_at_rate(LocalTime arrival, std::uint64_t bytes) {
  if (arrival > free_) {
    free_ = arrival;
    remainder_ = 0;
  }
  const std::uint64_t work = bytes * 8 * 1'000'000'000 + remainder_;  // below 2⁵⁰
  remainder_ = work % bottleneck_.bits_per_second;
  return free_ + Duration(work / bottleneck_.bits_per_second);
}

LocalTime BottleneckQueue::opportunity(std::uint64_t index) const {
  const auto& times = bottleneck_.opportunities_ms;
  const std::uint64_t ms = index / times.size() * times.back() + times[index % times.size()];
  return start_ + std::chrono::milliseconds(ms);
}

LocalTime BottleneckQueue::sent_at_opportunities(LocalTime arrival, std::uint64_t bytes) {
  const auto& times = bottleneck_.opportunities_ms;
  const auto since = static_cast<std::uint64_t>((std::max(arrival, free_) - start_).count());
  const std::uint64_t since_ms = (since + 999'999) / 1'000'000;
  const std::uint64_t cycle = since_ms == 0 ? 0 : (since_ms - 1) / times.back();
  const auto in_cycle = std::ranges::lower_bound(times, since_ms - cycle * times.back());
  const std::uint64_t first = cycle * times.size() + static_cast<std::uint64_t>(in_cycle - times.begin());
  if (first > opportunity_) {  // unused bytes of earlier opportunities are lost
    opportunity_ = first;
    bytes_left_ = kBytesPerOpportunity;
  }
  for (; bytes > bytes_left_; bytes_left_ = kBytesPerOpportunity) {
    bytes -= bytes_left_;
    ++opportunity_;
  }
  bytes_left_ -= bytes;
  return opportunity(opportunity_);
}

void BottleneckQueue::continue_from(BottleneckQueue&& before) noexcept {
  last_arrival_ = before.last_arrival_;
  free_ = before.free_;
  waiting_ = std::move(before.waiting_);
  bytes_waiting_ = before.bytes_waiting_;
}

}  // namespace tendon::injector
