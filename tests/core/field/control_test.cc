// SPDX-License-Identifier: Apache-2.0
// Fields in HapticController: use, poses, truths, release and rearming, with other forces and limits.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include "core/haptic_controller.h"
#include "tests/core/field/body.h"

namespace tendon::field::control_test {
namespace {

using std::chrono::milliseconds;

constexpr std::uint32_t kEngine = 7;
constexpr std::uint32_t kOther = 8;
constexpr double kMostJump = 0.2 + 1e-9;  // N/ms for 1000 N/m: the limit of 0.2 m/s after a swap

Field flat(double stiffness, double height = 0) {
  Field field;
  field.primitives = {{.shape = Plane{.at = {0, 0, height}}}};
  field.materials = {{.stiffness = stiffness}};
  return field;
}

HapticController::Config config_of(const Renderer::Config& renderer, std::size_t channels = 1) {
  HapticController::Config config;
  config.limiter = {.law = Law::kAol, .friction = {.coulomb = 0, .viscous = 4}, .longest_hold = milliseconds(1)};
  config.limiter.shared_account = true;
  config.max_force = 20;
  config.max_slew = std::numeric_limits<double>::infinity();
  config.hold.field = renderer;
  config.channels.assign(channels, ChannelRule::kSum);
  return config;
}

/// A controller that is stepped every millisecond.
struct Rig {
  explicit Rig(const HapticController::Config& config) : controller(config) {}

  Step at(const Vec3& x) {
    ++tick;
    Step step = controller.step({.at = now(), .position = x}, applied);
    jump = tick > 1 ? (step.force - applied).norm() : 0;
    applied = step.force;
    return step;
  }
  /// Moves slowly to and fro beside the surface, which pays b ‖Δx‖²/T.
  void earn(double joule) {
    for (int k = 0; at({0.02 * (k % 2), 0, 0.05}).energy < joule; ++k) ASSERT_LT(k, 1000);
  }
  bool use(const Field* field, std::uint32_t generation, std::uint32_t source = kEngine, std::size_t channel = 0) {
    return controller.use({.field = field, .generation = generation, .source = source}, now(), channel);
  }
  bool push(const Vec3& force, std::uint32_t source = kEngine, std::size_t channel = 0) {
    return controller.observe({.sequence = tick + 1,
                               .answers = now(),
                               .received = now(),
                               .force = force,
                               .valid_for = milliseconds(100),
                               .source = source},
                              channel);
  }
  bool tell(std::uint64_t answers_tick, const Vec3& truth, std::uint32_t generation, std::uint32_t source = kEngine) {
    return controller.observe(
        {.answers_tick = answers_tick, .received = now(), .force = truth, .source = source, .field = generation});
  }
  LocalTime now() const { return LocalTime(milliseconds(tick)); }

