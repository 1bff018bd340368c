// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/run.h"

#include <gtest/gtest.h>

#include <chrono>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace tendon::run_test {
namespace {

Vec3 nothing(const DeviceState& /*hand*/) { return Vec3::Zero(); }

/// Returns the text that `serve` writes to standard error. The exit code must be 1.
std::string said_by(const std::function<int()>& serve) {
  testing::internal::CaptureStderr();
  EXPECT_EQ(serve(), 1);
  return testing::internal::GetCapturedStderr();
}

TEST(Run, EndsWithOneAndNamesTheHostThatIsNotThere) {
  Options options;
  options.client.name = "wall";
  options.server = "haptics.invalid:47100";
  const std::string said = said_by([&] { return run(options, nothing); });
  EXPECT_TRUE(said.starts_with("wall: cannot find haptics.invalid: ")) << said;
}

TEST(Run, TriesEachAddressOfANameInItsTurn) {
  Options options;
  options.client.name = "wall";
  options.client.patience = std::chrono::milliseconds(50);
  options.client.retry_min = options.client.retry_max = std::chrono::milliseconds(1);
  options.duration = std::chrono::milliseconds(500);
  options.server = "LOCALHOST:9";
  const std::string said = said_by([&] { return run(options, nothing); });
  for (const Address& address : options.server.look_up().addresses) {
    EXPECT_NE(said.find("no answer from LOCALHOST:9 (" + to_string(address) + ")"), std::string::npos) << said;
  }
}

TEST(Run, WithSeveralDevicesSaysOfWhichOneItSpeaks) {
  Options options;
  options.client.name = "rod";
  options.client.patience = std::chrono::milliseconds(50);
  options.duration = std::chrono::milliseconds(200);
  options.server = "127.0.0.1:9";
  const std::string said = said_by([&] { return run(options, {{"left", nothing}, {"right", nothing}}); });
  for (const std::string device : {"left", "right"}) {
    EXPECT_NE(said.find("rod at " + device + ": no answer from 127.0.0.1:9"), std::string::npos) << said;
    EXPECT_NE(said.find("rod at " + device + ": was never connected"), std::string::npos) << said;
  }
}

TEST(Run, WithSeveralDevicesTakesNoOtherNameOfOne) {
  Options options;
  options.client.name = "rod";
  const std::string refusal = "rod: this program selects its devices itself: expected no --device\n";
  EXPECT_EQ(said_by([&] { return run(options, std::map<std::string, Physics>{}); }), refusal);
  EXPECT_EQ(said_by([&] { return run(options, {{"", nothing}, {"right", nothing}}); }), refusal);
  options.client.device = "middle";
  EXPECT_EQ(said_by([&] { return run(options, {{"left", nothing}, {"right", nothing}}); }), refusal);
}

TEST(Run, WithHandsTogetherEachHasItsDeviceAndItsServer) {
  Options options;
  options.client.name = "grasp";
  options.client.patience = std::chrono::milliseconds(50);
  options.duration = std::chrono::milliseconds(200);
  options.server = "127.0.0.1:9";
  const Together nothing = [](std::span<const std::optional<DeviceState>> hands) {
    return std::vector<Touch>(hands.size());
  };
  testing::internal::CaptureStderr();
  EXPECT_EQ(run(options, {HandAt{.device = "left"}, HandAt{.device = "right", .server = "127.0.0.1:19"}}, nothing), 1);
  EXPECT_EQ(run(options, std::vector<HandAt>{}, nothing), 1);
  const std::string said = testing::internal::GetCapturedStderr();
  for (const std::string line :
       {"grasp at left: no answer from 127.0.0.1:9", "grasp at right: no answer from 127.0.0.1:19",
        "grasp: expected one or more devices in the program, no --device"}) {
    EXPECT_NE(said.find(line), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace tendon::run_test
