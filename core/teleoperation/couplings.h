// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/teleoperation/coupling.h"
#include "core/teleoperation/shares.h"

namespace tendon {

struct CoupledLeader {
  std::uint32_t channel = 0;  ///< the channel of the follower's device that receives the states of the leader
  double share = 1;           ///< initial α
};

/// Contains the couplings of one device: a single coupling, or one for each leader if a follower has 2 to 4 leaders.
///     F = Σ α_i (K (y_i − u_i) + D (ẏ_i − u̇_i) − B u̇_i)       at the follower
///     F_i = α_i (K (u_i − y_i) + D (u̇_i − ẏ_i) − B ẏ_i)        at leader i
/// In free motion x_f = Σ α_i x_i over the engaged leaders, where the α_i are divided by their sum. Each pair is a
/// coupling with α_i K, α_i D and α_i B, so its properties are those of a single pair (PositionPosition: α K ≤ 2 α
/// B/T_loop). If all leaders are engaged, the follower renders B once. With position-force, leader i feels α_i times
/// the contact force (core/PROOFS.md, "Coupling springs").
///
/// **Phases.** The phases, clutch, offsets and loss of the peer are separate for each coupling. A leader that is not
/// engaged does not contribute, and the other shares do not change unless set_share is called. The unused part is used
/// by a robot (`holds_place`) to hold its position.
///
/// **One account.** All couplings use the account of the device's limiter, one after the other, and each of them only
/// sees the remaining energy. This satisfies the condition of the theorem in energy_tank.h: before the bound, coupling
/// j gives ΔG_j ≤ max(A_j, 0) with A_j = A + Σ_{k≤j} R_k − Σ_{k<j} ΔG_k. Therefore Σ ΔG ≤ max(A + Σ R, 0), and only R
/// increases A. The limiter is called once, after all couplings. If α changes while a spring is stretched, the work ½
/// ΔK δ² is charged to the account, and the limiter reduces the force if there is not enough energy.
///
/// **Messages.** Each leader receives its part of the account and of the need: α_i A and α_i n. The ratio A/n, which
/// determines the payments, is the same for all leaders. If each leader received the entire need, each would send all
/// of the missing energy. With 2 to 4 leaders that pushed together, this transferred 7 to 17 % more energy without a
/// larger force. This does not affect the guarantees.
///
/// **Trust.** Each peer has its own tank with max_power and max_account. If n peers are dishonest, this port still
/// guarantees that L ≥ −n (max_account + max_power · t).
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class Couplings {
 public:
  static constexpr std::size_t kMost = Shares::kMost;

  /// `leaders` is empty for a single coupling. Otherwise, it must contain 2 … kMost leaders, and each `config` must
  /// only couple positions. Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit Couplings(const Coupling::Config& config, std::span<const CoupledLeader> leaders = {});

  std::size_t size() const noexcept { return all_.size(); }
  /// To call receive, engage, disengage, conclude, and message of one coupling.
  Coupling& operator[](std::size_t which) noexcept { return all_[which]; }
  const Coupling& operator[](std::size_t which) const noexcept { return all_[which]; }

  /// Takes effect with the next period (Shares).
  void set_share(std::size_t which, double share) noexcept { shares_.set(which, share); }

  // These functions call Coupling for all couplings. The result of `settle` is the sum of all settlements.
  void observe(const Interval<3>& interval, double payable) noexcept;
  Demand<3> command(const Motion& hand, std::uint32_t buttons, bool ready,
                    const HandleSample* handle = nullptr) noexcept;
  const Vec3& torque() const noexcept { return all_.front().torque(); }
  double grip_force() const noexcept { return all_.front().grip_force(); }
  void command_unseen(LocalTime now, bool ready) noexcept;
  EnergyTank::Settlement settle_grip(double payable, double loss, Duration elapsed) noexcept {
    return all_.front().settle_grip(payable, loss, elapsed);
  }
  EnergyTank::Settlement settle(double payable, double loss, Duration elapsed) noexcept;
  const EnergyTank::Settlement& settled(std::size_t which) const noexcept { return settled_[which]; }
  bool live() const noexcept;  ///< at least one coupling is live

 private:
  void share(LocalTime now) noexcept;

  std::vector<Coupling> all_;
  Shares shares_;
  std::array<EnergyTank::Settlement, kMost> settled_{};
  LocalTime now_{};
  bool began_ = false;
};

}  // namespace tendon
