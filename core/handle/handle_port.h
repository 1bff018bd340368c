// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/control/aol_plus.h"
#include "core/control/limiter.h"
#include "core/ledger/hold_bound.h"
#include "core/ledger/output_bound.h"

namespace tendon {

/// The limiter for the wrench of a handle that can be rotated, or for its gripper. The law can be AOL+ (AolPlus) with
/// its parts, AOL (AOL+ without parts), or none, in which case the force is not limited. It keeps the guarantee of
/// Limiter: E ≥ 0 through overruns, because its T follows the longest hold (HoldBound).
///     HandlePort<2, 3>   a wrench: F (N) with Δx (m), τ (N·m) with Δθ (rad), friction of each, **one account**:
///                            E(n) = Σₖ [ −F·Δx − τ·Δθ + f_c ‖Δx‖ + b ‖Δx‖²/T + τ_c ‖Δθ‖ + b_r ‖Δθ‖²/T ]
///                        and one factor γ for force and torque, so the wrench keeps its direction
///     HandlePort<1>      a gripper: N and m at its fingers
/// Δθ is the rotation vector between two samples, in base frame axes. If the axis of the handle turns during the
/// interval, the ledger can overestimate the energy by up to (‖τ‖T/b_r)²/48 of the viscous friction of the interval. A
/// friction bound that is 2 % below the truth covers this while ‖τ‖ ≤ b_r/T (core/PROOFS.md, "Several coordinates").
/// Satisfies StabilityController and SharesAccount. Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int Blocks, int Size = 1>
class HandlePort {
 public:
  static constexpr int kSize = Blocks * Size;
  using Plus = AolPlus<Blocks, Size>;

  struct Config {
    Law law = Law::kAolPlus;  ///< kAolPlus, kAol or kNone
    std::array<Friction, Blocks> friction{};
    Duration longest_hold{};  ///< T_max; > 0
    std::optional<HoldBound::Follow> follow_holds = HoldBound::Follow{};
    typename Plus::Parts parts{};  ///< of kAolPlus
    bool shared_account = false;   ///< other ports credit the account. See AolPlus::EnergyCap.
  };

  /// Throws std::invalid_argument with the name of the field, also if the law is not supported or cannot share.
  explicit HandlePort(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;

  /// `permitted` is the bound on the norm of the first block (a wrench: of its force, N) in the direction of the
  /// demand. If the first block of the demand is zero, it is the bound on that block alone.
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;

  double energy() const noexcept { return law_.energy(); }

  /// SharesAccount, J; `force` is N, or a wrench. The force and the torque of a wrench share the same account. For law
  /// none, `credit` and `withdraw` do nothing, `payable` is 0 and `worst_loss` is +∞.
  void credit(double energy) noexcept {
    if (limits_) law_.credit(energy);
  }
  void withdraw(double energy) noexcept {
    if (limits_) law_.withdraw(energy);
  }
  double payable() const noexcept { return limits_ ? law_.payable() : 0.0; }
  double worst_loss(const Vec<kSize>& force) const noexcept {
    return limits_ ? law_.worst_loss(force) : std::numeric_limits<double>::infinity();
  }

  void adapt(const std::array<Friction, Blocks>& friction) noexcept { law_.adapt(friction); }

  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }  ///< T
  std::uint64_t broken_assumptions() const noexcept { return law_.broken_assumptions(); }

 private:
  void follow(Duration held) noexcept;

  bool limits_;  ///< false if the law is none
  Plus law_;
  Duration longest_hold_;  ///< T_max
  std::optional<HoldBound> holds_;
  OutputBound first_;  ///< for the first block only
  double viscous_;     ///< b of the first block
};

/// The account of a handle with motors that move it and turn it.
using WrenchPort = HandlePort<2, 3>;
using GripPort = HandlePort<1>;

/// Limits for the rotation of a handle. The other values are taken from `point` by wrench_config().
struct RotationLimits {
  Friction friction{};                        ///< τ_c, N·m, and b_r, N·m·s/rad: lower bounds
  double max_torque = 0;                      ///< N·m, > 0
  double max_slew = 50;                       ///< N·m/s, > 0; 1000 N/s at a lever of 5 cm
  double encoder_step = 0;                    ///< rad, for robust_ledger, or 0 if exact
  std::optional<double> most_acceleration{};  ///< rad/s², for bounded_acceleration
  std::optional<double> shaping_stiffness{};  ///< N·m/rad, for shaping
  double damping = 0;                         ///< N·m·s/rad, for damper, or 0 if not damped
  double contact = 0.005;                     ///< N·m, for damper; a larger torque is a contact
};
/// Throws std::invalid_argument if the point lists a part without a value for rotation.
WrenchPort::Config wrench_config(const LimiterConfig& point, const RotationLimits& rotation);

struct GripLimits {
  Friction friction{};                                        ///< N and N·s/m at the fingers: lower bounds
  double arm = 0;                                             ///< m/rad, travel of the fingers per opening; > 0
  double max_force = 0;                                       ///< N, > 0
  double max_slew = std::numeric_limits<double>::infinity();  ///< N/s, > 0
};
/// Only the parts energy_cap, fading_contact, knee and latency_reserve of `point` are used for the gripper, because the
/// others are specific to the position. The account is shared if that of `point` is, through a separate tank.
GripPort::Config grip_config(const LimiterConfig& point, const GripLimits& grip);

/// The result of applying a limit without memory to a wrench. `saturate` applies the first s to the wrench, and
/// `limit_slew` the second s to its change. s ≤ 1 is the largest value with
///     ‖s F‖ ≤ max_force,   ‖s τ‖ ≤ max_torque
///     ‖s (F − F_before)‖ ≤ max_slew · T,   ‖s (τ − τ_before)‖ ≤ max_torque_slew · T
struct LimitedWrench {
  Vec<6> wrench;
  Reasons reasons;
};
LimitedWrench saturate(const Vec<6>& wanted, double max_force, double max_torque) noexcept;
LimitedWrench limit_slew(const Vec<6>& wanted, const Vec<6>& before, double force_rate, double torque_rate,
                         Duration elapsed) noexcept;

inline Vec<6> wrench_of(const Vec3& force, const Vec3& torque) noexcept {
  Vec<6> wrench;
  wrench << force, torque;
  return wrench;
}

}  // namespace tendon
