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

/// The driver of the Novint Falcon: a state machine from connection to force output over a `usb::Pipe`, advanced by
/// `read`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──────────────────────▶ kUnhomed ──its three legs are homed──▶ kHomed
///                               │                                         ▲   ▲                                  │
///                               └─no answer in 300 ms─▶ kFirmware ─loaded─┘   └──the device says: a leg is not──┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and starts again
///
/// Each packet to the device carries torques. They are zero in every state other than kHomed, and in kHomed if there
/// was no plausible reply for 10 ms. The device has no documented watchdog.
///
/// Each reply contains the encoder counts. A reply is implausible if its encoders moved further than a hand can move
/// them. After 100 ms without a plausible reply, the encoders have lost counts and the device must be reset: the driver
/// loads the firmware again if it has the file; otherwise the user must switch the device off and on.
///
/// Positions are relative to `falcon::kCentre`: x to the right, y up, z towards the user. The time of a sample is that
/// of `read`; the device sampled up to one period later. Buttons, from bit 0: right, forward, centre, left.
///
/// There is one outstanding request at a time. If its answer is late, `read` returns no sample and `apply` changes
/// nothing, except that a zero force is sent immediately (`usb::Dialogue`).
///
/// Thread-safe: `counts` and `state` from any thread, the others from one thread. Realtime-safe: `read`, `apply` and
/// `counts`.
class FalconDevice final : public Device {
 public:
  static constexpr usb::Id kId{0x0403, 0xCB48};

  struct Config {
    /// From `read_firmware`. If empty, only a device that already has firmware can be used; any other stays in
    /// kFirmware.
    std::vector<std::uint8_t> firmware{};
  };

  /// Takes the pipe to a Falcon.
  FalconDevice(Config config, std::unique_ptr<usb::Pipe> pipe);

  const DeviceInfo& info() const noexcept override { return info_; }
  State state() const noexcept override { return state_.load(std::memory_order_relaxed); }
  DeviceCounts counts() const noexcept override { return dialogue_.counts(); }
  std::optional<PositionSample> read(LocalTime now) noexcept override;
  Joints joints(const Motion& hand) const noexcept override;
  Vec3 apply(const Vec3& force) noexcept override;
  /// The device has one output, "ring", a ring of light-emitting diodes. Red, green and blue are each on from half of
  /// their strength. The ring shows the color while the device may render forces, and green if the color is off or pure
  /// red. Pure red means that the device is not ready, which a client cannot change.
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
  LocalTime entered_{};  ///< time at which the state was entered

  // kOpening
  usb::ftdi::Setup setup_{{}};
  bool set_up_ = false;
  // kFirmware
  falcon::FirmwareLoader loader_;
  bool loaded_ = false;   ///< loaded on this connection
  bool resting_ = false;  ///< no firmware is available, or loading has failed

  // From kOpening on
  falcon::ReplyParser parser_;
  std::optional<falcon::Reply> newest_{};  ///< last plausible reply
  bool fresh_ = false;                     ///< newest_ arrived in this `read` and has a pose
  int homed_replies_ = 0;      ///< number of consecutive replies that say "homed", or, if negative, "not homed"
  bool moved_origin_ = false;  ///< the encoders have lost counts since the device was homed
  std::optional<falcon::Pose> pose_{};         ///< last known pose; belongs to newest_ if located_
  bool located_ = false;                       ///< newest_ has a pose
  falcon::Counts held_{};                      ///< the last torques sent
  std::uint8_t ready_lamps_ = falcon::kGreen;  ///< lamps while the device may render forces
};

namespace falcon {

/// Configuration of a Falcon in a scene.
struct Config {
  std::string port{};                               ///< name in `tendond devices`; empty: the first free one
  std::optional<std::filesystem::path> firmware{};  ///< empty: the device already has firmware
  bool accept_unknown_firmware = false;
};

// The overloads of driver.h. `make` throws the exceptions of `read_firmware`.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace falcon

}  // namespace tendon
