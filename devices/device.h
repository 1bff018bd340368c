// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/motion.h"
#include "core/base/output.h"
#include "devices/counts.h"

namespace tendon {

/// The data sheet of a device.
struct DeviceInfo {
  std::string name;
  double max_force = 0;               ///< N, norm of the force vector it can give out
  double position_resolution = 0;     ///< m, one encoder count at the handle; 0 = exact
  double force_resolution = 0;        ///< N, the force written is within this of the force asked for; 0 = exact
  bool measures_orientation = false;  ///< every sample has one
  double max_torque = 0;              ///< N·m, norm of the torque vector it can give out; 0 = no motors that turn
  double angular_resolution = 0;      ///< rad, one encoder count of the orientation; 0 = exact
  /// A gripper: two fingers that open by an angle.
  struct Gripper {
    double open = 0;       ///< rad, its largest opening
    double arm = 0;        ///< m, travel of the fingers on each other for each radian
    double max_force = 0;  ///< N, on the fingers; 0 = no motor
    bool operator==(const Gripper&) const = default;
  };
  std::optional<Gripper> gripper{};
  std::vector<std::string> joints{};  ///< names of its joints, at most Joints::kMost; empty: it does not tell them
  std::vector<OutputDescription> outputs{};  ///< lamps and vibration, at most 8; empty: none
  Duration watchdog{};                       ///< the force drops to zero when no command comes for this long; 0 = none

  /// It tells neither orientation nor gripper nor joints.
  bool position_only() const noexcept { return !measures_orientation && !gripper && joints.empty(); }
};

/// One encoder reading.
struct PositionSample {
  LocalTime at{};
  Vec3 position = Vec3::Zero();  ///< m, device base frame
  /// N, of the hand **on the handle** (not the other way round), measured by a force sensor; empty without one.
  std::optional<Vec3> hand_force = std::nullopt;
  std::uint32_t buttons = 0;  ///< bit i is set while button i is held down
  /// Turns the handle frame into the base frame; empty unless the device measures it. The handle frame: −z is where the
  /// stylus or finger points, y up, x to the right, when the handle is in its middle (OpenXR's aim pose).
  std::optional<Quat> orientation = std::nullopt;
  std::optional<double> opening = std::nullopt;  ///< rad, of the gripper; empty without one
};

/// A haptic device: position out, force in. A device of admittance type also measures the force of the hand.
/// Encoder counts and USB transfers stay below this interface; above it everything is SI.
///
/// Thread-safe: no; the haptic thread owns it.
/// Realtime-safe: `read` and `apply` must not allocate, lock or log, nor block for longer than the device's own
/// transfer.
class Device {
 public:
  /// How far the device has come on its way from the plug to the force. Positions are valid in `kHomed` only.
  enum class State : std::uint8_t {
    kAbsent,    ///< not plugged in, or gone
    kOpening,   ///< being opened and set up
    kFirmware,  ///< being given its firmware
    kUnhomed,   ///< alive; its encoders have no origin yet
    kHomed,     ///< ready
  };

  virtual ~Device() = default;

  virtual const DeviceInfo& info() const noexcept = 0;

  /// A device that needs no opening and no homing is ready from the start. May be called from any thread.
  virtual State state() const noexcept { return State::kHomed; }

  /// The operator asks for forces: the first time, or again after a fault. A safety layer decides later whether to
  /// grant this (SafeDevice). A device without one is ready as soon as it is homed; the default does nothing.
  virtual void arm() noexcept {}
  /// The operator wants no forces until the next `arm`. A safety layer (SafeDevice) gives none from the next `apply`
  /// on. For any other device the control law asks for none (HapticController::disarm); the default does nothing.
  virtual void disarm() noexcept {}
  /// False while a safety layer keeps the force at zero (SafeDevice). A device without one gives what it is asked for.
  virtual bool armed() const noexcept;
  /// How often `arm` has been granted. Each time clears the fault before it.
  virtual std::uint32_t times_armed() const noexcept { return 0; }
  /// How often the device has ended the force by itself because of a fault (SafeDevice).
  virtual std::uint32_t faults() const noexcept { return 0; }
  /// What its driver has counted so far. May be called from any thread.
  virtual DeviceCounts counts() const noexcept { return {}; }

  /// Samples the position. Empty when the device did not answer.
  virtual std::optional<PositionSample> read(LocalTime now) noexcept = 0;

  /// The joints of `info().joints` at `hand`, which is at the sample that `read` has just given, and how fast each turns
  /// while the handle moves at that velocity. Near a singular pose these speeds grow beyond all bounds. Called for a device that names
  /// joints only. Realtime-safe.
  virtual Joints joints(const Motion& /*hand*/) const noexcept { return {}; }

  /// Commands `force` (N, on the hand) and returns **the force really written**, after every clamp and rounding of the
  /// device. The device holds it until the next `apply`, or until its own watchdog ends it. The energy ledger counts
  /// the force returned here, never the force asked for.
  virtual Vec3 apply(const Vec3& force) noexcept = 0;

  /// The same for a handle with more motors than those of its position: commands all of them at once, and returns what
  /// was really written. Called in place of `apply` when `info` names a torque or a gripper with a motor; a device that
  /// has neither gives no torque and no grip.
  virtual Effort apply_all(const Effort& effort) noexcept { return {.force = apply(effort.force)}; }

  /// Sets `info().outputs[output]`. What is no output of the device, or of another kind, changes nothing; the default
  /// has none. Not part of any ledger: no output is a motor of the position.
  virtual void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;
};

}  // namespace tendon
