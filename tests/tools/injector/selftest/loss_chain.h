// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

namespace tendon::injector {

/// A hidden Markov chain of losses, and in closed form what it does in the long run: the oracle for every loss model,
/// for each of them is such a chain. In state i a datagram is lost with probability loss[i]; then, before the next one,
/// the chain goes to j with probability step[i][j]. Every state must be reachable from every other.
///
/// Thread-safe: yes, once made.
struct LossChain {
  std::vector<std::vector<double>> step;
  std::vector<double> loss;

  /// Each datagram for itself with probability p.
  static LossChain bernoulli(double p);
  /// A share `loss` of all in bursts of `mean_burst` datagrams: Gilbert 1960 with r = 1 / mean_burst,
  /// p = r · loss / (1 − loss), as WebRTC's SimulatedNetwork has it.
  static LossChain burst(double loss, double mean_burst);
  /// Gilbert and Elliott: p = P(good → bad), r = P(bad → good), and what is lost in either state. (netem's `loss
  /// gemodel`.)
  static LossChain gilbert(double p, double r, double loss_in_bad, double loss_in_good);
  /// netem's `loss state` (Salsano et al. 2012): 1 received in a gap, 2 received in a burst, 3 lost in a burst, 4 lost
  /// alone in a gap, after which always 1.
  static LossChain four_state(double p13, double p31, double p32, double p23, double p14);

  /// A Markov chain in continuous time, looked at every `period`: state i lasts for an exponential time of mean
  /// dwell[i], then each of the others follows with the same probability. step = exp(Q · period), exactly, with the
  /// changes that happen between two looks.
  static LossChain regimes(const std::vector<double>& dwell, double period, std::vector<double> loss);

  /// Shares of time in the states: π = π · step.
  std::vector<double> shares() const;

  /// Share of all datagrams that is lost: Σ π_i loss_i.
  double rate() const;

  /// By how much the variance of the number lost among many exceeds that of independent losses of the same rate:
  ///     1 + 2 Σ_k cov(lost₀, lost_k) / var(lost₀)
  double variance_factor() const;

  /// Probabilities that a burst of losses has exactly 1, 2, … `longest` − 1 datagrams, and, last, `longest` or more:
  ///     P(L ≥ k) = α (S D)^(k−1) 1,   α ∝ π (1 − D) S D,   S = step, D = diag(loss)
  std::vector<double> bursts(std::size_t longest) const;

  /// Every how many bursts must one be taken so that the state in which it begins says less than 1e-3 about the state
  /// in which the next taken one begins? Those lengths can be tested as independent ones. 1: they all can.
  std::size_t bursts_to_forget() const;
};

}  // namespace tendon::injector
