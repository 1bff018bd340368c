// SPDX-License-Identifier: Apache-2.0
// A magnet at the origin: within its reach it draws the hand in, and holds it there.
#include <cmath>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "magnet"}};
  double stiffness = 300, reach_mm = 8;
  CommandLine line("Render a magnet at the origin, which attracts the hand within its reach and holds it there.",
                   options);
  line.add("--stiffness-n-per-m", stiffness, "Stiffness at the magnet, N/m");
  line.add("--reach-mm", reach_mm, "Distance of the maximum force, mm", 1);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  return run(options, [&](const DeviceState& hand) -> Touch {
    const Vec3& x = hand.position;
    const double r2 = std::pow(reach_mm / 1000, 2);
    // F = -k x exp(-x²/2r²): the pull is strongest at the distance r. The stiffness is -∂F/∂x.
    const double k = stiffness * std::exp(-x.squaredNorm() / (2 * r2));
    Touch magnet = Vec3(-k * x);
    magnet.stiffness = k * (Mat3::Identity() - x * x.transpose() / r2);
    return magnet;
  });
}