  HapticController controller;
  std::uint64_t tick = 0;
  Vec3 applied = Vec3::Zero();
  double jump = 0;  ///< N, change of the force in the last step
};

TEST(FieldControl, AFieldUnderTheHandStartsWithNoForce) {
  const Field field = flat(1000);
  for (const bool after_a_force : {false, true}) {
    Rig rig(config_of({}));
    rig.earn(1);
    const Vec3 x(0, 0, -0.004);
    rig.at(x);
    if (after_a_force) {
      for (int k = 0; k < 200; ++k) {
        rig.push({2, 0, 0});
        rig.at(x);
      }
      EXPECT_EQ(rig.applied, Vec3(2, 0, 0));
    }
    EXPECT_TRUE(rig.use(&field, 1));
    const Step first = rig.at(x);
    ASSERT_TRUE(first.field);
    EXPECT_EQ(first.field->generation, 1U);
    EXPECT_EQ(first.field->depth, 0);
    EXPECT_TRUE(first.field->swapping);
    EXPECT_NEAR(first.force.x(), after_a_force ? 1.98 : 0, 1e-12);
    EXPECT_EQ(first.force.z(), 0);
    Step last;
    for (int k = 0; k < 500; ++k) {
      EXPECT_TRUE(rig.push({9, 9, 9})) << "a force that was on its way is ignored";
      last = rig.at(x);
      EXPECT_LE(rig.jump, kMostJump + 0.02);  // the previous force fades out in 100 ms
    }
    EXPECT_NEAR(last.force.z(), 4, 1e-9);
    EXPECT_EQ(last.force.x(), 0);
    EXPECT_EQ(last.mode, Mode::kActive);
    EXPECT_NEAR(last.field->stored, 0.5 * 1000 * 16e-6, 1e-9);
    EXPECT_NEAR(last.field->proxy.z(), 0, 1e-9);
  }
}

TEST(FieldControl, ADeadEnginesFieldFadesWithoutAJump) {
  const Field field = flat(1000);
  for (const bool dropped : {false, true}) {
    Rig rig(config_of({}));
    rig.earn(1);
    rig.at({0, 0, 0.001});
    rig.use(&field, 3);
    const Vec3 x(0, 0, -0.003);
    for (int k = 0; k < 300; ++k) rig.at(x);
    EXPECT_NEAR(rig.applied.z(), 3, 1e-9);
    EXPECT_EQ(rig.controller.field(), 3U);
    rig.controller.release(rig.now(), kOther);
    EXPECT_EQ(rig.controller.field(), 3U) << "of another engine";
    if (dropped) {
      rig.use(nullptr, 0);
    } else {
      rig.controller.release(rig.now(), kEngine);
    }
    EXPECT_EQ(rig.controller.field(), 0U);
    Step step;
    double before = 3;
    for (int k = 0; k < 280; ++k) {
      step = rig.at(x);
      EXPECT_FALSE(step.field);
      EXPECT_LE(rig.jump, 0.065) << k;  // 3 N e^(−t/50 ms)
      EXPECT_LE(step.force.z(), before);
      before = step.force.z();
      if (k == 10) {
        EXPECT_EQ(step.mode, Mode::kHolding);
        EXPECT_NEAR(step.force.z(), 3, 1e-9);
      }
    }
    EXPECT_EQ(step.mode, Mode::kSafeStop);
    EXPECT_EQ(step.force, Vec3(0, 0, 0));
  }
}

TEST(FieldControl, TheNextForceAfterAFieldIsRampedIn) {
  const Field field = flat(1000);
  Rig rig(config_of({}));
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1);
  const Vec3 x(0, 0, -0.003);
  for (int k = 0; k < 300; ++k) rig.at(x);
  rig.use(nullptr, 0);
  rig.at(x);
  for (int k = 0; k < 150; ++k) {
    rig.push({-3, 0, 0});
    rig.at(x);
    EXPECT_LE(rig.jump, 0.06) << k;
  }
  EXPECT_NEAR(rig.applied.x(), -3, 1e-9);
  EXPECT_NEAR(rig.applied.z(), 0, 1e-9);
}

TEST(FieldControl, AnotherEnginesFieldStartsWithNoForceAndNoPose) {
  const Field field = flat(1000);
  Rig rig(config_of({}));
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 5);
  EXPECT_TRUE(rig.controller.observe(TimedPose{.at = rig.now(), .pose = {.position = {0, 0, -0.001}}}));
  const Vec3 x(0, 0, -0.004);
  for (int k = 0; k < 300; ++k) rig.at(x);
  EXPECT_NEAR(rig.applied.z(), 3, 1e-6);
  rig.use(&field, 1, kOther);
  EXPECT_EQ(rig.at(x).field->generation, 1U);
  EXPECT_NEAR(rig.applied.z(), 2.97, 1e-6);
  for (int k = 0; k < 300; ++k) {
    rig.at(x);
    EXPECT_LE(rig.jump, kMostJump + 0.03);
  }
  EXPECT_NEAR(rig.applied.z(), 4, 1e-6);
}

TEST(FieldControl, AfterRearmingTheFieldStartsAgainWithNoForce) {
  const Field field = flat(1000);
  for (const bool fault : {false, true}) {
    Rig rig(config_of({}));
    rig.earn(1);
    rig.at({0, 0, 0.001});
    rig.use(&field, 1);
    const Vec3 x(0, 0, -0.003);
    for (int k = 0; k < 300; ++k) rig.at(x);
    if (fault) {
      rig.at(Vec3::Constant(std::numeric_limits<double>::quiet_NaN()));
    } else {
      rig.controller.disarm();
    }
    for (int k = 0; k < 50; ++k) EXPECT_EQ(rig.at(x).force, Vec3(0, 0, 0));
    rig.controller.rearm();
    for (int k = 0; k < 300; ++k) {
      const Step step = rig.at(x);
      if (k == 0) {
        EXPECT_EQ(step.force, Vec3(0, 0, 0));
      }
      EXPECT_LE(rig.jump, kMostJump);
    }
    EXPECT_NEAR(rig.applied.z(), 3, 1e-6);
  }
}

