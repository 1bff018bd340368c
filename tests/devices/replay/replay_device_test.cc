// SPDX-License-Identifier: Apache-2.0
#include "devices/replay/replay_device.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::replay_device_test {
namespace {

using namespace std::chrono_literals;
using AtEnd = ReplayDevice::AtEnd;
using Sample = ReplayDevice::Sample;

constexpr LocalTime kStart{5s};
const Vec3 kHere(0.01, 0.02, 0.03);

/// Returns `count` samples at random positions and times with a mean spacing of `interval`.
std::vector<Sample> recorded(Dice& dice, int count, Duration interval, double jitter = 0) {
  std::vector<Sample> samples;
  for (int i = 0; i < count; ++i) {
    const Duration off(
        static_cast<Duration::rep>(dice.within(-jitter, jitter) * static_cast<double>(interval.count())));
    samples.push_back({1h + i * interval + off, 0.1 * dice.uniform() * dice.direction()});
  }
  return samples;
}

struct Replayed {
  std::vector<PositionSample> samples;
  int without = 0;  ///< reads without a sample
};

/// Samples are taken every `period`, with a timing error of up to ±`jitter`.
Replayed replayed(ReplayDevice& device, Dice& dice, Duration period, double jitter, Duration time) {
  Replayed out;
  for (Duration t{}; t <= time; t += period) {
    const Duration off(static_cast<Duration::rep>(dice.within(-jitter, jitter) * static_cast<double>(period.count())));
    const auto sample = device.read(kStart + t + (t == Duration::zero() ? 0ns : off));
    EXPECT_EQ(device.apply({3, 4, 5}), Vec3::Zero());
    if (sample) {
      out.samples.push_back(*sample);
    } else {
      ++out.without;
    }
  }
  return out;
}

TEST(ReplayDevice, GivesEverySampleOfTheRecordingToTheLastBitAtItsOwnTime) {
  Dice dice(1);
  for (int round = 0; round < 20; ++round) {
    const auto samples = recorded(dice, 500, 1ms, 0.2);
    ReplayDevice device({.samples = samples});
    const auto out = replayed(device, dice, 1ms, 0.2, 498ms);
    ASSERT_GE(out.samples.size(), 497U);
    for (std::size_t i = 0; i < out.samples.size(); ++i) {
      ASSERT_EQ(out.samples[i].position, samples[i].position) << i;
      ASSERT_EQ(out.samples[i].at, kStart + (samples[i].at - samples[0].at)) << i;
      ASSERT_FALSE(out.samples[i].hand_force);
    }
  }
}

TEST(ReplayDevice, ASlowerLoopGetsWhatWasNewestOneReadAgo) {
  Dice dice(2);
  const auto samples = recorded(dice, 2000, 500us);
  ReplayDevice device({.samples = samples});
  const auto out = replayed(device, dice, 1ms, 0, 900ms);
  ASSERT_EQ(out.without, 0);
  for (std::size_t i = 3; i < out.samples.size(); ++i) {
    const LocalTime now = kStart + static_cast<Duration::rep>(i) * 1ms;
    ASSERT_EQ(now - out.samples[i].at, 1ms);
    ASSERT_EQ(out.samples[i].position, samples[2 * (i - 1)].position);
  }
}

TEST(ReplayDevice, AFasterLoopGetsEverySampleOnceAndNothingMadeUpBetween) {
  Dice dice(3);
  const auto samples = recorded(dice, 100, 8ms);
  ReplayDevice device({.samples = samples});
  const auto out = replayed(device, dice, 1ms, 0.3, 790ms);
  ASSERT_EQ(out.samples.size(), 99U);
  for (std::size_t i = 0; i < out.samples.size(); ++i) ASSERT_EQ(out.samples[i].position, samples[i].position);
  EXPECT_EQ(out.without, 791 - 99);
}

// The ledger is integrated over the intervals between the samples.
TEST(ReplayDevice, TimesIncreaseWhateverTheLoopDoes) {
  Dice dice(4);
  for (const AtEnd at_end : {AtEnd::kHold, AtEnd::kRepeat}) {
    for (int round = 0; round < 200; ++round) {
      ReplayDevice device({.samples = recorded(dice, 50, 1ms, 0.45), .at_end = at_end});
      LocalTime now = kStart;
      LocalTime last{};
      for (int i = 0; i < 200; ++i) {
        const LocalTime seen = dice.chance(0.02) ? now - dice.milliseconds(0, 20) : now;  // backward clock step
        if (const auto sample = device.read(seen)) {
          ASSERT_TRUE(sample->at > last || sample->at == seen) << round << ' ' << i;
          last = std::max(last, sample->at);
        } else {
          last = std::max(last, seen);
        }
        now += dice.chance(0.05) ? dice.milliseconds(0, 80) : dice.milliseconds(0, 2);
      }
    }
  }
}

TEST(ReplayDevice, AClockFromBeforeTheStartChangesNothing) {
  Dice dice(8);
  for (const AtEnd at_end : {AtEnd::kHold, AtEnd::kRepeat}) {
    const auto samples = recorded(dice, 10, 1ms);
    ReplayDevice device({.samples = samples, .at_end = at_end});
    device.read(kStart);
    EXPECT_FALSE(device.read(kStart - 3s));
    const auto sample = device.read(kStart + 1ms);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->position, samples[1].position);
  }
}

