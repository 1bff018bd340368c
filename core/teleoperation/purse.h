// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>

#include "core/base/compensated_sum.h"
#include "core/control/stability_controller.h"

namespace tendon {

/// What one port tells another about its account. It may be sent as seldom as one likes, late, twice, in any order.
/// Every J is the sender's.
struct PurseMessage {
  std::uint64_t epoch = 0;          ///< of the sender; 0: no message
  std::uint64_t answers_epoch = 0;  ///< the receiver's epoch that `given` and `taken` belong to; 0: not heard yet
  std::uint64_t sequence = 0;       ///< 1, 2, … within an epoch
  double account = 0;               ///< J, A after giving; ± kMostAccount
  double need = 0;                  ///< J, n; 0 … kMostAccount
  double given = 0;  ///< J, G: total given to the receiver; never falls within the two epochs; ≤ kMostTotal
  double taken = 0;  ///< J, R: the receiver's total that was heard of, in the receiver's joules; ≤ kMostTotal

  static constexpr double kMostAccount = 1e3;
  static constexpr double kMostTotal = 1e6;
};

/// Ports that pay each other: together passive, each for itself able to do net work.
///
/// A limiter at each of two coupled devices makes each of them passive **by itself**. A follower that may do no net
/// work cannot even move. Only the sum of all ports must be passive. So each port gives the others energy out of its
/// own account, and its limiter bounds its force by that account in place of its own ledger. Port i has
///
///     L_i       its ledger (EnergyLedger), with the force that was really applied
///     G_ij      the total that it has given to j;    R_ji the largest G_ji that it has heard of from j
///     A_i = L_i − Σ_j G_ij + Σ_j R_ji − discarded_i          the account: Limiter::energy
///
/// and in each period, in this order: **book** the interval, **add** what came, **give**, **limit** the force. share()
/// does the middle two.
///
/// **Theorem.** If every port gives 0 ≤ ΔG_ij with Σ_j ΔG_ij ≤ max(A_i, 0) before it limits its force, then A_i ≥ 0 for
/// ever at every port, and Σ_i L_i ≥ 0: the ports together give out nothing that was not put in, for every delay, loss,
/// order, duplication, pause and motion.
/// Proof. The step of the limiter needs only that A_i rises by nothing but booked work and R (OutputBound, Theorem 1);
/// giving leaves A_i ≥ 0 and comes before the bound, so the bound knows of it. R_ij ≤ G_ij, because totals never fall
/// and only the largest that was heard counts. So Σ L_i = Σ A_i + Σ (G_ij − R_ij) + Σ discarded_i ≥ 0, term by term. ∎
/// It needs no common clock, no acknowledgement, nothing sent again. It holds while no hold is longer than T_max; a
/// longer one costs what OutputBound says.
/// Several purses may settle for one account, one after the other, each with what is left of it as `payable`
/// (Couplings): what they give in a period is then bounded as the theorem asks.
///
/// **What is given** brings the accounts to one ratio of account to need, what is under way counted in:
///
///     n_i = ℓ_i(F_wanted) + ε          ℓ: SharesAccount::worst_loss;  ε, so that somebody at rest has a start
///     Â_j = A_j(told) + G_ij − R_ij(told)
///     ΔG_ij = (ρ n_j − Â_j)₊,     ρ = (A_i + Σ Â_j) / (n_i + Σ n_j)    over i and the peers that are given something
///
/// which for one peer is (A_i n_j − Â_j n_i)₊/(n_i + n_j). If the sum exceeds max(A_i, 0) (an account told below zero),
/// all are cut in proportion. Nothing is given to a peer that has not been heard, or while `giving` is false.
///
/// **Scales.** With x_f = s_x x_l and F_l = s_f F_f one joule of the leader is s_x/s_f joules at the follower: the
/// leader's `joule` is s_f/s_x and the follower's s_x/s_f, each the worth of one of the **peer's** joules here. Then
/// W_l + (s_f/s_x) W_f stays ≥ 0.
///
/// **Scales that change.** A joule that was given at one worth must not be credited at a higher one, and an account
/// must not be worth more to a peer than when it was filled. So whoever changes `joule` (revalue) forgoes what is under
/// way until the peer tells that it knows, and the follower gives up the part of its account by which (s_f/s_x) A has
/// grown: in the leader's joules no change of scale raises the sum of the accounts.
///
/// **Epochs.** A port that starts anew has forgotten what it gave and took; its new purse has an epoch above all that
/// it had before (a counter that survives, or the time of day at the start: no two machines' are compared). Totals
/// belong to a pair of epochs. A peer's higher epoch voids both totals of the pair; messages of a lower one, and totals
/// that answer another epoch than ours, are passed over. So no total is counted twice, whatever arrives late. Energy
/// that was under way is lost, which is safe.
///
/// **Trust.** The sum is ≥ 0 while the peers keep their accounts honestly. Against one that does not, this port alone
/// keeps L ≥ −(max_account + max_power · t): what came is credited up to an allowance, at first max_account, that rises
/// by max_power (and by what we give) up to max_account; the rest is discarded. An account above max_account is
/// discarded down to it, too, whoever earned it. To discard is always safe.
///
/// **Bad input.** A message with a value that is not finite or out of its bounds, a `taken` above what was given, or a
/// total that falls although its sequence rises, changes nothing and is counted in `refused`. One that is no newer
/// than the newest is passed over. A period's values that are not finite give and credit nothing.
///
/// Cost, with PositionPosition: 85 ns a period beside one peer (README).
///
/// Source: derived here; related to the two-layer tank (Franken et al. 2011) and energy-reflecting TDPA (Ryu et al.
/// 2010).
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class Purse {
 public:
  static constexpr std::size_t kMostPeers = 3;

  struct Config {
    std::size_t peers = 1;                             ///< 1 … kMostPeers
    std::array<double, kMostPeers> joule = {1, 1, 1};  ///< what one joule of each peer is worth here; 1e-6 … 1e6
    double start = 0.2e-3;                             ///< ε, J; > 0
    double max_power = 2;                              ///< W, > 0
    double max_account = 0.2;                          ///< J, > 0 … kMostAccount
    std::uint64_t epoch = 1;                           ///< > 0; above every one that this port had before
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit Purse(const Config& config);

  /// At any time before settle(); peer < Config::peers, else nothing happens.
  void receive(std::size_t peer, const PurseMessage& message) noexcept;

  /// Forgets all peers, whose next message may be of any epoch, and begins an epoch of its own: above every one before,
  /// so that no total of before counts again. Energy that was under way is lost.
  void renew(std::uint64_t epoch) noexcept;

  /// One joule of the peer is worth `joule` here from now on, and ε is `start`. What it has given and is not credited
  /// yet is lost, because nobody knows at which worth it was given.
  void revalue(std::size_t peer, double joule, double start) noexcept;
  /// The same, of what a message told that the peer made before it knew of that.
  void forgo(std::size_t peer) noexcept;

  /// Once in each period, after the interval was booked and before the force is limited.
  struct Period {
    double payable = 0;  ///< J, SharesAccount::payable
    double loss = 0;     ///< J, ℓ of the force that is wanted; +∞ is allowed
    Duration elapsed{};  ///< length of the interval that has just ended
    bool giving = true;  ///< false: clutched or not engaged; what comes is still added
  };
  /// J ≥ 0, for the limiter: credit first, then withdraw.
  struct Settlement {
    double credit = 0;
    double withdraw = 0;
  };
  Settlement settle(const Period& period) noexcept;

  /// What to send to a peer after settle(), or empty epoch (0) for a peer that is none. Each call has a sequence of its
  /// own.
  PurseMessage message(std::size_t peer) noexcept;

  double account() const noexcept { return account_; }              ///< A after the last settle, J
  double need() const noexcept { return need_; }                    ///< n at the last settle, J
  double discarded() const noexcept { return discarded_.value(); }  ///< J so far
  std::uint64_t refused() const noexcept { return refused_; }       ///< messages
  double given(std::size_t peer) const noexcept;                    ///< G, J, of the present epochs
  /// R, in the peer's joules, of the present epochs.
  double taken(std::size_t peer) const noexcept;

 private:
  struct Peer {
    std::uint64_t epoch = 0;
    std::uint64_t sequence = 0;
    double account = 0;   ///< J of the peer
    double need = 0;      ///< J of the peer; 0: nothing heard
    double heard = 0;     ///< R, J of the peer
    double credited = 0;  ///< of R
    double given = 0;     ///< G, J of ours
    double arrived = 0;   ///< of G, as it told
    std::uint64_t sent = 0;
  };

  double take() noexcept;
  double give(double account, double need) noexcept;

  Config config_;
  std::array<Peer, kMostPeers> peers_;
  double allowance_;  ///< J that may be credited now
  double account_ = 0;
  double need_ = 0;
  CompensatedSum discarded_;
  std::uint64_t refused_ = 0;
};

/// Adds what came and gives, between `observe` and `limit` of a period: `wanted` is the force that `limit` will get.
template <int N, class Law>
requires SharesAccount<Law, N>
void share(Purse& purse, Law& law, const Vec<N>& wanted, Duration elapsed, bool giving = true) noexcept {
  const auto settlement = purse.settle({law.payable(), law.worst_loss(wanted), elapsed, giving});
  law.credit(settlement.credit);
  law.withdraw(settlement.withdraw);
}

}  // namespace tendon
