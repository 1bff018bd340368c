// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "core/control/preset.h"
#include "devices/simulated/profiles.h"
#include "devices/simulated/recorded_motion.h"
#include "server/scene/scene.h"

// Which keys a scene may have. Each is declared once, by a line that a Table walks over: Reader fills a Draft from a
// file (reader.h), Reference prints the same line (reference.h). A new key is one line in keys.cc or device_keys.cc.
// Internal to server/scene.

namespace tendon::scene_file {

/// Where a hand wants to be: a script that the scene lists, or a recording that is still to be read.
struct DraftMotion {
  ScriptedMotion::Script script = ScriptedMotion::Sine{};
  std::optional<RecordedMotionFile> recorded{};
};

/// A scene while it is read. Values that depend on several keys are still open: resolver.h settles them.
struct Draft {
  Draft() {
    // 1 N per step at 1 kHz: a hand cannot tell the ramp from a step, and a force that flips its sign at every
    // datagram loses its edge.
    scene.loop.control.max_slew = 1000;
  }

  Scene scene;
  SimulatedDevice::Config simulated;  ///< the device, or what stands in for a real one
  const DeviceProfile* profile = nullptr;
  const OperatorProfile* operator_profile = nullptr;
  std::optional<Vec3> joint_coulomb;
  OperatorHand::Config hand{0, 0, 0,
                            ScriptedMotion(ScriptedMotion::Sine{})};  // 0: what the scene does not list does not exist
  bool has_hand = false;
  DraftMotion motion;
  DraftMotion turning;                            ///< of [device.rotation.hand]
  DraftMotion gripping;                           ///< of [device.gripper.hand]
  std::optional<RecordedMotionFile> csv;          ///< what a replay plays
  std::optional<std::filesystem::path> replayed;  ///< a recording of tendond
  std::optional<Duration> longest_hold;
  HoldBound::Follow follow_holds;  ///< a memory of 0: none
  std::optional<double> coulomb_bound;
  std::optional<double> viscous_bound;
  std::optional<double> max_force;
  /// Of [limiter.rotation] and [limiter.gripper].
  struct FrictionBounds {
    std::optional<double> coulomb;
    std::optional<double> viscous;
  };
  FrictionBounds rotation_bounds;  ///< N·m, N·m·s/rad
  FrictionBounds grip_bounds;      ///< N, N·s/m
  std::optional<double> most_angular_acceleration;
  std::optional<double> angular_shaping_stiffness;
  double angular_damping = 0;
  std::optional<double> max_torque;  ///< N·m
  double max_torque_slew = 50;       ///< N·m/s: 1 N per step, as for the force, at a lever of 5 cm
  std::optional<double> max_grip;    ///< N
  std::optional<double> ledger_step;
  /// 8.5 N on a handle of 75 g that nobody holds are 113 m/s²; a tap is some 200 (control.md 8.7).
  double most_acceleration = 300;
  double shaping_stiffness = 1000;  ///< N/m
  double damping = 24;              ///< N·s/m
  double damper_contact = 0.1;      ///< N
  std::optional<Preset> preset;
  Coupling::Config coupling;             ///< of [teleoperation], when there is one
  Vec3 map_rotation = Vec3::Zero();      ///< rad, rotation vector
  std::optional<double> coupling_force;  ///< N
  bool absolute_map = false;
  std::optional<double> align_within;  ///< m
  double align_energy = 0;             ///< J
  std::optional<double> drift_rate;    ///< 1/s
  bool engages_by_button = false;
  std::optional<std::uint32_t> engage_button;
  std::vector<Vec3> places;
  std::vector<double> place_coulomb;
  std::vector<double> place_viscous;
  double reach = 0.05;
};

/// What a missing key means, where it is not simply the default of the target.
struct Absent {
  bool required = false;
  std::string_view text = {};
};
inline constexpr Absent kRequired = {.required = true};

/// All of a scene. Defined for Reader and Reference.
template <class Table>
void declare_scene(Table& scene, Draft& draft);

/// [teleoperation]. Defined for Reader and Reference.
template <class Table>
void declare_teleoperation(Table& scene, Draft& draft);

/// [device]. Defined for Reader and Reference.
template <class Table>
void declare_device(Table& device, Draft& draft);

}  // namespace tendon::scene_file
