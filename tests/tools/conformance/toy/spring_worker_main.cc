// SPDX-License-Identifier: Apache-2.0
// A minimal worker in C++: a spring that pulls the hand to the origin.
#include <cstdio>
#include <exception>

#include "clients/cpp/worker/worker.h"

int main() {
  try {
    tendon::worker::work([](const tendon::DeviceState& hand) { return tendon::Touch(-500 * hand.position); });
    return 0;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "spring_worker: %s\n", error.what());
    return 1;
  }
}
