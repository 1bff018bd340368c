// SPDX-License-Identifier: Apache-2.0
// Tests the real libusb and libudev on a machine that is simulated by umockdev.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "devices/safety/safe_device.h"
#include "devices/spacemouse/spacemouse_device.h"
#include "devices/usb/usb.h"
#include "server/commands/devices_report.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/spacemouse/fake_spacemouse.h"
#include "tests/devices/usb/as_nobody.h"
#include "tests/devices/usb/falcon_driver.h"
#include "tests/devices/usb/mock_usb.h"

namespace tendon::mock_usb_test {
namespace {

using namespace std::chrono_literals;
using State = Device::State;

constexpr FakeFalcon::Options kReady = {.has_firmware = true, .is_homed = true, .firmware_bytes = 4096};
const Vec3 kForce(1, -2, 2);

MockUsb& the_usb() {
  static MockUsb usb;
  return usb;
}

class MockUsbTest : public testing::Test {
 protected:
  static usb::PipeConfig to_falcon() { return {.ids = {FalconDevice::kId}}; }
  bool pushes() const {
    return port.with([this] { return falcon.pushes(); });
  }

  MockUsb& usb = the_usb();
  FakeFalcon falcon{kReady};
  FakeSpaceMouse mouse;
  MockPort port{usb, 2, falcon};
  MockPort other{usb, 3, mouse};
};

TEST_F(MockUsbTest, DevicesAreListedWhereTheyArePluggedInAndNotWhenTheyAreOut) {
  const auto report = [] { return in_json(report_devices(usb::plugged_in(), "")); };
  EXPECT_EQ(report(), "");
  EXPECT_EQ(usb::plugged_in().size(), 1U) << "the hub that the controller is";
  port.plug();
  other.plug();
  const std::string falcon_line = R"({"name":"Novint Falcon","kind":"falcon","id":"0403:cb48","port":"1-2","node":")" +
                                  port.node() + R"(","may_open":true,"missing":[]})" + "\n";
  const std::string mouse_line =
      R"({"name":"3Dconnexion SpaceMouse","kind":"spacemouse","id":"046d:c626","port":"1-3","node":")" + other.node() +
      R"(","may_open":true,"missing":[]})" + "\n";
  const std::string both = report();
  EXPECT_NE(both.find(falcon_line), std::string::npos) << both;
  EXPECT_NE(both.find(mouse_line), std::string::npos) << both;
  EXPECT_EQ(both.size(), falcon_line.size() + mouse_line.size());
  port.unplug();
  EXPECT_EQ(report(), mouse_line);
  other.unplug();
  EXPECT_EQ(report(), "");
}

// This test is run without privileges, because the default user of a container is root and may open every node.
TEST_F(MockUsbTest, AForbiddenAnUnpluggedAndAMissingNodeAreToldApart) {
  const auto look = [] {
    const auto lacks = [] {
      const auto reports = report_devices(usb::plugged_in(), "");
      return reports.empty() ? "nothing" : reports[0].lacks.empty() ? "no lack" : reports[0].lacks[0].what;
    };
    // A process not connected to the machine's udev may not write to the socket of umockdev.
    return as_nobody(lacks);
  };
  ASSERT_EQ(chmod(usb.really("/").c_str(), 0777), 0);
  EXPECT_EQ(look(), "nothing");
  port.plug();
  const std::string node = port.node();
  ASSERT_EQ(chmod(usb.really(node).c_str(), 0), 0);
  EXPECT_EQ(look(), "this user has no permission to open " + node);
  ASSERT_EQ(chmod(usb.really(node).c_str(), 0666), 0);
  EXPECT_EQ(look(), "no lack");
  ASSERT_EQ(unlink(usb.really(node).c_str()), 0);
  EXPECT_EQ(look(), "there is no " + node + ", although the kernel has found the device");
}

