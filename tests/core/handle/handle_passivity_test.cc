// SPDX-License-Identifier: Apache-2.0
// The common account of force and torque and the account of the gripper must not be negative for any motion and any
// demand. The test computes both of them again from the equations and the true motion.
#include <gtest/gtest.h>
#include <rapidcheck.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/base/rotation.h"
#include "core/haptic_controller.h"
#include "tests/support/dice.h"

namespace tendon::handle_passivity_test {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr Duration kLongest = std::chrono::milliseconds(2);

/// J: −F·Δx + f_c ‖Δx‖ + b ‖Δx‖²/T.
template <class Vector>
double income(const Vector& force, const Vector& moved, const Friction& friction, Duration held) {
  const double way = moved.norm();
  return -force.dot(moved) + friction.coulomb * way + friction.viscous * way * way / seconds(held);
}

/// The motion of eq. (7), which extracts the most energy along the force.
template <class Vector>
Vector worst_motion(const Vector& force, const Friction& friction, Duration held) {
  const double size = force.norm();
  if (size <= friction.coulomb) return Vector::Zero();
  return force / size * (seconds(held) * (size - friction.coulomb) / (2 * friction.viscous));
}

AolPlus<1, 3>::Parts any_parts(Dice& dice) {
  AolPlus<1, 3>::Parts parts;
  if (dice.chance(0.5)) parts.energy_cap = {dice.decades(-4, 0), dice.decades(-3, 0)};
  if (dice.chance(0.3)) parts.robust_ledger = {.encoder_step = {0}, .window = static_cast<int>(dice.within(1, 20))};
  if (dice.chance(0.5)) parts.knee = {dice.within(0.1, 0.9)};
  if (dice.chance(0.3)) parts.latency_reserve = {static_cast<int>(dice.within(1, 4))};
  return parts;
}

HapticController::Config any_config(Dice& dice, Law law) {
  const auto friction = [&dice](double lowest, double highest) {
    return Friction{dice.chance(0.3) ? 0.0 : dice.decades(lowest, highest), dice.decades(lowest, highest)};
  };
  HapticController::Config config;
  config.limiter.law = law;
  config.limiter.friction = friction(-2.5, 0.3);
  config.limiter.longest_hold = kLongest;
  if (law == Law::kAolPlus) config.limiter.parts = any_parts(dice);
  config.max_force = dice.decades(0, 2);
  config.max_slew = dice.chance(0.5) ? kInf : dice.decades(2, 5);
  config.hold.ramp_in = dice.chance(0.5) ? Duration::zero() : std::chrono::milliseconds(50);
  config.rotation = {.friction = friction(-5, -1),
                     .max_torque = dice.decades(-2, 1),
                     .max_slew = dice.chance(0.5) ? kInf : dice.decades(0, 3)};
  config.grip = {.friction = friction(-2.5, 0.3), .arm = dice.decades(-2, 0), .max_force = dice.decades(0, 2)};
  return config;
}

RemoteForce any_answer(Dice& dice, const Vec3& x, const Quat& q, const Effort& applied) {
  RemoteForce answer;
  answer.valid_for = std::chrono::milliseconds(static_cast<int>(dice.within(1, 400)));
  answer.force = dice.chance(0.3) ? Vec3(-dice.decades(1, 5) * x) : Vec3(dice.direction() * dice.decades(-3, 5));
  RemoteTorque torque{.torque = dice.direction() * dice.decades(-4, 3)};
  if (dice.chance(0.3)) torque.torque = applied.torque * 1e3;
  if (dice.chance(0.4)) {
    Mat3 stiffness = Mat3::Identity() * dice.decades(-2, 3);
    if (dice.chance(0.3)) stiffness(0, 1) = dice.within(-100, 100);  // not symmetric, so it generates energy
    torque.model = {.at = q, .stiffness = stiffness};
  }
  if (dice.chance(0.9)) answer.torque = torque;
  if (dice.chance(0.8)) answer.grip_force = dice.within(-1, 1) * dice.decades(-2, 3);
  return answer;
}

struct Outcome {
  double least_energy = kInf;  ///< J, force and torque together
  double least_grip = kInf;    ///< J
  bool within_limits = true;
};

Outcome run(std::uint64_t seed, Law law) {
  Dice dice(seed);
  const HapticController::Config config = any_config(dice, law);
  const double hostility = dice.uniform();
  const double answers = dice.uniform();
  HapticController controller(config);
  Outcome outcome;
  LocalTime now{};
  Vec3 x = dice.direction() * 0.02;
  Quat q = rotation_by(dice.direction() * dice.within(0, 3));
  double opening = dice.uniform();
  Effort applied;
  double energy = 0;
  double grip_energy = 0;
  double turnover = 1;  // J, energy exchanged, the scale of rounding errors
  for (std::uint64_t i = 0; i < 300; ++i) {
    if (dice.chance(answers)) {
      RemoteForce answer = any_answer(dice, x, q, applied);
      answer.sequence = i + 1;
      answer.received = now;
      controller.observe(answer);
    }
    const Duration held(static_cast<std::int64_t>(dice.within(500'000, 2'000'000)));
    now += held;
    Vec3 dx = dice.direction() * dice.decades(-7, -2);
    Vec3 turn = dice.direction() * dice.decades(-6, 0);
    double dopening = dice.within(-1, 1) * dice.decades(-6, -1);
    if (dice.chance(hostility)) {
      dx = worst_motion(applied.force, config.limiter.friction, held);
      turn = worst_motion(applied.torque, config.rotation->friction, held);
      if (turn.norm() > 3) turn *= 3 / turn.norm();  // this would be a different rotation
      const Vec<1> grip = worst_motion(Vec<1>(applied.grip), config.grip->friction, held);
      dopening = grip[0] / config.grip->arm;
    }
    x += dx;
    q = unit(product(rotation_by(turn), q));
    opening += dopening;
    if (i > 0) {
      const double step = income(applied.force, dx, config.limiter.friction, held) +
                          income(applied.torque, turn, config.rotation->friction, held);
      energy += step;
      grip_energy += income(Vec<1>(applied.grip), Vec<1>(config.grip->arm * dopening), config.grip->friction, held);
      turnover += std::abs(step);
    }
    outcome.least_energy = std::min(outcome.least_energy, energy / turnover);
    outcome.least_grip = std::min(outcome.least_grip, grip_energy / turnover);

    const double sign = dice.chance(0.5) ? 1 : -1;  // q and −q are the same rotation
    const Quat shown{sign * q.w, sign * q.x, sign * q.y, sign * q.z};
    const HandleSample handle{.turning = Turning{.orientation = shown},
                              .grip = Grip{.opening = opening},
                              .torque = applied.torque,
                              .grip_force = applied.grip};
    const bool seen = !dice.chance(0.02);
    const Step step = seen ? controller.step({now, x, Vec3::Zero()}, applied.force, {}, &handle)
                           : controller.step_unseen(now, applied.force, &handle);
    applied = {step.force, step.turn()->torque, step.grip()->force};
    outcome.within_limits = outcome.within_limits && step.force.norm() <= config.max_force * (1 + 1e-12) &&
                            applied.torque.norm() <= config.rotation->max_torque * (1 + 1e-12) &&
                            std::abs(applied.grip) <= config.grip->max_force && step.force.allFinite() &&
                            applied.torque.allFinite() && std::isfinite(applied.grip);
    if (dice.chance(0.1)) {  // the device applied less
      applied.force *= 0.5;
      applied.torque *= 0.5;
    }
  }
  return outcome;
}

class HandlePassivity : public ::testing::TestWithParam<Law> {};

TEST_P(HandlePassivity, NoHandAndNoEngineMakesItsAccountsNegative) {
  const auto law = GetParam();
  EXPECT_TRUE(rc::check([law] {
    const auto seed = *rc::gen::arbitrary<std::uint64_t>();
    const Outcome outcome = run(seed, law);
    RC_ASSERT(outcome.least_energy >= -1e-9);
    RC_ASSERT(outcome.least_grip >= -1e-9);
    RC_ASSERT(outcome.within_limits);
  }));
}

INSTANTIATE_TEST_SUITE_P(Laws, HandlePassivity, ::testing::Values(Law::kAol, Law::kAolPlus),
                         [](const auto& test) { return test.param == Law::kAol ? "Aol" : "AolPlus"; });

/// Returns the minimum energy (J) of a motion along `scale` times the permitted wrench, with a full account.
double after_a_wrench(double scale, double share_of_torque) {
  const std::array friction{Friction{0.02, 0.26}, Friction{1e-4, 1e-3}};
  WrenchPort port({.law = Law::kAol, .friction = friction, .longest_hold = kLongest});
  double energy = 0;
  const auto live = [&](const Vec<6>& held, const Vec3& dx, const Vec3& turn) {
    energy += income(Vec3(held.head<3>()), dx, friction[0], kLongest) +
              income(Vec3(held.tail<3>()), turn, friction[1], kLongest);
    port.observe({.applied = held, .dx = wrench_of(dx, turn), .held = kLongest});
  };
  for (int i = 0; i < 50; ++i) live(Vec<6>::Zero(), Vec3(1e-4, 0, 0), Vec3(0, 1e-3, 0));
  const Vec<6> wanted = wrench_of(Vec3(0, 1 - share_of_torque, 0), Vec3(share_of_torque, 0, 0)) * 1e4;
  const Vec<6> permitted = scale * port.limit({.force = wanted}).force;
  live(permitted, worst_motion(Vec3(permitted.head<3>()), friction[0], kLongest),
       worst_motion(Vec3(permitted.tail<3>()), friction[1], kLongest));
  return energy;
}

TEST(HandlePassivity, ABoundOnePercentHigherCanBeBroken) {
  for (const double share : {0.0, 0.01, 0.1, 0.9, 1.0}) {
    EXPECT_NEAR(after_a_wrench(1, share), 0, 1e-15) << "the bound is tight";
    EXPECT_LT(after_a_wrench(1.01, share), -1e-7) << share;
  }
}

}  // namespace
}  // namespace tendon::handle_passivity_test
