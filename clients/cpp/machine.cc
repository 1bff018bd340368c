// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/machine.h"

#include <sys/random.h>

#include <chrono>
#include <stdexcept>

namespace tendon {

LocalTime read_clock() { return LocalTime(std::chrono::steady_clock::now().time_since_epoch()); }

Seed seed_from_system() {
  Seed seed;
  if (getrandom(seed.bytes.data(), seed.bytes.size(), 0) != static_cast<ssize_t>(seed.bytes.size())) {
    throw std::runtime_error("the system gives no random numbers");
  }
  return seed;
}

}  // namespace tendon
