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

/// One of several leaders of a follower.
struct CoupledLeader {
  std::uint32_t channel = 0;  ///< of the follower's device, by which its states come
  double share = 1;           ///< α at first
};

/// The couplings of one device: one, or of a follower one for each of 2 … 4 leaders. It is the centre of a star: each
/// leader is an ordinary leader, which knows nothing of the others and talks to the follower only.
///
///     F = Σ α_i (K (y_i − u_i) + D (ẏ_i − u̇_i) − B u̇_i)       at the follower
///     F_i = α_i (K (u_i − y_i) + D (u̇_i − ẏ_i) − B ẏ_i)        at leader i
///
/// so that in free motion x_f = Σ α_i x_i over the leaders that are engaged, their α_i over their sum. Each pair is a
/// pair of α_i K, α_i D and α_i B: all that is said of one pair holds of each (PositionPosition: α K ≤ 2 α B/T_loop).
/// With all leaders engaged the follower renders B once. By position-force leader i feels α_i times the contact.
///
/// **Each engages by its own act**, clutches, falls silent and is lost by itself; its own offsets make that nothing
/// moves. A leader that is not engaged counts for nothing: its spring is absent, and the springs of the others do not
/// grow. Whoever wants them to grow moves the share (set_share). A robot (`holds_place`) holds its place as far as no
/// leader has it.
///
/// **One account.** All couplings pay and are paid from the one account of the device's limiter, one after the other:
/// each sees what those before it have left. That is what the theorem of purse.h asks for. Before the bound coupling
/// j gives ΔG_j ≤ max(A_j, 0), A_j = A + Σ_{k≤j} R_k − Σ_{k<j} ΔG_k. So a gift never takes the account below zero, and
/// an account that is below zero gives nothing: Σ ΔG ≤ max(A + Σ R, 0), and nothing in between raises A but R. The
/// force is limited once, after all of them. A move of α under stretch, which costs ½ ΔK δ², is work that this account
/// or that of the leader pays when it is felt, like any other work of a spring; where there is none, the limiter
/// leaves less of the force.
///
/// **What a leader is told** of the account and of the need is its part, α_i A and α_i n. The ratio A/n, by which the
/// ports give, is the same for all; but leaders that were each told the whole need would each send what is missing, and
/// the follower would send some of it back: 2 … 4 leaders that press together sent 7 … 17 % more to and fro, and felt
/// no more. It is a matter of balance: no promise depends on it.
///
/// **Trust.** Each peer has a purse of its own, with max_power and max_account of its own: against n peers that lie the
/// port alone keeps L ≥ −n (max_account + max_power · t).
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class Couplings {
 public:
  static constexpr std::size_t kMost = Shares::kMost;

  /// `leaders`: empty for one coupling, else 2 … kMost, each by the same `config`, which then couples positions only.
  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Couplings(const Coupling::Config& config, std::span<const CoupledLeader> leaders = {});

  std::size_t size() const noexcept { return all_.size(); }
  /// Returns a coupling. Callers use receive, engage, disengage, conclude, and message.
  Coupling& operator[](std::size_t which) noexcept { return all_[which]; }
  const Coupling& operator[](std::size_t which) const noexcept { return all_[which]; }

  /// From the next period on it goes to `share` (Shares).
  void set_share(std::size_t which, double share) noexcept { shares_.set(which, share); }

  // As those of Coupling, in its order, for all of them.
  void observe(const Interval<3>& interval, double payable) noexcept;
  Demand<3> command(const Motion& hand, std::uint32_t buttons, bool ready,
                    const HandleSample* handle = nullptr) noexcept;
  const Vec3& torque() const noexcept { return all_.front().torque(); }
  double grip_force() const noexcept { return all_.front().grip_force(); }
  void command_unseen(LocalTime now, bool ready) noexcept;
  Purse::Settlement settle_grip(double payable, double loss, Duration elapsed) noexcept {
    return all_.front().settle_grip(payable, loss, elapsed);
  }
  /// The sum of what they settled.
  Purse::Settlement settle(double payable, double loss, Duration elapsed) noexcept;
  /// In the newest period, of one of them.
  const Purse::Settlement& settled(std::size_t which) const noexcept { return settled_[which]; }
  bool live() const noexcept;  ///< one of them is

 private:
  void share(LocalTime now) noexcept;

  std::vector<Coupling> all_;
  Shares shares_;
  std::array<Purse::Settlement, kMost> settled_{};
  LocalTime now_{};  ///< of the newest period
  bool began_ = false;
};

}  // namespace tendon
