// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// If no memory can be allocated in any thread, prints the reason and exits with status 1. std::bad_alloc could not always
/// be caught, because glibc needs memory if an exception passes through pthread_once.
void exit_when_out_of_memory();

/// Prints the reason, for memory that is not allocated by `new`.
void say_out_of_memory() noexcept;

}  // namespace tendon
