// SPDX-License-Identifier: Apache-2.0
// Corduroy: ridges along x, which push the hand into the grooves between them.
#include <cmath>
#include <numbers>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "texture"}};
  double pitch_mm = 4, force_n = 0.8;
  CommandLine line("Render corduroy: ridges along x that push the hand into the grooves between them.", options);
  line.add("--pitch-mm", pitch_mm, "Distance between ridges, mm", 0.5);
  line.add("--force-n", force_n, "Force at the flank of a ridge, N");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  return run(options, [&](const DeviceState& hand) -> Touch {
    const double per_metre = 2 * std::numbers::pi / (pitch_mm / 1000);
    const double phase = per_metre * hand.position.x();  // 0 in the middle of a groove
    Touch corduroy = Vec3(-force_n * std::sin(phase), 0, 0);
    const double stiffness = force_n * per_metre * std::cos(phase);  // negative on a ridge: unstable equilibrium
    corduroy.stiffness = Vec3(stiffness, 0, 0).asDiagonal();
    return corduroy;
  });
}
