// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <cstdint>
#include <set>
#include <string>

namespace tendon::e2e {

std::set<std::string> threads_of(pid_t process);

/// Returns the state from /proc. 'T' means that the thread is stopped.
char state_of(pid_t process);

/// Returns the number of voluntary context switches. Throws std::runtime_error if there is no such thread.
std::uint64_t sleeps_of(pid_t process, const std::string& thread);

/// Replaces the number of a name as server/THREADS.md does, for example "haptic-3" by "haptic-N".
std::string general_name(const std::string& thread);

/// Returns the threads of tendond that are listed in server/THREADS.md.
std::set<std::string> threads_of_the_page();

}  // namespace tendon::e2e
