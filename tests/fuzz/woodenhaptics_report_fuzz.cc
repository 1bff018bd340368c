// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <vector>

#include "devices/woodenhaptics/report.h"
#include "tests/fuzz/target.h"

// One byte selects the model. A packet is only accepted if it has 14 bytes. The pose of the arm must be finite.
// Currents must be within bounds and zero without a force, and the resulting force may only exceed the requested one by
// rounding.

using namespace tendon;
using namespace tendon::woodenhaptics;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const Model& model = models()[data[0] % models().size()];
  const std::vector<std::uint8_t> bytes(data + 1, data + size);  // the size is exact, so that the sanitizer detects
  const auto report = parse(bytes);
  fuzz::require(report.has_value() == (bytes.size() == kReportBytes && bytes[12] < 2 && bytes[13] == 0));
  if (!report) return 0;

  for (std::size_t i = 0; i < report->counters.size(); ++i) {
    const auto counter = static_cast<std::uint16_t>(report->counters[i]);
    fuzz::require(bytes[2 * i] == (counter & 255) && bytes[2 * i + 1] == counter >> 8);
  }
  fuzz::require(report->calibrate == (bytes[12] == 1));

  const auto& counters = report->counters;
  const Pose pose = pose_with(model, angles_at(model, {counters[0], counters[1], counters[2]}));
  fuzz::require(pose.position.allFinite() && pose.jacobian.allFinite());
  const double share = force_share(model, pose);
  fuzz::require(share >= 0 && share <= 1);
  const auto back = pose_at(model, pose.position);
  fuzz::require(share == 0 || (back && (pose_with(model, back->angles).position - pose.position).norm() <= 1e-9));

  const Vec3 force = 1e-3 * Vec3(counters[3], counters[4], counters[5]);
  for (const double most : {1.0, 2000.0, 32'767.0}) {
    const Currents currents = currents_for(model, pose, force, most);
    for (const int current : currents) fuzz::require(std::abs(current) <= most);
    if (share == 0) fuzz::require(currents == Currents{});
    const auto given = force_of(model, pose, currents);
    fuzz::require(given.has_value() == (share > 0));
    if (given) fuzz::require(given->norm() <= force.norm() + 0.5);
  }
  return 0;
}
