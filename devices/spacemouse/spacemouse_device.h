// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "devices/device.h"
#include "devices/driver.h"
#include "devices/simulated/simulated_device.h"
#include "devices/spacemouse/report.h"
#include "devices/usb/dialogue.h"

namespace tendon {

/// A 3Dconnexion SpaceMouse as a leader without force. The cap controls the velocity because its travel is too short:
///
///     d = (X, −Z, Y) / 350, no longer than 1;     v = speed · (|d| − dead_band) / (1 − dead_band) · d/|d|, or 0
///     within; p ← p + v (now − before), each component within ±reach
///
/// As for the Falcon, x is to the right, y up, z towards the user. Rotating the cap changes the orientation in the same
/// way, using r = (Rx, −Rz, Ry) / 350 and `turn_speed`: q ← rotation_by(ω (now − before)) q. The axis of rotation is
/// fixed in space and does not rotate with q.
///
/// Position and orientation start at zero, and do not change while the device is unplugged. Velocities are reset to
/// zero if they are not confirmed for 100 ms, which also limits the motion in one `read`. `apply` always returns zero.
/// The state is kAbsent or kHomed. Buttons start at bit 0; the two names are correct for models with two buttons.
/// Thread-safe: `counts` and `state` only. Realtime-safe: `read`, `apply`, `counts`.
class SpaceMouseDevice final : public Device {
 public:
  /// The list of spacenavd, from the SpaceMouse Plus XT to Bluetooth models that are connected by a cable.
  static constexpr std::array kIds = std::to_array<usb::Id>(
      {{0x046D, 0xC603}, {0x046D, 0xC605}, {0x046D, 0xC606}, {0x046D, 0xC621}, {0x046D, 0xC623}, {0x046D, 0xC625},
       {0x046D, 0xC626}, {0x046D, 0xC627}, {0x046D, 0xC628}, {0x046D, 0xC629}, {0x046D, 0xC62B}, {0x046D, 0xC640},
       {0x256F, 0xC62E}, {0x256F, 0xC62F}, {0x256F, 0xC631}, {0x256F, 0xC632}, {0x256F, 0xC633}, {0x256F, 0xC635},
       {0x256F, 0xC636}, {0x256F, 0xC638}, {0x256F, 0xC63A}});

  struct Config {
    double speed = 0.1;       ///< m/s at the stop, > 0
    double dead_band = 0.05;  ///< relative to the stop, 0 ≤ dead_band < 1
    double reach = 0.05;      ///< m, on each axis, > 0
    double turn_speed = 1;    ///< rad/s at the stop, > 0
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field.
  SpaceMouseDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

  static Vec3 velocity_for(const Config& config, const spacemouse::Axes& cap) noexcept;  ///< v, in m/s; realtime-safe
  /// ω, in rad/s. Realtime-safe.
  static Vec3 angular_velocity_for(const Config& config, const spacemouse::Axes& twist) noexcept;

 private:
  void receive(LocalTime now) noexcept;
  void take(const spacemouse::Motion& motion, LocalTime now) noexcept;
  void let_go() noexcept;

  Config config_;
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};
  LocalTime before_{};
  LocalTime pushed_{};
  LocalTime twisted_{};
  Vec3 velocity_ = Vec3::Zero();
  Vec3 angular_velocity_ = Vec3::Zero();
  Vec3 position_ = Vec3::Zero();
  Quat orientation_;
  std::uint32_t buttons_ = 0;
};

namespace spacemouse {

struct Config {
  std::string port{};  ///< from `tendond devices`; optional
  SpaceMouseDevice::Config motion{};
};

const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace spacemouse

}  // namespace tendon
