// SPDX-License-Identifier: Apache-2.0
// A maze in the x-y plane: each wall pushes back through the face by which the hand came in.
#include <array>
#include <cmath>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "maze"}};
  CommandLine line(
      "Render a maze in the x-y plane. Each wall pushes the hand back through the face by which it entered.", options);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  const std::string maze[] = {"#########", "#   #   #", "# #   # #", "#   #   #", "#########"};
  constexpr double kCell = 0.008, kStiffness = 1200;  // m, N/m; the middle cell is at the origin
  std::array<std::size_t, 2> room = {4, 2};           // the cell of the hand if the walls were rigid
  return run(options, [&](const DeviceState& hand) -> Touch {
    const double at[] = {hand.position.x() / kCell + 4.5, 2.5 - hand.position.y() / kCell};  // in cells
    Vec3 force(0, 0, -200 * hand.position.z());
    for (const std::size_t axis : {0U, 1U}) {
      const double from_middle = at[axis] - static_cast<double>(room[axis]) - 0.5;
      if (std::abs(from_middle) <= 0.5) continue;
      const int side = from_middle > 0 ? 1 : -1;
      auto behind = room;
      behind[axis] += static_cast<std::size_t>(side);
      if (maze[behind[1]][behind[0]] == ' ') {
        room = behind;
      } else {
        force[static_cast<int>(axis)] = (axis == 0 ? -1 : 1) * kStiffness * kCell * (from_middle - 0.5 * side);
      }
    }
    return force;
  });
}
