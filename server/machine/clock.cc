// SPDX-License-Identifier: Apache-2.0
#include "server/machine/clock.h"

#include <cerrno>
#include <ctime>

namespace tendon::clock {

namespace {

Duration read(clockid_t id) noexcept {
  timespec time{};
  clock_gettime(id, &time);
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

}  // namespace

LocalTime now() noexcept { return LocalTime(read(CLOCK_MONOTONIC)); }

void sleep_until(LocalTime deadline) noexcept {
  const auto since = deadline.time_since_epoch();
  const auto whole = std::chrono::floor<std::chrono::seconds>(since);
  const timespec time{.tv_sec = whole.count(), .tv_nsec = (since - whole).count()};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, nullptr) == EINTR) {
  }
}

Duration processor_time() noexcept { return read(CLOCK_THREAD_CPUTIME_ID); }

Duration unix_time() noexcept { return read(CLOCK_REALTIME); }

Duration unix_offset() noexcept { return unix_time() - read(CLOCK_MONOTONIC); }

}  // namespace tendon::clock
