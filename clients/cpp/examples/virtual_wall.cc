// SPDX-License-Identifier: Apache-2.0
// A wall at x = 0. Outside, x < 0, the hand is free; inside, a spring pushes it back out along -x.
#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "virtual_wall", .rate_hz = 100}};
  double stiffness = 2000;
  bool local_model = false;
  CommandLine line("Render a wall at x = 0 that pushes the hand out along -x.", options);
  line.add("--stiffness-n-per-m", stiffness, "Stiffness of the wall, N/m");
  line.add("--local-model", local_model, "Also send the stiffness, for use between two answers");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  return run(options, [&](const DeviceState& hand) -> Touch {
    const double depth = hand.position.x();
    if (depth <= 0) return {};
    Touch wall = Vec3(-stiffness * depth, 0, 0);
    if (local_model) wall.stiffness = Vec3(stiffness, 0, 0).asDiagonal();
    return wall;
  });
}
