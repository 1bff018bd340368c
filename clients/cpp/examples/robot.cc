// SPDX-License-Identifier: Apache-2.0
// A robot follows the hand at half its way and feels a table. Button 0 engages it when let go, and is its clutch.
#include <algorithm>
#include <cmath>

#include "clients/cpp/machine.h"
#include "clients/cpp/options.h"
#include "clients/cpp/teleop/follower.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "robot", .rate_hz = 200}};
  CommandLine line(
      "Let a simulated robot follow the hand at half scale and touch a table. Button 0 engages it, and is its clutch.",
      options);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  Follower follow({.scale = 0.5, .clutch_button = 0});
  Pose tool{.position =
                Vec3(0.4, 0, 0.04)};  // m: your robot's pose, motion and force sensor go into these three places
  const auto move = [&](const std::optional<Pose>& target) {
    if (target) tool = *target;  // otherwise the robot holds its pose
  };
  options.on_silence = [&](LocalTime now) { move(follow.silence(now)); };
  return run(options, [&](const DeviceState& hand) {
    move(follow.target(hand, tool, read_clock()));
    const Vec3 force(0, 0, std::max(0., -300 * tool.position.z()));
    return follow.touch(ToolContact{.force = force, .stiffness = 300, .normal = Vec3(0, 0, 1)});
  });
}
