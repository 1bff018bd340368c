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

/// The Novint Falcon: from the plug to the force as one state machine that `read` turns, over a `usb::Pipe`.
///
///     kAbsent ──plugged in──▶ kOpening ──answers──────────────────────▶ kUnhomed ──its three legs are homed──▶ kHomed
///                               │                                         ▲   ▲                                  │
///                               └─no answer in 300 ms─▶ kFirmware ─loaded─┘   └──the device says: a leg is not──┘
///     any ──unplugged, a transfer failed, or silent for 100 ms──▶ kAbsent, and all the way again
///
/// Each packet to the device carries torques. They are zero in every state other than kHomed, and in kHomed while no
/// believable reply has come for 10 ms. No watchdog of the device is documented.
///
/// Each reply brings the encoders. A reply whose encoders moved further than a hand can move them is not believed. When
/// none is believed for 100 ms, the encoders have lost count, and the device has to be reset: the driver loads the
/// firmware again when it has the file; otherwise the user switches the device off and on.
///
/// Positions are relative to `falcon::kCentre`: x to the right, y up, z towards the user. A sample's time is that of
/// `read`; the device took it up to one period later. Buttons, from bit 0: right, forward, centre, left.
///
/// One request is under way at a time. When its answer is late, `read` has no sample and `apply` changes nothing; only
/// zero is sent at once (`usb::Dialogue`).
///
/// Thread-safe: `counts` and `state` from any thread, the rest from one. Realtime-safe: `read`, `apply` and `counts`.
class FalconDevice final : public Device {
 public:
  static constexpr usb::Id kId{0x0403, 0xCB48};

  struct Config {
    /// From `read_firmware`. Empty: a device that has its firmware already is used; any other waits in kFirmware.
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
  /// The ring of light-emitting diodes is its one output, "ring": red, green and blue, each on from half its strength.
  /// It shows that colour while the device may give a force, and green when the colour is off or red alone. Red alone
  /// says that the device is not ready, and no client can change that.
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
  LocalTime entered_{};  ///< when the state began

  // kOpening
  usb::ftdi::Setup setup_{{}};
  bool set_up_ = false;
  // kFirmware
  falcon::FirmwareLoader loader_;
  bool loaded_ = false;   ///< on this connection
  bool resting_ = false;  ///< there is no firmware, or it did not go in

  // From kOpening on
  falcon::ReplyParser parser_;
  std::optional<falcon::Reply> newest_{};      ///< the last reply that was believed
  bool fresh_ = false;                         ///< newest_ came in this `read`, and belongs to a position
  int homed_replies_ = 0;                      ///< in a row that say "homed"; below 0: that many that say the contrary
  bool moved_origin_ = false;                  ///< the encoders have lost count since the device was homed
  std::optional<falcon::Pose> pose_{};         ///< the last one that is known; of newest_ when
  bool located_ = false;                       ///< newest_ belongs to a position
  falcon::Counts held_{};                      ///< the torques that were sent last
  std::uint8_t ready_lamps_ = falcon::kGreen;  ///< while the device may give a force
};

namespace falcon {

/// A Falcon, as a scene describes it.
struct Config {
  std::string port{};                               ///< as `tendond devices` names it; empty: the first free one
  std::optional<std::filesystem::path> firmware{};  ///< empty: one that has its firmware already
  bool accept_unknown_firmware = false;
};

// The overloads of driver.h. `make` throws what `read_firmware` throws.
const Driver& driver(const Config& config);
SimulatedDevice::Config stand_in(const Config& config);
std::unique_ptr<Device> make(const Config& config, FromOutside outside);

}  // namespace falcon

}  // namespace tendon
