// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <optional>

#include "core/ledger/friction.h"
#include "devices/device.h"
#include "tests/support/dice.h"

namespace tendon::simulation {

/// A device with a witness at its port: sees every position that is read and every force that is really held, and keeps
/// an account of its own of what went through the port, from nothing but these:
///
///     E = Σ [ −F·Δx + f_c ‖Δx‖ + b ‖Δx‖²/T ]        and the same for each axis by itself
///
/// An interval whose motion nobody saw (a reading at either end failed, or the device's watchdog ended the force) is
/// booked at its worst, −T (‖F‖ − f_c)₊²/(4b). It uses none of the code under test.
///
/// It can make readings fail, as a bad cable does, and go on holding its force when it is told zero, as an amplifier
/// that falls slowly or a command that was lost does.
class WatchedDevice final : public Device {
 public:
  struct Config {
    Friction friction;     ///< what the limiter was told
    Duration watchdog{};   ///< … of the device; zero: it has none
    double unseen = 0;     ///< probability that a reading fails
    double most_gone = 0;  ///< … and then so many in a row, at most
    double disobeys = 0;   ///< probability that it keeps its force when it is told zero
    std::uint64_t seed = 0;
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
      book(sample->position - *last_, held);
    } else if (last_at_) {
      book_unseen(held);
    }
    last_at_ = now;
    if (fails) {
      last_.reset();
      return std::nullopt;
    }
    last_ = sample->position;
    return sample;
  }

  Vec3 apply(const Vec3& force) noexcept override {
    told_ = force;
    const bool keeps = config_.disobeys > 0 && force.isZero(0) && dice_.chance(config_.disobeys);
    force_ = device_.apply(keeps ? force_ : force);
    return force_;
  }

  /// From now on readings come.
  void heal() noexcept {
    config_.unseen = 0;
    failing_ = 0;
  }

  double energy() const noexcept { return joint_; }                   ///< J, friction isotropic
  double least_of_axes() const noexcept { return axes_.minCoeff(); }  ///< J, each axis has all the friction
  double sum_of_axes() const noexcept { return axes_.sum(); }         ///< J
  const Vec3& told() const noexcept { return told_; }                 ///< N, what the device was told
  const Vec3& held() const noexcept { return force_; }                ///< N, what it holds

 private:
  void book(const Vec3& dx, Duration held) noexcept {
    const double length = dx.norm();
    const double t = seconds(held);
    const double rate = t > 0 ? config_.friction.viscous / t : 0;
    joint_ += -force_.dot(dx) + config_.friction.coulomb * length + rate * length * length;
    for (int i = 0; i < 3; ++i) {
      axes_[i] += -force_[i] * dx[i] + config_.friction.coulomb * std::abs(dx[i]) + rate * dx[i] * dx[i];
    }
  }

  void book_unseen(Duration held) noexcept {
    const Duration at_most = config_.watchdog > Duration::zero() ? std::min(held, config_.watchdog) : held;
    const auto worst = [&](double force) {
      const double excess = std::max(force - config_.friction.coulomb, 0.0);
      return excess > 0 ? seconds(at_most) * excess * excess / (4 * config_.friction.viscous) : 0.0;
    };
    joint_ -= worst(force_.norm());
    for (int i = 0; i < 3; ++i) axes_[i] -= worst(std::abs(force_[i]));
  }

  Device& device_;
  Config config_;
  Dice dice_;
  int failing_ = 0;
  std::optional<LocalTime> last_at_;
  std::optional<Vec3> last_;
  Vec3 told_ = Vec3::Zero();
  Vec3 force_ = Vec3::Zero();
  double joint_ = 0;
  Vec3 axes_ = Vec3::Zero();
};

}  // namespace tendon::simulation
