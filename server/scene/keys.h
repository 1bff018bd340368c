// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string_view>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/recorded_motion.h"
#include "server/scene/scene.h"

// Which keys a scene may have. Each is declared once, by a line that a Table walks over: Reader fills a Draft from a
// file (reader.h), Reference prints the same line (reference.h). A new key is one line in keys.cc or device_keys.cc.
// Internal to server/scene.

namespace tendon::scene_file {

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
  ScriptedMotion::Script motion = ScriptedMotion::Sine{};
  std::optional<RecordedMotionFile> recorded_motion;
  std::optional<std::filesystem::path> replayed;  ///< a recording of tendond
  std::optional<Duration> longest_hold;
  HoldBound::Follow follow_holds;  ///< a memory of 0: none
  std::optional<double> coulomb_bound;
  std::optional<double> viscous_bound;
  std::optional<double> max_force;
  std::optional<double> ledger_step;
  /// 8.5 N on a handle of 75 g that nobody holds are 113 m/s²; a tap is some 200 (control.md 8.7).
  double most_acceleration = 300;
  /// With more, delayed walls stay passive but buzz (control.md 8.7).
  double shaping_viscous = 0.3;
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

/// [device]. Defined for Reader and Reference.
template <class Table>
void declare_device(Table& device, Draft& draft);

}  // namespace tendon::scene_file
