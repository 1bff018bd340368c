// SPDX-License-Identifier: Apache-2.0
// Connects models of a Falcon and a SpaceMouse to the real kernel, through its usbfs and the real libusb
// (deploy/test-usb-kernel, in an emulated machine). The limits of times are relative to the round trip that is measured
// in the same run.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/usbdevice_fs.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <iomanip>
#include <iostream>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <string_view>
#include <thread>
#include <utility>
#include <vector>

#include "devices/falcon/falcon_device.h"
#include "devices/falcon/packet.h"
#include "devices/safety/guardian.h"
#include "devices/safety/safe_device.h"
#include "devices/spacemouse/spacemouse_device.h"
#include "devices/usb/usb.h"
#include "tests/devices/falcon/fake_falcon.h"
#include "tests/devices/spacemouse/fake_spacemouse.h"
#include "tests/devices/usb/as_nobody.h"
#include "tests/devices/usb/falcon_driver.h"
#include "tests/devices/usb/usbip_cable.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;
using State = Device::State;

constexpr FakeFalcon::Options kReady = {.has_firmware = true, .is_homed = true, .firmware_bytes = 4096};
const Vec3 kForce(1, -2, 2);

usb::PipeConfig to_falcon() { return {.ids = {FalconDevice::kId}}; }

bool pushes(const UsbIpCable& cable, const FakeFalcon& falcon) {
  return cable.with([&] { return falcon.pushes(); });
}

double quantile(std::vector<double>& values, double share) {
  std::ranges::sort(values);
  return values.empty() ? 0 : values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

double ms(Duration time) { return seconds(time) * 1e3; }

void record(const std::string& name, double value) {
  std::ostringstream text;
  text << std::setprecision(4) << value;
  testing::Test::RecordProperty(name, text.str());
}

void record_quantiles(const std::string& name, std::vector<double>& values) {
  record(name + "_n", static_cast<double>(values.size()));
  record(name + "_p50", quantile(values, 0.5));
  record(name + "_p99", quantile(values, 0.99));
}

std::optional<usb::PluggedIn> find(const usb::Id& id) {
  for (const auto& one : usb::plugged_in()) {
    if (one.id == id) return one;
  }
  return std::nullopt;
}

TEST(UsbKernel, ListsWhatIsPluggedInAndWhoMayOpenIt) {
  EXPECT_FALSE(find(FalconDevice::kId));
  FakeFalcon falcon(kReady);
  UsbIpCable cable(falcon);
  ASSERT_TRUE(comes_true([] { return find(FalconDevice::kId).has_value(); }));
  const auto found = *find(FalconDevice::kId);
  EXPECT_TRUE(found.may_open);
  EXPECT_EQ(access(found.node.c_str(), F_OK), 0) << found.node;
  const std::string seen = as_nobody([] { return std::string(find(FalconDevice::kId)->may_open ? "may" : "may not"); });
  EXPECT_EQ(seen, "may not");
  const std::string told = as_nobody([] {
    std::mutex mutex;
    std::string why;
    auto config = to_falcon();
    config.tell = [&](const std::string& sentence) {
      const std::lock_guard lock(mutex);
      why = sentence;
    };
    const auto pipe = usb::open_pipe(config);
    comes_true([&] {
      const std::lock_guard lock(mutex);
      return !why.empty();
    });
    const std::lock_guard lock(mutex);
    return why;
  });
  EXPECT_EQ(told, found.node + " cannot be opened: Permission denied; see `tendond devices`");
}

TEST(UsbKernel, FromThePlugToTheForce) {
  FakeFalcon falcon({.has_firmware = false, .firmware_bytes = 4096});
  FalconDriver driver(usb::open_pipe(to_falcon()));
  for (int i = 0; i < 50; ++i) driver.step(kForce);
  EXPECT_EQ(driver.device.state(), State::kAbsent);
  UsbIpCable cable(falcon);
  const LocalTime plugged = real_now();
  ASSERT_TRUE(driver.reaches(State::kOpening, kForce));
  record("plugged_to_open_ms", ms(real_now() - plugged));
  ASSERT_TRUE(driver.reaches(State::kFirmware, kForce));
  const LocalTime loads = real_now();
  ASSERT_TRUE(driver.turns_until([&] { return driver.device.state() == State::kUnhomed; }, kForce, 30s));
  record("firmware_load_ms", ms(real_now() - loads));
  EXPECT_EQ(cable.with([&] { return falcon.image(); }), fake_firmware(4096));
  EXPECT_FALSE(pushes(cable, falcon));
  cable.with([&] { falcon.pull_through(); });
  ASSERT_TRUE(driver.reaches(State::kHomed, kForce));
  ASSERT_TRUE(driver.turns_until([&] { return pushes(cable, falcon); }, kForce));
  EXPECT_LT((cable.with([&] { return falcon.force(); }) - kForce).norm(), 0.02);
  const Vec3 place(0.01, -0.005, 0.008);
  cable.with([&] { falcon.move_to(falcon::kCentre + place); });
  EXPECT_TRUE(driver.turns_until([&] { return driver.sample && (driver.sample->position - place).norm() < 1e-4; },
                                 Vec3::Zero()));
}

/// Returns the time from each packet to its reply, measured by a single thread with blocking calls.
std::vector<double> bare_round_trips_ms(const std::string& node, int count) {
  const int file = open(node.c_str(), O_RDWR | O_CLOEXEC);
  unsigned interface = 0;
  EXPECT_EQ(ioctl(file, USBDEVFS_CLAIMINTERFACE, &interface), 0);
  auto bytes = falcon::encode(falcon::kLastCommand);
  std::array<std::uint8_t, usb::kPacketSize> packet{};
  usbdevfs_bulktransfer out{.ep = 0x02, .len = bytes.size(), .timeout = 1000, .data = bytes.data()};
  usbdevfs_bulktransfer in{.ep = 0x81, .len = packet.size(), .timeout = 1000, .data = packet.data()};
  for (int silent = 0; silent < 20; ++silent) {
    if (ioctl(file, USBDEVFS_BULK, &in) > static_cast<int>(usb::ftdi::kStatusBytes)) silent = 0;
  }
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const LocalTime begin = real_now();
    int size = ioctl(file, USBDEVFS_BULK, &out);
    while (size >= 0 && size <= static_cast<int>(usb::ftdi::kStatusBytes)) size = ioctl(file, USBDEVFS_BULK, &in);
    if (size < 0) break;
    times.push_back(ms(real_now() - begin));
  }
  close(file);
  return times;
}

