// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

#include "core/control/preset.h"
#include "devices/simulated/profiles.h"
#include "server/scene/scene.h"
#include "server/tables/recorded_motion.h"

// Declares the keys of a scene for Reader (reader.h), Reference (reference.h) and Parts (parts.h). The default value of
// a key is the initializer of its target. A new key is one line in keys.cc or device_keys.cc. Internal.

namespace tendon::scene_file {

struct DraftMotion {
  ScriptedMotion::Script script = ScriptedMotion::Sine{};
  std::optional<RecordedMotionFile> recorded{};
};

/// A scene while it is being read. resolver.h computes the values that depend on several keys.
struct Draft {
  Scene scene;
  SimulatedDevice::Config simulated;  ///< the device, or the simulation of a real device
  const DeviceProfile* profile = nullptr;
  const OperatorProfile* operator_profile = nullptr;
  std::optional<Vec3> joint_coulomb;
  DraftMotion motion;                             ///< [device.hand]
  DraftMotion turning;                            ///< [device.rotation.hand]
  DraftMotion gripping;                           ///< [device.gripper.hand]
  std::optional<RecordedMotionFile> csv;          ///< for a replay from a table
  std::optional<std::filesystem::path> replayed;  ///< for a replay of a recording
  std::optional<Duration> longest_hold;
  HoldBound::Follow follow_holds;  ///< disabled if the memory is 0
  std::optional<double> coulomb_bound;
  std::optional<double> viscous_bound;
  std::optional<double> max_force;
  struct FrictionBounds {
    std::optional<double> coulomb;
    std::optional<double> viscous;
  };
  FrictionBounds rotation_bounds;    ///< N·m, N·m·s/rad
  FrictionBounds grip_bounds;        ///< N, N·s/m
  RotationLimits rotation;           ///< only used if there are motors for the rotation
  std::optional<double> max_torque;  ///< N·m
  std::optional<double> max_grip;    ///< N
  std::optional<double> ledger_step;
  /// m; from the ledger if the scene has a value for it, otherwise from the device.
  std::optional<double> encoder_step() const { return ledger_step ? ledger_step : simulated.encoder_step; }
  std::optional<Preset> preset;
  Coupling::Config coupling;
  Vec3 map_rotation = Vec3::Zero();      ///< rad, rotation vector
  std::optional<double> coupling_force;  ///< N
  bool absolute_map = false;
  std::optional<double> align_within;  ///< m
  double align_energy = 0;             ///< J
  std::optional<double> drift_rate;    ///< 1/s
  bool engages_by_button = false;
  std::optional<std::uint32_t> engage_button;
  FrictionMap::Config friction_map;  ///< without the places
  std::vector<Vec3> places;
  std::vector<double> place_coulomb;
  std::vector<double> place_viscous;
};

inline constexpr double kUnfelt = 10;  ///< N, without motors; enough to record the forces of the engines unchanged

template <class Table>
void declare_scene(Table& scene, Draft& draft);

template <class Table>
void declare_teleoperation(Table& scene, Draft& draft);

template <class Table>
void declare_device(Table& device, Draft& draft);

}  // namespace tendon::scene_file
