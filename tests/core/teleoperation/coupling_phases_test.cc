// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/teleoperation/coupling_config.h"
#include "core/teleoperation/mapped_end.h"
#include "core/teleoperation/phases/alignment.h"
#include "core/teleoperation/phases/clutch.h"
#include "core/teleoperation/phases/force_ramp.h"
#include "core/teleoperation/phases/loss_stages.h"
#include "core/teleoperation/phases/phase_machine.h"
#include "tests/support/refusal.h"

namespace tendon::coupling_phases_test {
namespace {

using namespace std::chrono_literals;
using enum PortPhase;

constexpr std::array kPhases = {kAlone, kCoupled, kAligning, kEngaged, kClutched, kLost, kFault};

PortPhase expected(PortPhase phase, PhaseInput input) {
  const bool in_act = phase == kEngaged || phase == kClutched;
  switch (input) {
    case PhaseInput::kNotReady:
      return kFault;
    case PhaseInput::kReady:
      return phase == kFault ? kAlone : phase;
    case PhaseInput::kGone:
      if (in_act) return kLost;
      return phase == kCoupled || phase == kAligning ? kAlone : phase;
    case PhaseInput::kHeard:
      return phase == kAlone || phase == kLost ? kCoupled : phase;
    case PhaseInput::kAlign:
      return phase == kCoupled ? kAligning : phase;
    case PhaseInput::kAct:
      return phase == kCoupled || phase == kAligning ? kEngaged : phase;
    case PhaseInput::kClutch:
      return phase == kEngaged ? kClutched : phase;
    case PhaseInput::kRelease:
      return phase == kClutched ? kEngaged : phase;
    case PhaseInput::kEnd:
      return in_act || phase == kAligning ? kCoupled : phase;
    case PhaseInput::kRenew:
      return phase == kFault ? kFault : kAlone;
  }
  return phase;
}

TEST(PhaseMachine, GoesFromEachPhaseByEachInputWhereItsTableSays) {
  for (const PortPhase phase : kPhases) {
    for (std::size_t i = 0; i < kPhaseInputs; ++i) {
      const auto input = static_cast<PhaseInput>(i);
      EXPECT_EQ(next(phase, input), expected(phase, input)) << to_string(phase) << ", input " << i;
    }
  }
}

TEST(LossStages, TrustsAStateForLongerWhereGapsAreLong) {
  LossStages stages(1ms);
  const LocalTime start(10s);
  EXPECT_FALSE(stages.at(start, false, false).fresh);
  EXPECT_TRUE(stages.at(start, false, false).gone);
  stages.receive(start, false);
  EXPECT_EQ(stages.patience(), 20ms);
  EXPECT_TRUE(stages.at(start + 20ms, true, false).fresh);
  EXPECT_FALSE(stages.at(start + 21ms, true, false).fresh);
  EXPECT_FALSE(stages.at(start + 40ms, true, false).silent);
  EXPECT_TRUE(stages.at(start + 41ms, true, false).silent);
  EXPECT_FALSE(stages.at(start + 270ms, true, false).gone);
  EXPECT_TRUE(stages.at(start + 271ms, true, false).gone);
  stages.receive(start + 30ms, true);
  EXPECT_EQ(stages.patience(), 60ms);
  stages.receive(start + 1s, true);
  EXPECT_EQ(stages.patience(), 200ms) << "a longer gap counts as 100 ms";
  stages.forget(start + 1s);
  EXPECT_EQ(stages.patience(), 20ms);
}

TEST(LossStages, HasAllStagesAtOnceOnALinkThatIsTooLong) {
  LossStages stages(1ms);
  stages.receive(LocalTime(1s), false);
  const LossStages::Stage stage = stages.at(LocalTime(1s), true, true);
  EXPECT_FALSE(stage.fresh);
  EXPECT_TRUE(stage.silent && stage.gone);
}

TEST(Clutch, IsHeldOrToggled) {
  Clutch held;
  EXPECT_TRUE(held.asks({.bit = 2}, 4, 4));
  EXPECT_FALSE(held.asks({.bit = 2}, 3, 4));
  Clutch toggled;
  const CouplingButton button{.bit = 0, .toggles = true};
  EXPECT_TRUE(toggled.asks(button, 1, 0));
  EXPECT_TRUE(toggled.asks(button, 0, 1));
  EXPECT_TRUE(toggled.asks(button, 0, 0));
  EXPECT_FALSE(toggled.asks(button, 1, 0));
  EXPECT_TRUE(toggled.asks(button, 1, 0));
  toggled.reset();
  EXPECT_FALSE(toggled.asks(button, 1, 1));
}

TEST(Alignment, IsDoneWhenTheHandleWasNearForLongEnough) {
  Alignment alignment;
  alignment.begin(LocalTime(0s));
  alignment.observe(0.03, 0.02, LocalTime(100ms));
  alignment.observe(0.01, 0.02, LocalTime(200ms));
  EXPECT_FALSE(alignment.is_done(LocalTime(299ms)));
  EXPECT_TRUE(alignment.is_done(LocalTime(300ms)));
  alignment.observe(std::numeric_limits<double>::quiet_NaN(), 0.02, LocalTime(300ms));
  EXPECT_FALSE(alignment.is_done(LocalTime(300ms)));
  EXPECT_FALSE(alignment.is_overdue(LocalTime(5s)));
  EXPECT_TRUE(alignment.is_overdue(LocalTime(5001ms)));
}

TEST(Alignment, DrawsAtItsSpeedAndWithNoMoreThanItsForce) {
  Alignment alignment;
  alignment.begin(LocalTime(0s));
  const Vec3 there(1, 0, 0);
  const Alignment::Spring spring{.stiffness = 100, .damping = 2, .max_force = 10};
  EXPECT_EQ(alignment.force(there, Vec3::Zero(), Vec3(0.1, 0, 0), spring, 0ms), Vec3(-0.2, 0, 0));
  EXPECT_NEAR(alignment.force(there, Vec3::Zero(), Vec3::Zero(), spring, 100ms).x(), 100 * 0.005, 1e-12);
  EXPECT_NEAR(alignment.force(there, Vec3::Zero(), Vec3::Zero(), spring, 10s).x(), Alignment::kForce, 1e-12);
}

TEST(ForceRamp, RisesAndFadesWithoutAStep) {
  ForceRamp ramp;
  EXPECT_TRUE(ramp.drive(true, false, 1ms, 100ms).turned);
  EXPECT_EQ(ramp.gain(), 0);
  EXPECT_FALSE(ramp.drive(true, false, 50ms, 100ms).turned);
  EXPECT_EQ(ramp.gain(), 0.5);
  EXPECT_EQ(ramp.fade(Vec3(2, 0, 0), false, false, 1ms, 9), Vec3(2, 0, 0));
  const ForceRamp::Change change = ramp.drive(false, false, 1ms, 100ms);
  EXPECT_TRUE(change.turned && change.ended);
  EXPECT_EQ(ramp.gain(), 0);
  EXPECT_EQ(ramp.fade(Vec3::Zero(), true, false, 1ms, 9), Vec3(2, 0, 0));
  EXPECT_NEAR(ramp.fade(Vec3::Zero(), false, false, 25ms, 9).x(), 1, 1e-12);
  EXPECT_EQ(ramp.fade(Vec3(5, 0, 0), false, false, 0ms, 4), Vec3(4, 0, 0));
  EXPECT_EQ(ramp.fade(Vec3::Zero(), false, true, 0ms, 9), Vec3(Vec3::Zero())) << "a fault ends the force at once";
}

TEST(ForceRamp, LosesItsGainInPeriodsWithoutAPosition) {
  ForceRamp ramp;
  ramp.drive(true, false, 0ms, 100ms);
  ramp.drive(true, false, 100ms, 100ms);
  ramp.skip(true, 25ms);
  EXPECT_EQ(ramp.gain(), 0.5);
  EXPECT_EQ(ramp.force(), Vec3(Vec3::Zero()));
  ramp.skip(false, 25ms);
  EXPECT_TRUE(ramp.drive(true, false, 1ms, 100ms).turned);
}

TEST(MappedEnd, FollowsTheLeadersScalesAndKeepsWhatTheAccountIsWorth) {
  MappedEnd follower({.position_scale = 2, .force_scale = 2}, PortRole::kFollower);
  PortState leader;
  EXPECT_TRUE(follower.tells_ours(leader)) << "0 stands for the scales of the scene";
  leader.position_scale = 1;
  leader.force_scale = 4;
  EXPECT_FALSE(follower.tells_ours(leader));
  follower.rescale_as_told(leader);
  EXPECT_TRUE(follower.tells_ours(leader));
  EXPECT_TRUE(follower.told());
  EXPECT_EQ(follower.take_kept(), 0.25) << "one of its joules is worth 4 of the leader's, not 1";
  EXPECT_EQ(follower.take_kept(), 1);
  EXPECT_EQ(follower.worth(4), 1);
  EXPECT_TRUE(follower.rescale_as_scene());
  EXPECT_EQ(follower.take_kept(), 1) << "worth less: all of it is kept";
  EXPECT_FALSE(follower.rescale_as_scene());
}

TEST(CouplingRules, NameTheFieldThatDoesNotGoWithTheOthers) {
  CouplingConfig leader;
  leader.spring.own_damping = 4;
  CouplingConfig follower = leader;
  follower.role = PortRole::kFollower;
  const auto use = [](const CouplingConfig& config) {
    for (const auto& reason : check(config)) throw std::invalid_argument(std::string(reason.key));
  };
  expect_refusals(follower, use,
                  {
                      {"clutch", [](auto& c) { c.clutch.emplace(); }},
                      {"engage_by", [](auto& c) { c.engage_by = 1; }},
                  });
  expect_refusals(leader, use,
                  {
                      {"holds_place", [](auto& c) { c.holds_place = true; }},
                      {"share", [](auto& c) { c.share = 0.5; }},
                      {"rate", [](auto& c) { c.rate.emplace(); }},
                      {"rate", [](auto& c) { c.method = CouplingMethod::kRate; }},
                      {"absolute", [](auto& c) { c.absolute.emplace(), c.method = CouplingMethod::kWaves; }},
                      {"clutch", [](auto& c) { c.absolute.emplace(), c.clutch.emplace(); }},
                  });
  for (const CouplingMethod method : {CouplingMethod::kWaves, CouplingMethod::kPassivity}) {
    CouplingConfig config;
    config.method = method;
    EXPECT_EQ(check(config).at(0).key, "own_damping");
  }
}

}  // namespace
}  // namespace tendon::coupling_phases_test
