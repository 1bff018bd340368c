// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "tests/tools/injector/models/draws.h"
#include "tests/tools/injector/models/quantile_table.h"
#include "tests/tools/injector/profile/profile.h"

namespace tendon::injector {

/// Decides which datagrams are lost, by the models of Loss (profile.h). Random loss compares the first draw with p, so
/// a higher p loses a superset of the datagrams. The others are Markov chains. Thread-safe: no.
class LossModel {
 public:
  /// `event` and `state` are the purposes of its two draws.
  LossModel(const Loss& loss, Purpose event, Purpose state);

  /// Must be called for each datagram, lost or not, because it advances the chain.
  bool lost(const Draws& draws, std::uint64_t index) noexcept;

  /// Takes over the state of `before` if that is a chain of the same kind.
  void continue_from(const LossModel& before) noexcept;

 private:
  static constexpr std::uint8_t kUnborn = 255;
  enum class Kind : std::uint8_t { kNever, kRandom, kTwoState, kFourState, kPattern, kBursts };

  bool in_burst(const Draws& draws, std::uint64_t index) noexcept;

  Purpose event_;
  Purpose state_draw_;
  Kind kind_ = Kind::kNever;
  Chance random_{0};
  /// Cumulative probabilities that the next state is 0, at most 1, at most 2; otherwise it is 3.
  using Row = std::array<Chance, 3>;
  static constexpr Chance kNo = Chance(0);
  static constexpr Chance kSure = Chance(1);
  std::array<Chance, 4> loss_in_{kNo, kNo, kNo, kNo};
  std::array<Row, 4> rows_{Row{kNo, kNo, kNo}, {kNo, kNo, kNo}, {kNo, kNo, kNo}, {kNo, kNo, kNo}};
  Row stationary_{kNo, kNo, kNo};
  std::uint8_t state_ = kUnborn;
  std::vector<bool> pattern_;
  std::vector<QuantileTable> lengths_;  ///< burst lengths in units of 2⁻¹⁶ datagrams, indexed by state
  std::int64_t burst_ = -1;  ///< number of datagrams left in the burst; negative if the next one starts a burst
};

}  // namespace tendon::injector
