// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <set>
#include <string>

namespace tendon::e2e {

/// The names of a process's threads at this moment, as `top -H` shows them.
std::set<std::string> threads_of(pid_t process);

/// Returns the state of a process from /proc. 'T' means stopped.
char state_of(pid_t process);

/// How often the thread of that name has gone to sleep, not counting when it lost its processor to another one. Throws
/// std::runtime_error when there is no such thread.
std::uint64_t sleeps_of(pid_t process, const std::string& thread);

/// "haptic-3": "haptic-N", as server/THREADS.md calls them all.
std::string general_name(const std::string& thread);

/// The threads of tendond that server/THREADS.md names.
std::set<std::string> threads_of_the_page();

}  // namespace tendon::e2e
