// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"
#include "devices/simulated/mechanism.h"

namespace tendon {

/// Friction in the joints of a mechanism, where real devices have it. At the handle it then depends on position and
/// direction:
///
///     F = −Jᵀ(x) τ,      τᵢ = τ_c,i sgn(q̇ᵢ) + b_i q̇ᵢ,      q̇ = J(x) v;   any |sgn| ≤ 1 at q̇ᵢ = 0
///
/// (F in N on the handle, τ in N·m, J in rad/m: Mechanism.) Each joint sticks by itself, so a handle that is pushed may
/// give way sideways. A limiter counts on isotropic friction; joint friction is never less than
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

  /// Lower bounds of f_c and b at any position in the workspace and in any direction.
  Friction least() const noexcept;
  /// Lower bounds of f_c and b at `position` (m, device base frame) in any direction. They hold only while the handle
  /// stays there.
  Friction least_at(const Vec3& position) const noexcept;

  /// The joints of the mechanism, while the handle is where `hand` says.
  Joints at(const Motion& hand) const noexcept;
  /// Writes their names.
  void name(std::vector<std::string>& joints) const;

  /// The torques (N·m) with which the least Coulomb friction anywhere is `coulomb` (N). They turn a handle's friction
  /// into friction of this mechanism's joints when nothing else is known about it.
  static Vec3 torques(const Mechanism::Kind& mechanism, double coulomb);

  /// The velocities of the rubbing mass in a substep of length h.
  struct Slide {
    Vec3 mean;  ///< v̄, m/s
    Vec3 end;   ///< v₁ = 2 v̄ − v₀, except where joints come to rest
  };
  /// The motion that the mass would have without this friction: v̄ = momentum / resistance.
  struct Impetus {
    Vec3 momentum;      ///< m v₀ + (h/2) push, N·s
    double resistance;  ///< kg: the mass, plus h/2 times all that resists its velocity
    double mass;        ///< kg
    Vec3 push;          ///< N, the sum of all forces that do not depend on its velocity
  };

  /// The implicit midpoint rule with set-valued friction in each joint and with the J of `position`: τ satisfies its
  /// law exactly with the mean joint velocities J v̄. A joint rests when its velocity came to zero or crossed it, and
  /// friction can hold it against the push: v₁ is then the nearest velocity (in kinetic energy) at which it stands.
  Slide step(const Vec3& position, const Vec3& v0, const Impetus& impetus, double h) const noexcept;

 private:
  Mechanism mechanism_;
  Vec3 centre_;
  Vec3 coulomb_;
  Vec3 viscous_;
};

}  // namespace tendon
