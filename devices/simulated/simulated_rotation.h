// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "core/base/rotation.h"
#include "core/base/time.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The rotation of a simulated handle: a rigid body with the same inertia about every axis, held by the operator's
/// hand,
///
///     J dω/dt = τ_device + τ_hand − b ω − τ_c ω/|ω|,      q̇ = ½ ω q          any |ω/|ω|| ≤ 1 at ω = 0
///
/// Torques in N·m on the handle and ω in rad/s, both in the base frame; q rotates from the handle frame to the base
/// frame. With isotropic inertia there is no gyroscopic torque and no coupling with the position.
///
/// **The hand** holds the handle by a spring and a damper at an orientation s(t):
///
///     τ_hand = K θ + c (ω_s − ω),      s = rotation_by(θ) · q,      |θ| ≤ π
///
/// The spring is linear in the rotation vector θ, as that of the position is in the displacement: a hand is as stiff at
/// 60° as at 1°. Its energy is K θ²/2. It is discontinuous at 180°, which is beyond the range of a hand. The script
/// defines s by a rotation vector φ(t), s = rotation_by(φ); ω_s is the angular velocity of that rotation.
///
/// **Integration** is that of SimulatedDevice. With the mean velocity ω̄ of a substep h it satisfies, exactly,
///
///     J (ω₁ − ω₀)/h = τ_device + τ_hand − b ω̄ − τ_c ω̄/|ω̄|,      q₁ = rotation_by(h ω̄) · q₀
///
/// so it sticks exactly, without a velocity threshold, and neither generates nor dissipates energy: J (ω₁ − ω₀)·ω̄ is
/// exactly the change of kinetic energy, and while a torque is held,
///
///     work of the hand + kinetic energy at the start = −Σ τ_device·h ω̄ + Σ (τ_c |ω̄| + b ω̄²) h + kinetic energy now
///
/// up to rounding if it did not come to rest; otherwise the stored energy is not larger than that. h ω̄ equals
/// turn_between(q₀, q₁). Over several substeps, turn_between is their sum only while the axis is constant; for changing
/// axes the two differ by ½ ∫∫ ω × ω, a third-order term in time.
///
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedRotation {
 public:
  struct Hand {
    double stiffness = 0;  ///< K, N·m/rad, > 0
    double damping = 0;    ///< c, N·m·s/rad, ≥ 0
    /// Positions are rotation vectors (rad, base frame), velocities their time derivatives.
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  struct Config {
    double inertia = 0;                          ///< J, kg·m², > 0
    std::optional<Vec3> start{};                 ///< rotation vector, rad; empty: that of the hand, or zero
    Vec3 start_angular_velocity = Vec3::Zero();  ///< rad/s
    std::optional<double> viscous_friction{};    ///< b, N·m·s/rad, > 0
    std::optional<double> coulomb_friction{};    ///< τ_c, N·m, > 0
    /// N·m, norm of the torque vector, > 0. Empty: no motors, and it moves as the hand does (Touch).
    std::optional<double> max_torque{};
    /// rad, > 0. The sample is the start orientation rotated by a rotation vector whose components are whole counts.
    /// Its error is at most half a count per axis, √3/2 in total; the start is exact.
    std::optional<double> encoder_step{};
    std::optional<Hand> hand{};
  };

  /// The true state, for tests only.
  struct Truth {
    Quat orientation;
    Vec3 angular_velocity = Vec3::Zero();  ///< rad/s
    Vec3 device_torque = Vec3::Zero();     ///< N·m, on the handle
    Vec3 hand_torque = Vec3::Zero();       ///< N·m, mean over the last substep, on the handle
    double hand_work = 0;                  ///< J, ∫ τ_hand·ω dt since the start
    double kinetic_energy = 0;             ///< J
  };

  /// Throws std::invalid_argument, naming the field ("rotation.…"), its value and the expected range.
  explicit SimulatedRotation(Config config);

  /// Holds this torque (N·m) from now on. It must be within `max_torque`, and zero without motors.
  void hold(const Vec3& torque) noexcept { truth_.device_torque = torque; }

  /// Integrates `substeps` of `h` seconds each, starting `begin` seconds after the start.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  /// Returns the orientation measured by the encoders.
  Quat sample() const noexcept;

  const Truth& truth() const noexcept { return truth_; }

 private:
  /// J plus h/2 times all coefficients of torques proportional to the velocity.
  double resistance(double h) const noexcept;
  /// K θ + c ω_s at the midpoint of a substep, with the orientation at its start.
  Vec3 drive(double t) const noexcept;

  Config config_;
  Quat start_;
  Truth truth_;
};

}  // namespace tendon
