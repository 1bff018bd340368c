// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/machine.h"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/random.h>

#include <chrono>
#include <stdexcept>

namespace tendon {

LocalTime read_clock() { return LocalTime(std::chrono::steady_clock::now().time_since_epoch()); }

Duration read_unix_clock() { return std::chrono::system_clock::now().time_since_epoch(); }

bool has_one_processor() {
  cpu_set_t allowed;
  return sched_getaffinity(0, sizeof allowed, &allowed) == 0 && CPU_COUNT(&allowed) == 1;
}

Punctual::Punctual() noexcept : slack_ns_(::prctl(PR_GET_TIMERSLACK, 0UL, 0UL, 0UL, 0UL)) {
  ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
}

Punctual::~Punctual() {
  if (slack_ns_ > 0) ::prctl(PR_SET_TIMERSLACK, static_cast<unsigned long>(slack_ns_), 0UL, 0UL, 0UL);
}

Seed seed_from_system() {
  Seed seed;
  if (getrandom(seed.bytes.data(), seed.bytes.size(), 0) != static_cast<ssize_t>(seed.bytes.size())) {
    throw std::runtime_error("cannot read random numbers from the system");
  }
  return seed;
}

}  // namespace tendon
