// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/teleop/follower.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include "protocol/expect.h"
#include "protocol/rotation.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;

constexpr double kSmoothingNs = 1e9;                  // time constant of the delay filter
constexpr Duration kLongestStep = milliseconds(100);  // after a pause of the robot program, the target does not jump
constexpr Duration kHold = milliseconds(20);
constexpr Duration kLost = milliseconds(250);

void expect_text(bool holds, const std::string& field, const std::string& value, const std::string& expected) {
  if (!holds) throw std::invalid_argument(field + " = " + value + ": expected " + expected);
}

void expect_between(double least, double most, const char* field, double value) {
  expect(value >= least && value <= most, field, value, shortest(least) + " to " + shortest(most));
}

void expect_scales(double scale, double force_scale) {
  expect_between(0.01, 100, "scale", scale);
  expect_between(0.01, 100, "force_scale", force_scale);
}

bool are_axes(const std::string& axes) {
  return !axes.empty() && axes.find_first_not_of("xyz") == std::string::npos &&
         std::is_sorted(axes.begin(), axes.end()) && std::adjacent_find(axes.begin(), axes.end()) == axes.end();
}

const Follower::Config& checked(const Follower::Config& config) {
  const auto& [w, x, y, z] = config.rotation;
  expect_scales(config.scale, config.force_scale);
  expect_text(is_rotation(config.rotation), "rotation",
              "of length " + rounded(std::sqrt(w * w + x * x + y * y + z * z), 6), "a unit quaternion");
  expect_text(are_axes(config.axes), "axes", '"' + config.axes + '"',
              "one or more of the letters \"xyz\", in this order");
  if (config.clutch_button) expect_between(0, 31, "clutch_button", *config.clutch_button);
  const bool by_button = config.engage_by == Follower::EngageBy::kButton;
  expect_text(!by_button || config.clutch_button, "engage_by", "\"button\"", "\"call\" without clutch_button");
  expect_text(!config.toggle || config.clutch_button, "toggle", "true", "false without clutch_button");
  expect_between(0.001, 10, "speed", config.speed);
  expect_between(0.01, 100, "spin", config.spin);
  expect_between(0, 10, "ramp_s", config.ramp_s);
  expect_between(0.001, 1000, "grip_ratio", config.grip_ratio);
  expect_between(0.001, 100, "grip_speed", config.grip_speed);
  expect(config.rate_hz >= 1 && config.rate_hz <= 100000, "rate_hz", config.rate_hz, "1 to 100000");
  return config;
}

bool is_finite(const Pose& pose) {
  const Quat q = pose.orientation.value_or(Quat{});
  return pose.position.allFinite() && std::isfinite(q.w + q.x + q.y + q.z) && std::isfinite(pose.grip.value_or(0));
}

double share(double whole, double most) { return whole <= most ? 1 : most / whole; }  ///< limits a length to `most`

}  // namespace

Follower::Follower(const Config& config)
    : config_(checked(config)),
      scale_(config.scale),
      force_scale_(config.force_scale),
      turn_(unit(config.rotation)),
      late_(std::max<Duration>(from_seconds(3 / config.rate_hz), milliseconds(20))) {
  const auto is_coupled = [&](char axis) { return config.axes.find(axis) == std::string::npos ? 0. : 1.; };
  mask_ = Vec3(is_coupled('x'), is_coupled('y'), is_coupled('z'));
}

void Follower::disengage() noexcept {
  asked_ = false;
  if (phase_ == Following::kEngaged || phase_ == Following::kClutched) phase_ = Following::kCoupled;
}

bool Follower::set_scale(double scale, double force_scale) {
  expect_scales(scale, force_scale);
  if (phase_ == Following::kEngaged) return false;
  scale_ = scale;
  force_scale_ = force_scale;
  return true;
}

std::optional<Pose> Follower::target(const DeviceState& hand, const Pose& pose, LocalTime now) noexcept {
  double elapsed = advance(now);
  if (hand.tick < tick_) lose();  // the server has been replaced or restarted
  const Duration old = take(hand);
  if (old > late_ + kLost) lose();
  const bool fresh = phase_ != Following::kLost && old <= late_;
  if (is_finite(pose)) {
    act(hand, pose, fresh);
  } else {
    disengage();
    words_ = "the robot's pose is not finite: disengaged";
  }
  if (phase_ != Following::kEngaged || old > late_ + kHold) {
    waits_ = true;
    return {};
  }
  if (waits_) {
    waits_ = false;
    target_ = pose;
    elapsed = 0;
  }
  if (fresh) approach(hand, elapsed);
  return target_;
}

std::optional<Pose> Follower::silence(LocalTime now) noexcept {
  advance(now);
  if (phase_ == Following::kEngaged && age() <= late_ + kHold) return target_;
  waits_ = true;
  return {};
}

