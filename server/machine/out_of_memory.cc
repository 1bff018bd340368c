// SPDX-License-Identifier: Apache-2.0
#include "server/machine/out_of_memory.h"

#include <unistd.h>

#include <cstdlib>
#include <new>
#include <string_view>

namespace tendon {

void say_out_of_memory() noexcept {
  constexpr std::string_view kText = "error: out of memory; check the limit in `ulimit -v`\n";
  [[maybe_unused]] const auto written = ::write(STDERR_FILENO, kText.data(), kText.size());
}

void exit_when_out_of_memory() {
  std::set_new_handler([] {
    say_out_of_memory();
    std::_Exit(EXIT_FAILURE);
  });
}

}  // namespace tendon
