// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/motion.h"

namespace tendon {

/// What a device can do, in the words of its data sheet.
struct DeviceInfo {
  std::string name;
  double max_force = 0;            ///< N, norm of the force vector it can give out
  double position_resolution = 0;  ///< m, one encoder count at the handle; 0 = exact
  double force_resolution = 0;     ///< N, what is written may differ by so much from what was asked; 0 = exact
  Duration watchdog{};             ///< force drops to zero when no command comes for so long; 0 = it has none
};

/// One encoder reading.
struct PositionSample {
  LocalTime at{};
  Vec3 position = Vec3::Zero();  ///< m, device base frame
  /// N, of the hand **on the handle** (not the other way round): what a device with a force sensor measures.
  std::optional<Vec3> hand_force = std::nullopt;
  std::uint32_t buttons = 0;  ///< bit i is set while button i is held down
};

/// A haptic device: position out, force in; a device of admittance type also measures the force of the hand.
/// Counts and transfers end here; above this interface everything is SI.
///
/// Thread-safe: no; the haptic thread owns it.
/// Realtime-safe: `read` and `apply` must neither allocate, lock, log nor block longer than the
/// device's own transfer.
class Device {
 public:
  /// How far it has come on its way from the plug to the force. Positions mean something in `kHomed` only.
  enum class State : std::uint8_t {
    kAbsent,    ///< not plugged in, or gone
    kOpening,   ///< being opened and set up
    kFirmware,  ///< being given its firmware
    kUnhomed,   ///< alive; its encoders have no origin yet
    kHomed,     ///< ready
  };

  virtual ~Device() = default;

  virtual const DeviceInfo& info() const noexcept = 0;

  /// A device with nothing to open and nothing to home is ready from the start. From any thread.
  virtual State state() const noexcept { return State::kHomed; }

  /// The operator asks for forces, at first or again after a fault. To be refused or granted later, by whoever wants to
  /// know first that nobody is hurt by them (SafeDevice); a device that is ready when it is homed needs no asking.
  virtual void arm() noexcept {}
  /// The operator wants no forces until he asks for them again. Whoever has a say in it (SafeDevice) gives none from
  /// the next `apply` on; of any other device the control law asks for none (HapticController::disarm).
  virtual void disarm() noexcept {}
  /// How often that has been granted. Each time, whatever was at fault before is over.
  virtual std::uint32_t times_armed() const noexcept { return 0; }
  /// How often it has ended the force by itself, because something was wrong (SafeDevice).
  virtual std::uint32_t faults() const noexcept { return 0; }

  /// Samples the position. Empty when the device did not answer.
  virtual std::optional<PositionSample> read(LocalTime now) noexcept = 0;

  /// Commands `force` (N, on the hand) and returns **the force really written** after every clamp
  /// and rounding of the device. It is held until the next `apply` (or until the device's own
  /// watchdog ends it). The energy ledger counts what is returned here, never what was asked for.
  virtual Vec3 apply(const Vec3& force) noexcept = 0;
};

}  // namespace tendon
