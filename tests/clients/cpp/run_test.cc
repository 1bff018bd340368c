// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/run.h"

#include <gtest/gtest.h>

#include <chrono>
#include <string>

namespace tendon {
namespace {

TEST(Run, EndsWithOneAndNamesTheHostThatIsNotThere) {
  Options options;
  options.client.name = "wall";
  options.server = "haptics.invalid:47100";
  testing::internal::CaptureStderr();
  EXPECT_EQ(run(options, [](const DeviceState&) { return Vec3(0, 0, 0); }), 1);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_TRUE(said.starts_with("wall: cannot find haptics.invalid: ")) << said;
}

TEST(Run, TriesEachAddressOfANameInItsTurn) {
  Options options;
  options.client.name = "wall";
  options.client.patience = std::chrono::milliseconds(50);
  options.client.retry_min = options.client.retry_max = std::chrono::milliseconds(1);
  options.duration = std::chrono::milliseconds(500);
  options.server = "LOCALHOST:9";
  testing::internal::CaptureStderr();
  EXPECT_EQ(run(options, [](const DeviceState&) { return Vec3(0, 0, 0); }), 1);
  const std::string said = testing::internal::GetCapturedStderr();
  for (const Address& address : options.server.look_up()) {
    EXPECT_NE(said.find("no answer from LOCALHOST:9 (" + to_string(address) + ")"), std::string::npos) << said;
  }
}

}  // namespace
}  // namespace tendon