// The limit is relative to the bare round trip of the same run, because an emulated machine may get little CPU time.
TEST(UsbKernel, ExchangesAtAKilohertzOrAsFastAsThisMachineCan) {
  std::optional<LocalTime> before;
  std::vector<double> intervals_ms;
  FakeFalcon falcon(kReady);
  UsbIpCable cable(falcon, [&](LocalTime at) {
    if (before) intervals_ms.push_back(ms(at - *before));
    before = at;
  });
  constexpr int kTurns = 5000;
  std::vector<double> late_ms;
  std::vector<double> trips_ms;
  int seen = 0;
  {
    FalconDriver driver(usb::open_pipe(to_falcon()));
    ASSERT_TRUE(driver.reaches(State::kHomed));
    cable.with([&] { intervals_ms.clear(); });
    const DeviceCounts at_first = driver.device.counts();
    const LocalTime begin = real_now();
    for (int i = 0; i < kTurns; ++i) {
      driver.step(kForce);
      seen += driver.sample ? 1 : 0;
      late_ms.push_back(
          std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - driver.due).count());
    }
    const DeviceCounts counts = driver.device.counts();
    record("steps_per_s", kTurns / seconds(real_now() - begin));
    record("steps_with_a_position_percent", 100.0 * seen / kTurns);
    record("unanswered", static_cast<double>(counts[DeviceCount::kUnanswered] - at_first[DeviceCount::kUnanswered]));
    EXPECT_EQ(counts[DeviceCount::kImplausible], 0U);
    EXPECT_EQ(counts[DeviceCount::kUnreadable], 0U);
  }
  auto intervals = cable.with([&] { return intervals_ms; });
  trips_ms = bare_round_trips_ms(find(FalconDevice::kId)->node, 1000);
  record_quantiles("late_ms", late_ms);
  record_quantiles("between_commands_at_the_device_ms", intervals);
  record_quantiles("bare_round_trip_ms", trips_ms);
  ASSERT_EQ(trips_ms.size(), 1000U);
  // If a reply is late for a step, it is read in the next step.
  const double in_steps = std::ceil(quantile(trips_ms, 0.5)) + 1;
  EXPECT_GE(seen, 0.5 * kTurns / in_steps);
}