Touch Follower::touch(const std::optional<ToolContact>& contact) noexcept {
  Touch felt;
  if (!contact) {
    words_ = "the robot measures no contact force: the hand feels nothing";
    felt.unknown = true;
    return felt;
  }
  if (phase_ != Following::kEngaged) return felt;
  const double grown = config_.ramp_s > 0 ? std::min(seconds(now_ - gain_from_) / config_.ramp_s, 1.) : 1;
  const double gain = force_scale_ * grown;
  const double lever = gain / scale_;
  const Quat back = inverse(turn_);
  felt.force = gain * masked(rotated(back, contact->force));
  if (contact->torque) felt.torque = lever * rotated(back, *contact->torque);
  if (contact->grip_force) felt.grip_force = lever * config_.grip_ratio * *contact->grip_force;
  const Vec3 normal = contact->normal.value_or(contact->force);
  const double length = normal.norm();
  const double k = contact->stiffness.value_or(0);
  if (!(k > 0 && length > 0 && std::isfinite(length))) return felt;
  const Vec3 n = rotated(back, normal / length);
  const Vec3 along = masked(n);
  felt.stiffness = gain * scale_ * k * along * along.transpose();
  const double depth = contact->force.dot(normal) / length / (k * scale_);
  if (mask_ == Vec3::Ones()) felt.contact = Contact{.normal = n, .gap = -depth};
  return felt;
}

/// Returns the elapsed time in s, at most kLongestStep.
double Follower::advance(LocalTime now) noexcept {
  const Duration elapsed = std::clamp<Duration>(now - now_, Duration::zero(), kLongestStep);
  now_ = std::max(now, now_);
  if (age() > late_ + kLost) lose();
  return seconds(elapsed);
}

/// Age of the newest state, beyond the smoothed delay.
Duration Follower::age() const noexcept {
  if (!base_) return Duration::zero();
  return (now_ - base_->came) - (sampled_ - base_->sampled) - Duration(std::llround(usual_ns_));
}

/// Returns the age of the state on arrival. The first state after a silence is the reference.
Duration Follower::take(const DeviceState& hand) noexcept {
  if (!base_) {
    base_ = {now_, hand.sampled};
    usual_ns_ = 0;
    sampled_ = hand.sampled;
    phase_ = Following::kCoupled;
    asked_ = false;
    held_ = true;
  }
  const Duration period = std::max(hand.sampled - sampled_, Duration::zero());
  tick_ = hand.tick;
  sampled_ = hand.sampled;
  const Duration old = age();
  const double weight = std::min(static_cast<double>(period.count()) / kSmoothingNs, 1.);
  usual_ns_ += weight * static_cast<double>(old.count());
  return old;
}

void Follower::lose() noexcept {
  phase_ = Following::kLost;
  base_.reset();
  asked_ = false;
  tick_ = 0;
}

void Follower::act(const DeviceState& hand, const Pose& pose, bool fresh) noexcept {
  const bool held = config_.clutch_button && ((hand.buttons >> *config_.clutch_button) & 1U) != 0;
  const bool pressed = held && !held_;
  held_ = held;
  const Reasons reasons = Reasons::from_bits(hand.reasons);
  if (hand.mode == Mode::kFault || reasons.has(Reason::kFault) || reasons.has(Reason::kDisarmed)) return disengage();
  if (!fresh) return;
  const bool asked = std::exchange(asked_, false);
  if (phase_ == Following::kCoupled) {
    const bool by_button = pressed && config_.engage_by == EngageBy::kButton;
    if (by_button) phase_ = Following::kClutched;
    if (asked || (by_button && config_.toggle)) begin(hand, pose);
  } else if (phase_ == Following::kEngaged && pressed) {
    phase_ = Following::kClutched;
  } else if (phase_ == Following::kClutched && (config_.toggle ? pressed : !held)) {
    begin(hand, pose);
  }
}

/// Engages. The offset is chosen so that the target is the current pose.
void Follower::begin(const DeviceState& hand, const Pose& pose) noexcept {
  phase_ = Following::kEngaged;
  gain_from_ = now_;
  hand0_ = hand.position;
  turned0_ = hand.turning ? std::optional(hand.turning->orientation) : std::nullopt;
  pose0_ = pose;
  waits_ = true;
}

void Follower::approach(const DeviceState& hand, double seconds) noexcept {
  const Vec3 wanted = pose0_.position + scale_ * rotated(turn_, masked(hand.position - hand0_));
  const Vec3 way = wanted - target_.position;
  target_.position += share(way.norm(), config_.speed * seconds) * way;
  if (turned0_ && hand.turning && target_.orientation && pose0_.orientation) {
    const Quat turned = product(product(turn_, product(hand.turning->orientation, inverse(*turned0_))), inverse(turn_));
    const Vec3 spin = rotation_vector(product(product(turned, *pose0_.orientation), inverse(*target_.orientation)));
    const Quat part = rotation_by(share(spin.norm(), config_.spin * seconds) * spin);
    target_.orientation = unit(product(part, *target_.orientation));
  }
  if (target_.grip && hand.grip) {
    const double rest = config_.grip_ratio * hand.grip->opening - *target_.grip;
    *target_.grip += share(std::abs(rest), config_.grip_speed * seconds) * rest;
  }
}

}  // namespace tendon
