// SPDX-License-Identifier: Apache-2.0
#include "server/realtime.h"

#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <sys/prctl.h>

#include <array>
#include <cstddef>
#include <system_error>

namespace tendon {

namespace {

// Faults in the part of the stack that the loop will use, so that it never does so in a step.
void touch_stack() {
  constexpr std::size_t kBytes = 128 * 1024;
  constexpr std::size_t kPage = 4096;
  std::array<volatile std::byte, kBytes> stack;
  for (std::size_t i = 0; i < kBytes; i += kPage) stack[i] = std::byte{0};
}

}  // namespace

void enter_punctual() { prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL); }

std::vector<std::string> enter_realtime(int priority) {
  std::vector<std::string> refused;
  enter_punctual();
  sched_param param{};
  param.sched_priority = priority;
  if (const int error = pthread_setschedparam(pthread_self(), SCHED_FIFO, &param); error != 0) {
    refused.push_back("the haptic thread runs without real-time priority (SCHED_FIFO " + std::to_string(priority) +
                      ": " + std::system_category().message(error) +
                      "); expect late steps under load. Grant it with LimitRTPRIO= in the unit, or rtprio in "
                      "/etc/security/limits.d");
  }
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    refused.push_back(
        "memory is not locked (mlockall: " + std::system_category().message(errno) +
        "); a page fault may delay a step. Grant it with LimitMEMLOCK=infinity in the unit, or memlock in "
        "/etc/security/limits.d");
  }
  touch_stack();
  return refused;
}

}  // namespace tendon
