// SPDX-License-Identifier: Apache-2.0
// touch_states ARGUMENT…: runs touch_mjcf, which is linked unchanged, without a server. Each input line is a state,
// "T X Y Z W I J K": the time in s, the position in m, and the orientation, or four zeros in place of it. For each line,
// it prints the answer and its processor time as a JSON object. If a number is not finite, it prints null.
#include <ctime>
#include <iostream>
#include <nlohmann/json.hpp>
#include <vector>

#include "clients/cpp/run.h"

namespace tendon {
namespace {

nlohmann::json array(const auto& values) { return std::vector<double>(values.data(), values.data() + values.size()); }

double processor_us() {
  std::timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return 1e6 * static_cast<double>(time.tv_sec) + 1e-3 * static_cast<double>(time.tv_nsec);
}

}  // namespace

int run(const Options&, Physics physics) {  // NOLINT(performance-unnecessary-value-param): as in run.h
  double t = 0;
  Vec3 x;
  Quat q;
  while (std::cin >> t >> x.x() >> x.y() >> x.z() >> q.w >> q.x >> q.y >> q.z) {
    DeviceState hand;
    hand.sampled = PeerTime(from_seconds(t));
    hand.position = x;
    if (q != Quat{.w = 0}) hand.turning = Turning{.orientation = q};
    const double before = processor_us();
    const Touch touch = physics(hand);
    nlohmann::json said{{"us", processor_us() - before}, {"force", array(touch.force)}};
    if (touch.stiffness) said["stiffness"] = array(*touch.stiffness);
    if (touch.stiffness) said["valid_radius"] = touch.valid_radius;
    if (touch.contact) said["normal"] = array(touch.contact->normal);
    if (touch.contact) said["gap"] = touch.contact->gap;
    if (touch.torque) said["torque"] = array(*touch.torque);
    if (touch.angular_stiffness) said["angular_stiffness"] = array(*touch.angular_stiffness);
    std::cout << said << '\n';
  }
  return 0;
}

}  // namespace tendon
