// SPDX-License-Identifier: Apache-2.0
// A virtual fixture: the hand is free along a line, in a plane or inside a cone, and is led back when it leaves.
#include <cmath>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "virtual_fixture"}};
  std::string shape;
  double k = 400;
  CommandLine line(
      "Render a virtual fixture: the hand is free along a line, in a plane or inside a cone, and is pulled back "
      "otherwise.",
      options);
  line.add_argument("SHAPE", shape, {"line", "plane", "cone"}, "Along y; y = 0; or from the origin along +y");
  line.add("--stiffness-n-per-m", k, "Stiffness of the pull back, N/m");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  const double slope = std::tan(0.35);  // of the cone: its radius over its height
  return run(options, [&](const DeviceState& hand) -> Touch {
    const Vec3 aside(hand.position.x(), 0, hand.position.z()), up(0, hand.position.y(), 0);
    const double away = aside.norm();
    Touch flat = Vec3(-k * up);
    flat.stiffness = Vec3(0, k, 0).asDiagonal();
    if (shape == "plane") return flat;
    if (shape == "line") return Vec3(-k * aside);
    if (up.y() <= -away * slope) return Vec3(-k * hand.position);  // the tip is the closest point of the cone
    // Along the cone's normal, which is (1, -slope) in radius and height.
    const double out = (away - slope * up.y()) / (1 + slope * slope);
    return out <= 0 ? Vec3(0, 0, 0) : Vec3(-k * out * (aside / away - Vec3(0, slope, 0)));
  });
}