TEST(FieldControl, APoseWithoutATankCannotPush) {
  const auto given = [](const EnergyGate::Config& push) {
    const Field field = flat(1000);
    HapticController::Config config = config_of({.push = push});
    Rig rig(config);
    Body body{.friction = config.limiter.friction, .x = {0, 0, 0.001}};
    rig.at(body.x);
    rig.use(&field, 1);
    double credit = 0;
    double work = 0;  // on the hand
    double least = 0;
    for (int k = 0; k < 1500; ++k) {  // the plane moves up by 20 mm in 0.2 s
      EXPECT_TRUE(
          rig.controller.observe(TimedPose{.at = rig.now(), .pose = {.position = {0, 0, std::min(0.02, 1e-4 * k)}}}));
      const Step step = rig.at(body.x);
      EXPECT_LE(step.field->stored, step.energy + step.field->credit + 1e-12);
      credit += step.field->credit;
      least = std::min(least, step.energy);
      const Vec3 before = body.x;
      body.go(step.force, {0, 0, 0.001}, {0, 0, 0});
      work += step.force.dot(body.x - before);
    }
    EXPECT_GE(least, -1e-9);
    EXPECT_LE(credit, push.push_j + push.push_w * 1.5 + 1e-12);
    return work;
  };
  EXPECT_LE(given({}), 1e-9);
  EXPECT_GT(given({.push_j = 0.05, .push_w = 1}), 0.01);
}

TEST(FieldControl, ASwapUnderLoadIsPaidOrSinks) {
  const Field low = flat(1000);
  const Field high = flat(1000, 2e-3);
  const Field stiff = flat(3000);
  const Field soft = flat(300);
  for (const Field* second : {&high, &stiff, &soft}) {
    for (const bool rich : {false, true}) {
      HapticController::Config config = config_of({.max_stiffness = 3000});
      Rig rig(config);
      if (rich) rig.earn(1);
      Body body{.friction = config.limiter.friction, .x = {0, 0, 0.002}};
      rig.at(body.x);
      rig.use(&low, 1);
      double most = 0;
      double least = 0;
      for (int k = 0; k < 2500; ++k) {
        if (k == 1500) rig.use(second, 2);
        const double before = rig.applied.norm();
        const Step step = rig.at(body.x);
        least = std::min(least, step.energy);
        EXPECT_LE(step.field->stored, step.energy + 1e-9) << k;
        if (k >= 1500) most = std::max(most, rig.jump);
        if (k == 1499) {
          EXPECT_NEAR(before, 1.38, 0.05);
        }
        body.go(step.force, {0, 0, 0.002 - 0.008 * std::min(1.0, 1e-3 * k)}, {0, 0, k < 1000 ? -0.008 : 0.0});
      }
      EXPECT_LT(most, 0.25);
      EXPECT_GE(least, -1e-9);
    }
  }
}

TEST(FieldControl, ATableLearnsTheSameAtAnyDelay) {
  const auto learned = [](int delay) {
    const Field field = flat(500);
    Rig rig(config_of({.max_stiffness = 2000, .holds = false}));
    rig.earn(1);
    rig.at({0, 0, 0.001});
    rig.use(&field, 1);
    const auto hand = [](std::uint64_t k) { return Vec3(0, 0, -0.0015 + 0.0025 * std::cos(0.01 * double(k))); };
    const std::uint64_t start = rig.tick;
    std::vector<Vec3> last;
    for (std::uint64_t k = 0; k < 4000; ++k) {
      const Step step = rig.at(hand(k));
      const auto then = static_cast<std::int64_t>(k) - delay;
      if (then > 300 && then < 2400 && then % 16 == 0) {  // the stiffness of the true object is 1000 N/m
        const double depth = std::max(0.0, -hand(static_cast<std::uint64_t>(then)).z());
        EXPECT_TRUE(rig.tell(start + static_cast<std::uint64_t>(then) + 1, {0, 0, 1000 * depth}, 1));
      }
      if (k >= 3100) last.push_back(step.force);
    }
    return last;
  };
  const std::vector<Vec3> at_once = learned(0);
  EXPECT_NEAR(std::ranges::max(at_once, {}, [](const Vec3& f) { return f.z(); }).z(), 4, 0.1);
  for (const int delay : {50, 200, 600}) EXPECT_EQ(learned(delay), at_once) << delay << " ms";
}

