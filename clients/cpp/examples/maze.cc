// SPDX-License-Identifier: Apache-2.0
// A maze in the x-y plane: each wall pushes back through the face by which the hand came in.
#include <cmath>
#include <cstdlib>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "maze"}};
  CommandLine line("A maze in the x-y plane: each wall pushes back through the face by which the hand came in.",
                   options);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  const char* const maze[] = {"#########", "#   #   #", "# #   # #", "#   #   #", "#########"};
  constexpr double kCell = 0.008, kStiffness = 1200;  // m, N/m; the middle cell is at the origin
  const auto is_room = [&](int i, int j) { return i >= 0 && i < 9 && j >= 0 && j < 5 && maze[j][i] == ' '; };
  int room[] = {4, 2};
  return run(options, [&](const DeviceState& hand) -> Touch {
    const double at[] = {hand.position.x() / kCell + 4.5, 2.5 - hand.position.y() / kCell};  // in cells
    const int i = static_cast<int>(std::floor(at[0])), j = static_cast<int>(std::floor(at[1]));
    // Only into the next room, and not through a wall.
    if (is_room(i, j) && std::abs(i - room[0]) + std::abs(j - room[1]) <= 1) room[0] = i, room[1] = j;
    Vec3 force(0, 0, -200 * hand.position.z());
    for (int axis = 0; axis < 2; ++axis) {
      for (const int side : {-1, 1}) {
        const double depth = side * (at[axis] - room[axis] - 0.5) - 0.5;
        const bool open = axis == 0 ? is_room(room[0] + side, room[1]) : is_room(room[0], room[1] + side);
        if (!open && depth > 0) force[axis] -= (axis == 0 ? 1 : -1) * side * kStiffness * kCell * depth;
      }
    }
    return force;
  });
}
