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

/// The limiter of a port that is no point in space: the wrench of a handle that turns, or its gripper. The law is AOL+
/// (AolPlus) with its parts, AOL, which is AOL+ without any, or none, which books but does not bound. It keeps the
/// promise of Limiter: E ≥ 0 through overruns, because its T follows the longest hold (HoldBound).
///
///     HandlePort<2, 3>   a wrench: F (N) with Δx (m), τ (N·m) with Δθ (rad), friction of each, **one account**:
///                            E(n) = Σₖ [ −F·Δx − τ·Δθ + f_c ‖Δx‖ + b ‖Δx‖²/T + τ_c ‖Δθ‖ + b_r ‖Δθ‖²/T ]
///                        and one share γ for force and torque, so that the wrench keeps its direction
///     HandlePort<1>      a gripper: N and m at its fingers
///
/// Δθ is the turn between two samples about one axis, in base frame axes. A handle whose axis turns meanwhile may take
/// up to (‖τ‖T/b_r)²/48 of the interval's viscous friction more than is booked: a bound of friction that is 2 % below
/// the truth covers it while ‖τ‖ ≤ b_r/T.
///
/// Satisfies StabilityController and SharesAccount. Thread-safe: no. Realtime-safe: all but the constructor.
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
    /// Other ports pay into the account; the energy cap then leaves room for what they pay (AolPlus::Cap).
    bool shared_account = false;
  };

  /// Throws std::invalid_argument naming the field; so for a law that is not one of the three, and for a
  /// `shared_account` of law none.
  explicit HandlePort(const Config& config);

  void observe(const Interval<kSize>& interval) noexcept;
  void observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept;

  /// `permitted` is the bound on the norm of the first block (a wrench: of its force, N) in the direction that is
  /// wanted; for a demand whose first block is zero, what it could be alone.
  LimitedForce<kSize> limit(const Demand<kSize>& wanted) noexcept;

  double energy() const noexcept { return law_.energy(); }

  /// SharesAccount, J; `force` is N, or a wrench. A wrench has one account to pay into for force and torque. Law none
  /// passes over `credit` and `withdraw`; its `payable` is 0 and its `worst_loss` +∞.
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

  /// T: the next force may be held for so long.
  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }
  std::uint64_t broken_assumptions() const noexcept { return law_.broken_assumptions(); }

 private:
  void follow(Duration held) noexcept;

  bool limits_;  ///< false: law none
  Plus law_;
  Duration longest_hold_;  ///< T_max
  std::optional<HoldBound> holds_;
  OutputBound first_;  ///< of the first block alone
  double viscous_;     ///< its b
};

/// The account of a handle with motors that move it and turn it.
using WrenchPort = HandlePort<2, 3>;
/// The account of a gripper.
using GripPort = HandlePort<1>;

/// The configuration of a wrench for the law, friction of movement, holds, parts and shared account of `point`, and these
/// of rotation.
struct RotationLimits {
  Friction friction{};                        ///< τ_c, N·m, and b_r, N·m·s/rad: lower bounds
  double max_torque = 0;                      ///< N·m, > 0
  double max_slew = 50;                       ///< N·m/s, > 0: HapticController::Config::max_slew at a lever of 5 cm
  double encoder_step = 0;                    ///< rad, of robust_ledger; 0: exact
  std::optional<double> most_acceleration{};  ///< rad/s², of bounded_acceleration
  std::optional<double> shaping_stiffness{};  ///< N·m/rad, of shaping
  double damping = 0;                         ///< N·m·s/rad, of damper; 0: turning is not damped
  double contact = 0.005;                     ///< N·m; the damper takes a larger torque for a contact
};
/// Throws std::invalid_argument when the point lists a part that lacks its value for rotation.
WrenchPort::Config wrench_config(const LimiterConfig& point, const RotationLimits& rotation);

/// What a gripper's motor may do.
struct GripLimits {
  Friction friction{};   ///< N and N·s/m at the fingers: lower bounds
  double arm = 0;        ///< m, travel of the fingers for each radian of opening; > 0
  double max_force = 0;  ///< N, > 0
  double max_slew = std::numeric_limits<double>::infinity();  ///< N/s, > 0
};
/// The parts energy_cap, fading_contact, knee and latency_reserve of `point` hold for the gripper too; the others are about the
/// position. Its account is shared where that of `point` is, by a purse of its own.
GripPort::Config grip_config(const LimiterConfig& point, const GripLimits& grip);

/// What the memoryless limits leave of a wrench, and why: the first share s and then the second, s ≤ 1 the largest with
///
///     ‖s F‖ ≤ max_force,   ‖s τ‖ ≤ max_torque
///     ‖s (F − F_before)‖ ≤ max_slew · T,   ‖s (τ − τ_before)‖ ≤ max_torque_slew · T          (on the change)
struct LimitedWrench {
  Vec<6> wrench;
  Reasons reasons;
};
LimitedWrench saturate(const Vec<6>& wanted, double max_force, double max_torque) noexcept;
LimitedWrench limit_slew(const Vec<6>& wanted, const Vec<6>& before, double force_rate, double torque_rate,
                         Duration elapsed) noexcept;

/// Force first, then torque.
inline Vec<6> wrench_of(const Vec3& force, const Vec3& torque) noexcept {
  Vec<6> wrench;
  wrench << force, torque;
  return wrench;
}

}  // namespace tendon
