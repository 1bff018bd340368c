// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"

namespace tendon {

/// Admittance control. It makes a heavy device with a force sensor feel like a tool with a different mass.
///     M dv_d/dt = F_hand + F_env − D v_d − S x_d,   dx_d/dt = v_d        (the tool; v_d(0) = x_d(0) = 0)
///     F_wanted  = K_p (v_d − v) + K_i Σ (v_d T − Δx)                      (PI loop on the velocity)
/// F_hand is the measured force of the hand on the handle, F_env the force of the remote environment on the tool, and
/// F_wanted the force of the device on the hand. v is the velocity of the handle; Δx and T are the displacement and the
/// measured length of the last interval. M, D, S, K_p and K_i are diagonal. The tool is integrated with the implicit
/// Euler method, which is stable for any T.
///
/// Pass F_wanted to a stability controller, and the same intervals to both. The port is then passive for all gains:
///     law.observe(interval);                                 loop.observe(interval);
///     force = law.limit(loop.command({hand_force, environment, velocity})).force;
///
/// Anti-windup: if the applied force was smaller than the command, the last integration step is not taken in the
/// direction of the shortfall, and the integral in that direction is limited to the applied force. The force therefore
/// leaves its bound as soon as the velocity error changes sign.
///
/// Limitation: the account of the limiter includes friction but not kinetic energy. To accelerate a handle of mass m
/// like a lighter tool of mass M, the motors must provide ½ (m − M) v² in advance. The limiter clips the part that has
/// not been earned by the damping of the tool, so the hand feels the mass of the device. A credit of ½ m (|v| − a_max
/// T)₊² would not be passive (admittance_loop_test.cc contains a counterexample).
///
/// If a measurement is not finite, the tool and the integral are reset to rest, the demand is not finite, and the law
/// returns zero force with this reason. An interval is ignored if it is not finite or not positive.
///
/// Source: Lee & Lee, IEEE TCST 17(4), 2009, section II-A; core/PROOFS.md, "Admittance loop".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class AdmittanceLoop {
 public:
  struct Config {
    Vec<N> mass;                        ///< M, kg (kg·m² for angles); > 0
    Vec<N> damping = Vec<N>::Zero();    ///< D, N·s/m; ≥ 0
    Vec<N> stiffness = Vec<N>::Zero();  ///< S, N/m, ≥ 0; pulls the tool to its start position
    Vec<N> proportional;                ///< K_p, N·s/m; ≥ 0
    Vec<N> integral = Vec<N>::Zero();   ///< K_i, N/m; ≥ 0
  };

  struct Measured {
    Vec<N> hand_force;   ///< N, applied by the hand to the handle
    Vec<N> environment;  ///< N, applied by the remote environment to the tool
    Vec<N> velocity;     ///< m/s, of the handle
  };

  /// Throws std::invalid_argument with the field, its value and the expected range.
  explicit AdmittanceLoop(const Config& config);

  /// Updates the integral with the last interval. Must not be called in the first step.
  void observe(const Interval<N>& interval) noexcept;

  /// Replaces `observe` if the motion was not measured. The tool and the integral are not updated.
  void observe_unseen() noexcept;

  /// Returns the force that is used to make the handle follow the tool. It must be passed to the stability controller.
  Demand<N> command(const Measured& measured) noexcept;

  const Vec<N>& tool_velocity() const noexcept { return velocity_; }  ///< v_d, m/s

 private:
  Config config_;
  Vec<N> velocity_ = Vec<N>::Zero();      ///< v_d
  Vec<N> displacement_ = Vec<N>::Zero();  ///< x_d
  Vec<N> integral_ = Vec<N>::Zero();      ///< N, K_i Σ (v_d T − Δx), of the accepted steps
  Vec<N> step_ = Vec<N>::Zero();          ///< N, last step of the integral, which the next `observe` adds
  Vec<N> commanded_ = Vec<N>::Zero();     ///< N
  Vec<N> dx_ = Vec<N>::Zero();            ///< m, of the interval that `command` uses
  double held_ = 0;                       ///< s, length of this interval, if any
};

}  // namespace tendon
