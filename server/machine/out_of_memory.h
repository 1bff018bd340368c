// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace tendon {

/// Makes `new` print a message and exit with status 1 if there is no memory, in all threads. An exception would need
/// memory itself to pass through pthread_once.
void exit_when_out_of_memory();

/// Prints the reason, for memory that is not allocated by `new`.
void say_out_of_memory() noexcept;

}  // namespace tendon
