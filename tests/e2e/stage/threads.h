// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <set>
#include <string>

namespace tendon::e2e {

/// The names of a process's threads at this moment, as `top -H` shows them.
std::set<std::string> threads_of(pid_t process);

/// "haptic-3": "haptic-N", as server/THREADS.md calls them all.
std::string general_name(const std::string& thread);

/// The threads of tendond that server/THREADS.md names.
std::set<std::string> threads_of_the_page();

}  // namespace tendon::e2e
