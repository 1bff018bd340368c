// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/compensated_sum.h"
#include "core/control/stability_controller.h"

namespace tendon {

/// The message that one port sends to another about its account. These messages can be rare, late, duplicated or
/// reordered. All energies are in joules of the sender.
struct EnergyTankMessage {
  std::uint64_t epoch = 0;          ///< epoch of the sender, or 0 if there is no message
  std::uint64_t answers_epoch = 0;  ///< epoch of the receiver for `given` and `taken`, or 0 if not known
  std::uint64_t sequence = 0;       ///< 1, 2, … within an epoch
  double account = 0;               ///< J, A after giving; ± kMostAccount
  double need = 0;                  ///< J, n; 0 … kMostAccount
  double given = 0;  ///< J, G, total given to the receiver; cannot decrease within the two epochs; ≤ kMostTotal
  double taken = 0;  ///< J, R, total of the receiver as known by the sender, in joules of the receiver; ≤ kMostTotal

  static constexpr double kMostAccount = 1e3;
  static constexpr double kMostTotal = 1e6;
};

/// An energy tank (Franken et al.) for one of several coupled ports that exchange energy. The ports are passive
/// together, although each of them may generate net energy.
///
/// If two coupled devices have a limiter each, each is passive **by itself**, but the follower cannot move because it
/// must not do net work. It is sufficient if the sum of all ports is passive. Each port therefore gives energy from its
/// account to the others. Its limiter uses this account instead of its own ledger. Port i has
///     L_i       its ledger (EnergyLedger), with the applied force
///     G_ij      the total given to j;    R_ji the largest received G_ji
///     A_i = L_i − Σ_j G_ij + Σ_j R_ji − discarded_i          the account: Limiter::energy
/// and per period, in this order: **observe** the interval, **add** and **give** energy (share()), **limit** the force.
///
/// **Theorem** (core/PROOFS.md, "Energy tank"). If each port gives 0 ≤ ΔG_ij with Σ_j ΔG_ij ≤ max(A_i, 0) before it
/// limits its force, then A_i ≥ 0 at all times at each port, and Σ_i L_i ≥ 0: together the ports do not generate
/// energy, for every delay, loss, order, duplication, pause and motion. Proof. The limiter requires that only observed
/// work and R increase A_i (core/PROOFS.md, "Output bound"). Giving keeps A_i ≥ 0 and is done before the bound. R_ij ≤
/// G_ij, because totals do not decrease and only the largest received one is used. So Σ L_i = Σ A_i + Σ (G_ij − R_ij) +
/// Σ discarded_i ≥ 0, because each term is ≥ 0. ∎ The theorem requires no common clock, no acknowledgement and no
/// retransmission. It is assumed that all holds are at most T_max long (see OutputBound for longer holds). Several
/// tanks can use the same account one after the other if `payable` is the remaining energy (Couplings), which satisfies
/// the condition.
///
/// **Amount.** The ports equalize the ratio of account to need, and count the energy in transit:
///     n_i = ℓ_i(F_wanted) + ε          ℓ: SharesAccount::worst_loss;  ε > 0, so that a port at rest can start to move
///     Â_j = A_j(received) + G_ij − R_ij(received)
///     ΔG_ij = (ρ n_j − Â_j)₊,     ρ = (A_i + Σ Â_j) / (n_i + Σ n_j)    over i and the peers that receive energy
/// For one peer this is (A_i n_j − Â_j n_i)₊/(n_i + n_j). If the sum exceeds max(A_i, 0) because a received account is
/// negative, all amounts are reduced in proportion. Nothing is given without a message, or if `giving` is false.
///
/// **Scales.** With x_f = s_x x_l and F_l = s_f F_f, one joule of the leader is s_x/s_f joules of the follower.
/// `joule`, that of the **peer**, is s_f/s_x at the leader and s_x/s_f at the follower: W_l + (s_f/s_x) W_f ≥ 0.
///
/// **Changes of the scales.** Energy that was given at one value must not be credited at a higher one, and an account
/// must not become more valuable for the peer. Therefore, a port that changes `joule` (revalue) discards the energy in
/// transit until the peer knows the new value. If (s_f/s_x) A has increased, the follower discards this increase. A
/// change of the scales therefore never increases the sum of the accounts in joules of the leader.
///
/// **Epochs.** The totals are lost if a port restarts. Its new tank must have an epoch above all previous ones (a
/// persistent counter, or the time of day at the start; clocks of two machines are not compared). Totals belong to a
/// pair of epochs. A higher epoch of the peer resets both totals. Messages of a lower epoch, and totals for another
/// epoch of this port, are ignored. No total is therefore counted twice. Energy in transit is lost, which is safe.
///
/// **Trust.** The sum is ≥ 0 if the accounts of the peers are correct. If they are not, this port can still ensure that
/// L ≥ −(max_account + max_power · t). Received energy is only credited up to an allowance, which is initially
/// max_account and increases by max_power and by the given energy up to max_account. The remaining energy is discarded.
/// The part of an account above max_account is also discarded. This is safe (core/PROOFS.md, "Discarded credit").
///
/// **Bad input.** A message is refused and counted in `refused` if a value is not finite or out of bounds, if `taken`
/// exceeds the given total, or if a total decreases although its sequence increases. Messages are ignored if they are
/// not newer. If a value of the period is not finite, nothing is given or credited.
///
/// Source: derived here; related to the two-layer tank (Franken et al. 2011) and energy-reflecting TDPA (Ryu et al.
/// 2010).
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
class EnergyTank {
 public:
  static constexpr std::size_t kMostPeers = 3;

