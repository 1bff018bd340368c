// SPDX-License-Identifier: Apache-2.0
// A rod from the device "left" to "right", which stands 200 mm beside it along x: each hand feels the other.
#include <map>

#include "clients/cpp/options.h"

using namespace tendon;

int main(int argc, char** argv) {
  Options options{.client = {.name = "two_hands"}};
  double stiffness = 400, length_mm = 200;
  CommandLine line(
      "Connect the devices \"left\" and \"right\", 200 mm apart along x, by a rod: each hand feels the other.",
      options);
  line.add("--stiffness-n-per-m", stiffness, "Stiffness of the rod, N/m");
  line.add("--length-mm", length_mm, "Length of the rod at rest, mm", 1);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  std::map<std::string, Vec3> ends;  // of the rod, m, in the frame centered between the two devices
  const auto rod = [&](const char* mine, const char* other, double device_x, const DeviceState& hand) -> Touch {
    const Vec3 end = ends[mine] = hand.position + Vec3(device_x, 0, 0);
    const Vec3 along = ends.contains(other) ? Vec3(end - ends[other]) : Vec3(0, 0, 0);
    if (along.isZero(0)) return {};  // the other hand does not hold it yet
    const Vec3 n = along.normalized();
    const double tension = stiffness * (along.norm() - length_mm / 1000);
    Touch touch = Vec3(-tension * n);
    touch.stiffness = stiffness * n * n.transpose() + tension / along.norm() * (Mat3::Identity() - n * n.transpose());
    return touch;
  };
  return run(options, {{"left", [&](const DeviceState& hand) { return rod("left", "right", -0.1, hand); }},
                       {"right", [&](const DeviceState& hand) { return rod("right", "left", 0.1, hand); }}});
}
