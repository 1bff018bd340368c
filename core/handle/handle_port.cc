// SPDX-License-Identifier: Apache-2.0
#include "core/handle/handle_port.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kUnbounded = std::numeric_limits<double>::infinity();

}  // namespace

template <int Blocks, int Size>
HandlePort<Blocks, Size>::HandlePort(const Config& config)
    : limits_(config.law != Law::kNone),
      law_({.friction = config.friction,
            .longest_hold = config.longest_hold,
            .parts = config.law == Law::kAolPlus ? config.parts : typename Plus::Parts{},
            .shared_account = config.shared_account}),
      longest_hold_(config.longest_hold),
      first_(OutputBound::of(config.friction[0], config.longest_hold)),
      viscous_(config.friction[0].viscous) {
  if (config.law != Law::kAolPlus && config.law != Law::kAol && config.law != Law::kNone) {
    throw std::invalid_argument(
        "law \"" + std::string(info(config.law).name) +
        "\" only limits the force on a point: expected aol+, aol or none for a handle with rotation or gripper");
  }
  if (config.shared_account && !limits_) {
    throw std::invalid_argument(
        "law \"" + std::string(info(config.law).name) +
        "\" has no energy account that an energy tank can share: expected aol or aol+ for a handle");
  }
  if (limits_ && config.follow_holds) holds_.emplace(config.longest_hold, *config.follow_holds);
}

template <int Blocks, int Size>
void HandlePort<Blocks, Size>::follow(Duration held) noexcept {
  if (!holds_) return;
  const Duration before = holds_->in_force();
  holds_->observe(held);
  const Duration now = holds_->in_force();
  if (now == before) return;
  law_.hold_at_most(now);
  first_.viscous_per_hold = viscous_ / seconds(now);
}

template <int Blocks, int Size>
void HandlePort<Blocks, Size>::observe(const Interval<kSize>& interval) noexcept {
  law_.observe(interval);
  follow(interval.held);
}

template <int Blocks, int Size>
void HandlePort<Blocks, Size>::observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept {
  law_.observe_unseen(applied, at_most);
  follow(at_most);
}

template <int Blocks, int Size>
auto HandlePort<Blocks, Size>::limit(const Demand<kSize>& wanted) noexcept -> LimitedForce<kSize> {
  if (!limits_) {
    if (!wanted.force.allFinite()) return {Vec<kSize>::Zero(), kUnbounded, Reason::kNotFinite};
    return {wanted.force, kUnbounded, {}};
  }
  LimitedForce<kSize> limited = law_.limit(wanted);
  if constexpr (Blocks > 1) {
    const double all = wanted.force.norm();
    const double first = wanted.force.template head<Size>().norm();
    limited.permitted = first > 0 ? limited.permitted * (first / all) : first_.largest(law_.spendable());
  }
  return limited;
}

template class HandlePort<2, 3>;
template class HandlePort<1>;

WrenchPort::Config wrench_config(const LimiterConfig& point, const RotationLimits& rotation) {
  expect_above_zero(rotation.max_torque, "rotation.max_torque");
  expect(rotation.max_slew > 0, "rotation.max_slew", rotation.max_slew, "a number above 0 N·m/s, or infinity");
  WrenchPort::Config config{.law = point.law,
                            .friction = {point.friction, rotation.friction},
                            .longest_hold = point.longest_hold,
                            .follow_holds = point.follow_holds,
                            .shared_account = point.shared_account};
  const auto& parts = point.parts;
  if (const auto& cap = parts.energy_cap) config.parts.energy_cap = {cap->energy, cap->most_contact};
  if (const auto& robust = parts.robust_ledger) {
    config.parts.robust_ledger = {.encoder_step = {robust->encoder_step[0], rotation.encoder_step},
                                  .window = robust->window};
  }
  if (const auto& knee = parts.knee) config.parts.knee = {knee->start};
  if (const auto& reserve = parts.latency_reserve) config.parts.latency_reserve = {reserve->holds};
  if (const auto& bounded = parts.bounded_acceleration) {
    if (!rotation.most_acceleration) {
      throw std::invalid_argument(
          "rotation.most_acceleration: expected a number above 0 rad/s², because bounded_acceleration is used");
    }
    config.parts.bounded_acceleration.emplace().most = {bounded->most[0], *rotation.most_acceleration};
  }
  if (const auto& shaping = parts.shaping) {
    if (!rotation.shaping_stiffness) {
      throw std::invalid_argument(
          "rotation.shaping_stiffness: expected a number above 0 N·m/rad, because shaping is used");
    }
    config.parts.shaping.emplace().stiffness = {shaping->stiffness[0], *rotation.shaping_stiffness};
  }
  if (const auto& thrift = parts.thrift) config.parts.thrift = {thrift->share, thrift->energy};
  if (const auto& damper = parts.damper) {
    config.parts.damper = {.viscous = {damper->viscous[0], rotation.damping},
                           .contact = {damper->contact[0], rotation.contact},
                           .smoothing = damper->smoothing,
                           .slow = damper->slow,
                           .dead_zone = damper->dead_zone};
  }
  if (const auto& fading = parts.fading_contact) config.parts.fading_contact = {fading->memory};
  if (const auto& adaptive = parts.adaptive_friction) config.parts.adaptive_friction = {adaptive->rise};
  return config;
}

GripPort::Config grip_config(const LimiterConfig& point, const GripLimits& grip) {
  expect_above_zero(grip.arm, "gripper.arm");
  expect_above_zero(grip.max_force, "gripper.max_force");
  expect(grip.max_slew > 0, "gripper.max_slew", grip.max_slew, "a number above 0 N/s, or infinity");
  GripPort::Config config{.law = point.law,
                          .friction = {grip.friction},
                          .longest_hold = point.longest_hold,
                          .follow_holds = point.follow_holds,
                          .shared_account = point.shared_account};
  if (const auto& cap = point.parts.energy_cap) config.parts.energy_cap = {cap->energy, cap->most_contact};
  if (const auto& fading = point.parts.fading_contact) config.parts.fading_contact = {fading->memory};
  if (const auto& knee = point.parts.knee) config.parts.knee = {knee->start};
  if (const auto& reserve = point.parts.latency_reserve) config.parts.latency_reserve = {reserve->holds};
  return config;
}

LimitedWrench saturate(const Vec<6>& wanted, double max_force, double max_torque) noexcept {
  const double force = wanted.head<3>().norm();
  const double torque = wanted.tail<3>().norm();
  const double share =
      std::min(force > max_force ? max_force / force : 1.0, torque > max_torque ? max_torque / torque : 1.0);
  if (share >= 1) return {wanted, {}};
  return {wanted * share, Reason::kMaxForce};
}

LimitedWrench limit_slew(const Vec<6>& wanted, const Vec<6>& before, double force_rate, double torque_rate,
                         Duration elapsed) noexcept {
  const Vec<6> change = wanted - before;
  const double time = std::max(0.0, seconds(elapsed));
  const auto share_of = [time](double size, double rate) {
    if (std::isinf(rate) || size <= rate * time) return 1.0;  // the product ∞ · 0 s would be NaN
    return rate * time / size;
  };
  const double share =
      std::min(share_of(change.head<3>().norm(), force_rate), share_of(change.tail<3>().norm(), torque_rate));
  if (share >= 1) return {wanted, {}};
  return {before + change * share, Reason::kSlew};
}

}  // namespace tendon
