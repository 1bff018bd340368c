// SPDX-License-Identifier: Apache-2.0
// A dry table: it carries the hand, and a bristle that slips at Coulomb's limit holds it back (Dahl's model).
#include <algorithm>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "friction_surface"}};
  double height_mm = 2, friction = 0.5;
  CommandLine line("Render a table with Coulomb friction, which uses a bristle that slips at the friction limit.",
                   options);
  line.add("--height-mm", height_mm, "Height of the table along y, mm", -100);
  line.add("--friction", friction, "Coefficient of friction");
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  constexpr double kTable = 1000, kBristle = 500;  // N/m
  std::optional<Vec3> foot;                        // end point of the bristle on the table; empty: no contact
  return run(options, [&](const DeviceState& hand) -> Touch {
    const double depth = height_mm / 1000 - hand.position.y();
    if (depth <= 0) foot.reset();
    if (depth <= 0) return {};
    const Vec3 at(hand.position.x(), 0, hand.position.z());
    const Vec3 bend = at - foot.value_or(at);
    const double length = bend.norm() > 0 ? bend.norm() : 1;
    const double slip = std::min(1.0, friction * kTable * depth / kBristle / length);
    foot = at - slip * bend;  // slides so that the force stays at the limit
    return Vec3(Vec3(0, kTable * depth, 0) - kBristle * slip * bend);
  });
}
