// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/meter.h"

#include <linux/perf_event.h>
#include <sys/ioctl.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <ctime>

namespace tendon::lab {
namespace {

double clock_seconds(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

}  // namespace

Meter::Meter() {
  perf_event_attr attributes{};
  attributes.type = PERF_TYPE_HARDWARE;
  attributes.size = sizeof(attributes);
  attributes.config = PERF_COUNT_HW_INSTRUCTIONS;
  attributes.exclude_kernel = 1;
  attributes.exclude_hv = 1;
  counter_ = static_cast<int>(::syscall(SYS_perf_event_open, &attributes, 0, -1, -1, 0));
}

Meter::~Meter() {
  if (counter_ >= 0) ::close(counter_);
}

Meter::Reading Meter::read() const {
  Reading now{.wall = clock_seconds(CLOCK_MONOTONIC), .processor = clock_seconds(CLOCK_PROCESS_CPUTIME_ID)};
  std::uint64_t count = 0;
  if (counter_ >= 0 && ::read(counter_, &count, sizeof(count)) == sizeof(count)) now.instructions = count;
  return now;
}

Meter::Reading Meter::Reading::operator-(const Reading& before) const {
  Reading cost{.wall = wall - before.wall, .processor = processor - before.processor};
  if (instructions && before.instructions) cost.instructions = *instructions - *before.instructions;
  return cost;
}

}  // namespace tendon::lab
