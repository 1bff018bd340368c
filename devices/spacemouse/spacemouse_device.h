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

/// A 3Dconnexion SpaceMouse over a `usb::Pipe`, as a leader without force. Its cap moves by some millimetres and
/// springs back, so it controls a velocity (rate control): the further it is pushed, the faster the position moves.
///
///     d = (X, −Z, Y) / 350, no longer than 1;     v = speed · (|d| − dead_band) / (1 − dead_band) · d/|d|, or 0
///     within; p ← p + v (now − before), each component within ±reach
///
/// The frame is x right, y up, z towards the user, like the Falcon's. Twisting the cap changes the orientation in the
/// same way: with r = (Rx, −Rz, Ry) / 350 instead of d, and `turn_speed` instead of `speed`, the angular velocity is ω,
/// and q ← rotation_by(ω (now − before)) q. The orientation thus rotates about the axis of the twist as the operator
/// sees it, and not about a body axis.
///
/// Position and orientation start at zero and are kept while the device is disconnected. A push or a twist ends if no
/// report has confirmed it for 100 ms, and one `read` moves the position by at most 100 ms of pushing. `apply` always
/// returns zero.
///
/// The state is kAbsent while the device is disconnected and otherwise kHomed: it needs no opening. Buttons are those
/// of the report, from bit 0; the row in driver.h names the first two, as on models that have two buttons.
///
/// Thread-safe: `counts` and `state` from any thread, the others from one thread. Realtime-safe: `read`, `apply` and
/// `counts`.
class SpaceMouseDevice final : public Device {
 public:
  /// Vendor and product ids from spacenavd, from the SpaceMouse Plus XT to Bluetooth models connected by cable.
  static constexpr std::array kIds = std::to_array<usb::Id>(
      {{0x046D, 0xC603}, {0x046D, 0xC605}, {0x046D, 0xC606}, {0x046D, 0xC621}, {0x046D, 0xC623}, {0x046D, 0xC625},
       {0x046D, 0xC626}, {0x046D, 0xC627}, {0x046D, 0xC628}, {0x046D, 0xC629}, {0x046D, 0xC62B}, {0x046D, 0xC640},
       {0x256F, 0xC62E}, {0x256F, 0xC62F}, {0x256F, 0xC631}, {0x256F, 0xC632}, {0x256F, 0xC633}, {0x256F, 0xC635},
       {0x256F, 0xC636}, {0x256F, 0xC638}, {0x256F, 0xC63A}});

  struct Config {
    double speed = 0.1;       ///< m/s at the stop, > 0
    double dead_band = 0.05;  ///< fraction of the way to the stop in which nothing moves, 0 ≤ dead_band < 1
    double reach = 0.05;      ///< m, largest distance from the origin on each axis, > 0
    double turn_speed = 1;    ///< rad/s at the stop of a twist, > 0
  };

  /// Takes the pipe to a SpaceMouse. Throws std::invalid_argument, naming the field, its value and the expected range.
  SpaceMouseDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

  /// Returns v (m/s) of the equation above. Realtime-safe.
  static Vec3 velocity_for(const Config& config, const spacemouse::Axes& cap) noexcept;
  /// Returns ω (rad/s) for a twist. Realtime-safe.
  static Vec3 angular_velocity_for(const Config& config, const spacemouse::Axes& twist) noexcept;

 private:
  void receive(LocalTime now) noexcept;
  void take(const spacemouse::Motion& motion, LocalTime now) noexcept;
  void let_go() noexcept;

  Config config_;
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};
  LocalTime before_{};            ///< time of the last `read`
  LocalTime pushed_{};            ///< time of the last translation report
  LocalTime twisted_{};           ///< time of the last rotation report
  Vec3 velocity_ = Vec3::Zero();  ///< since that report
  Vec3 angular_velocity_ = Vec3::Zero();
  Vec3 position_ = Vec3::Zero();
  Quat orientation_;
  std::uint32_t buttons_ = 0;
};

namespace spacemouse {

/// Configuration of a SpaceMouse in a scene.
struct Config {
  std::string port{};  ///< name in `tendond devices`; empty: the first free one
  SpaceMouseDevice::Config motion{};
};

const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace spacemouse

}  // namespace tendon
