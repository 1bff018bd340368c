// SPDX-License-Identifier: Apache-2.0
#include "devices/spacemouse/spacemouse_device.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <stdexcept>
#include <vector>

#include "core/base/rotation.h"
#include "tests/devices/spacemouse/fake_spacemouse.h"
#include "tests/support/dice.h"

namespace tendon::spacemouse_device_test {
namespace {

using State = Device::State;
using spacemouse::Axes;
using namespace std::chrono_literals;

class MousePipe final : public usb::Pipe {
 public:
  explicit MousePipe(FakeSpaceMouse& mouse) : mouse_(mouse) {}
  std::uint32_t connection() noexcept override { return mouse_.connection; }
  bool request(const usb::Request&) noexcept override {
    ADD_FAILURE() << "nothing is asked of a SpaceMouse";
    return false;
  }
  bool write(std::span<const std::uint8_t>) noexcept override {
    ADD_FAILURE() << "nothing is told to a SpaceMouse";
    return false;
  }
  bool settled() const noexcept override { return true; }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    if (mouse_.reports.empty()) return 0;
    const auto report = mouse_.take_in({});
    std::ranges::copy(report, packet.begin());
    return report.size();
  }
  void reopen() noexcept override { mouse_.plug(); }

 private:
  FakeSpaceMouse& mouse_;
};

struct Bench {
  explicit Bench(const SpaceMouseDevice::Config& config = {}) : device(config, std::make_unique<MousePipe>(mouse)) {}

  /// Holds the cap at `cap` for `time`. There is a report every 16 ms, and the device is read every millisecond.
  void hold(const Axes& cap, Duration time) {
    for (Duration t{}; t < time; t += 1ms) {
      if (t % 16ms == Duration::zero()) mouse.push(cap);
      step();
    }
  }
  void run(Duration time) {
    for (Duration t{}; t < time; t += 1ms) step();
  }
  void step() {
    now += 1ms;
    sample = device.read(now);
    EXPECT_EQ(device.apply({1, 2, 3}), Vec3::Zero());
  }

