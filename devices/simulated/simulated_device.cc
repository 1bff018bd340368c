// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/expect.h"

namespace tendon {
namespace {

void expect_effect(const std::optional<double>& value, std::string_view field) {
  if (!value) return;
  expect(*value > 0 && std::isfinite(*value), field, *value,
         "a number above 0 (left out when there is no such effect)");
}

/// `force` cut down to the norm `limit` in its own direction. Through its largest component, because the
/// square of a mad but finite force overflows.
Vec3 saturated(const Vec3& force, double limit) {
  const double largest = force.lpNorm<Eigen::Infinity>();
  if (!(largest > 0)) return force;
  const Vec3 shape = force / largest;
  const double length = shape.norm();  // 1 … √3
  if (largest <= limit / length) return force;
  return shape * (limit / length);
}

/// The centre of the count that `x` lies in.
Vec3 counted(const Vec3& x, double step) { return (x.array() / step + 0.5).floor().matrix() * step; }

}  // namespace

SimulatedDevice::SimulatedDevice(Config config) : config_(std::move(config)) {
  expect(config_.mass > 0 && std::isfinite(config_.mass), "mass", config_.mass, "a number above 0 kg");
  expect_finite(config_.start_velocity, "start_velocity");
  if (config_.start_position) expect_finite(*config_.start_position, "start_position");
  expect_effect(config_.viscous_friction, "viscous_friction");
  expect_effect(config_.coulomb_friction, "coulomb_friction");
  expect_effect(config_.encoder_step, "encoder_step");
  expect_effect(config_.max_force, "max_force");
  expect_effect(config_.amplifier_bandwidth, "amplifier_bandwidth");
  if (config_.force_sensor) expect_effect(config_.force_sensor->resolution, "force_sensor.resolution");
  if (config_.watchdog) {
    expect(*config_.watchdog > Duration::zero(), "watchdog", seconds(*config_.watchdog),
           "a duration above 0 s (left out when there is none)");
  }
  expect(config_.max_substep > Duration::zero(), "max_substep", seconds(config_.max_substep), "a duration above 0 s");
  if (config_.hand) hand_.emplace(*std::exchange(config_.hand, std::nullopt));
  if (config_.amplifier_bandwidth) amplifier_force_ = Vec3::Zero();
  take_substeps_ =
      substeps_with(config_.coulomb_friction.has_value(), hand_.has_value(), config_.amplifier_bandwidth.has_value());

  info_ = {.name = config_.name,
           .max_force = config_.max_force.value_or(std::numeric_limits<double>::infinity()),
           .position_resolution = config_.encoder_step.value_or(0),
           .watchdog = config_.watchdog.value_or(Duration::zero())};

  truth_.position = config_.start_position.value_or(hand_ ? hand_->target(0).position : Vec3::Zero());
  truth_.velocity = config_.start_velocity;
  settle_energies();
}

std::optional<PositionSample> SimulatedDevice::read(LocalTime now) noexcept {
  truth_.watchdog_fired = false;
  if (!last_read_) {
    last_read_ = now;
    until_watchdog_ = config_.watchdog;
  } else if (now > *last_read_) {
    advance(std::min(now - *last_read_, kMaxGap));
    last_read_ = now;
    settle_energies();
  }
  PositionSample sample{now, truth_.position, {}};
  if (config_.encoder_step) sample.position = counted(truth_.position, *config_.encoder_step);
  if (config_.force_sensor) sample.hand_force = sensed_force();
  if (config_.button_after) sample.buttons = lived_ >= *config_.button_after ? 1 : 0;
  return sample;
}

Vec3 SimulatedDevice::sensed_force() const noexcept {
  const auto& resolution = config_.force_sensor->resolution;
  return resolution ? counted(truth_.hand_force, *resolution) : truth_.hand_force;
}

Vec3 SimulatedDevice::apply(const Vec3& force) noexcept {
  command_ = Vec3::Zero();
  if (force.allFinite()) command_ = force;
  if (config_.max_force) command_ = saturated(command_, *config_.max_force);
  if (config_.watchdog) until_watchdog_ = config_.watchdog;
  return command_;
}

void SimulatedDevice::advance(Duration gap) noexcept {
  if (until_watchdog_) gap = live_with_watchdog(gap);
  integrate(gap);
}

/// What is left of the gap after the watchdog has taken the force away, or all of it when it does not.
Duration SimulatedDevice::live_with_watchdog(Duration gap) noexcept {
  if (gap <= *until_watchdog_) {
    *until_watchdog_ -= gap;
    return gap;
  }
  const Duration before = *until_watchdog_;
  until_watchdog_.reset();
  integrate(before);
  command_.setZero();
  truth_.watchdog_fired = true;
  return gap - before;
}

void SimulatedDevice::integrate(Duration span) noexcept {
  if (span <= Duration::zero()) return;
  const auto substeps = (span + config_.max_substep - Duration(1)) / config_.max_substep;
  (this->*take_substeps_)(substeps, seconds(span) / static_cast<double>(substeps));
  lived_ += span;
}

SimulatedDevice::Substeps SimulatedDevice::substeps_with(bool coulomb, bool hand, bool lag) {
  using Self = SimulatedDevice;
  constexpr std::array<Substeps, 8> kAll = {
      &Self::take_substeps<false, false, false>, &Self::take_substeps<false, false, true>,
      &Self::take_substeps<false, true, false>,  &Self::take_substeps<false, true, true>,
      &Self::take_substeps<true, false, false>,  &Self::take_substeps<true, false, true>,
      &Self::take_substeps<true, true, false>,   &Self::take_substeps<true, true, true>};
  return kAll.at((coulomb ? 4U : 0U) + (hand ? 2U : 0U) + (lag ? 1U : 0U));
}

template <bool kCoulomb, bool kHand, bool kLag>
void SimulatedDevice::take_substeps(Duration::rep count, double h) noexcept {
  const double begin = seconds(lived_);
  double mass = config_.mass;
  if constexpr (kHand) mass += hand_->mass();
  double resistance = mass;
  if (config_.viscous_friction) resistance += h / 2 * *config_.viscous_friction;
  if constexpr (kHand) resistance += h / 2 * (hand_->damping() + h / 2 * hand_->stiffness());
  Lag lag;
  if constexpr (kLag) {
    lag.h_over_tau = h * 2 * std::numbers::pi * *config_.amplifier_bandwidth;
    lag.reached = -std::expm1(-lag.h_over_tau);
  }
  for (Duration::rep i = 0; i < count; ++i) {
    const Vec3 v0 = truth_.velocity;
    if constexpr (kLag) {
      truth_.device_force = force_over(lag);
    } else {
      truth_.device_force = command_;
    }
    Vec3 push = truth_.device_force;
    Vec3 drive;
    if constexpr (kHand) {
      drive = hand_->drive(begin + h * (static_cast<double>(i) + 0.5), truth_.position);
      push += drive;
    }

    Vec3 mean = mass * v0 + h / 2 * push;
    if constexpr (kCoulomb) {
      const double momentum = mean.norm();
      const double lost = h / 2 * *config_.coulomb_friction;
      mean *= momentum > lost ? (1 - lost / momentum) / resistance : 0.0;
    } else {
      mean /= resistance;
    }

    truth_.velocity = 2 * mean - v0;
    if constexpr (kCoulomb) {
      if (truth_.velocity.dot(mean) <= 0 && push.norm() <= *config_.coulomb_friction) truth_.velocity.setZero();
    }
    if constexpr (kHand) {
      const Vec3 pull = drive - (hand_->damping() + h / 2 * hand_->stiffness()) * mean;
      drive_work_ += h * pull.dot(mean);
      truth_.hand_force = pull - hand_->mass() / h * (truth_.velocity - v0);
    }
    truth_.position += h * mean;
  }
}

/// The mean force of the motors over the next substep: the exact mean of the first-order response to the command.
Vec3 SimulatedDevice::force_over(const Lag& lag) noexcept {
  const Vec3 missing = command_ - *amplifier_force_;
  *amplifier_force_ += missing * lag.reached;
  return command_ - missing * (lag.reached / lag.h_over_tau);
}

/// The hand's mass moves with the handle: what it has gained in kinetic energy did not go through the
/// port between the two.
void SimulatedDevice::settle_energies() noexcept {
  const double half_v2 = truth_.velocity.squaredNorm() / 2;
  truth_.kinetic_energy = config_.mass * half_v2;
  if (!hand_) return;
  truth_.hand_work = drive_work_ - hand_->mass() * (half_v2 - config_.start_velocity.squaredNorm() / 2);
}

}  // namespace tendon
