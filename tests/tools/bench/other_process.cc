// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/other_process.h"

#include <sched.h>
#include <sys/prctl.h>
#include <sys/resource.h>

#include <cerrno>
#include <system_error>

namespace tendon::bench {

void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

Duration read(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

void raise_file_limit() {
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
}

void end_with_parent() { ::prctl(PR_SET_PDEATHSIG, SIGKILL); }

AtPriority::AtPriority(int priority) {
  if (priority == 0) return;
  ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  sched_param param{};
  param.sched_priority = priority;
  if (::sched_setscheduler(0, SCHED_FIFO, &param) != 0) {
    throw std::system_error(errno, std::generic_category(), "SCHED_FIFO " + std::to_string(priority));
  }
  raised_ = true;
}

AtPriority::~AtPriority() {
  if (!raised_) return;
  const sched_param param{};
  ::sched_setscheduler(0, SCHED_OTHER, &param);
}

}  // namespace tendon::bench
