// SPDX-License-Identifier: Apache-2.0
#include "devices/spacemouse/spacemouse_device.h"

#include <algorithm>
#include <cstddef>
#include <span>
#include <utility>
#include <variant>

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;

constexpr Duration kHeld = 100ms;  ///< while the cap is pushed, there are reports every 16 ms or faster

/// 0 in the dead band, length 1 at the stop.
Vec3 rate_of(const spacemouse::Axes& cap, double dead_band) noexcept {
  const Vec3 push = Vec3(cap[0], -cap[2], cap[1]) / spacemouse::kFullDeflection;
  const double length = push.norm();
  if (length <= dead_band) return Vec3::Zero();
  return (std::min(length, 1.0) - dead_band) / (1 - dead_band) / length * push;
}

}  // namespace

SpaceMouseDevice::SpaceMouseDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe)
    : config_(config),
      info_{.name = "3Dconnexion SpaceMouse", .max_force = 0, .position_resolution = 0, .measures_orientation = true},
      dialogue_(std::move(pipe)) {
  expect_above_zero(config.speed, "spacemouse.speed");
  expect(config.dead_band >= 0 && config.dead_band < 1, "spacemouse.dead_band", config.dead_band, "0 or more, below 1");
  expect_above_zero(config.reach, "spacemouse.reach");
  expect_above_zero(config.turn_speed, "spacemouse.turn_speed");
}

Vec3 SpaceMouseDevice::velocity_for(const Config& config, const spacemouse::Axes& cap) noexcept {
  return config.speed * rate_of(cap, config.dead_band);
}

Vec3 SpaceMouseDevice::angular_velocity_for(const Config& config, const spacemouse::Axes& twist) noexcept {
  return config.turn_speed * rate_of(twist, config.dead_band);
}

void SpaceMouseDevice::let_go() noexcept {
  velocity_.setZero();
  angular_velocity_.setZero();
  buttons_ = 0;
}

void SpaceMouseDevice::receive(LocalTime now) noexcept {
  dialogue_.receive([this, now](std::span<const std::uint8_t> packet) {
    const auto report = spacemouse::parse(packet);
    dialogue_.counters().add(report ? DeviceCount::kAnswers : DeviceCount::kUnreadable);
    if (!report) return;
    if (const auto* motion = std::get_if<spacemouse::Motion>(&*report)) {
      take(*motion, now);
    } else if (const auto* buttons = std::get_if<spacemouse::Buttons>(&*report)) {
      buttons_ = buttons->held;
    }
  });
  if (now - pushed_ >= kHeld) velocity_.setZero();
  if (now - twisted_ >= kHeld) angular_velocity_.setZero();
}

void SpaceMouseDevice::take(const spacemouse::Motion& motion, LocalTime now) noexcept {
  if (motion.translation) {
    velocity_ = velocity_for(config_, *motion.translation);
    pushed_ = now;
  }
  if (motion.rotation) {
    angular_velocity_ = angular_velocity_for(config_, *motion.rotation);
    twisted_ = now;
  }
}

std::optional<PositionSample> SpaceMouseDevice::read(LocalTime now) noexcept {
  const Duration gap = std::clamp(now - before_, Duration::zero(), kHeld);
  before_ = now;
  if (dialogue_.begin(now)) let_go();
  state_.store(dialogue_.connected() ? State::kHomed : State::kAbsent, std::memory_order_relaxed);
  if (!dialogue_.connected()) return std::nullopt;
  position_ = (position_ + velocity_ * seconds(gap)).cwiseMax(-config_.reach).cwiseMin(config_.reach);
  orientation_ = unit(product(rotation_by(angular_velocity_ * seconds(gap)), orientation_));
  receive(now);
  return PositionSample{
      .at = now, .position = position_, .hand_force = std::nullopt, .buttons = buttons_, .orientation = orientation_};
}

Vec3 SpaceMouseDevice::apply(const Vec3& /*force*/) noexcept { return Vec3::Zero(); }

namespace spacemouse {

const Driver& driver(const Config& /*config*/) {
  static const Driver kRow{.kind = "spacemouse",
                           .name = "3Dconnexion SpaceMouse",
                           .exerts_force = false,
                           .axes = "right=x up=y user=z",
                           .buttons = {"left", "right"},
                           .ids = SpaceMouseDevice::kIds,
                           .transfers = usb::PipeConfig::Transfers::kInterrupt};
  return kRow;
}

SimulatedDevice::Config stand_in(const Config& /*config*/) { return plain_stand_in("spacemouse"); }

std::unique_ptr<Device> make(const Config& config, FromOutside outside) {
  return std::make_unique<SpaceMouseDevice>(config.motion, std::move(outside.pipe));
}

}  // namespace spacemouse

}  // namespace tendon
