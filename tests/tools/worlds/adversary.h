// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <limits>

#include "core/ledger/friction.h"
#include "devices/device.h"
#include "tests/support/dice.h"

namespace tendon::simulation {

/// A device in the hand of an adversary, who knows the law and the force, senses positions exactly, and
/// moves so as to get the most energy out: a mixture of random motion and of the worst motion there is,
/// eq. (7) of Lee & Lee 2009:
///
///     Δx* = F/‖F‖ · T (‖F‖ − f_c)₊ / (2b)
class AdversaryDevice final : public Device {
 public:
  struct Config {
    Friction friction;
    double hostility = 0.5;                                  ///< share of intervals in which the worst motion is made
    double largest_move = 1e-2;                              ///< m, of a random motion
    double clamp = std::numeric_limits<double>::infinity();  ///< N, the device's own limit
    /// Sabotage: gives out so much more than it is told to. 1.01 must break passivity, or no test here means anything.
    double force_scale = 1;
  };

  AdversaryDevice(const Config& config, std::uint64_t seed) : config_(config), dice_(seed) {
    info_.name = "adversary";
    info_.max_force = config.clamp;
  }

  const DeviceInfo& info() const noexcept override { return info_; }

  std::optional<PositionSample> read(LocalTime now) noexcept override {
    if (last_) move(now - *last_);
    last_ = now;
    return PositionSample{now, position_};
  }

  Vec3 apply(const Vec3& force) noexcept override {
    saw_only_finite_forces_ = saw_only_finite_forces_ && force.allFinite();
    force_ = force * config_.force_scale;
    if (const double size = force_.norm(); size > config_.clamp) force_ *= config_.clamp / size;
    return force_;
  }

  bool saw_only_finite_forces() const { return saw_only_finite_forces_; }

 private:
  void move(Duration held) {
    const double size = force_.norm();
    if (dice_.chance(config_.hostility)) {
      if (size <= config_.friction.coulomb) return;
      position_ += force_ / size * (seconds(held) * (size - config_.friction.coulomb) / (2 * config_.friction.viscous));
    } else {
      position_ += dice_.direction() * config_.largest_move * dice_.decades(-5, 0);
      // Comes back now and then, so that walls are left and entered.
      if (position_.norm() > 0.05) position_ *= 0.5;
    }
  }

  Config config_;
  Dice dice_;
  DeviceInfo info_;
  std::optional<LocalTime> last_;
  Vec3 position_ = Vec3::Zero();
  Vec3 force_ = Vec3::Zero();
  bool saw_only_finite_forces_ = true;
};

}  // namespace tendon::simulation
