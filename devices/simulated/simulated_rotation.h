// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "core/base/rotation.h"
#include "core/base/time.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The rotation of a simulated handle: a rigid body with isotropic inertia, held by the operator's hand.
///
///     J dω/dt = τ_device + τ_hand − b ω − τ_c ω/|ω|,      q̇ = ½ ω q          any |ω/|ω|| ≤ 1 at ω = 0
///
/// Torques are in N·m on the handle and ω is in rad/s, both in the base frame; q is the rotation from the handle frame
/// to the base frame. There is no gyroscopic torque, and no coupling with the position.
///
/// **The hand** is a spring and a damper, with the target orientation s(t):
///
///     τ_hand = K θ + c (ω_s − ω),      s = rotation_by(θ) · q,      |θ| ≤ π
///
/// The spring is linear in θ and has the energy K θ²/2, so that its stiffness does not depend on the angle. It is
/// discontinuous at 180°, but a hand does not reach this angle. The script is a rotation vector φ(t), with s =
/// rotation_by(φ) and its angular velocity ω_s.
///
/// **Integration** as in SimulatedDevice. With the mean velocity ω̄ of a substep h, the following is satisfied exactly:
///
///     J (ω₁ − ω₀)/h = τ_device + τ_hand − b ω̄ − τ_c ω̄/|ω̄|,      q₁ = rotation_by(h ω̄) · q₀
///
/// Sticking is exact, without a velocity threshold. Energy is not added or removed, since J (ω₁ − ω₀)·ω̄ is exactly the
/// change of the kinetic energy. For a constant device torque,
///
///     work of the hand + kinetic energy at the start = −Σ τ_device·h ω̄ + Σ (τ_c |ω̄| + b ω̄²) h + kinetic energy now
///
/// up to rounding, if it did not stop; otherwise, at most this much is stored. Here h ω̄ is turn_between(q₀, q₁). Over
/// several substeps, turn_between is only their sum if the axis is constant; otherwise the difference is ½ ∫∫ ω × ω,
/// which is of third order in time. Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedRotation {
 public:
  struct Hand {
    double stiffness = 0;                           ///< K, N·m/rad, > 0
    double damping = 0;                             ///< c, N·m·s/rad, ≥ 0
    ScriptedMotion motion{ScriptedMotion::Sine{}};  ///< positions are rotation vectors (rad, base frame)
  };

  struct Config {
    double inertia = 0;                          ///< J, kg·m², > 0
    std::optional<Vec3> start{};                 ///< rotation vector, rad; default: the rotation of the hand, or 0
    Vec3 start_angular_velocity = Vec3::Zero();  ///< rad/s
    std::optional<double> viscous_friction{};    ///< b, N·m·s/rad, > 0
    std::optional<double> coulomb_friction{};    ///< τ_c, N·m, > 0
    std::optional<double> max_torque{};          ///< N·m, maximum norm, > 0; empty without motors, as in the Touch
    /// rad, > 0. Samples are the start orientation, rotated by whole counts of a rotation vector. The error is at most
    /// half a count per axis, √3/2 in total; the start is exact.
    std::optional<double> encoder_step{};
    std::optional<Hand> hand{};
  };

  struct Truth {
    Quat orientation;
    Vec3 angular_velocity = Vec3::Zero();  ///< rad/s
    Vec3 device_torque = Vec3::Zero();     ///< N·m, on the handle
    Vec3 hand_torque = Vec3::Zero();       ///< N·m, mean of last substep
    double hand_work = 0;                  ///< J, ∫ τ_hand·ω dt since the start
    double kinetic_energy = 0;             ///< J
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field ("rotation.…").
  explicit SimulatedRotation(Config config);

  /// In N·m, within `max_torque`; zero without motors.
  void hold(const Vec3& torque) noexcept { truth_.device_torque = torque; }

  /// Integrates `substeps` of `h` seconds, starting at `begin`.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  Quat sample() const noexcept;  ///< as measured by the encoders

  const Truth& truth() const noexcept { return truth_; }

 private:
  double resistance(double h) const noexcept;  ///< J plus h/2 times all damping
  /// K θ + c ω_s in the middle of a substep, for the orientation at its start.
  Vec3 drive(double t) const noexcept;

  Config config_;
  Quat start_;
  Truth truth_;
};

}  // namespace tendon
