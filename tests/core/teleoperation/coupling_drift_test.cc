// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <utility>

#include "tests/core/teleoperation/ports.h"
#include "tests/support/property_cases.h"

namespace tendon::coupling_drift_test {
namespace {

struct Cell {
  CouplingMethod method;
  double count;           ///< m; 0: exact
  double amplitude;       ///< m, of the hand
  double frequency;       ///< Hz
  int seconds;            ///< of motion
  int presses;            ///< number of clutch presses
  double coulomb = 0.02;  ///< N, of both devices
};

constexpr int kRest = 1000;  ///< ms, for `rate`, the handle rests before each mean, and the clutch is pressed once
constexpr int kMoves = 1000;
constexpr int kMean = 2000;  ///< ms, whole periods of the motion

/// For `rate`: the velocity (m/s) of the follower, which the state of the leader asks for.
double asked_by(const PortState& leader, const RateControl& rate) {
  const double away = leader.position.x();
  const double beyond = std::abs(away) - rate.dead_zone;
  if (leader.phase != PortPhase::kEngaged || beyond <= 0) return 0;
  return std::copysign(std::min(rate.gain * beyond, rate.max_speed), away);
}

Ports ports_of(const Cell& of) {
  PortSetup leader = port_of(PortRole::kLeader);
  PortSetup follower = port_of(PortRole::kFollower);
  for (PortSetup* const end : {&leader, &follower}) {
    couple_by(of.method, end->coupling);
    if (of.method == CouplingMethod::kWaves) end->coupling.tank.reset();
    end->friction = {.coulomb = of.coulomb, .viscous = 0.26};
    end->encoder_step = of.count;
    end->preset = Preset::kFeel;
    end->measures_contact = of.method != CouplingMethod::kWaves;
  }
  leader.coupling.clutch = CouplingButton{.bit = 0};
  leader.mass += 0.05;
  const double w = 2 * std::numbers::pi * of.frequency;
  const double end = 1e-3 * (1000 + kRest + kMoves + kMean) + of.seconds;
  const bool rate = of.method == CouplingMethod::kRate;
  // For `rate`, a stiff hand, so that friction hardly shifts the center.
  leader.around[0] = {
      .stiffness = rate ? 3000.0 : 600.0, .damping = 5, .reference = [a = of.amplitude, w, end, rate](double t) {
        const bool rests = t < 2 || (rate && t > end && t < end + 1e-3 * kRest);
        return rests ? 0.0 : a * std::sin(w * (t - 2));
      }};
  return {leader, follower, {.delay = 10, .seed = 1}, {.delay = 10, .seed = 2}};
}

struct Drift {
  double counts = 0;  ///< of 10 µm if the positions are exact
  double energy = 0;  ///< J
};

/// The change of the mean distance between the displacements that both ends send. With `rate`, the follower must be
/// where the states of the leader asked for; the rest of the leader sets the same center before each mean.
Drift drift(const Cell& of) {
  Ports ports = ports_of(of);
  EXPECT_TRUE(ports.engage());
  const bool rate = of.method == CouplingMethod::kRate;
  double asked = 0;
  const auto offset = [&](int ms, auto pressed) {
    double sum = 0;
    for (int i = 0; i < ms; ++i) {
      ports.leader.buttons = pressed(i) ? 1 : 0;
      ports.run(1);
      if (rate) asked += 1e-3 * asked_by(ports.told_there, *ports.leader.setup.coupling.rate);
      sum += (rate ? asked : ports.told_there.position.x()) - ports.told_back.position.x();
    }
    return sum / ms;
  };
  const auto never = [](int) { return false; };
  const auto mean_after_rest = [&](int rest) {
    offset(rest, [&](int i) { return rate && i >= rest / 2 && i < rest / 2 + 100; });
    offset(kMoves, never);
    return offset(kMean, never);
  };
  const double before = mean_after_rest(1000 + kRest - ports.now);
  const int each = of.presses > 0 ? of.seconds * 1000 / of.presses : 1;
  offset(of.seconds * 1000, [&](int i) { return of.presses > 0 && i % each >= each / 3 && i % each < 2 * each / 3; });
  const double after = mean_after_rest(kRest);
  EXPECT_TRUE(ports.leader.coupling->live() && ports.follower.coupling->live());
  return {(after - before) / (of.count > 0 ? of.count : 10e-6), ports.least_sum};
}

// Regression: the line of `waves` kept the motion of the interval before the clutch was pressed, so 200 presses shifted
// the ends by up to nine counts. Ten thousand property cases test a whole minute, also without presses. If the motion
// has only eight counts, friction holds the follower anywhere within some counts of its place; this is not a drift.
TEST(CouplingDrift, IsLessThanOneCountWithAndWithoutAClutch) {
  const bool all = property_cases() >= 10'000;
  double worst = 0;
  for (const CouplingMethod method : kCouplingMethods) {
    for (const auto& [amplitude, frequency] : {std::pair(0.02, 1.0), std::pair(8e-4, 6.0)}) {
      for (const double count : {0.0, 10e-6, 30e-6, 100e-6}) {
        for (const int presses : {0, 200}) {
          const bool chosen = presses > 0 && count == (method == CouplingMethod::kWaves ? 0 : 30e-6);
          if (!all && !chosen) continue;
          const Drift found = drift({method, count, amplitude, frequency, all ? 60 : 12, all ? presses : presses / 5});
          EXPECT_GE(found.energy, kRounding);
          if (amplitude < 10 * count) continue;
          // After small motion, `waves` wander: by 10, 21 and 9 µm after 20, 60 and 180 s with counts of 10 µm.
          const bool wanders = method == CouplingMethod::kWaves && amplitude < 1e-3;
          EXPECT_LT(std::abs(found.counts), wanders ? std::max(1.0, 30e-6 / std::max(count, 10e-6)) : 1.0)
              << to_string(method) << ' ' << amplitude << " m, counts of " << count << " m, " << presses;
          worst = std::max(worst, std::abs(found.counts));
        }
      }
    }
  }
  RecordProperty("worst_counts", std::to_string(worst));
}

// Regression: an empty account sent `waves` without their missing part, so the ends were 93 µm apart after a minute
// with counts of 30 µm, and 9 mm with 100 µm. They wander now, with counts of 100 µm by 5, 10 and 5 counts after 20, 60
// and 180 s.
TEST(CouplingDrift, WavesWithoutEnergyForAllOfTheirSumDoNotDriftEither) {
  for (const double count : {10e-6, 30e-6, 100e-6}) {
    constexpr double kAmplitude = 8e-4;
    const Drift found = drift({CouplingMethod::kWaves, count, kAmplitude, 6, 60, 0, 0.002});
    EXPECT_LT(std::abs(found.counts), kAmplitude < 10 * count ? 15 : 1) << "counts of " << count << " m";
    EXPECT_GE(found.energy, kRounding);
  }
}

}  // namespace
}  // namespace tendon::coupling_drift_test
