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

/// A 3Dconnexion SpaceMouse over a `usb::Pipe`, as a leader without force. Its cap travels some millimetres and springs
/// back, so it controls the speed (rate control): the further the cap is pushed, the faster the position moves.
///
///     d = (X, −Z, Y) / 350, no longer than 1;     v = speed · (|d| − dead_band) / (1 − dead_band) · d/|d|, or 0
///     within; p ← p + v (now − before), each component within ±reach
///
/// x right, y up, z towards the user, as the Falcon's. The twist of the cap turns the orientation in the same way: with
/// r = (Rx, −Rz, Ry) / 350 for d, ω is `turn_speed` in place of `speed`, and q ← rotation_by(ω (now − before)) q. So
/// the orientation turns about the axis about which the cap is twisted, as the operator sees it, not about one of its
/// own.
///
/// The position starts at the origin, the orientation unturned, and both stay while the plug is out. A push that no
/// report has confirmed for 100 ms has ended, and so has a twist; one `read` moves the position at most as far as 100
/// ms of pushing do. `apply` returns zero, whatever is asked for.
///
/// kAbsent while it is not plugged in, otherwise kHomed: it needs no opening. Buttons are those of its report, from
/// bit 0; its row names the first two, as they lie on the models that have no more.
///
/// Thread-safe: `counts` and `state` from any thread, the rest from one. Realtime-safe: `read`, `apply` and
/// `counts`.
class SpaceMouseDevice final : public Device {
 public:
  /// Vendor and product, as spacenavd lists them: from the SpaceMouse Plus XT to those with Bluetooth at a cable.
  static constexpr std::array kIds = std::to_array<usb::Id>(
      {{0x046D, 0xC603}, {0x046D, 0xC605}, {0x046D, 0xC606}, {0x046D, 0xC621}, {0x046D, 0xC623}, {0x046D, 0xC625},
       {0x046D, 0xC626}, {0x046D, 0xC627}, {0x046D, 0xC628}, {0x046D, 0xC629}, {0x046D, 0xC62B}, {0x046D, 0xC640},
       {0x256F, 0xC62E}, {0x256F, 0xC62F}, {0x256F, 0xC631}, {0x256F, 0xC632}, {0x256F, 0xC633}, {0x256F, 0xC635},
       {0x256F, 0xC636}, {0x256F, 0xC638}, {0x256F, 0xC63A}});

  struct Config {
    double speed = 0.1;       ///< m/s with the cap at its stop, > 0
    double dead_band = 0.05;  ///< share of the way to the stop in which nothing moves, 0 ≤ dead_band < 1
    double reach = 0.05;      ///< m to either side of the origin on each axis, > 0
    double turn_speed = 1;    ///< rad/s with the cap twisted to its stop, > 0
  };

  /// Takes the pipe to a SpaceMouse. Throws std::invalid_argument naming the field, its value and what was expected.
  SpaceMouseDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

  /// m/s: v of the equation above. Realtime-safe.
  static Vec3 velocity_for(const Config& config, const spacemouse::Axes& cap) noexcept;
  /// rad/s: ω, of a twist. Realtime-safe.
  static Vec3 angular_velocity_for(const Config& config, const spacemouse::Axes& twist) noexcept;

 private:
  void receive(LocalTime now) noexcept;
  void take(const spacemouse::Motion& motion, LocalTime now) noexcept;
  void let_go() noexcept;

  Config config_;
  DeviceInfo info_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};
  LocalTime before_{};            ///< the last `read`
  LocalTime pushed_{};            ///< when the last translation was reported
  LocalTime twisted_{};           ///< when the last rotation was reported
  Vec3 velocity_ = Vec3::Zero();  ///< since then
  Vec3 angular_velocity_ = Vec3::Zero();
  Vec3 position_ = Vec3::Zero();
  Quat orientation_;
  std::uint32_t buttons_ = 0;
};

namespace spacemouse {

/// A SpaceMouse, as a scene describes it.
struct Config {
  std::string port{};  ///< as `tendond devices` names it; empty: the first free one
  SpaceMouseDevice::Config motion{};
};

// The overloads of driver.h.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace spacemouse

}  // namespace tendon