TEST(FieldControl, LateAndForeignTruthsAreIgnored) {
  const Field field = flat(500);
  Rig rig(config_of({}));
  EXPECT_FALSE(rig.tell(1, {0, 0, 9}, 1)) << "no field";
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1);
  const Vec3 x(0, 0, -0.002);
  for (int k = 0; k < 300; ++k) rig.at(x);
  const std::uint64_t old = rig.tick;
  rig.use(&field, 2);
  for (int k = 0; k < 300; ++k) rig.at(x);
  EXPECT_NEAR(rig.applied.z(), 1, 1e-9);
  EXPECT_FALSE(rig.tell(rig.tick - 5, {0, 0, 9}, 1)) << "old generation";
  EXPECT_FALSE(rig.tell(old, {0, 0, 9}, 2)) << "a step of the old generation";
  EXPECT_FALSE(rig.tell(rig.tick - 5, {0, 0, 9}, 2, kOther)) << "another engine";
  EXPECT_FALSE(rig.tell(rig.tick - 5, {0, 0, std::numeric_limits<double>::infinity()}, 2));
  EXPECT_FALSE(rig.tell(rig.tick + 5, {0, 0, 9}, 2)) << "a step that was not made yet";
  rig.at(x);
  EXPECT_NEAR(rig.applied.z(), 1, 1e-9);
  EXPECT_TRUE(rig.tell(rig.tick - 5, {0, 0, 1.5}, 2));
  EXPECT_FALSE(rig.tell(rig.tick - 5, {0, 0, 9}, 2)) << "twice";
  EXPECT_FALSE(rig.tell(rig.tick - 6, {0, 0, 9}, 2)) << "older than the last one";
  for (int k = 0; k < 50; ++k) rig.at(x);
  EXPECT_GT(rig.applied.z(), 1.1);
  EXPECT_LT(rig.applied.z(), 1.6);
}

TEST(FieldControl, TwoChannelsShareOneAccount) {
  const Field floor = flat(1000);
  Field wall = flat(800);
  wall.primitives = {{.shape = Plane{.normal = Vec3::UnitX()}}};
  HapticController::Config config = config_of({}, 2);
  Rig rig(config);
  const Vec3 x(-0.002, 0, -0.002);
  for (int k = 0; rig.at(x + Vec3(0, 2e-5 * (k % 2), 0)).energy < 1e-3; ++k) ASSERT_LT(k, 1000);
  rig.use(&floor, 4, kEngine, 0);
  rig.use(&wall, 9, kOther, 1);
  Step step;
  for (int k = 0; k < 600; ++k) {
    step = rig.at(x);
    ASSERT_TRUE(step.field);
    EXPECT_LE(step.field->stored, step.energy + 1e-12) << k;
    EXPECT_GE(step.energy, -1e-9);
  }
  EXPECT_EQ(step.field->generation, 4U);
  EXPECT_EQ(step.field->channel, 0U);
  EXPECT_GT(step.field->stored, 0.9 * step.energy) << "nearly all is used";
  EXPECT_GT(step.force.x() + step.force.z(), 0.5);
  rig.controller.release(rig.now(), kEngine, 0);
  step = rig.at(x);
  EXPECT_EQ(step.field->generation, 9U);
  EXPECT_EQ(step.field->channel, 1U);
  EXPECT_EQ(rig.controller.field(0), 0U);
  EXPECT_EQ(rig.controller.field(1), 9U);
}

TEST(FieldControl, AFieldAndAForceOfAnotherChannelAreAdded) {
  const Field field = flat(1000);
  Rig rig(config_of({}, 2));
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1, kEngine, 1);
  const Vec3 x(0, 0, -0.002);
  for (int k = 0; k < 300; ++k) {
    rig.push({0.5, 0, 0}, kOther, 0);
    rig.at(x);
  }
  const Step step = rig.at(x);
  EXPECT_NEAR((step.wanted - Vec3(0.5, 0, 2)).norm(), 0, 1e-6);
  EXPECT_EQ(step.field->channel, 1U);
  EXPECT_NEAR(step.stiffness(2, 2), 1000, 1e-6);
  EXPECT_EQ(step.channel, 0U);
  EXPECT_GT(step.force_sequence, 0U);
}

TEST(FieldControl, APriorityChannelRendersItsField) {
  const Field field = flat(1000);
  HapticController::Config config = config_of({});
  config.channels = {ChannelRule::kPriority};
  Rig rig(config);
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1);
  for (int k = 0; k < 300; ++k) rig.at({0, 0, -0.002});
  EXPECT_NEAR(rig.applied.z(), 2, 1e-6);
}

