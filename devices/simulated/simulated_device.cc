// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/simulated_device.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "core/base/expect.h"
#include "core/base/portable_math.h"
#include "devices/finite.h"

namespace tendon {
namespace {

void expect_effect(const std::optional<double>& value, std::string_view field) {
  if (!value) return;
  expect(*value > 0 && std::isfinite(*value), field, *value, "a number above 0 (omit it to disable this effect)");
}

/// Limits the norm. Divides by the largest component first, because the square of a large force may overflow.
Vec3 saturated(const Vec3& force, double limit) {
  const double largest = force.lpNorm<Eigen::Infinity>();
  if (!(largest > 0)) return force;
  const Vec3 shape = force / largest;
  const double length = shape.norm();  // 1 … √3
  if (largest <= limit / length) return force;
  return shape * (limit / length);
}

double share_within(const Vec3& vector, double limit) {
  const double largest = vector.lpNorm<Eigen::Infinity>();
  if (!(largest > 0)) return 1;
  return std::min(1.0, limit / (vector / largest).norm() / largest);
}

void check(const SimulatedDevice::Config::Press& press) {
  expect(press.button < 32, "presses.button", press.button, "a number from 0 to 31");
  expect_not_negative(seconds(press.from), "presses.from");
  expect_above_zero(seconds(press.length), "presses.length");
}

void expect_delay(const std::optional<Duration>& delay, std::string_view field) {
  if (!delay) return;
  expect(*delay > Duration::zero() && *delay <= SimulatedDevice::kMostDelay, field, seconds(*delay),
         "above 0 s, at most 0.1 s (omit it if there is none)");
}

void check(const SimulatedDevice::Config::StructuralMode& mode, double mass) {
  expect(mode.handle_mass > 0 && mode.handle_mass < mass, "structural_mode.handle_mass", mode.handle_mass,
         "above 0 kg and below the mass of " + shortest(mass) + " kg");
  expect_above_zero(mode.stiffness, "structural_mode.stiffness");
  expect_not_negative(mode.damping, "structural_mode.damping");
}

Vec3 counted(const Vec3& x, double step) { return (x.array() / step + 0.5).floor().matrix() * step; }

}  // namespace

SimulatedDevice::SimulatedDevice(Config config) : config_(std::move(config)) {
  expect(config_.mass > 0 && std::isfinite(config_.mass), "mass", config_.mass, "a number above 0 kg");
  expect_finite(config_.start_velocity, "start_velocity");
  if (config_.start_position) expect_finite(*config_.start_position, "start_position");
  expect_effect(config_.viscous_friction, "viscous_friction");
  expect_effect(config_.coulomb_friction, "coulomb_friction");
  if (config_.joint_friction) {
    expect(!config_.coulomb_friction, "coulomb_friction", config_.coulomb_friction.value_or(0),
           "none in addition to joint_friction");
    joints_.emplace(*config_.joint_friction);
  }
  if (config_.structural_mode) check(*config_.structural_mode, config_.mass);
  expect_effect(config_.encoder_step, "encoder_step");
  expect_effect(config_.max_force, "max_force");
  expect_effect(config_.amplifier_bandwidth, "amplifier_bandwidth");
  if (config_.force_sensor) expect_effect(config_.force_sensor->resolution, "force_sensor.resolution");
  if (config_.watchdog) {
    expect(*config_.watchdog > Duration::zero(), "watchdog", seconds(*config_.watchdog),
           "a duration above 0 s (omit it if there is none)");
  }
  expect_delay(config_.sample_delay, "sample_delay");
  expect_delay(config_.force_delay, "force_delay");
  if (config_.sample_delay || config_.force_delay) {
    under_way_.emplace(config_.sample_delay.value_or(Duration::zero()) +
                       config_.force_delay.value_or(Duration::zero()));
  }
  expect(config_.max_substep > Duration::zero(), "max_substep", seconds(config_.max_substep), "a duration above 0 s");
  if (config_.environment) {
    expect(!config_.structural_mode, "structural_mode.handle_mass",
           config_.structural_mode ? config_.structural_mode->handle_mass : 0, "none with an environment");
    environment_.emplace(*std::exchange(config_.environment, std::nullopt));
  }
  if (config_.hand) hand_.emplace(*std::exchange(config_.hand, std::nullopt));
  for (const Config::Press& press : config_.presses) check(press);
  if (config_.amplifier_bandwidth) amplifier_force_ = Vec3::Zero();
  if (config_.lets_go_after) {
    expect(*config_.lets_go_after >= Duration::zero() && hand_, "hand.lets_go_after", seconds(*config_.lets_go_after),
           "0 s or more, for a device with a hand");
  }
  choose_substeps();

  info_ = {.name = config_.name,
           .max_force = config_.max_force.value_or(std::numeric_limits<double>::infinity()),
           .position_resolution = config_.encoder_step.value_or(0),
           .watchdog = config_.watchdog.value_or(Duration::zero())};
  if (joints_) joints_->name(info_.joints);
  if (config_.rotation) {
    info_.measures_orientation = true;
    info_.max_torque = config_.rotation->max_torque.value_or(0);
    info_.angular_resolution = config_.rotation->encoder_step.value_or(0);
    rotation_.emplace(*std::exchange(config_.rotation, std::nullopt));
  }
  if (config_.gripper) gripper_.emplace(*std::exchange(config_.gripper, std::nullopt));
  if (gripper_) info_.gripper = gripper_->info();
  if (!config_.outputs.empty()) outputs_ = SimulatedOutputs(config_.outputs);
  info_.outputs = config_.outputs;
  turns_or_grips_ = rotation_ || gripper_;
  has_more_ = turns_or_grips_ || !config_.presses.empty();

  truth_.position = config_.start_position.value_or(hand_ ? hand_->target(0).position : Vec3::Zero());
  truth_.velocity = config_.start_velocity;
  motor_velocity_ = config_.start_velocity;
  settle_energies();
}

std::optional<PositionSample> SimulatedDevice::read(LocalTime now) noexcept {
  truth_.watchdog_fired = false;
  if (config_.sample_delay) now -= *config_.sample_delay;
  if (!last_read_) {
    last_read_ = now;
    until_watchdog_ = config_.watchdog;
  } else if (now > *last_read_) {
    advance(std::min(now - *last_read_, kMaxGap));
    last_read_ = now;
    settle_energies();
  }
  PositionSample sample{now, truth_.position, {}};
  if (config_.structural_mode) sample.position += truth_.deflection;
  if (config_.encoder_step) sample.position = counted(sample.position, *config_.encoder_step);
  if (config_.force_sensor) sample.hand_force = sensed_force();
  if (config_.button_after) sample.buttons = lived_ >= *config_.button_after ? 1 : 0;
  if (has_more_) sense_more(sample);
  return sample;
}

std::uint32_t SimulatedDevice::pressed() const noexcept {
  std::uint32_t held = 0;
  for (const Config::Press& press : config_.presses) {
    if (lived_ >= press.from && lived_ - press.from < press.length) held |= std::uint32_t{1} << press.button;
  }
  return held;
}

void SimulatedDevice::sense_more(PositionSample& sample) const noexcept {
  sample.buttons |= pressed();
  if (rotation_) sample.orientation = rotation_->sample();
  if (gripper_) sample.opening = gripper_->sample();
}

Vec3 SimulatedDevice::sensed_force() const noexcept {
  const auto& resolution = config_.force_sensor->resolution;
  const Vec3 force = truth_.hand_force + truth_.environment_force;
  return resolution ? counted(force, *resolution) : force;
}

Vec3 SimulatedDevice::apply(const Vec3& force) noexcept {
  if (turns_or_grips_) return apply_alone(force);
  Vec3 held = Vec3::Zero();
  if (force.allFinite()) held = force;
  if (config_.max_force) held = saturated(held, *config_.max_force);
  if (under_way_) return send(held);
  command_ = held;
  if (config_.watchdog) until_watchdog_ = config_.watchdog;
  return held;
}

Vec3 SimulatedDevice::send(const Vec3& force) noexcept {
  under_way_->send(lived_, {.force = force});
  return force;
}

Vec3 SimulatedDevice::apply_alone(const Vec3& force) noexcept { return apply_all({.force = force}).force; }

Effort SimulatedDevice::apply_all(const Effort& effort) noexcept {
  if (!turns_or_grips_) return {.force = apply(effort.force)};
  const Effort held = written(effort);
  if (under_way_) {
    under_way_->send(lived_, held);
  } else {
    hold(held);
  }
  return held;
}

Effort SimulatedDevice::written(const Effort& effort) const noexcept {
  Effort most;
  if (!is_finite(effort)) return most;
  double share = 1;
  if (config_.max_force) share = share_within(effort.force, *config_.max_force);
  if (info_.max_torque > 0) {
    share = std::min(share, share_within(effort.torque, info_.max_torque));
    most.torque = share * effort.torque;
  }
  most.force = share * effort.force;
  if (info_.gripper) most.grip = std::clamp(effort.grip, -info_.gripper->max_force, info_.gripper->max_force);
  return most;
}

/// Called when a command has reached the motors.
void SimulatedDevice::hold(const Effort& effort) noexcept {
  command_ = effort.force;
  if (turns_or_grips_) hold_torque_and_grip(effort);
  if (config_.watchdog) until_watchdog_ = config_.watchdog;
}

void SimulatedDevice::hold_torque_and_grip(const Effort& effort) noexcept {
  if (rotation_) rotation_->hold(effort.torque);
  if (gripper_) gripper_->hold(effort.grip);
}

Duration::rep SimulatedDevice::substeps_in(Duration span) const noexcept {
  return (span + config_.max_substep - Duration(1)) / config_.max_substep;
}

void SimulatedDevice::turn_and_grip(Duration span) noexcept {
  const Duration::rep substeps = substeps_in(span);
  const double h = seconds(span) / static_cast<double>(substeps);
  if (rotation_) rotation_->integrate(seconds(lived_), substeps, h);
  if (gripper_) gripper_->integrate(seconds(lived_), substeps, h);
}

void SimulatedDevice::advance(Duration gap) noexcept {
  if (under_way_) gap = live_to_last_arrival(gap);
  live(gap);
}

/// Integrates up to the last force that reaches the motors, and returns the remaining time.
Duration SimulatedDevice::live_to_last_arrival(Duration gap) noexcept {
  const Duration end = lived_ + gap;
  for (const auto* next = under_way_->next(); next != nullptr && next->arrives <= end; next = under_way_->next()) {
    live(next->arrives - lived_);
    hold(next->effort);
    under_way_->pop();
  }
  return end - lived_;
}

void SimulatedDevice::live(Duration gap) noexcept {
  if (until_watchdog_) gap = live_with_watchdog(gap);
  integrate(gap);
}

/// Sets the force to zero if the watchdog expires. Returns the remaining time.
Duration SimulatedDevice::live_with_watchdog(Duration gap) noexcept {
  if (gap <= *until_watchdog_) {
    *until_watchdog_ -= gap;
    return gap;
  }
  const Duration before = *until_watchdog_;
  until_watchdog_.reset();
  integrate(before);
  command_.setZero();
  if (turns_or_grips_) hold_torque_and_grip(Effort());
  truth_.watchdog_fired = true;
  return gap - before;
}

void SimulatedDevice::choose_substeps() noexcept {
  const Rub rub = joints_ ? Rub::kJoints : config_.coulomb_friction ? Rub::kHandle : Rub::kNone;
  const Far far = config_.structural_mode ? Far::kMode : environment_ ? Far::kEnvironment : Far::kNone;
  take_substeps_ = substeps_with(
      {.rub = rub, .hand = hand_.has_value(), .lag = config_.amplifier_bandwidth.has_value(), .far = far});
}

void SimulatedDevice::integrate(Duration span) noexcept {
  if (config_.lets_go_after && hand_) span = move_until_let_go(span);
  move(span);
}

/// Returns the remaining time, which is the whole span if the hand does not release the handle.
Duration SimulatedDevice::move_until_let_go(Duration span) noexcept {
  const Duration held = std::max(*config_.lets_go_after - lived_, Duration::zero());
  if (held > span) return span;
  move(held);
  settle_energies();
  hand_.reset();
  truth_.hand_force.setZero();
  choose_substeps();
  return span - held;
}

void SimulatedDevice::move(Duration span) noexcept {
  if (span <= Duration::zero()) return;
  if (turns_or_grips_) turn_and_grip(span);
  const auto substeps = substeps_in(span);
  (this->*take_substeps_)(substeps, seconds(span) / static_cast<double>(substeps));
  lived_ += span;
}

SimulatedDevice::Substeps SimulatedDevice::substeps_with(const Effects& effects) {
  constexpr auto kAll = []<std::size_t... kIs>(std::index_sequence<kIs...>) {
    return std::array<Substeps, sizeof...(kIs)>{&SimulatedDevice::take_substeps<Effects::numbered(kIs)>...};
  }
  (std::make_index_sequence<Effects::kHowMany>{});
  return kAll.at(effects.number());
}

/// Before the call, `mean` is the half-step momentum and `velocity` is v₀. After the call, they are the mean velocity
/// and v₁. References are used because copying vectors is expensive here.
template <SimulatedDevice::Rub kRub>
void SimulatedDevice::slide(Vec3& mean, Vec3& velocity, const Side& side, const Vec3& push, const Vec3& position,
                            double h) const noexcept {
  if constexpr (kRub == Rub::kJoints) {
    const auto slide = joints_->step(position, velocity, {mean, side.resistance, side.mass, push}, h);
    mean = slide.mean;
    velocity = slide.end;
    return;
  }
  if constexpr (kRub == Rub::kHandle) {
    const double momentum = mean.norm();
    const double lost = h / 2 * *config_.coulomb_friction;
    mean *= momentum > lost ? (1 - lost / momentum) / side.resistance : 0.0;
  } else {
    mean /= side.resistance;
  }
  velocity = 2 * mean - velocity;
  if constexpr (kRub == Rub::kHandle) {
    if (velocity.dot(mean) <= 0 && push.norm() <= *config_.coulomb_friction) velocity.setZero();
  }
}

template <SimulatedDevice::Effects kEffects>
void SimulatedDevice::take_substeps(Duration::rep count, double h) noexcept {
  constexpr bool kMode = kEffects.far == Far::kMode;
  constexpr bool kEnvironment = kEffects.far == Far::kEnvironment;
  const double begin = seconds(lived_);
  double viscous = 0;
  if (config_.viscous_friction) viscous = h / 2 * *config_.viscous_friction;
  Side handle{config_.mass, 0};  // the whole mass, or only the handle if there is a structural mode
  if constexpr (kMode) handle.mass = config_.structural_mode->handle_mass;
  if constexpr (kEffects.hand) handle.mass += hand_->mass();
  handle.resistance = handle.mass;
  if constexpr (!kMode) handle.resistance += viscous;
  if constexpr (kEnvironment) handle.resistance += h / 2 * environment_->damping();
  if constexpr (kEffects.hand) handle.resistance += h / 2 * (hand_->damping() + h / 2 * hand_->stiffness());
  Side motor;
  double coupling = 0;
  if constexpr (kMode) {
    coupling = h / 2 * (config_.structural_mode->damping + h / 2 * config_.structural_mode->stiffness);
    handle.resistance += coupling;
    motor.mass = config_.mass - config_.structural_mode->handle_mass;
    // After eliminating the handle's velocity.
    motor.resistance = motor.mass + viscous + coupling - coupling * coupling / handle.resistance;
  }
  Lag lag;
  if constexpr (kEffects.lag) {
    lag.h_over_tau = h * 2 * std::numbers::pi * *config_.amplifier_bandwidth;
    lag.reached = -portable::expm1(-lag.h_over_tau);
  }
  for (Duration::rep i = 0; i < count; ++i) {
    const Vec3 v0 = truth_.velocity;
    if constexpr (kEffects.lag) {
      truth_.device_force = force_over(lag);
    } else {
      truth_.device_force = command_;
    }
    Vec3 push = truth_.device_force;
    Vec3 contact;
    if constexpr (kEnvironment) {
      const double middle = begin + h * (static_cast<double>(i) + 0.5);
      contact = environment_->push(middle, truth_.position + h / 2 * v0, v0);
      push += contact;
    }
    if constexpr (kMode) push = config_.structural_mode->stiffness * truth_.deflection;
    Vec3 drive;
    if constexpr (kEffects.hand) {
      drive = hand_->drive(begin + h * (static_cast<double>(i) + 0.5), truth_.position);
      push += drive;
    }

    Vec3 mean = handle.mass * v0 + h / 2 * push;
    if constexpr (kEnvironment) contact += environment_->rub(mean, h);
    if constexpr (kMode) {
      const Vec3 motor_push = truth_.device_force - config_.structural_mode->stiffness * truth_.deflection;
      Vec3 motor_mean = motor.mass * motor_velocity_ + h / 2 * motor_push + coupling / handle.resistance * mean;
      slide<kEffects.rub>(motor_mean, motor_velocity_, motor, motor_push + config_.structural_mode->damping * v0,
                          truth_.position + truth_.deflection, h);
      mean = (mean + coupling * motor_mean) / handle.resistance;
      truth_.velocity = 2 * mean - v0;
      truth_.deflection += h * (motor_mean - mean);
    } else {
      slide<kEffects.rub>(mean, truth_.velocity, handle, push, truth_.position, h);
    }
    if constexpr (kEnvironment) {
      environment_->stop(truth_.velocity);
      contact -= environment_->damping() * mean;
      truth_.environment_force = contact;
      truth_.environment_work += h * contact.dot(mean);
    }
    if constexpr (kEffects.hand) {
      const Vec3 pull = drive - (hand_->damping() + h / 2 * hand_->stiffness()) * mean;
      drive_work_ += h * pull.dot(mean);
      truth_.hand_force = pull - hand_->mass() / h * (truth_.velocity - v0);
    }
    truth_.position += h * mean;
  }
}

/// The exact mean of the motors' first-order response over the next substep.
Vec3 SimulatedDevice::force_over(const Lag& lag) noexcept {
  const Vec3 missing = command_ - *amplifier_force_;
  *amplifier_force_ += missing * lag.reached;
  return command_ - missing * (lag.reached / lag.h_over_tau);
}

/// The hand's mass moves with the handle, so its kinetic energy was not transferred to the handle.
void SimulatedDevice::settle_energies() noexcept {
  const double half_v2 = truth_.velocity.squaredNorm() / 2;
  truth_.kinetic_energy = config_.mass * half_v2;
  if (config_.structural_mode) settle_mode();
  if (!hand_) return;
  truth_.hand_work = drive_work_ - hand_->mass() * (half_v2 - config_.start_velocity.squaredNorm() / 2);
}

void SimulatedDevice::settle_mode() noexcept {
  const auto& mode = *config_.structural_mode;
  const double more = motor_velocity_.squaredNorm() - truth_.velocity.squaredNorm();
  truth_.kinetic_energy += (config_.mass - mode.handle_mass) * more / 2;
  truth_.spring_energy = mode.stiffness * truth_.deflection.squaredNorm() / 2;
}

Friction least_friction(const SimulatedDevice::Config& config) {
  Friction least{.coulomb = config.coulomb_friction.value_or(0), .viscous = config.viscous_friction.value_or(0)};
  if (!config.joint_friction) return least;
  const Friction joints = JointFriction(*config.joint_friction).least();
  return {.coulomb = joints.coulomb, .viscous = least.viscous + joints.viscous};
}

Friction least_friction_at(const SimulatedDevice::Config& config, const Vec3& position) {
  if (!config.joint_friction) return least_friction(config);
  const Friction joints = JointFriction(*config.joint_friction).least_at(position);
  return {.coulomb = joints.coulomb, .viscous = config.viscous_friction.value_or(0) + joints.viscous};
}

const Driver& driver(const SimulatedDevice::Config& /*config*/) {
  static const Driver kRow{
      .kind = "simulated", .name = "simulated device", .axes = "right=x up=y user=z", .buttons = {"button"}};
  return kRow;
}

SimulatedDevice::Config stand_in(const SimulatedDevice::Config& config) { return config; }

std::unique_ptr<Device> make(const SimulatedDevice::Config& config, FromOutside /*outside*/) {
  return std::make_unique<SimulatedDevice>(config);
}

SimulatedDevice::Config plain_stand_in(std::string name) {
  SimulatedDevice::Config device;
  device.name = std::move(name);
  device.mass = 0.1;
  return device;
}

}  // namespace tendon
