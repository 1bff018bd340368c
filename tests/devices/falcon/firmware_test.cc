// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/firmware.h"

#include <gtest/gtest.h>

#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/falcon/fake_firmware.h"
#include "tests/devices/model_pipe.h"
#include "tests/support/refusal.h"

namespace tendon::falcon::firmware_test {
namespace {

std::string refusal(std::vector<std::uint8_t> bytes, UnknownFirmware unknown) {
  return thrown_by<std::runtime_error>([&] { check_firmware(std::move(bytes), "a.bin", unknown); });
}

TEST(FalconFirmware, AFileOfTheWrongSizeIsNone) {
  EXPECT_EQ(refusal(fake_firmware(4095), UnknownFirmware::kAccept),
            "a.bin: expected the Falcon's firmware, a file of 4096 to 65536 bytes, found 4095 bytes");
  EXPECT_EQ(refusal(fake_firmware(65537), UnknownFirmware::kAccept),
            "a.bin: expected the Falcon's firmware, a file of 4096 to 65536 bytes, found more");
  EXPECT_EQ(refusal({}, UnknownFirmware::kAccept),
            "a.bin: expected the Falcon's firmware, a file of 4096 to 65536 bytes, found 0 bytes");
}

TEST(FalconFirmware, AFileWithoutTheLoadersKeyIsNone) {
  auto bytes = fake_firmware(8192);
  bytes[1] = 0x09;
  EXPECT_EQ(refusal(bytes, UnknownFirmware::kAccept),
            "a.bin: expected the Falcon's firmware, which starts with the bytes AA 08, found other bytes");
}

TEST(FalconFirmware, AFileThatNobodyKnowsHasToBeAcceptedExplicitly) {
  const auto bytes = fake_firmware(8192);
  EXPECT_EQ(check_firmware(bytes, "a.bin", UnknownFirmware::kAccept), bytes);
  const std::string sentence = refusal(bytes, UnknownFirmware::kRefuse);
  EXPECT_NE(sentence.find("found another one, with the SHA-256 "), std::string::npos) << sentence;
  EXPECT_NE(sentence.find(kFakeFirmwareSha256), std::string::npos) << sentence;
}

TEST(FalconFirmware, AFileIsReadWhole) {
  const auto bytes = fake_firmware(8492);
  std::istringstream file(std::string(bytes.begin(), bytes.end()));
  EXPECT_EQ(read_firmware(file, "a.bin", UnknownFirmware::kAccept), bytes);
}

struct Load {
  explicit Load(const FakeFalcon::Options& options, std::size_t bytes = 4096)
      : falcon(options), image(fake_firmware(bytes)) {
    loader.restart();
  }

  FirmwareLoader::Progress step() {
    now += std::chrono::milliseconds(1);
    std::array<std::uint8_t, usb::kPacketSize> packet{};
    while (const std::size_t size = pipe.read(packet)) {
      loader.receive(usb::ftdi::payload(std::span(packet).first(size)));
    }
    return loader.step(now, pipe);
  }

  FirmwareLoader::Progress run(int most_ms) {
    auto progress = step();
    for (int i = 0; i < most_ms && progress == FirmwareLoader::Progress::kBusy; ++i) progress = step();
    return progress;
  }

  LocalTime now{};
  FakeFalcon falcon;
  ModelPipe<FakeFalcon> pipe{falcon, now};
  std::vector<std::uint8_t> image;
  FirmwareLoader loader{image};
};

constexpr FakeFalcon::Options kEmpty = {.has_firmware = false, .firmware_bytes = 4096};

TEST(FalconFirmware, TheDeviceHasEveryByteAndRuns) {
  for (const bool zero_in_front : {false, true}) {
    auto options = kEmpty;
    options.answers_greeting_late = zero_in_front;
    Load load(options);
    EXPECT_EQ(load.run(2000), FirmwareLoader::Progress::kDone);
    EXPECT_EQ(load.falcon.image(), load.image);
    EXPECT_TRUE(load.falcon.running());
    EXPECT_FALSE(load.falcon.heard_garbage()) << "something was said at the wrong speed";
  }
}

TEST(FalconFirmware, AnImageThatIsNoMultipleOfThePacketGoesInToo) {
  for (const std::size_t bytes : {4096U, 4097U, 4154U, 4155U}) {
    auto options = kEmpty;
    options.firmware_bytes = bytes;
    Load load(options, bytes);
    EXPECT_EQ(load.run(2000), FirmwareLoader::Progress::kDone);
    EXPECT_EQ(load.falcon.image(), load.image);
  }
}

TEST(FalconFirmware, ADeviceThatRunsIsResetAndGetsItAnew) {
  Load load({.has_firmware = true, .is_homed = true, .firmware_bytes = 4096});
  EXPECT_EQ(load.run(2000), FirmwareLoader::Progress::kDone);
  EXPECT_TRUE(load.falcon.running());
  EXPECT_FALSE(load.falcon.homed());
}

TEST(FalconFirmware, TheGreetingIsRepeatedUntilSomebodyAnswers) {
  Load load(kEmpty);
  load.falcon.set_fault(FakeFalcon::Fault::kSilent);
  EXPECT_EQ(load.run(1000), FirmwareLoader::Progress::kBusy);
  load.falcon.plug();  // the loader waits for a greeting after power-on
  load.falcon.set_fault(FakeFalcon::Fault::kLosesFirmware);
  load.falcon.set_fault(FakeFalcon::Fault::kNone);
  EXPECT_EQ(load.run(2000), FirmwareLoader::Progress::kDone);
}

TEST(FalconFirmware, NobodyIsGreetedForEver) {
  Load load(kEmpty);
  load.falcon.set_fault(FakeFalcon::Fault::kSilent);
  EXPECT_EQ(load.run(20'000), FirmwareLoader::Progress::kFailed);
  EXPECT_GT(load.now, LocalTime(std::chrono::seconds(9)));
  EXPECT_LT(load.now, LocalTime(std::chrono::seconds(12)));
}

// Tests wrong, truncated, missing and excess echoes at each point of the load.
TEST(FalconFirmware, AnEchoThatDiffersEndsTheLoadWhereverItHappens) {
  using enum FakeFalcon::Fault;
  for (const auto fault : {kGarblesAll, kSilent, kStalls, kLosesFirmware}) {
    for (int after_ms = 35; after_ms < 330; after_ms += 7) {
      Load load(kEmpty);
      ASSERT_EQ(load.run(after_ms), FirmwareLoader::Progress::kBusy);
      load.falcon.set_fault(fault);
      EXPECT_NE(load.run(5000), FirmwareLoader::Progress::kDone) << static_cast<int>(fault) << ' ' << after_ms;
      load.falcon.set_fault(kNone);
      load.loader.restart();
      EXPECT_EQ(load.run(12'000), FirmwareLoader::Progress::kDone) << static_cast<int>(fault) << ' ' << after_ms;
    }
  }
}

}  // namespace
}  // namespace tendon::falcon::firmware_test
