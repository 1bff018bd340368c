// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"
#include "devices/simulated/mechanism.h"

namespace tendon {

/// Friction in the joints of a mechanism, as in real devices. At the handle, it depends on position and direction:
///
///     F = −Jᵀ(x) τ,      τᵢ = τ_c,i sgn(q̇ᵢ) + b_i q̇ᵢ,      q̇ = J(x) v;   any |sgn| ≤ 1 at q̇ᵢ = 0
///
/// (F in N on the handle, τ in N·m, J in rad/m: Mechanism.) Each joint sticks independently, so a pushed handle may
/// move sideways. A limiter assumes isotropic friction; joint friction is never less than
///
///     Σ τ_c,i |q̇ᵢ| ≥ f_c |v|,   f_c = minᵢ τ_c,i / ‖J⁻¹ eᵢ‖          exact: the easiest direction is that of one joint
///     Σ b_i q̇ᵢ²    ≥ b |v|²,    b = λ_min(Jᵀ diag(b_i) J) ≥ 1 / Σ ‖J⁻¹ eᵢ‖²/b_i
///
/// Thread-safe: yes, immutable. Realtime-safe: `step`.
class JointFriction {
 public:
  struct Config {
    Mechanism::Kind mechanism;
    Vec3 centre = Vec3::Zero();   ///< m, middle of the workspace in the device base frame
    Vec3 coulomb = Vec3::Zero();  ///< τ_c, N·m, for each joint, each ≥ 0
    Vec3 viscous = Vec3::Zero();  ///< b_i, N·m·s/rad, for each joint, each ≥ 0
  };

  /// Throws std::invalid_argument, naming the field, its value and the expected range. At least one of the six numbers
  /// must be above 0.
  explicit JointFriction(const Config& config);

  /// Lower bounds of f_c and b for all positions in the workspace and all directions.
  Friction least() const noexcept;
  /// Lower bounds of f_c and b at `position` (m, device base frame) for all directions. They hold only while the handle
  /// stays there.
  Friction least_at(const Vec3& position) const noexcept;

  /// Returns the joint angles and velocities for `hand`.
  Joints at(const Motion& hand) const noexcept;
  /// Writes the names of the joints.
  void name(std::vector<std::string>& joints) const;

  /// Returns the torques (N·m) for which the smallest Coulomb friction at any position is `coulomb` (N). Use them to
  /// convert the friction of a handle to joint friction if nothing else is known about it.
  static Vec3 torques(const Mechanism::Kind& mechanism, double coulomb);

  /// The velocities of the mass in a substep of length h.
  struct Slide {
    Vec3 mean;  ///< v̄, m/s
    Vec3 end;   ///< v₁ = 2 v̄ − v₀, unless joints come to rest
  };
  /// The motion of the mass without this friction: v̄ = momentum / resistance.
  struct Impetus {
    Vec3 momentum;      ///< m v₀ + (h/2) push, N·s
    double resistance;  ///< kg: the mass, plus h/2 times all forces proportional to its velocity
    double mass;        ///< kg
    Vec3 push;          ///< N, sum of all forces that do not depend on the velocity
  };

  /// One step of the implicit midpoint rule with set-valued friction in each joint and the J of `position`: τ satisfies
  /// its law exactly with the mean joint velocities J v̄. A joint comes to rest if its velocity reached or crossed zero
  /// and friction can hold it against the push. v₁ is then the nearest velocity (in kinetic energy) at which it is at
  /// rest.
  Slide step(const Vec3& position, const Vec3& v0, const Impetus& impetus, double h) const noexcept;

 private:
  Mechanism mechanism_;
  Vec3 centre_;
  Vec3 coulomb_;
  Vec3 viscous_;
};

}  // namespace tendon
