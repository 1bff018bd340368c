// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/ledger/friction.h"
#include "devices/device.h"
#include "tests/support/dice.h"

namespace tendon::simulation {

/// Observes all positions read and all forces held, to compute the energy of the port without code under test:
///
///     E = Σ [ −F·Δx + f_c ‖Δx‖ + b ‖Δx‖²/T ]
///
/// in total and per axis. An interval with unknown motion (a reading failed at either end, or the device's watchdog
/// ended the force) is booked at its worst case, −T (‖F‖ − f_c)₊²/(4b). If motors turn the handle, torque and rotation
/// enter E in the same way; a gripper with a motor has its own account. Can inject failed readings (a bad cable) and a
/// force that persists after a zero command (a slow amplifier or a lost command).
class WatchedDevice final : public Device {
 public:
  struct Config {
    Friction friction;     ///< the limiter's values
    Duration watchdog{};   ///< of the device; zero: none
    double unseen = 0;     ///< probability that a reading fails
    double most_gone = 0;  ///< maximum number of consecutive failures
    double disobeys = 0;   ///< probability that the force persists after a zero command
    std::uint64_t seed = 0;
    std::optional<Friction> rotation{};  ///< N·m and N·m·s/rad; only with motors that turn the handle
    std::optional<Friction> grip{};      ///< only used if the gripper has a motor
    double arm = 0;                      ///< m/rad, of the gripper
  };

  WatchedDevice(Device& device, const Config& config) : device_(device), config_(config), dice_(config.seed) {}

  const DeviceInfo& info() const noexcept override { return device_.info(); }

  std::optional<PositionSample> read(LocalTime now) noexcept override {
    auto sample = device_.read(now);
    if (failing_ == 0 && config_.unseen > 0 && dice_.chance(config_.unseen)) {
      failing_ = 1 + static_cast<int>(dice_.within(0, config_.most_gone));
    }
    const bool fails = failing_ > 0;
    if (fails) --failing_;
    const Duration held = last_at_ ? now - *last_at_ : Duration::zero();
    if (fails || (config_.watchdog > Duration::zero() && held > config_.watchdog)) {
      if (last_at_) book_unseen(held);
    } else if (last_) {
      book(*last_, *sample, held);
    } else if (last_at_) {
      book_unseen(held);
    }
    last_at_ = now;
    if (fails) {
      last_.reset();
      return std::nullopt;
    }
    last_ = sample;
    return sample;
  }

  Vec3 apply(const Vec3& force) noexcept override {
    told_ = {.force = force};
    held_ = {.force = device_.apply(keeps(told_) ? held_.force : force)};
    return held_.force;
  }

  Effort apply_all(const Effort& effort) noexcept override {
    told_ = effort;
    held_ = device_.apply_all(keeps(told_) ? held_ : effort);
    return held_;
  }

  void heal() noexcept {
    config_.unseen = 0;
    failing_ = 0;
  }

  double energy() const noexcept { return joint_ + turned_; }         ///< J, isotropic friction; includes rotation
  double least_of_axes() const noexcept { return axes_.minCoeff(); }  ///< J, each axis with the full friction
  double sum_of_axes() const noexcept { return axes_.sum(); }         ///< J
  double grip_energy() const noexcept { return gripped_; }
  const Effort& told() const noexcept { return told_; }
  const Effort& held() const noexcept { return held_; }  ///< output held by the device

 private:
  bool keeps(const Effort& told) { return config_.disobeys > 0 && told == Effort{} && dice_.chance(config_.disobeys); }

  /// Dissipated J for a motion `along` the effort with path length `length` in time `t`.
  static double taken(double effort_along, double length, const Friction& friction, double t) {
    const double rate = t > 0 ? friction.viscous / t : 0;
    return -effort_along + friction.coulomb * length + rate * length * length;
  }
  static double worst(double effort, const Friction& friction, double t) {
    const double excess = std::max(effort - friction.coulomb, 0.0);
    return excess > 0 ? -t * excess * excess / (4 * friction.viscous) : 0.0;
  }

  /// Rotation vector (rad) of the shorter rotation from `from` to `to`.
  static Vec3 turn(const Quat& from, const Quat& to) {
    const Eigen::Quaterniond a(from.w, from.x, from.y, from.z);
    const Eigen::Quaterniond b(to.w, to.x, to.y, to.z);
    const Eigen::AngleAxisd by(b * a.conjugate());
    return by.angle() * by.axis();
  }

  void book(const PositionSample& before, const PositionSample& now, Duration held) noexcept {
    const double t = seconds(held);
    const Vec3 dx = now.position - before.position;
    joint_ += taken(held_.force.dot(dx), dx.norm(), config_.friction, t);
    for (int i = 0; i < 3; ++i) axes_[i] += taken(held_.force[i] * dx[i], std::abs(dx[i]), config_.friction, t);
    if (config_.rotation) {
      const Vec3 by = turn(*before.orientation, *now.orientation);
      turned_ += taken(held_.torque.dot(by), by.norm(), *config_.rotation, t);
    }
    if (config_.grip) {
      const double by = config_.arm * (*now.opening - *before.opening);
      gripped_ += taken(held_.grip * by, std::abs(by), *config_.grip, t);
    }
  }

  void book_unseen(Duration held) noexcept {
    const double t = seconds(config_.watchdog > Duration::zero() ? std::min(held, config_.watchdog) : held);
    joint_ += worst(held_.force.norm(), config_.friction, t);
    for (int i = 0; i < 3; ++i) axes_[i] += worst(std::abs(held_.force[i]), config_.friction, t);
    if (config_.rotation) turned_ += worst(held_.torque.norm(), *config_.rotation, t);
    if (config_.grip) gripped_ += worst(std::abs(held_.grip), *config_.grip, t);
  }

  Device& device_;
  Config config_;
  Dice dice_;
  int failing_ = 0;
  std::optional<LocalTime> last_at_;
  std::optional<PositionSample> last_;
  Effort told_;
  Effort held_;
  double joint_ = 0;
  double turned_ = 0;
  double gripped_ = 0;
  Vec3 axes_ = Vec3::Zero();
};

}  // namespace tendon::simulation
