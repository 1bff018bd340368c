// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/cpp/force_client.h"

namespace tendon {

/// Virtual coupling: a spring and a damper between the hand and a rigid tool in the engine. Use it if contact forces
/// of the engine cannot be read or are too noisy to be felt. The hand then feels the coupling, and the contact solver
/// of the engine stops the tool. (Colgate, Stanley & Brown 1995, "Issues in the haptic display of tool use".)
///
///     f = [k·(x_h − x_t + T·(v_h − v_t)) + b·(v_h − v_t)] / [1 + (b + k·T)·T/m]      N, on the tool; the hand gets −f
///
/// This is the spring-damper force at the end of the engine's time step T for an otherwise free tool (backward
/// Euler). In an engine that integrates v ← v + T·f/m, x ← x + T·v, the free tool is stable for all k, b and T. At
/// rest, f = k·(x_h − x_t)/[1 + (b + k·T)·T/m]; at a wall of stiffness K, the hand feels this stiffness in series
/// with K.
///
/// Thread-safe: yes, stateless. Realtime-safe: yes, except the constructor.
class ToolCoupling {
 public:
  struct Config {
    double stiffness = 500;   ///< k, N/m, > 0; upper limit of the stiffness that can be felt
    double damping = 2;       ///< b, N·s/m, ≥ 0
    double tool_mass = 0.05;  ///< m, kg, > 0, as in the engine. A heavier tool is more stable but is felt in free space
    double step_s = 0.001;    ///< T, s, > 0, as in the engine
    double max_force = 10;    ///< N, > 0, so that a jump of the hand does not accelerate the tool too much
  };
  struct Forces {
    Vec3 on_tool = Vec3::Zero();  ///< N, to apply to the body in the engine
    Vec3 on_hand = Vec3::Zero();  ///< N, to return to the server
  };

  explicit ToolCoupling(const Config& config);  ///< throws std::invalid_argument "FIELD = VALUE: expected …"

  /// Returns a coupling with `config`, except that felt_stiffness() is `config.stiffness`, and k is larger. Throws
  /// std::invalid_argument as above, and if the mass is not above stiffness·step_s²: no spring is then felt that hard.
  static ToolCoupling felt_as(Config config);

  /// Must be called before each step of the engine. Positions (m) and velocities (m/s) that are not finite result in
  /// a force that is not finite. ForceClient does not send such a force; do not apply it in the engine.
  Forces couple(const DeviceState& hand, const Vec3& tool_position, const Vec3& tool_velocity) const noexcept;

  /// The same for the displacement `apart` from the tool to the hand, and its rate `parting`. A second coupling can thus
  /// turn the tool with the handle (HeldTool): its config is in N·m/rad, N·m·s/rad, kg·m² and N·m, `apart` in rad,
  /// `parting` in rad/s, and the forces are torques in N·m.
  Forces couple(const Vec3& apart, const Vec3& parting) const noexcept;

  /// N/m, stiffness felt if the tool cannot move: k/[1 + (b + k·T)·T/m].
  double felt_stiffness() const noexcept { return share_ * config_.stiffness; }

 private:
  Config config_;
  double share_;
};

}  // namespace tendon