TEST(UsbKernel, UnpluggedInMidForceIsAFaultWithoutForceAndReplugWantsArming) {
  FakeFalcon falcon({.has_firmware = true, .is_homed = true, .firmware_bytes = 4096, .own_supply = true});
  UsbIpCable cable(falcon);
  FalconDriver driver(usb::open_pipe(to_falcon()));
  SafeDevice safe({}, driver.device);
  const auto home = [&] { cable.with([&] { falcon.pull_through(); }); };
  const auto is_pushed = [&] { return pushes(cable, falcon); };
  std::vector<double> absent_ms;
  for (int i = 0; i < 15; ++i) {
    SCOPED_TRACE(i);
    ASSERT_TRUE(driver.comes_to_push(safe, kForce, home, is_pushed));
    const LocalTime pulled = real_now();
    cable.unplug();
    ASSERT_TRUE(driver.reaches(State::kAbsent, kForce));
    absent_ms.push_back(ms(real_now() - pulled));
    driver.step(kForce);
    EXPECT_EQ(driver.written, Vec3::Zero());
    EXPECT_EQ(safe.status().state, SafetyState::kFault);
    EXPECT_EQ(safe.status().last_fault, SafetyFault::kDeviceLost);
    EXPECT_TRUE(falcon.pushes()) << "its own supply is on, and nobody can tell it";
    cable.plug();
    ASSERT_TRUE(driver.turns_until([&] { return !is_pushed(); }, kForce)) << "the first thing it is told";
    for (int step = 0; step < 50; ++step) driver.step(kForce);
    EXPECT_FALSE(is_pushed());
  }
  record_quantiles("unplugged_to_absent_ms", absent_ms);
}

constexpr const char* kDrive = "--drive-guarded";
constexpr const char* kDriveAlone = "--drive-alone";

[[noreturn]] void drive(bool guarded) {
  std::optional<Guardian> guardian;  // created before any thread
  auto config = to_falcon();
  if (guarded) {
    guardian.emplace();
    const auto bytes = falcon::encode(falcon::kLastCommand);
    const auto zero = ZeroPacket::usb(config.out, std::as_bytes(std::span(bytes)));
    config.opened = [&guardian, zero](int node) {
      if (!(node >= 0 ? guardian->guard(0, node, zero) : guardian->forget(0))) _exit(1);
    };
  }
  FalconDriver driver(usb::open_pipe(config));
  for (;;) driver.step(kForce);
}

/// This Falcon is driven by another process.
class Driven {
 public:
  explicit Driven(const char* how) {
    pid_ = fork();
    if (pid_ == 0) {
      execl("/proc/self/exe", "driver", how, nullptr);
      _exit(127);
    }
  }
  ~Driven() {
    if (pid_ > 0) kill_and_wait();
  }
  Driven(const Driven&) = delete;
  Driven& operator=(const Driven&) = delete;

  /// Sends SIGKILL. Returns the time, or nothing if the Falcon was never pushed.
  std::optional<LocalTime> kill_in_mid_force() {
    int pushing = 0;
    int commands = 0;
    const bool streams = comes_true([&] {
      const bool more = cable.with(
          [&] { return falcon.pushes() && falcon.commands() != std::exchange(commands, falcon.commands()); });
      pushing += more ? 1 : 0;
      return pushing >= 50;
    });
    if (!streams || !comes_true([&] { return pushes(cable, falcon); })) return std::nullopt;
    return kill_and_wait();
  }

  std::optional<LocalTime> let_go;  ///< start of the current period without force
  FakeFalcon falcon{kReady};
  UsbIpCable cable{falcon, [this](LocalTime at) {
                     if (falcon.pushes()) {
                       let_go.reset();
                     } else if (!let_go) {
                       let_go = at;
                     }
                   }};

 private:
  LocalTime kill_and_wait() {
    const LocalTime sent = real_now();
    kill(pid_, SIGKILL);
    waitpid(pid_, nullptr, 0);
    pid_ = -1;
    return sent;
  }

  pid_t pid_ = -1;
};

