// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/other_process.h"

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

}  // namespace tendon::bench