TEST(FieldControl, TheForceIsSaturatedThenSlewedThenLimited) {
  const Field field = flat(1000);
  HapticController::Config config = config_of({});
  config.max_force = 1.5;
  config.max_slew = 50;
  Rig rig(config);
  rig.earn(1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1);
  for (int k = 0; k < 300; ++k) {
    const Step step = rig.at({0, 0, -0.003});
    EXPECT_LE(rig.jump, 0.05 + 1e-12);
    EXPECT_LE(step.force.norm(), 1.5 + 1e-12);
    EXPECT_LE(step.force.norm(), step.permitted + 1e-12);
  }
  const Step step = rig.at({0, 0, -0.003});
  EXPECT_NEAR(step.wanted.z(), 3, 1e-6);
  EXPECT_NEAR(step.force.z(), 1.5, 1e-9);
  EXPECT_TRUE(step.reasons.has(Reason::kMaxForce));
}

TEST(FieldControl, AnEnergyTankDoesNotGiveWhatAFieldStores) {
  const Field field = flat(1000);
  HapticController::Config config = config_of({});
  Coupling::Config& coupling = config.coupling.emplace();
  coupling.role = PortRole::kFollower;
  coupling.spring = {.stiffness = 100, .own_damping = 1, .period = milliseconds(1)};
  coupling.tank.emplace();
  coupling.holds_place = true;
  Rig rig(config);
  rig.earn(0.1);
  rig.at({0, 0, 0.001});
  rig.use(&field, 1);
  const Vec3 x(0, 0, -0.002);
  for (int k = 0; k < 300; ++k) rig.at(x);
  double given = 0;
  double least = 1;  // of E − H
  for (std::uint64_t n = 1; n <= 1000; ++n) {
    PortState peer;
    peer.epoch = 5;
    peer.sequence = n;
    peer.answers_epoch = 1;
    peer.answers = n - 1;
    peer.time = milliseconds(n);
    peer.engagement = n < 100 ? 0 : 1;
    peer.phase = n < 100 ? PortPhase::kCoupled : PortPhase::kEngaged;
    peer.need = 1;
    (*rig.controller.couplings())[0].receive(peer, rig.now());
    const Step step = rig.at(x);
    given += rig.controller.couplings()->settled(0).withdraw;
    least = std::min(least, step.energy - step.field->stored);
    (*rig.controller.couplings())[0].conclude(rig.applied, {});
    static_cast<void>((*rig.controller.couplings())[0].message());
  }
  EXPECT_GT(given, 0.01);
  EXPECT_GE(least, -1e-9);
  EXPECT_NEAR(rig.applied.z(), 2, 1e-6);
}

TEST(FieldControl, CreditOfATankNeedsASharedAccount) {
  HapticController::Config config = config_of({.push = {.push_j = 0.01}});
  EXPECT_NO_THROW(HapticController{config});
  config.limiter.shared_account = false;
  EXPECT_THROW(HapticController{config}, std::invalid_argument);
  config.hold.field->push = {};
  EXPECT_NO_THROW(HapticController{config});
  config.hold.learned_model.emplace();
  EXPECT_THROW(HapticController{config}, std::invalid_argument);
}

TEST(FieldControl, WithoutThePartNoFieldIsUsedAndForcesAreAsBefore) {
  const Field field = flat(1000);
  HapticController::Config listed = config_of({});
  HapticController::Config plain = listed;
  plain.hold.field.reset();
  Rig with(listed);
  Rig without(plain);
  EXPECT_FALSE(without.use(&field, 1));
  EXPECT_FALSE(without.controller.observe(TimedPose{}));
  EXPECT_FALSE(without.tell(1, {0, 0, 1}, 1));
  EXPECT_FALSE(with.use(&field, 0)) << "generation 0";
  for (int k = 0; k < 500; ++k) {
    const Vec3 x(0.001 * (k % 5), 0, -0.001);
    for (Rig* rig : {&with, &without}) {
      RemoteForce force{.sequence = 1, .received = rig->now(), .force = {0, 0, 1}, .valid_for = milliseconds(30)};
      force.model = LocalModel{.at = {0, 0, -0.001}, .stiffness = 200 * Mat3::Identity()};
      if (k % 16 == 0 && k < 300) rig->controller.observe(force);
    }
    const Step a = with.at(x);
    const Step b = without.at(x);
    EXPECT_EQ(a.force, b.force);
    EXPECT_EQ(a.mode, b.mode);
    EXPECT_FALSE(a.field);
  }
}

}  // namespace
}  // namespace tendon::field::control_test
