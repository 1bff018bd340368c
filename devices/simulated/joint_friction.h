// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "core/ledger/friction.h"
#include "devices/simulated/mechanism.h"

namespace tendon {

/// Friction where it really is, in the joints of a mechanism: at the handle it then depends on the place and on the
/// direction,
///
///     F = −Jᵀ(x) τ,      τᵢ = τ_c,i sgn(q̇ᵢ) + b_i q̇ᵢ,      q̇ = J(x) v;   any |sgn| ≤ 1 at q̇ᵢ = 0
///
/// (F in N on the handle, τ in N·m, J in rad/m: Mechanism.) Each joint sticks by itself, so a handle that is pushed may
/// give way aside. Isotropic friction is what a limiter counts on; of this, that is
///
///     Σ τ_c,i |q̇ᵢ| ≥ f_c |v|,   f_c = minᵢ τ_c,i / ‖J⁻¹ eᵢ‖          exact: the easiest direction is that of one joint
///     Σ b_i q̇ᵢ²    ≥ b |v|²,    b = λ_min(Jᵀ diag(b_i) J) ≥ 1 / Σ ‖J⁻¹ eᵢ‖²/b_i
///
/// Thread-safe: yes, it never changes. Realtime-safe: `step`.
class JointFriction {
 public:
  struct Config {
    Mechanism::Kind mechanism;
    Vec3 centre = Vec3::Zero();   ///< m, where the middle of its workspace lies in the device base frame
    Vec3 coulomb = Vec3::Zero();  ///< τ_c, N·m, of each joint, each ≥ 0
    Vec3 viscous = Vec3::Zero();  ///< b_i, N·m·s/rad, of each joint, each ≥ 0
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected; also when all six numbers are 0.
  explicit JointFriction(const Config& config);

  /// f_c and b anywhere and in any direction: lower bounds that hold.
  Friction least() const noexcept;
  /// … at `position` (m, device base frame) in any direction. As long as the handle stays there only.
  Friction least_at(const Vec3& position) const noexcept;

  /// The torques (N·m) with which the least Coulomb friction anywhere is `coulomb` (N): how a handle's friction of
  /// which no more is known goes into the joints of this mechanism.
  static Vec3 torques(const Mechanism::Kind& mechanism, double coulomb);

  /// What the rubbing mass comes to in a substep of length h.
  struct Slide {
    Vec3 mean;  ///< v̄, m/s
    Vec3 end;   ///< v₁ = 2 v̄ − v₀, but where joints come to rest
  };
  /// What it is without this friction: v̄ = momentum / resistance.
  struct Impetus {
    Vec3 momentum;      ///< m v₀ + (h/2) push, N·s
    double resistance;  ///< kg: the mass, and h/2 of whatever resists its velocity
    double mass;        ///< kg
    Vec3 push;          ///< N, of all that does not depend on its velocity
  };

  /// The implicit midpoint rule with set-valued friction in each joint, J that of `position`: τ satisfies its law with
  /// the mean joint velocities J v̄ exactly. A joint whose velocity came to or through zero, and which friction can hold
  /// against what pushes, rests: v₁ is the nearest velocity (in kinetic energy) in which it stands.
  Slide step(const Vec3& position, const Vec3& v0, const Impetus& impetus, double h) const noexcept;

 private:
  Mechanism mechanism_;
  Vec3 centre_;
  Vec3 coulomb_;
  Vec3 viscous_;
};

}  // namespace tendon
