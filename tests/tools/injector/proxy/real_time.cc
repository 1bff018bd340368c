// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/real_time.h"

#include <ctime>

namespace tendon::injector {
namespace {

Duration read(clockid_t id) noexcept {
  timespec time{};
  clock_gettime(id, &time);
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

}  // namespace

LocalTime monotonic_now() noexcept { return LocalTime(read(CLOCK_MONOTONIC)); }

ClockPair read_both_clocks() noexcept {
  ClockPair best{};
  Duration narrowest = Duration::max();
  // Three readings take 0.2 µs; an interruption of all of them is practically excluded.
  for (int i = 0; i < 3; ++i) {
    const Duration before = read(CLOCK_MONOTONIC);
    const Duration calendar = read(CLOCK_REALTIME);
    const Duration after = read(CLOCK_MONOTONIC);
    if (after - before >= narrowest) continue;
    narrowest = after - before;
    best = {LocalTime(after), calendar - (before + narrowest / 2)};
  }
  return best;
}

}  // namespace tendon::injector
