// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "core/base/rotation.h"
#include "core/base/time.h"
#include "devices/simulated/scripted_motion.h"

namespace tendon {

/// The rotation of a simulated handle: a rigid body with the same inertia about every axis, in the operator's hand,
///
///     J dω/dt = τ_device + τ_hand − b ω − τ_c ω/|ω|,      q̇ = ½ ω q          any |ω/|ω|| ≤ 1 at ω = 0
///
/// Torques in N·m on the handle and ω in rad/s, both in base frame axes; q turns the handle frame into the base frame.
/// An inertia that is the same about every axis has no gyroscopic torque, and no coupling with the position.
///
/// **The hand** holds the handle by a spring and a damper to an orientation s(t):
///
///     τ_hand = K θ + c (ω_s − ω),      s = rotation_by(θ) · q,      |θ| ≤ π
///
/// Its spring is linear in the turn θ, as that of the position is in the way: a hand is as stiff at 60° as at 1°. It
/// has the energy K θ²/2, and jumps at 180°, further than a hand lets itself be turned. The script gives s as a
/// rotation vector φ(t), s = rotation_by(φ); ω_s is the angular velocity of that rotation.
///
/// **Integration** is that of SimulatedDevice: with the mean velocity ω̄ of a substep h it satisfies, exactly,
///
///     J (ω₁ − ω₀)/h = τ_device + τ_hand − b ω̄ − τ_c ω̄/|ω̄|,      q₁ = rotation_by(h ω̄) · q₀
///
/// so it sticks exactly, without a velocity threshold, and neither makes nor hides energy: J (ω₁ − ω₀)·ω̄ is exactly
/// the change of kinetic energy, and while a torque is held,
///
///     work of the hand + kinetic energy at the start = −Σ τ_device·h ω̄ + Σ (τ_c |ω̄| + b ω̄²) h + kinetic energy now
///
/// up to rounding, where it did not come to rest; it stores no more than that where it did. The h ω̄ is
/// turn_between(q₀, q₁). Over several substeps turn_between is the sum of them only while the axis stays the same; for
/// turns about changing axes the two differ by ½ ∫∫ ω × ω, a third order of the time.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class SimulatedRotation {
 public:
  struct Hand {
    double stiffness = 0;  ///< K, N·m/rad, > 0
    double damping = 0;    ///< c, N·m·s/rad, ≥ 0
    /// Its positions are rotation vectors (rad, base frame axes), its velocities their time derivatives.
    ScriptedMotion motion{ScriptedMotion::Sine{}};
  };

  struct Config {
    double inertia = 0;                          ///< J, kg·m², > 0
    std::optional<Vec3> start{};                 ///< rotation vector, rad; left out: the hand's, or none
    Vec3 start_angular_velocity = Vec3::Zero();  ///< rad/s
    std::optional<double> viscous_friction{};    ///< b, N·m·s/rad, > 0
    std::optional<double> coulomb_friction{};    ///< τ_c, N·m, > 0
    /// N·m, norm of the torque vector, > 0. Left out: it has no motors, and turns as the hand does (Touch).
    std::optional<double> max_torque{};
    /// rad, > 0. The sample is the start orientation, turned by a rotation vector whose components are whole counts. So
    /// the truth is never further away than half a count on each axis, √3/2 in all; the start is exact.
    std::optional<double> encoder_step{};
    std::optional<Hand> hand{};
  };

  /// The true state, for tests; no production code may read it.
  struct Truth {
    Quat orientation;
    Vec3 angular_velocity = Vec3::Zero();  ///< rad/s
    Vec3 device_torque = Vec3::Zero();     ///< N·m, on the handle
    Vec3 hand_torque = Vec3::Zero();       ///< N·m, mean over the last substep, on the handle
    double hand_work = 0;                  ///< J, ∫ τ_hand·ω dt since the start
    double kinetic_energy = 0;             ///< J
  };

  /// Throws std::invalid_argument naming the field ("rotation.…"), its value and what was expected.
  explicit SimulatedRotation(Config config);

  /// From now on this torque (N·m) is held. It has to be within `max_torque`, and zero without motors.
  void hold(const Vec3& torque) noexcept { truth_.device_torque = torque; }

  /// Integrates `substeps` of `h` seconds each; the first begins `begin` seconds after the start.
  void integrate(double begin, Duration::rep substeps, double h) noexcept;

  /// The orientation that the encoders give.
  Quat sample() const noexcept;

  const Truth& truth() const noexcept { return truth_; }

 private:
  /// J, with h/2 of all that resists the velocity in proportion to it.
  double resistance(double h) const noexcept;
  /// K θ + c ω_s at the middle of a substep, with the orientation of its beginning.
  Vec3 drive(double t) const noexcept;

  Config config_;
  Quat start_;
  Truth truth_;
};

}  // namespace tendon