  struct Config {
    std::size_t peers = 1;                             ///< 1 … kMostPeers
    std::array<double, kMostPeers> joule = {1, 1, 1};  ///< value of one joule of each peer at this port; 1e-6 … 1e6
    double start = 0.2e-3;                             ///< ε, J; > 0
    double max_power = 2;                              ///< W, > 0
    double max_account = 0.2;                          ///< J, > 0 … kMostAccount
    std::uint64_t epoch = 1;                           ///< > 0; larger than all previous epochs of this port
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit EnergyTank(const Config& config);

  /// May be called at any time before settle(). Does nothing unless peer < Config::peers.
  void receive(std::size_t peer, const EnergyTankMessage& message) noexcept;

  /// Resets all peers, so that any epoch is accepted, and starts a higher epoch. Energy in transit is lost.
  void renew(std::uint64_t epoch) noexcept;

  /// Sets the value of a joule of the peer and ε. Energy received but not credited is lost, as its value is unknown.
  void revalue(std::size_t peer, double joule, double start) noexcept;
  /// Discards received energy that was given by the peer before it knew about the change.
  void forgo(std::size_t peer) noexcept;

  /// Once per period, after the interval was observed and before the force is limited.
  struct Period {
    double payable = 0;  ///< J, SharesAccount::payable
    double loss = 0;     ///< J, ℓ of the requested force; can be +∞
    Duration elapsed{};  ///< length of the previous interval
    bool giving = true;  ///< false if clutched or not engaged; received energy is still added
  };
  /// J, ≥ 0. The limiter must apply `credit` first.
  struct Settlement {
    double credit = 0;
    double withdraw = 0;
  };
  Settlement settle(const Period& period) noexcept;

  /// Returns the next message to a peer after settle(), with its own sequence. The epoch is 0 if there is no such peer.
  EnergyTankMessage message(std::size_t peer) noexcept;

  double account() const noexcept { return account_; }              ///< A after the last settle, J
  double need() const noexcept { return need_; }                    ///< n in the last settle, J
  double discarded() const noexcept { return discarded_.value(); }  ///< total, J
  std::uint64_t refused() const noexcept { return refused_; }       ///< number of messages
  double given(std::size_t peer) const noexcept;                    ///< G, J, in the current epochs
  double taken(std::size_t peer) const noexcept;                    ///< R, J of the peer, in the current epochs

 private:
  struct Peer {
    std::uint64_t epoch = 0;
    std::uint64_t sequence = 0;
    double account = 0;   ///< J of the peer
    double need = 0;      ///< J of the peer, or 0 if not known
    double heard = 0;     ///< R, J of the peer
    double credited = 0;  ///< part of R, J of the peer
    double given = 0;     ///< G, J of this port
    double arrived = 0;   ///< part of G known to the peer
    std::uint64_t sent = 0;
  };

  double take() noexcept;
  double give(double account, double need) noexcept;

  Config config_;
  std::array<Peer, kMostPeers> peers_;
  double allowance_;  ///< J that may be credited
  double account_ = 0;
  double need_ = 0;
  CompensatedSum discarded_;
  std::uint64_t refused_ = 0;
};

/// Adds and gives energy. This must be called between `observe` and `limit`. `wanted` is the argument of `limit`.
template <int N, class Law>
requires SharesAccount<Law, N>
void share(EnergyTank& tank, Law& law, const Vec<N>& wanted, Duration elapsed, bool giving = true) noexcept {
  const auto settlement = tank.settle({law.payable(), law.worst_loss(wanted), elapsed, giving});
  law.credit(settlement.credit);
  law.withdraw(settlement.withdraw);
}

}  // namespace tendon
