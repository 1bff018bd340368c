// SPDX-License-Identifier: Apache-2.0
// Prints the position of the hand, the force on it, and the network's round-trip time. An observer.
#include <array>
#include <cstdio>
#include <iostream>

#include "clients/cpp/options.h"

using namespace tendon;

constexpr char kText[] = "tick %ju   position %+.4f %+.4f %+.4f m   force %+.2f %+.2f %+.2f N   round trip %.1f ms\n";
constexpr char kJson[] =
    "{\"tick\":%ju,\"position_m\":[%.6f,%.6f,%.6f],\"force_n\":[%.4f,%.4f,%.4f],\"round_trip_ms\":%.3f}\n";

int main(int argc, char** argv) {
  Options options{.client = {.name = "echo_motion", .rate_hz = 10}};
  CommandLine line("Print the motion of the hand, the force on it, and the round-trip time of the network.", options);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  return run(options, [&](const DeviceState& hand, const LinkStats& link) {
    const Vec3 &x = hand.position, &f = hand.force_applied;
    std::array<char, 200> text{};
    std::snprintf(text.data(), text.size(), options.json ? kJson : kText, std::uintmax_t{hand.tick}, x.x(), x.y(),
                  x.z(), f.x(), f.y(), f.z(), 1e3 * seconds(link.smoothed_round_trip));
    std::cout << text.data() << std::flush;
  });
}
