// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "devices/device.h"
#include "devices/driver.h"
#include "devices/falcon/firmware.h"
#include "devices/falcon/kinematics.h"
#include "devices/falcon/packet.h"
#include "devices/simulated/simulated_device.h"
#include "devices/usb/dialogue.h"
#include "devices/usb/ftdi.h"

namespace tendon {

/// The driver of the Novint Falcon: a state machine over a `usb::Pipe`, which is advanced by `read`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──────────────────────▶ kUnhomed ──its three legs are homed──▶ kHomed
///                               │                                         ▲   ▲                                  │
///                               └─no answer in 300 ms─▶ kFirmware ─loaded─┘   └──the device says: a leg is not──┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and starts again
///
/// Every packet contains torques. They are only nonzero in kHomed, while there are plausible replies (at least every 10
/// ms). A reply is plausible if a hand can move the encoders at this speed. If there is no plausible reply for 100 ms,
/// the encoders have lost counts and the device must be reset, either by loading the firmware again or, if the driver
/// does not have the file, by switching it off and on. The device has no documented watchdog.
///
/// Positions are relative to `falcon::kCentre`: x to the right, y up, z towards the user. Samples use the time of
/// `read`, but can be up to one period older. The buttons, starting at bit 0, are right, forward, centre and left.
///
/// If an answer is late, `read` returns nullopt and `apply` only sends a zero force (`usb::Dialogue`).
/// Thread-safe: `counts` and `state` only. Realtime-safe: `read`, `apply`, `counts`.
class FalconDevice final : public Device {
 public:
  static constexpr usb::Id kId{0x0403, 0xCB48};

  struct Config {
    std::vector<std::uint8_t> firmware{};  ///< if empty, a device without firmware stays in kFirmware
  };

  FalconDevice(Config config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Joints joints(const Motion& hand) const noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;
  /// Output 0, "ring", consists of light-emitting diodes. Each of red, green and blue is on if it is at least half. The
  /// color is only used if forces can be rendered. Pure red means not ready, so green replaces pure red and off.
  void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept override;

 private:
  void enter(State state) noexcept;
  void receive() noexcept;
  void believe(const falcon::Reply& reply) noexcept;
  bool plausible(const falcon::Reply& reply) const noexcept;
  void locate(const falcon::Reply& reply) noexcept;
  void advance() noexcept;
  void give_up() noexcept;
  bool streaming() const noexcept;

  DeviceInfo info_;
  std::vector<std::uint8_t> firmware_;
  usb::Dialogue dialogue_;
  std::atomic<State> state_{State::kAbsent};
  LocalTime entered_{};

  usb::ftdi::Setup setup_{{}};
  bool set_up_ = false;
  falcon::FirmwareLoader loader_;
  bool loaded_ = false;
  bool resting_ = false;  ///< without firmware, or after a failure

  falcon::ReplyParser parser_;
  std::optional<falcon::Reply> newest_{};
  bool fresh_ = false;         ///< located in this `read`
  int homed_replies_ = 0;      ///< number of consecutive replies that are homed; negative if they are not homed
  bool moved_origin_ = false;  ///< encoders have lost counts
  std::optional<falcon::Pose> pose_{};
  bool located_ = false;
  falcon::Counts held_{};
  std::uint8_t ready_lamps_ = falcon::kGreen;
};

namespace falcon {

/// A Falcon in a scene (driver.h). `make` can throw the exceptions of `read_firmware`.
struct Config {
  std::string port{};                               ///< from `tendond devices`; optional
  std::optional<std::filesystem::path> firmware{};  ///< empty if already loaded
  bool accept_unknown_firmware = false;
};

const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace falcon

}  // namespace tendon
