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

/// The properties of a device.
struct DeviceInfo {
  std::string name;
  double max_force = 0;            ///< N, largest norm of the force vector
  double position_resolution = 0;  ///< m, one encoder count at the handle; 0 = exact
  double force_resolution = 0;  ///< N, largest difference between the force written and the force requested; 0 = exact
  bool measures_orientation = false;  ///< every sample has an orientation
  double max_torque = 0;              ///< N·m, largest norm of the torque vector; 0 = no torque
  double angular_resolution = 0;      ///< rad, one encoder count of the orientation; 0 = exact
  /// A gripper with two fingers that open by an angle.
  struct Gripper {
    double open = 0;       ///< rad, largest opening
    double arm = 0;        ///< m per radian, relative travel of the fingers
    double max_force = 0;  ///< N, on the fingers; 0 = no motor
    bool operator==(const Gripper&) const = default;
  };
  std::optional<Gripper> gripper{};
  std::vector<std::string> joints{};         ///< names of the joints, at most Joints::kMost; empty: not reported
  std::vector<OutputDescription> outputs{};  ///< lamps and vibration, at most 8; empty: none
  Duration watchdog{};  ///< the force drops to zero if no command arrives for this long; 0 = no watchdog

  /// Returns true if samples contain neither orientation nor gripper nor joints.
  bool position_only() const noexcept { return !measures_orientation && !gripper && joints.empty(); }
};

struct PositionSample {
  LocalTime at{};
  Vec3 position = Vec3::Zero();  ///< m, device base frame
  /// N, force of the hand on the handle (and not the reverse), measured by a force sensor; empty without a sensor.
  std::optional<Vec3> hand_force = std::nullopt;
  std::uint32_t buttons = 0;  ///< bit i is set while button i is held down
  /// From the handle frame to the base frame; empty if it is not measured. In the handle frame, −z is the direction of
  /// the stylus or finger, y is up and x to the right when the handle is in its middle position (OpenXR's aim pose).
  std::optional<Quat> orientation = std::nullopt;
  std::optional<double> opening = std::nullopt;  ///< rad, opening of the gripper; empty without a gripper
};

/// A haptic device: it measures a position and renders a force. A device of admittance type also measures the force of
/// the hand. All values are in SI units; encoder counts and USB transfers are hidden by the implementation.
///
/// Thread-safe: no; the haptic thread owns it. Realtime-safe: `read` and `apply` must not allocate, lock or log, and
/// must not block for longer than the transfer of the device.
class Device {
 public:
  /// The state between connection and force output. Positions are valid only in `kHomed`.
  enum class State : std::uint8_t {
    kAbsent,    ///< not connected
    kOpening,   ///< being opened and set up
    kFirmware,  ///< receiving its firmware
    kUnhomed,   ///< running, but its encoders have no origin yet
    kHomed,     ///< ready
  };

  virtual ~Device() = default;

  virtual const DeviceInfo& info() const noexcept = 0;

  /// A device that needs neither opening nor homing is always kHomed. May be called from any thread.
  virtual State state() const noexcept { return State::kHomed; }

  /// The operator requests forces, for the first time or after a fault. A safety layer decides later whether to grant
  /// this (SafeDevice). A device without a safety layer is ready as soon as it is homed, so the default does nothing.
  virtual void arm() noexcept {}
  /// The operator requests no forces until the next `arm`. A safety layer (SafeDevice) renders none from the next
  /// `apply` on. For other devices the control law does this (HapticController::disarm), so the default does nothing.
  virtual void disarm() noexcept {}
  /// False while a safety layer holds the force at zero (SafeDevice).
  virtual bool armed() const noexcept;
  /// The number of times that `arm` was granted. Each one clears the fault before it.
  virtual std::uint32_t times_armed() const noexcept { return 0; }
  /// The number of faults because of which the device has ended the force (SafeDevice).
  virtual std::uint32_t faults() const noexcept { return 0; }
  /// The counters of the driver. May be called from any thread.
  virtual DeviceCounts counts() const noexcept { return {}; }

  /// Samples the position. Returns nullopt if the device did not answer.
  virtual std::optional<PositionSample> read(LocalTime now) noexcept = 0;

  /// Returns angles and velocities of the joints `info().joints` for `hand`, whose position is that of the last sample.
  /// The velocities are unbounded near a singular pose. Called only if the device names joints. Realtime-safe.
  virtual Joints joints(const Motion& /*hand*/) const noexcept { return {}; }

  /// Commands `force` (N, on the hand) and returns the force that was actually written, after all clamping and
  /// rounding. The device holds it until the next `apply` or until its watchdog ends it. The energy ledger counts the
  /// returned force and not the requested one.
  virtual Vec3 apply(const Vec3& force) noexcept = 0;

  /// Does the same for a device that also has motors for torque or a gripper: commands all of them at once and returns
  /// what was actually written. Called instead of `apply` if `info` names a torque or a gripper with a motor. By
  /// default, torque and grip are zero.
  virtual Effort apply_all(const Effort& effort) noexcept { return {.force = apply(effort.force)}; }

  /// Sets `info().outputs[output]`. An index that does not exist or a setting of another kind is ignored. Outputs are
  /// not part of the energy ledger, because they do not move the handle.
  virtual void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;
};

}  // namespace tendon
