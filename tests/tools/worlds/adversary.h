// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/rotation.h"
#include "core/ledger/friction.h"
#include "devices/device.h"
#include "tests/support/dice.h"

namespace tendon::simulation {

/// Factors of the device's output. 1.01 must break passivity, which shows that the tests can detect a violation.
struct Sabotage {
  double force = 1;
  double torque = 1;
  double grip = 1;
  bool operator==(const Sabotage&) const = default;
};

/// A device moved by an adversary that knows the law and the force and senses positions exactly. It mixes random motion
/// with the worst case, eq. (7) of Lee & Lee 2009:
///
///     Δx* = F/‖F‖ · T (‖F‖ − f_c)₊ / (2b)
///
/// Rotation and gripper move by the same rule. The reported orientation switches sign at random (q or −q).
class AdversaryDevice final : public Device {
 public:
  struct Config {
    Friction friction;
    double hostility = 0.5;                                  ///< share of intervals with worst-case motion
    double largest_move = 1e-2;                              ///< m, of a random motion
    double clamp = std::numeric_limits<double>::infinity();  ///< N, the device's own limit
    struct Turn {
      Friction friction;   ///< N·m and N·m·s/rad
      double largest = 0;  ///< rad, of a random rotation
      double clamp = 0;    ///< N·m, the limit of the device, or 0 if there are no motors
    };
    std::optional<Turn> turn{};
    struct Fingers {
      Friction friction;
      double arm = 0;    ///< m/rad
      double open = 0;   ///< rad
      double clamp = 0;  ///< N, the limit of the device, or 0 if there is no motor
    };
    std::optional<Fingers> fingers{};
    Sabotage more{};
  };
  using Turn = Config::Turn;
  using Fingers = Config::Fingers;

  AdversaryDevice(const Config& config, std::uint64_t seed) : config_(config), dice_(seed), handle_dice_(~seed) {
    info_.name = "adversary";
    info_.max_force = config.clamp;
    info_.measures_orientation = config.turn.has_value();
    if (config.turn) info_.max_torque = config.turn->clamp;
    if (config.fingers) {
      info_.gripper = DeviceInfo::Gripper{
          .open = config.fingers->open, .arm = config.fingers->arm, .max_force = config.fingers->clamp};
    }
  }

  const DeviceInfo& info() const noexcept override { return info_; }

  std::optional<PositionSample> read(LocalTime now) noexcept override {
    if (last_) move(now - *last_);
    last_ = now;
    PositionSample sample{now, position_};
    if (config_.turn) {
      const double sign = handle_dice_.chance(0.5) ? 1 : -1;
      const Quat& q = orientation_;
      sample.orientation = Quat{.w = sign * q.w, .x = sign * q.x, .y = sign * q.y, .z = sign * q.z};
    }
    if (config_.fingers) sample.opening = opening_;
    return sample;
  }

  Vec3 apply(const Vec3& force) noexcept override {
    force_ = force * config_.more.force;
    if (const double size = force_.norm(); size > config_.clamp) force_ *= config_.clamp / size;
    torque_.setZero();
    grip_ = 0;
    return force_;
  }

  /// Keeps the direction of a wrench that exceeds the maximum.
  Effort apply_all(const Effort& effort) noexcept override {
    force_ = effort.force * config_.more.force;
    torque_ = effort.torque * config_.more.torque;
    grip_ = effort.grip * config_.more.grip;
    double share = 1;
    if (const double size = force_.norm(); size > config_.clamp) share = config_.clamp / size;
    const double turn_clamp = config_.turn ? config_.turn->clamp : 0;
    if (const double size = torque_.norm(); size * share > turn_clamp) share = turn_clamp / size;
    force_ *= share;
    torque_ *= share;
    const double grip_clamp = config_.fingers ? config_.fingers->clamp : 0;
    grip_ = std::clamp(grip_, -grip_clamp, grip_clamp);
    return {.force = force_, .torque = torque_, .grip = grip_};
  }

 private:
  /// rad. Below π, because a larger rotation would be measured in the other direction.
  static constexpr double kMostTurn = 3;

  void move(Duration held) {
    const bool hostile = dice_.chance(config_.hostility);
    if (!hostile) {
      position_ += dice_.direction() * config_.largest_move * dice_.decades(-5, 0);
      // Back towards the origin, so that walls are entered and left.
      if (position_.norm() > 0.05) position_ *= 0.5;
    } else if (const double size = force_.norm(); size > config_.friction.coulomb) {
      position_ += force_ / size * worst(size, config_.friction, held);
    }
    if (config_.turn) turn(hostile, held);
    if (config_.fingers) squeeze(hostile, held);
  }

  void turn(bool hostile, Duration held) {
    Vec3 by = Vec3::Zero();
    if (!hostile) {
      by = handle_dice_.direction() * config_.turn->largest * handle_dice_.decades(-4, 0);
    } else if (const double size = torque_.norm(); size > config_.turn->friction.coulomb) {
      by = torque_ / size * std::min(worst(size, config_.turn->friction, held), kMostTurn);
    }
    orientation_ = unit(product(rotation_by(by), orientation_));
  }

  void squeeze(bool hostile, Duration held) {
    const Fingers& fingers = *config_.fingers;
    double by = 0;
    if (!hostile) {
      by = handle_dice_.within(-1, 1) * 0.1 * fingers.open * handle_dice_.decades(-3, 0);
    } else if (const double size = std::abs(grip_); size > fingers.friction.coulomb) {
      by = std::copysign(worst(size, fingers.friction, held) / fingers.arm, grip_);
    }
    opening_ = std::clamp(opening_ + by, 0.0, fingers.open);
  }

  static double worst(double size, const Friction& friction, Duration held) {
    return seconds(held) * (size - friction.coulomb) / (2 * friction.viscous);
  }

  Config config_;
  Dice dice_;
  Dice handle_dice_;
  DeviceInfo info_;
  std::optional<LocalTime> last_;
  Vec3 position_ = Vec3::Zero();
  Quat orientation_;
  double opening_ = 0;
  Vec3 force_ = Vec3::Zero();
  Vec3 torque_ = Vec3::Zero();
  double grip_ = 0;
};

}  // namespace tendon::simulation