// This must take at most 20 ms in half of the runs. If four bare round trips are longer, they are the limit.
TEST(UsbKernel, AGuardedFalconHasNoForce20MillisecondsAfterItsDriversSigkill) {
  std::vector<double> took_ms;
  std::vector<double> trips_ms;
  for (int i = 0; i < 20; ++i) {
    SCOPED_TRACE(i);
    Driven driven(kDrive);
    const auto killed = driven.kill_in_mid_force();
    ASSERT_TRUE(killed);
    ASSERT_TRUE(comes_true([&] { return !pushes(driven.cable, driven.falcon); }));
    std::this_thread::sleep_for(20ms);  // time for a wrong push
    driven.cable.with([&] {
      EXPECT_TRUE(driven.let_go);
      EXPECT_EQ(driven.falcon.lamps(), falcon::kRed) << "the last word is the guardian's";
      took_ms.push_back(std::max(0.0, ms(*driven.let_go - *killed)));
    });
    const auto trips = bare_round_trips_ms(find(FalconDevice::kId)->node, 20);
    trips_ms.insert(trips_ms.end(), trips.begin(), trips.end());
  }
  record("sigkill_to_zero_ms_n", static_cast<double>(took_ms.size()));
  record("sigkill_to_zero_ms_p50", quantile(took_ms, 0.5));
  record("sigkill_to_zero_ms_p90", quantile(took_ms, 0.9));
  record("sigkill_to_zero_ms_most", took_ms.back());
  record_quantiles("bare_round_trip_ms", trips_ms);
  EXPECT_LE(quantile(took_ms, 0.5), std::max(20.0, 4 * quantile(trips_ms, 0.5)));
}

TEST(UsbKernel, WithoutAGuardianItGoesOnPushing) {
  Driven driven(kDriveAlone);
  ASSERT_TRUE(driven.kill_in_mid_force());
  std::this_thread::sleep_for(500ms);
  EXPECT_TRUE(pushes(driven.cable, driven.falcon));
}

std::string kernel_driver(const std::string& port) {
  std::array<char, 256> target{};
  const std::string link = "/sys/bus/usb/devices/" + port + ":1.0/driver";
  const ssize_t size = readlink(link.c_str(), target.data(), target.size());
  const std::string_view path(target.data(), static_cast<std::size_t>(std::max<ssize_t>(0, size)));
  return std::string(path.substr(path.rfind('/') + 1));
}

TEST(UsbKernel, ASpaceMouseIsTakenFromUsbhidAndGivenBack) {
  FakeSpaceMouse mouse;
  UsbIpCable cable(mouse);
  constexpr usb::Id kId{0x046D, 0xC626};
  ASSERT_TRUE(comes_true([&] { return find(kId) && kernel_driver(find(kId)->port) == "usbhid"; }));
  const std::string port = find(kId)->port;
  {
    usb::PipeConfig config{.ids = {kId}, .transfers = usb::PipeConfig::Transfers::kInterrupt};
    SpaceMouseDevice device({.speed = 0.1, .dead_band = 0, .reach = 1}, usb::open_pipe(config));
    double x = 0;
    EXPECT_TRUE(comes_true([&] {
      cable.with([&] {
        if (mouse.reports.empty()) mouse.push({350, 0, 0});
      });
      if (const auto sample = device.read(real_now())) x = sample->position.x();
      return x > 0.01;
    }));
    EXPECT_EQ(kernel_driver(port), "usbfs");
    EXPECT_EQ(device.counts()[DeviceCount::kUnreadable], 0U);
    cable.unplug();
    EXPECT_TRUE(comes_true([&] { return device.read(real_now()), device.state() == State::kAbsent; }));
    cable.plug();
    EXPECT_TRUE(comes_true([&] { return device.read(real_now()), device.state() == State::kHomed; }));
  }
  EXPECT_TRUE(comes_true([&] { return find(kId) && kernel_driver(find(kId)->port) == "usbhid"; }));
}

/// Writes one JSON object per test and line. There is no need to escape names and values.
class Lines final : public testing::EmptyTestEventListener {
 public:
  explicit Lines(const std::string& path) : out_(path) {}

  void OnTestEnd(const testing::TestInfo& test) override {
    out_ << R"({"test":")" << test.name() << R"(","passed":)" << (test.result()->Passed() ? "true" : "false")
         << R"(,"took_ms":)" << test.result()->elapsed_time();
    for (int i = 0; i < test.result()->test_property_count(); ++i) {
      const auto& figure = test.result()->GetTestProperty(i);
      out_ << ",\"" << figure.key() << "\":" << figure.value();
    }
    out_ << "}\n" << std::flush;
  }

 private:
  std::ofstream out_;
};

}  // namespace
}  // namespace tendon

int main(int argc, char** argv) {
  const std::string_view how = argc == 2 ? argv[1] : "";
  if (how == tendon::kDrive || how == tendon::kDriveAlone) tendon::drive(how == tendon::kDrive);
  testing::InitGoogleTest(&argc, argv);
  if (argc > 2) {
    std::cerr << "usage: usb-kernel-test [RESULTS]; see deploy/test-usb-kernel\n";
    return 2;
  }
  if (argc == 2) testing::UnitTest::GetInstance()->listeners().Append(new tendon::Lines(argv[1]));
  return RUN_ALL_TESTS();
}