  LocalTime now{7s};
  FakeSpaceMouse mouse;
  SpaceMouseDevice device;
  std::optional<PositionSample> sample;
};

TEST(SpaceMouseDevice, TheCapAtItsStopGoesAtTheSpeedOfTheScene) {
  for (const bool split : {false, true}) {
    Bench bench({.speed = 0.08, .dead_band = 0.1, .reach = 1});
    bench.mouse.split = split;
    bench.hold({350, 0, 0}, 1s);
    EXPECT_NEAR(bench.sample->position.x(), 0.08, 0.08 * 2e-3);
    EXPECT_EQ(bench.sample->position.tail<2>(), Vec3::Zero().tail<2>());
    bench.hold({0, 0, 0}, 500ms);
    const Vec3 there = bench.sample->position;
    bench.run(1s);
    EXPECT_EQ(bench.sample->position, there) << "it stays where it was let go";
    EXPECT_EQ(bench.sample->at, bench.now);
    EXPECT_EQ(bench.device.counts()[DeviceCount::kUnreadable], 0U);
  }
}

TEST(SpaceMouseDevice, RightIsXLiftedIsYTowardsTheUserIsZ) {
  const SpaceMouseDevice::Config config{.speed = 1, .dead_band = 0, .reach = 1};
  EXPECT_EQ(SpaceMouseDevice::velocity_for(config, {350, 0, 0}), Vec3::UnitX());
  EXPECT_EQ(SpaceMouseDevice::velocity_for(config, {0, 350, 0}), Vec3::UnitZ());
  EXPECT_EQ(SpaceMouseDevice::velocity_for(config, {0, 0, -350}), Vec3::UnitY());
}

TEST(SpaceMouseDevice, ATwistTurnsItAboutTheAxisThatTheOperatorSees) {
  const Vec3 axes[] = {{1, 0, 0}, {0, 0, 1}, {0, -1, 0}};  // axes: right, to the user, down
  for (const bool split : {false, true}) {
    for (std::size_t i = 0; i < 3; ++i) {
      Bench bench({.dead_band = 0.1, .turn_speed = 0.5});
      bench.mouse.split = split;
      bench.mouse.twist = {};
      bench.mouse.twist[i] = 350;
      bench.hold({}, 2s);
      ASSERT_TRUE(bench.sample->orientation);
      EXPECT_NEAR((rotation_vector(*bench.sample->orientation) - axes[i]).norm(), 0, 2e-3);
      EXPECT_EQ(bench.sample->position, Vec3::Zero());
      bench.run(1s);
      const Quat there = *bench.sample->orientation;
      EXPECT_NEAR((rotation_vector(there) - axes[i] * 1.05).norm(), 0, 0.01) << "over 100 ms after the last report";
      bench.mouse.twist[i] = 0;
      bench.mouse.twist[(i + 1) % 3] = 34;  // in the dead band
      bench.hold({}, 1s);
      EXPECT_EQ(bench.sample->orientation, there) << "it stays where it was let go";
    }
  }
}

TEST(SpaceMouseDevice, TwistsAboutTwoAxesFollowEachOtherInTheBaseFrame) {
  Bench bench({.dead_band = 0, .turn_speed = 1});
  bench.mouse.twist = {350, 0, 0};
  bench.hold({}, 992ms);
  bench.mouse.twist = {0, 0, -350};
  bench.hold({}, 1s);
  const Quat exact = product(rotation_by({0, 1, 0}), rotation_by({1, 0, 0}));
  EXPECT_LT(turn_between(exact, *bench.sample->orientation).norm(), 0.02);
}

TEST(SpaceMouseDevice, ATwistEndsWhenItIsUnpluggedAndItsOrientationStays) {
  Bench bench;
  bench.mouse.twist = {350, 0, 0};
  bench.hold({}, 160ms);
  const Quat there = *bench.sample->orientation;
  EXPECT_GT(rotation_vector(there).x(), 0.1);
  bench.mouse.unplug();
  bench.step();
  EXPECT_FALSE(bench.sample);
  bench.mouse.plug();
  bench.run(200ms);
  EXPECT_LT(turn_between(there, *bench.sample->orientation).norm(), 2e-3);
}

TEST(SpaceMouseDevice, SpeedGrowsFromZeroAtTheDeadBandsEdge) {
  Dice dice(1);
  const SpaceMouseDevice::Config config{.speed = 0.2, .dead_band = 0.1, .reach = 1};
  for (int i = 0; i < 20'000; ++i) {
    const Vec3 push = dice.within(0, 1.5) * 350 * dice.direction();
    const auto whole = [&push](Eigen::Index axis) { return static_cast<std::int16_t>(push[axis]); };
    const Axes cap{whole(0), whole(1), whole(2)};
    const Vec3 d = Vec3(cap[0], -cap[2], cap[1]) / 350;
    const Vec3 v = SpaceMouseDevice::velocity_for(config, cap);
    if (d.norm() <= 0.1) {
      ASSERT_EQ(v, Vec3::Zero());
      continue;
    }
    ASSERT_NEAR(v.norm(), 0.2 * (std::min(d.norm(), 1.0) - 0.1) / 0.9, 1e-12);
    if (v.norm() > 0) {
      ASSERT_NEAR(v.normalized().dot(d.normalized()), 1, 1e-12);
    }
  }
  EXPECT_LE(SpaceMouseDevice::velocity_for(config, {-32768, -32768, -32768}).norm(), 0.2 + 1e-12);
}

TEST(SpaceMouseDevice, ItNeverLeavesItsWorkspaceAndComesBackAtOnce) {
  Dice dice(2);
  Bench bench({.speed = 0.5, .dead_band = 0, .reach = 0.03});
  for (int i = 0; i < 200; ++i) {
    const auto any = [&dice] { return static_cast<std::int16_t>(dice.bits()); };
    bench.hold({any(), any(), any()}, 50ms);
    ASSERT_LE(bench.sample->position.cwiseAbs().maxCoeff(), 0.03);
  }
  bench.hold({350, 0, 0}, 1s);
  EXPECT_EQ(bench.sample->position.x(), 0.03);
  bench.hold({-350, 0, 0}, 16ms);
  EXPECT_LT(bench.sample->position.x(), 0.03 - 0.5 * 14e-3);
}

TEST(SpaceMouseDevice, APushThatNoReportConfirmsIsOver) {
  Bench bench({.speed = 0.1, .dead_band = 0, .reach = 1});
  bench.hold({350, 0, 0}, 16ms);
  bench.run(2s);
  EXPECT_NEAR(bench.sample->position.x(), 0.1 * 0.1, 0.1 * 2e-3);
}

TEST(SpaceMouseDevice, ALoopThatStoodStillDoesNotJumpFurtherThanAPushLasts) {
  Bench bench({.speed = 0.1, .dead_band = 0, .reach = 1});
  bench.hold({350, 0, 0}, 48ms);
  const double before = bench.sample->position.x();
  bench.now += 30s;
  bench.step();
  EXPECT_LE(bench.sample->position.x() - before, 0.1 * 0.1 + 1e-12);
  bench.now -= 10s;
  bench.step();
  EXPECT_LE(bench.sample->position.x() - before, 0.1 * 0.1 + 1e-12) << "time that goes back moves nothing";
}

TEST(SpaceMouseDevice, ButtonsComeWithThePositionAndAreReleasedWithTheCable) {
  Bench bench;
  bench.mouse.reports.push_back({3, 2, 0});
  bench.step();
  EXPECT_EQ(bench.sample->buttons, 2U);
  bench.mouse.reports.push_back({0x17, 60, 0});
  bench.step();
  EXPECT_EQ(bench.sample->buttons, 2U);
  EXPECT_EQ(bench.device.counts()[DeviceCount::kUnreadable], 0U) << "the battery's report is known, and not used";
  bench.mouse.unplug();
  bench.mouse.plug();  // between two reads
  bench.step();
  EXPECT_EQ(bench.sample->buttons, 0U);
}

TEST(SpaceMouseDevice, UnpluggedItIsAbsentAndPluggedInItGoesOnFromWhereItWas) {
  Bench bench;
  bench.mouse.unplug();
  bench.step();
  EXPECT_EQ(bench.device.state(), State::kAbsent);
  EXPECT_FALSE(bench.sample);
  bench.mouse.plug();
  bench.hold({0, 0, -350}, 160ms);
  EXPECT_EQ(bench.device.state(), State::kHomed);
  const Vec3 there = bench.sample->position;
  EXPECT_GT(there.y(), 0.01);
  bench.mouse.unplug();
  bench.run(1s);
  EXPECT_EQ(bench.device.state(), State::kAbsent);
  EXPECT_FALSE(bench.sample);
  bench.mouse.plug();
  bench.run(1s);
  ASSERT_TRUE(bench.sample);
  EXPECT_EQ(bench.sample->position, there) << "nobody has pushed it since";
}

TEST(SpaceMouseDevice, BytesThatNobodyPlannedMoveItNoFasterAndAreCounted) {
  Dice dice(3);
  Bench bench({.speed = 0.1, .dead_band = 0.05, .reach = 0.05});
  Vec3 last = Vec3::Zero();
  for (int i = 0; i < 50'000; ++i) {
    std::vector<std::uint8_t> packet(1 + dice.bits() % 64);
    for (auto& byte : packet) byte = static_cast<std::uint8_t>(dice.bits());
    if (dice.chance(0.5)) {
      packet.resize(13);
      packet[0] = 1;
    }
    bench.mouse.reports.push_back(packet);
    bench.step();
    ASSERT_LE((bench.sample->position - last).norm(), 0.1 * 1e-3 + 1e-12);
    last = bench.sample->position;
  }
  const DeviceCounts counts = bench.device.counts();
  EXPECT_EQ(counts[DeviceCount::kAnswers] + counts[DeviceCount::kUnreadable], 50'000U);
  EXPECT_GT(counts[DeviceCount::kUnreadable], 10'000U);
}

TEST(SpaceMouseDevice, ItExertsNoForceAndSaysSo) {
  Bench bench;
  EXPECT_EQ(bench.device.info().max_force, 0);
  EXPECT_EQ(bench.device.apply({0, 0, std::numeric_limits<double>::quiet_NaN()}), Vec3::Zero());
}

TEST(SpaceMouseDevice, RefusesWhatIsNoRateControl) {
  FakeSpaceMouse mouse;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const SpaceMouseDevice::Config& config :
       {SpaceMouseDevice::Config{.speed = 0}, SpaceMouseDevice::Config{.dead_band = 1},
        SpaceMouseDevice::Config{.dead_band = nan}, SpaceMouseDevice::Config{.reach = -1}}) {
    EXPECT_THROW(SpaceMouseDevice(config, std::make_unique<MousePipe>(mouse)), std::invalid_argument);
  }
}

}  // namespace
}  // namespace tendon::spacemouse_device_test
