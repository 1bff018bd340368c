// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <concepts>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "core/control/preset.h"
#include "devices/simulated/profiles.h"
#include "server/scene/scene.h"
#include "server/tables/recorded_motion.h"

// Declares the keys of a scene. A class Table reads the declarations: Reader fills a Draft from a file (reader.h),
// Reference prints each key (reference.h), and Parts lists the parts of a scene (parts.h). The default of a key is the
// initializer of its target. A new key is one line in keys.cc or device_keys.cc. Internal to server/scene.

namespace tendon::scene_file {

/// Where a hand wants to be: a script that the scene lists, or a recording that is still to be read.
struct DraftMotion {
  ScriptedMotion::Script script = ScriptedMotion::Sine{};
  std::optional<RecordedMotionFile> recorded{};
};

/// A scene while it is read. Values that depend on several keys are still open: resolver.h settles them.
struct Draft {
  Scene scene;
  SimulatedDevice::Config simulated;  ///< the device, or what stands in for a real one
  const DeviceProfile* profile = nullptr;
  const OperatorProfile* operator_profile = nullptr;
  std::optional<Vec3> joint_coulomb;
  DraftMotion motion;                             ///< of [device.hand]
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
  FrictionBounds rotation_bounds;    ///< N·m, N·m·s/rad
  FrictionBounds grip_bounds;        ///< N, N·s/m
  RotationLimits rotation;           ///< for a device with motors that turn its handle
  std::optional<double> max_torque;  ///< N·m
  std::optional<double> max_grip;    ///< N
  std::optional<double> ledger_step;
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
  FrictionMap::Config friction_map;  ///< without its places
  std::vector<Vec3> places;
  std::vector<double> place_coulomb;
  std::vector<double> place_viscous;
};

/// N. The maximum force for a device that exerts no forces. It is large enough that recordings contain the forces of the
/// engines unchanged.
inline constexpr double kUnfelt = 10;

/// The name of a key or a table. If it is a part that can be removed from a scene, `part` is its line in the output of
/// `tendond explain`.
struct Name {
  std::string_view name;
  std::string_view part;

  template <std::convertible_to<std::string_view> Text>
  Name(const Text& text, std::string_view what = {}) : name(text), part(what) {}
};

/// Declares no keys.
struct NoKeys {
  void operator()(const auto& /*table*/) const {}
};

/// What a missing key means, where it is not simply the default of the target.
struct Absent {
  bool required = false;
  std::string_view text = {};
};
inline constexpr Absent kRequired = {.required = true};

/// All of a scene. Defined for Reader, Reference and Parts.
template <class Table>
void declare_scene(Table& scene, Draft& draft);

/// [teleoperation]. Defined for Reader, Reference and Parts.
template <class Table>
void declare_teleoperation(Table& scene, Draft& draft);

/// [device]. Defined for Reader, Reference and Parts.
template <class Table>
void declare_device(Table& device, Draft& draft);

}  // namespace tendon::scene_file
