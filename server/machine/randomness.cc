// SPDX-License-Identifier: Apache-2.0
#include "server/machine/randomness.h"

#include <sys/random.h>

#include <cerrno>
#include <system_error>

namespace tendon {

void fill_random(std::span<std::byte> bytes) {
  if (getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) {
    throw std::system_error(errno, std::system_category(), "cannot read random numbers from the system");
  }
}

}  // namespace tendon
