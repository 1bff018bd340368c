// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <vector>

namespace tendon::injector {

/// A hidden Markov chain with its statistics in closed form, the oracle of every loss model. In state i a datagram is
/// lost with probability loss[i]; the chain then goes to j with probability step[i][j]. Every state must be reachable
/// from every other. Thread-safe: yes, once made.
struct LossChain {
  std::vector<std::vector<double>> step;
  std::vector<double> loss;

  static LossChain bernoulli(double p);
  /// Loss rate `loss` in bursts of `mean_burst` datagrams: Gilbert 1960 with r = 1 / mean_burst, p = r · loss / (1 −
  /// loss), as WebRTC's SimulatedNetwork.
  static LossChain burst(double loss, double mean_burst);
  /// Gilbert and Elliott: p = P(good → bad), r = P(bad → good), and the loss probability in each state (netem's `loss
  /// gemodel`).
  static LossChain gilbert(double p, double r, double loss_in_bad, double loss_in_good);
  /// netem's `loss state` (Salsano et al. 2012): 1 received in a gap, 2 received in a burst, 3 lost in a burst, 4 lost
  /// alone in a gap, followed by 1.
  static LossChain four_state(double p13, double p31, double p32, double p23, double p14);

  /// Bursts of Pareto-II lengths, P(L ≥ k) = (1 + k/scale)^−shape, below `longest`, each followed by one datagram that
  /// passes (ParetoBurstLoss). A state consists of the state of the model and the number of datagrams left
  /// in the burst.
  static LossChain pareto_bursts(double p12, double p21, const std::array<double, 2>& shape,
                                 const std::array<double, 2>& scale, std::size_t longest);

  /// A continuous-time Markov chain sampled every `period`: state i lasts for an exponential time of mean dwell[i]; all
  /// others are equally likely successors. step = exp(Q · period), exactly, including changes between two samples.
  static LossChain regimes(const std::vector<double>& dwell, double period, std::vector<double> loss);

  /// Stationary distribution: π = π · step.
  std::vector<double> shares() const;

  /// Loss rate: Σ π_i loss_i.
  double rate() const;

  /// Ratio of the variance of the number of losses to that of independent losses with the same rate:
  ///     1 + 2 Σ_k cov(lost₀, lost_k) / var(lost₀)
  double variance_factor() const;

  /// Probabilities of burst lengths 1, 2, … `longest` − 1, and finally of `longest` or more:
  ///     P(L ≥ k) = α (S D)^(k−1) 1,   α ∝ π (1 − D) S D,   S = step, D = diag(loss)
  std::vector<double> bursts(std::size_t longest) const;

  /// The smallest m for which the initial states of every m-th burst depend on each other by less than 1e-3, so that
  /// their lengths can be tested as independent. 1: all bursts.
  std::size_t bursts_to_forget() const;
};

}  // namespace tendon::injector
