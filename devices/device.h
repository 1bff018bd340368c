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

struct DeviceInfo {
  std::string name;
  double max_force = 0;            ///< N, maximum norm
  double position_resolution = 0;  ///< m, encoder count at the handle; 0 = exact
  double force_resolution = 0;     ///< N, accuracy of the written force; 0 = exact
  bool measures_orientation = false;
  double max_torque = 0;          ///< N·m, maximum norm; 0 = no torque
  double angular_resolution = 0;  ///< rad, encoder count; 0 = exact
  struct Gripper {
    double open = 0;       ///< rad, fully open
    double arm = 0;        ///< m/rad, travel between the fingers per angle
    double max_force = 0;  ///< N, on the fingers; 0 = no motor
    bool operator==(const Gripper&) const = default;
  };
  std::optional<Gripper> gripper{};
  std::vector<std::string> joints{};         ///< at most Joints::kMost names
  std::vector<OutputDescription> outputs{};  ///< lamps and vibration, at most 8
  Duration watchdog{};                       ///< ends the force if commands stop; 0 = none

  bool position_only() const noexcept { return !measures_orientation && !gripper && joints.empty(); }
};

struct PositionSample {
  LocalTime at{};
  Vec3 position = Vec3::Zero();                   ///< m, device base frame
  std::optional<Vec3> hand_force = std::nullopt;  ///< N, of the hand on the handle, from a force sensor
  std::uint32_t buttons = 0;                      ///< bit i is set if button i is pressed
  /// Handle frame → base frame. In the handle frame, −z is the direction of the stylus or finger. In the middle
  /// position of the handle, y is up and x is to the right (OpenXR's aim pose).
  std::optional<Quat> orientation = std::nullopt;
  std::optional<double> opening = std::nullopt;  ///< rad, of the gripper
};

/// A device that measures the position of a handle and renders a force. Devices of admittance type also measure the
/// force of the hand. In SI units; counts and USB transfers are internal to drivers.
/// Thread-safe: no. It must only be used by the haptic thread. Realtime-safe: `read` and `apply` must not allocate,
/// lock or log, and must not block longer than a transfer of the device.
class Device {
 public:
  /// Positions are only valid in `kHomed`.
  enum class State : std::uint8_t {
    kAbsent,
    kOpening,
    kFirmware,
    kUnhomed,  ///< encoders without an origin
    kHomed,
  };

  virtual ~Device() = default;

  virtual const DeviceInfo& info() const noexcept = 0;

  /// May be called from any thread. Always kHomed if the device does not need opening or homing.
  virtual State state() const noexcept { return State::kHomed; }

  /// Called if the operator requests forces, also after a fault. SafeDevice grants this later, others when homed.
  virtual void arm() noexcept {}
  /// Prevents forces until `arm`. Only for safety layers (SafeDevice); without one, use HapticController::disarm.
  virtual void disarm() noexcept {}
  virtual bool armed() const noexcept;                              ///< false if a safety layer keeps the force at zero
  virtual std::uint32_t times_armed() const noexcept { return 0; }  ///< grants of `arm`, which also clear faults
  virtual std::uint32_t faults() const noexcept { return 0; }       ///< times a safety layer has ended the force
  virtual DeviceCounts counts() const noexcept { return {}; }       ///< may be called from any thread

  virtual std::optional<PositionSample> read(LocalTime now) noexcept = 0;  ///< nullopt if the device did not answer

  /// For devices with joints, at the position of `read`. Velocities are unbounded near singular poses. Realtime-safe.
  virtual Joints joints(const Motion& /*hand*/) const noexcept { return {}; }

  /// Commands `force` (N, on the hand) and returns the force that was actually written after clamping and rounding,
  /// which is counted by the energy ledger. The force is applied until the next call or until the watchdog expires.
  virtual Vec3 apply(const Vec3& force) noexcept = 0;

  /// Called instead of `apply` if `info` has a torque or a gripper with a motor. Returns what was actually written.
  virtual Effort apply_all(const Effort& effort) noexcept { return {.force = apply(effort.force)}; }

  /// Sets a lamp or starts a vibration pulse. This does nothing if the output is unknown or if the setting is of the
  /// wrong kind. Outputs do not move the handle, so the energy ledger does not contain them.
  virtual void set_output(LocalTime now, std::uint32_t output, const OutputSetting& setting) noexcept;
};

}  // namespace tendon
