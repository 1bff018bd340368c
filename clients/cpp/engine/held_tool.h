// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "clients/cpp/engine/tool_coupling.h"
#include "clients/cpp/force_client.h"
#include "clients/cpp/options.h"

namespace tendon {

/// A rigid-body engine with a free body, the tool. Positions, velocities, forces and normals are in the axes of the
/// scene, angular velocities and torques in those of the tool. Forces act at the origin of its frame. Set all functions.
struct ToolEngine {
  using Six = Eigen::Matrix<double, 6, 1>;  ///< a force and a torque (N, N·m), or their velocities (m/s, rad/s)
  struct Motion {
    Vec3 position = Vec3::Zero();  ///< m, of the origin
    Quat orientation{};            ///< rotates the axes of the tool into those of the scene; of any length > 0
    Six velocity = Six::Zero();
  };

  double step_s = 0.001;  ///< s, > 0
  double mass = 0.05;     ///< kg, must be larger than stiffness·step_s²
  double inertia = 2e-5;  ///< kg·m², > angular_stiffness·step_s²: the smallest moment of inertia about the origin
  std::function<Motion()> motion;
  std::function<void(const Six& pull)> pull;  ///< replaces the force on the tool
  /// Simulates a time step. Returns false if the solution was lost, for example as NaN. The engine must then be at its
  /// start again.
  std::function<bool()> step;
  /// Returns the force of contacts and joints on the tool for the newest pull. If only the pull has changed since
  /// the last call, `moved` is false.
  std::function<Six(bool moved)> held;
  /// Appends the contacts of the tool. Each normal points to the tool, and the gap is between the surfaces.
  std::function<void(std::vector<Contact>& found)> contacts;
};

/// The hand holds a tool in a rigid-body engine. There is a virtual coupling (ToolCoupling) for the position
/// and another for the orientation. Only the springs of the couplings are felt. The dampers prevent oscillations.
///
/// * The initial pose of the tool corresponds to the origin of the device and an unrotated handle.
/// * The engine simulates the time since the previous state. The hand moves at constant speed meanwhile.
/// * The stiffness is a finite difference of held(), so it is zero in free space, and that of the coupling at a wall.
///   It is valid up to the distance at which the force is zero.
/// * A contact is sent if all contacts have the same direction.
///
/// If the hand jumps, it drags the tool at `max_speed` and `max_spin`, which are not felt. If the engine loses its
/// solution, or the position of the hand is not finite, the force is not finite, so ForceClient does not send it.
/// Torques are only computed if the device measures its orientation.
///
/// Thread-safe: no. Realtime-safe: no.
class HeldTool {
 public:
  struct Config {
    double stiffness = 1000;       ///< N/m, > 0, felt at a rigid wall
    double angular_stiffness = 2;  ///< N·m/rad, > 0
    double max_speed = 1;          ///< m/s, > 0
    double max_spin = 20;          ///< rad/s, > 0
    int max_steps = 20;            ///< ≥ 1, per answer. If more are due, the simulation falls behind.
    /// If true, z points up in the scene and y points up in the device. Both x axes point to the right. If false, the
    /// axes are the same.
    bool z_up = false;
    std::string tool = "tool";  ///< name of the body, which is not used by HeldTool

    /// Adds --tool, --z-up, --stiffness-n-per-m and --angular-stiffness-nm-per-rad.
    void add_to(CommandLine& line);
  };

  HeldTool(const Config& config, ToolEngine engine);  ///< throws std::invalid_argument "FIELD = VALUE: expected …"

  Touch answer(const DeviceState& hand);  ///< as a Physics callback

 private:
  struct Pose {
    Vec3 at = Vec3::Zero();
    Quat turn{};
  };
  struct Coupled {
    ToolEngine::Six on_tool = ToolEngine::Six::Zero();
    Vec3 force = Vec3::Zero();   ///< N, on the hand, in the axes of the scene
    Vec3 torque = Vec3::Zero();  ///< N·m, likewise
  };
  Coupled couple(const Pose& hand) const;
  bool advance(const Pose& goal, int steps);
  Touch felt(bool turns);
  std::optional<Contact> surface(const Vec3& tool);

  Config config_;
  ToolEngine engine_;
  Quat axes_;  ///< rotates the base frame of the device into the axes of the scene
  ToolCoupling spring_;
  ToolCoupling twist_;
  Pose home_;
  Pose led_;  ///< pose of the hand in the scene
  Vec3 speed_ = Vec3::Zero();
  Vec3 spin_ = Vec3::Zero();
  std::optional<PeerTime> sampled_{};
  double due_ = 1;  ///< steps
  Touch touch_{};
  std::vector<Contact> contacts_{};
};

}  // namespace tendon
