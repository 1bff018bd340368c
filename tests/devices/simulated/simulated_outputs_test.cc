// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_outputs.h"

#include <gtest/gtest.h>

#include <chrono>
#include <stdexcept>
#include <vector>

#include "devices/simulated/simulated_device.h"

namespace tendon::simulated_outputs_test {
namespace {

using std::chrono::milliseconds;

const std::vector<OutputDescription>& ring_and_tip() {
  static const std::vector<OutputDescription> kOutputs = {{.name = "ring", .kind = OutputKind::kLamp},
                                                          {.name = "tip", .kind = OutputKind::kVibration}};
  return kOutputs;
}

TEST(SimulatedOutputs, ALampStaysAndAPulseEndsByItself) {
  SimulatedDevice::Config config;
  config.mass = 0.1;
  config.outputs = ring_and_tip();
  SimulatedDevice device(config);
  EXPECT_EQ(device.info().outputs, ring_and_tip());
  const LocalTime start{milliseconds(7)};
  device.set_output(start, 0, LampColour{0x123456});
  device.set_output(start, 1, Vibration{.amplitude = 0.25, .duration = milliseconds(40)});
  EXPECT_EQ(device.outputs().colour(0), 0x123456U);
  EXPECT_EQ(device.outputs().amplitude(start + milliseconds(39), 1), 0.25);
  EXPECT_EQ(device.outputs().amplitude(start + milliseconds(40), 1), 0);
  EXPECT_EQ(device.outputs().colour(0), 0x123456U);
}

TEST(SimulatedOutputs, ASettingForNoOutputOrOfAnotherKindChangesNothing) {
  SimulatedOutputs outputs(ring_and_tip());
  const LocalTime now{};
  outputs.set(now, 0, LampColour{5});
  outputs.set(now, 0, Vibration{.amplitude = 1, .duration = milliseconds(1)});
  outputs.set(now, 1, LampColour{6});
  outputs.set(now, 2, LampColour{7});
  EXPECT_EQ(outputs.colour(0), 5U);
  EXPECT_EQ(outputs.amplitude(now, 0), 0);
  EXPECT_EQ(outputs.colour(1), 0U);
  EXPECT_EQ(outputs.colour(2), 0U);
}

TEST(SimulatedOutputs, NineAreTooMany) {
  EXPECT_THROW(SimulatedOutputs(std::vector<OutputDescription>(9)), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::simulated_outputs_test
