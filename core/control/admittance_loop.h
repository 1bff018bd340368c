// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"

namespace tendon {

/// Makes a heavy device with a force sensor feel like a tool of another mass: the admittance form of haptic control.
///
///     M dv_d/dt = F_hand + F_env − D v_d − S x_d,   dx_d/dt = v_d        (the tool; v_d(0) = x_d(0) = 0)
///     F_wanted  = K_p (v_d − v) + K_i Σ (v_d T − Δx)                      (PI loop on the velocity)
///
/// F_hand is the measured force of the hand **on the handle**, F_env the remote environment's force on the hand-held
/// tool (a wall that resists motion along +x has it along −x), F_wanted the device's force on the hand; v is the
/// handle's velocity, Δx and T displacement and measured length of the last interval. M, D, S, K_p and K_i are
/// diagonal. The tool is integrated by the implicit Euler rule, stable for any T.
///
/// F_wanted takes the place of the reflective force. Hand it to a stability controller like any other demand, and
/// show both of them the same intervals:
///
///     law.observe(interval);                                 loop.observe(interval);
///     force = law.limit(loop.command({hand_force, environment, velocity})).force;
///
/// Then the port is passive as it is with any demand, whatever the gains.
///
/// Anti-windup. `observe` gets the force that was really applied. Where it fell short of the command, the last step of
/// the integral is not taken in the direction of the shortfall (conditional integration), and the integral's share in
/// that direction is cut to the applied force. So the force leaves its bound as soon as the velocity error changes
/// sign, even when the bound has shrunk meanwhile. A force output that rounds leaves a velocity error worth up to one
/// of its counts.
///
/// Limitation: the limiter's account contains the device's friction but not its kinetic energy. To speed up a
/// handle of mass m like a lighter tool, the motors must put in ½ (m − M) v² ahead of the hand. While the tool's
/// damping has not earned that, the excess is clipped and the hand feels the device's own mass; with D = 0 that is
/// always. The credit ½ m (|v| − a_max T)₊² that control.md 1.5 proposes for this is not passive, and not here: the
/// hand can take the kinetic energy back after the limiter has lent on it (admittance_loop_test.cc has the motion).
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, section II-A; control.md 1.5.
///
/// A measurement that is not finite resets tool and integral to rest, and the demand is not finite: the law answers
/// it with zero force and the reason. An interval that is not finite or not longer than zero is ignored.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class AdmittanceLoop {
 public:
  struct Config {
    Vec<N> mass;                        ///< M, kg (kg·m² for angles); > 0
    Vec<N> damping = Vec<N>::Zero();    ///< D, N·s/m; ≥ 0
    Vec<N> stiffness = Vec<N>::Zero();  ///< S, N/m, towards where the tool was at the start; ≥ 0
    Vec<N> proportional;                ///< K_p, N·s/m; ≥ 0
    Vec<N> integral = Vec<N>::Zero();   ///< K_i, N/m; ≥ 0
  };

  /// What was measured at this step.
  struct Measured {
    Vec<N> hand_force;   ///< N, of the hand on the handle
    Vec<N> environment;  ///< N, of the remote environment on the tool
    Vec<N> velocity;     ///< m/s, of the handle
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit AdmittanceLoop(const Config& config);

  /// The interval that has just ended; not in the first step.
  void observe(const Interval<N>& interval) noexcept;

  /// In place of `observe` when nobody saw the motion: tool and integral wait.
  void observe_unseen() noexcept;

  /// The force that makes the handle follow the tool: for the stability controller.
  Demand<N> command(const Measured& measured) noexcept;

  const Vec<N>& tool_velocity() const noexcept { return velocity_; }  ///< v_d, m/s

 private:
  Config config_;
  Vec<N> velocity_ = Vec<N>::Zero();      ///< v_d
  Vec<N> displacement_ = Vec<N>::Zero();  ///< x_d
  Vec<N> integral_ = Vec<N>::Zero();      ///< N, K_i Σ (v_d T − Δx), of the steps that were taken
  Vec<N> step_ = Vec<N>::Zero();          ///< N, the integral's last step, to be taken by the next `observe`
  Vec<N> commanded_ = Vec<N>::Zero();     ///< N
  Vec<N> dx_ = Vec<N>::Zero();            ///< m, of the interval that `command` is to answer
  double held_ = 0;                       ///< s, its length; 0: none
};

}  // namespace tendon
