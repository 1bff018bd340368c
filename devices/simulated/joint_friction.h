// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"
#include "devices/simulated/mechanism.h"

namespace tendon {

/// Friction in the joints of a mechanism. At the handle, it depends on position and direction:
///
///     F = −Jᵀ(x) τ,      τᵢ = τ_c,i sgn(q̇ᵢ) + b_i q̇ᵢ,      q̇ = J(x) v;   any |sgn| ≤ 1 at q̇ᵢ = 0
///
/// with F in N on the handle, τ in N·m, J in rad/m (Mechanism). Joints stick independently, so the handle can move in a
/// different direction than it is pushed. For limiters, which use isotropic friction, there are lower bounds:
///
///     Σ τ_c,i |q̇ᵢ| ≥ f_c |v|,   f_c = minᵢ τ_c,i / ‖J⁻¹ eᵢ‖         exact: the easiest direction is that of one joint
///     Σ b_i q̇ᵢ²    ≥ b |v|²,    b = λ_min(Jᵀ diag(b_i) J) ≥ 1 / Σ ‖J⁻¹ eᵢ‖²/b_i
/// Thread-safe: yes, immutable. Realtime-safe: `step`.
class JointFriction {
 public:
  struct Config {
    Mechanism::Kind mechanism;
    Vec3 centre = Vec3::Zero();   ///< m, middle of the workspace, base frame
    Vec3 coulomb = Vec3::Zero();  ///< τ_c, N·m, each ≥ 0
    Vec3 viscous = Vec3::Zero();  ///< b_i, N·m·s/rad, each ≥ 0
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field, or if no joint has friction.
  explicit JointFriction(const Config& config);

  Friction least() const noexcept;                         ///< lower bounds of f_c and b in the whole workspace
  Friction least_at(const Vec3& position) const noexcept;  ///< only at `position` (m, device base frame)

  Joints at(const Motion& hand) const noexcept;
  void name(std::vector<std::string>& joints) const;

  /// The torques (N·m) for which `coulomb` (N), if only this is known, is the smallest friction in the workspace.
  static Vec3 torques(const Mechanism::Kind& mechanism, double coulomb);

  /// For a substep of length h.
  struct Slide {
    Vec3 mean;  ///< v̄, m/s
    Vec3 end;   ///< v₁ = 2 v̄ − v₀, unless joints come to rest
  };
  /// Without friction, v̄ = momentum / resistance.
  struct Impetus {
    Vec3 momentum;      ///< m v₀ + (h/2) push, N·s
    double resistance;  ///< kg, mass plus h/2 times all damping
    double mass;        ///< kg
    Vec3 push;          ///< N, independent of the velocity
  };

  /// A step of the implicit midpoint rule with set-valued friction in each joint, using J at `position`. The mean joint
  /// velocities J v̄ satisfy the friction law exactly. Joints stop if their velocity has reached or crossed zero and
  /// friction can hold them. v₁ is then the closest velocity, in kinetic energy, without motion of these joints.
  Slide step(const Vec3& position, const Vec3& v0, const Impetus& impetus, double h) const noexcept;

 private:
  Mechanism mechanism_;
  Vec3 centre_;
  Vec3 coulomb_;
  Vec3 viscous_;
};

}  // namespace tendon
