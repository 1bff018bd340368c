// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/cpp/force_client.h"

namespace tendon {

/// The hand holds a rigid body of the engine by a spring and a damper: a virtual coupling. For engines whose contact
/// forces cannot be read, or are too rough to be felt: the hand feels the coupling instead, and the engine's own
/// contact stops the tool. (Colgate, Stanley & Brown 1995, "Issues in the haptic display of tool use".)
///
///     f = [k·(x_h − x_t + T·(v_h − v_t)) + b·(v_h − v_t)] / [1 + (b + k·T)·T/m]      N, on the tool; the hand gets −f
///
/// That is the force of the spring and the damper at the end of the engine's step, T later, for a tool that nothing
/// else pushes: backward Euler. Added to an engine that integrates v ← v + T·f/m, x ← x + T·v, the free tool is stable
/// for any k, b and T. At rest f = k·(x_h − x_t)/[1 + (b + k·T)·T/m]; against a wall of stiffness K the hand feels this
/// coupling's stiffness and K in series.
///
/// Thread-safe: yes, it has no state. Realtime-safe: yes, except the constructor.
class ToolCoupling {
 public:
  struct Config {
    double stiffness = 500;   ///< k, N/m, > 0: nothing can feel harder than this
    double damping = 2;       ///< b, N·s/m, ≥ 0
    double tool_mass = 0.05;  ///< m, kg, > 0: the engine's. Heavier is calmer, and is felt in free space
    double step_s = 0.001;    ///< T, s, > 0: the engine's
    /// N, > 0: a longer stretch gives no more force, so that a hand that jumps does not throw the tool.
    double max_force = 10;
  };
  struct Forces {
    Vec3 on_tool = Vec3::Zero();  ///< N, for the engine's body
    Vec3 on_hand = Vec3::Zero();  ///< N, the answer to the server
  };

  /// Throws std::invalid_argument "FIELD = VALUE: expected …" when a value of `config` is impossible.
  explicit ToolCoupling(const Config& config);

  /// To be called before each step of the engine. Positions (m) and velocities (m/s) that are not finite make a force
  /// that is not finite: ForceClient does not send it; do not give it to the engine.
  Forces couple(const DeviceState& hand, const Vec3& tool_position, const Vec3& tool_velocity) const noexcept;

  /// N/m, the most that the hand feels, when the tool cannot move: k/[1 + (b + k·T)·T/m].
  double felt_stiffness() const noexcept { return share_ * config_.stiffness; }

 private:
  Config config_;
  double share_;
};

}  // namespace tendon