TEST(ReplayDevice, AtItsEndItStaysWhereItIs) {
  Dice dice(5);
  const auto samples = recorded(dice, 10, 1ms);
  ReplayDevice device({.samples = samples});
  replayed(device, dice, 1ms, 0, 20ms);
  for (const Duration later : {30ms, 40ms, 3600000ms}) {
    const auto sample = device.read(kStart + later);
    ASSERT_TRUE(sample);
    EXPECT_EQ(sample->position, samples.back().position);
    EXPECT_EQ(sample->at, kStart + later);
  }
}

TEST(ReplayDevice, OrItBeginsAnewOneIntervalAfterTheLastSample) {
  Dice dice(6);
  const auto samples = recorded(dice, 10, 1ms);
  ReplayDevice device({.samples = samples, .at_end = AtEnd::kRepeat});
  const auto out = replayed(device, dice, 1ms, 0, 95ms);
  ASSERT_EQ(out.samples.size(), 96U);
  for (std::size_t i = 0; i < out.samples.size(); ++i) {
    ASSERT_EQ(out.samples[i].position, samples[i % 10].position) << i;
    ASSERT_EQ(out.samples[i].at, kStart + static_cast<Duration::rep>(i) * 1ms);
  }
}

TEST(ReplayDevice, ALoopThatStoodStillIsUpToDateAgainWithTheSecondRead) {
  Dice dice(7);
  const auto samples = recorded(dice, 5000, 1ms);
  ReplayDevice device({.samples = samples});
  replayed(device, dice, 1ms, 0, 10ms);
  device.read(kStart + 3000ms);
  const auto sample = device.read(kStart + 3001ms);
  ASSERT_TRUE(sample);
  EXPECT_EQ(sample->position, samples[3000].position);
}

TEST(ReplayDevice, ItExertsNoForceAndSaysSo) {
  ReplayDevice device({.samples = {{0s, kHere}, {1s, kHere}}, .position_resolution = 3e-5});
  EXPECT_EQ(device.info().max_force, 0);
  EXPECT_EQ(device.info().position_resolution, 3e-5);
  EXPECT_EQ(device.state(), Device::State::kHomed);
  EXPECT_EQ(device.apply({1, 2, std::numeric_limits<double>::quiet_NaN()}), Vec3::Zero());
}

TEST(ReplayDevice, AMotionAlongALineLiesWhereTheFileSays) {
  const ScriptedMotion::Recorded motion{
      .samples = {{10.25, 1}, {10.2505, -2}}, .origin = {1, 2, 3}, .direction = {0, 0, 4}, .at_end = AtEnd::kHold};
  const auto samples = ReplayDevice::samples_of(motion);
  ASSERT_EQ(samples.size(), 2U);
  EXPECT_EQ(samples[0].position, Vec3(1, 2, 4));
  EXPECT_EQ(samples[1].position, Vec3(1, 2, 1));
  EXPECT_EQ(samples[1].at - samples[0].at, 500us);
}

TEST(ReplayDevice, RefusesWhatIsNoMotion) {
  const double inf = std::numeric_limits<double>::infinity();
  const auto refuses = [](std::vector<Sample> samples, double resolution = 0) {
    EXPECT_THROW(ReplayDevice({.samples = std::move(samples), .position_resolution = resolution}),
                 std::invalid_argument);
  };
  refuses({});
  refuses({{0s, kHere}});
  refuses({{0s, kHere}, {0s, kHere}});
  refuses({{1s, kHere}, {0s, kHere}});
  refuses({{0s, kHere}, {1s, Vec3(0, inf, 0)}});
  refuses({{0s, kHere}, {1'000'000'001s, kHere}});
  refuses({{Duration::min(), kHere}, {Duration::max(), kHere}});
  refuses({{0s, kHere}, {1s, kHere}}, -1);
  ScriptedMotion::Recorded line{.samples = {{0, 1}, {1, 2}}};
  line.direction.setZero();
  EXPECT_THROW(ReplayDevice::samples_of(line), std::invalid_argument);
  EXPECT_THROW(ReplayDevice::samples_of({.samples = {{0, 1}, {1e300, 2}}}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::replay_device_test
