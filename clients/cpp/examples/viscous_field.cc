// SPDX-License-Identifier: Apache-2.0
// Honey: the faster the hand moves, the more it is held back.
#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "viscous_field"}};
  double damping = 5;
  CommandLine line("Render a viscous field: the force is proportional to the speed of the hand.", options);
  line.add("--damping-n-s-per-m", damping, "Damping of the field, N·s/m");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  return run(options, [&](const DeviceState& hand) -> Touch { return Vec3(-damping * hand.velocity); });
}