TEST_F(MockUsbTest, ThePipeSaysOnceWhyItOpensNothing) {
  port.plug();
  ASSERT_EQ(unlink(usb.really(port.node()).c_str()), 0);
  std::mutex mutex;
  std::vector<std::string> told;
  auto config = to_falcon();
  config.tell = [&](const std::string& why) {
    const std::lock_guard lock(mutex);
    told.push_back(why);
  };
  const auto pipe = usb::open_pipe(config);
  ASSERT_TRUE(comes_true([&] {
    const std::lock_guard lock(mutex);
    return !told.empty();
  }));
  std::this_thread::sleep_for(500ms);  // there are five polls per second
  const std::lock_guard lock(mutex);
  EXPECT_EQ(told, (std::vector<std::string>{port.node() +
                                            " cannot be opened: No such file or directory; see `tendond devices`"}));
}

TEST_F(MockUsbTest, OfTwoFalconsThatAtThePortIsOpened) {
  FakeFalcon second{kReady};
  MockPort there{usb, 7, second};
  port.plug();
  there.plug();
  for (const bool first : {true, false}) {
    auto config = to_falcon();
    config.port = first ? "1-2" : "1-7";
    const auto pipe = usb::open_pipe(config);
    ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
    EXPECT_GT((first ? port : there).open_transfers(), 0);
    EXPECT_EQ((first ? there : port).open_transfers(), 0);
  }
}

TEST_F(MockUsbTest, PluggedInLateItPushesUnpluggedItIsAFault) {
  falcon = FakeFalcon({.has_firmware = true, .is_homed = true, .own_supply = true});
  FalconDriver driver(usb::open_pipe(to_falcon()));
  SafeDevice safe({}, driver.device);
  driver.turned = &safe;
  for (int step = 0; step < 20; ++step) driver.step(kForce);
  EXPECT_EQ(safe.status().state, SafetyState::kAbsent);
  for (int i = 0; i < 2; ++i) {
    SCOPED_TRACE(i);
    port.plug();
    ASSERT_TRUE(driver.turns_until([&] { return driver.device.state() == State::kUnhomed; }, kForce));
    for (int step = 0; step < 20; ++step) driver.step(kForce);
    EXPECT_FALSE(pushes()) << "nobody has armed it";
    ASSERT_TRUE(driver.comes_to_push(
        safe, kForce, [&] { port.with([&] { falcon.pull_through(); }); }, [&] { return pushes(); }));
    port.unplug();
    ASSERT_TRUE(driver.reaches(State::kAbsent, kForce));
    driver.step(kForce);
    EXPECT_EQ(driver.written, Vec3::Zero());
    EXPECT_EQ(safe.status().state, SafetyState::kFault);
    EXPECT_EQ(safe.status().last_fault, SafetyFault::kDeviceLost);
    EXPECT_TRUE(comes_true([&] { return port.open_transfers() == 0; })) << "a handle is left open";
  }
}

TEST_F(MockUsbTest, ASpaceMouseIsReadThroughTheRealLibraryAndSurvivesAReplug) {
  usb::PipeConfig config{.transfers = usb::PipeConfig::Transfers::kInterrupt};
  config.ids.assign(SpaceMouseDevice::kIds.begin(), SpaceMouseDevice::kIds.end());
  SpaceMouseDevice device({.speed = 0.1, .dead_band = 0, .reach = 1}, usb::open_pipe(config));
  double x = 0;
  for (int i = 0; i < 2; ++i) {
    other.plug();
    const double before = x;
    EXPECT_TRUE(comes_true([&] {
      other.with([&] {
        if (mouse.reports.empty()) mouse.push({350, 0, 0});
      });
      if (const auto sample = device.read(real_now())) x = sample->position.x();
      return x > before + 0.01;
    }));
    other.unplug();
    EXPECT_TRUE(comes_true([&] { return device.read(real_now()), device.state() == State::kAbsent; }));
  }
  EXPECT_EQ(device.counts()[DeviceCount::kUnreadable], 0U);
}

}  // namespace
}  // namespace tendon::mock_usb_test
