// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/exchange/counter.h"
#include "devices/device.h"
#include "devices/driver.h"
#include "devices/falcon/firmware.h"
#include "devices/falcon/kinematics.h"
#include "devices/falcon/packet.h"
#include "devices/simulated/simulated_device.h"
#include "devices/usb/pipe.h"

namespace tendon {

/// The Novint Falcon: from the plug to the force as one state machine that `read` turns, over a `usb::Pipe`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──────────────────────▶ kUnhomed ──its three legs are homed──▶ kHomed
///                               │                                         ▲   ▲                                  │
///                               └─no answer in 300 ms─▶ kFirmware ─loaded─┘   └──the device says: a leg is not──┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and all the way again
///
/// Each packet to the device carries torques, and only in kHomed other ones than zero; also zero while no reply came
/// for 10 ms. The device has no watchdog of its own that anybody knows of. Each reply brings the encoders; one whose
/// encoders moved further than a hand can is not believed; when that does not pass within 100 ms, they have lost count,
/// and the device is set back: with its firmware when we have it, else by the user, who switches it off and on.
///
/// Positions are relative to `falcon::kCentre`: x to the right, y up, z towards the user. A sample's time is that of
/// `read`, up to one period after the device has taken it. Buttons, from bit 0: right, forward, centre, left.
///
/// One request is under way at a time. When its answer is late, `read` has no sample and `apply` keeps what the device
/// holds, with one exception: zero is sent at once.
///
/// Thread-safe: `stats` and `state` from any thread, the rest from one. Realtime-safe: `read` and `apply`.
class FalconDevice final : public Device {
 public:
  static constexpr usb::Id kId{0x0403, 0xCB48};

  struct Config {
    /// From `read_firmware`. Empty: a device that has its firmware already is used, another one waits in kFirmware.
    std::vector<std::uint8_t> firmware{};
  };

  /// Of all connections so far.
  struct Stats {
    std::uint64_t replies = 0;         ///< believed
    std::uint64_t implausible = 0;     ///< replies with encoders where no hand can have moved them
    std::uint64_t unreachable = 0;     ///< replies with encoders that belong to no position
    std::uint64_t left_out_bytes = 0;  ///< bytes in no reply
    std::uint64_t unanswered = 0;      ///< requests whose reply did not come in time, and that were sent again
    std::uint64_t silences = 0;        ///< times when the device was given up as silent
    std::uint64_t lost_counts = 0;     ///< times when the encoders were given up as having lost count
    std::uint64_t failed_loads = 0;    ///< of the firmware
  };

  /// Takes the pipe to a Falcon.
  FalconDevice(Config config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;

  Stats stats() const noexcept;

 private:
  void enter(State state) noexcept;
  void follow_connection() noexcept;
  void receive() noexcept;
  void believe(const falcon::Reply& reply) noexcept;
  bool plausible(const falcon::Reply& reply) const noexcept;
  void locate(const falcon::Reply& reply) noexcept;
  void advance() noexcept;
  void give_up() noexcept;
  bool streaming() const noexcept;

  DeviceInfo info_;
  std::vector<std::uint8_t> firmware_;
  std::unique_ptr<usb::Pipe> pipe_;
  std::atomic<State> state_{State::kAbsent};
  std::uint32_t connection_ = 0;
  LocalTime now_{};      ///< of the last `read`
  LocalTime entered_{};  ///< when the state began

  // kOpening
  usb::ftdi::Setup setup_{{}};
  bool set_up_ = false;
  // kFirmware
  falcon::FirmwareLoader loader_;
  bool loaded_ = false;   ///< on this connection
  bool resting_ = false;  ///< there is no firmware, or it did not go in

  // From kOpening on: requests and replies
  falcon::ReplyParser parser_;
  std::optional<LocalTime> asked_{};       ///< when the request was sent that has no reply yet
  LocalTime heard_{};                      ///< when the last well-formed reply came,
  LocalTime believed_{};                   ///< and the last one that was believed,
  std::optional<falcon::Reply> newest_{};  ///< which is this one
  bool fresh_ = false;                     ///< it came in this `read`, and belongs to a position
  int homed_replies_ = 0;                  ///< in a row; below 0: of those that are not
  bool moved_origin_ = false;              ///< the encoders have lost count since the device was homed
  std::optional<falcon::Pose> pose_{};     ///< the last one there was; of newest_ when
  bool located_ = false;                   ///< it belongs to a position
  falcon::Counts held_{};                  ///< the torques that the device has, as far as we know

  Counter replies_;
  Counter implausible_;
  Counter unreachable_;
  Counter left_out_bytes_;
  Counter unanswered_;
  Counter silences_;
  Counter lost_counts_;
  Counter failed_loads_;
};

namespace falcon {

/// A Falcon in a scene.
struct Config {
  std::string port{};                               ///< as `tendond devices` names it; empty: the first free one
  std::optional<std::filesystem::path> firmware{};  ///< empty: one that has its firmware already
  bool accept_unknown_firmware = false;
};

// The row of this driver: see driver.h. `make` throws what `read_firmware` throws.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace falcon

}  // namespace tendon
