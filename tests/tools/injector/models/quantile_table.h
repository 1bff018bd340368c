// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace tendon::injector {

/// An inverse cumulative distribution in integers, from 64 uniform bits to an integer (nanoseconds). It is a chain of
/// linear pieces, which map draws u in [from, next from) to
///
///     least + ⌊width · (u − from)/(next from − from)⌋        in least … least + width − 1
///
/// This takes one multiplication and no floating point. Piecewise linear distributions (constant, uniform, histograms,
/// samples) are exact; tabulate() approximates smooth ones.
///
/// Thread-safe: yes, once built.
class QuantileTable {
 public:
  struct Piece {
    std::uint64_t from = 0;   ///< 0 for the first piece, then strictly increasing; the last piece ends at 2⁶⁴
    std::int64_t least = 0;   ///< |least| below 2⁵⁵
    std::uint64_t width = 1;  ///< 1…2³⁷ − 1
    bool operator==(const Piece&) const = default;
  };

  /// `pieces` must have the ranges stated in Piece and 1…2²⁰ elements.
  explicit QuantileTable(const std::vector<Piece>& pieces);

  std::int64_t operator()(std::uint64_t u) const noexcept;

  bool constant() const noexcept { return pieces_.size() == 1 && pieces_.front().slope == 0; }

  /// FNV-1a of the pieces, for the trace. The decisions are identical if the hashes of the tables are equal.
  std::uint64_t hash() const noexcept;

 private:
  struct Compiled {
    std::uint64_t from;
    std::uint64_t slope;           ///< ⌊width · 2⁹⁰/(length · 2^shift)⌋; 0 for width 1
    std::int64_t least_and_shift;  ///< least · 64 + shift, where shift is the number of leading zeros of the length
  };
  std::vector<Compiled> pieces_;
  /// Lookup table for the leading bits of u. Contains the index of the last piece that starts at or before the value.
  std::vector<std::uint32_t> guide_;
  int guide_shift_ = 0;
};

/// 4096 equal cells; the outer 16 on either side are subdivided into 16 cells for each halving of the tail probability,
/// down to 2⁻⁴⁰ (9e-13), where the table ends. The error is below 5e-4 of the distance over which the tail falls by a
/// factor of e, both in the tails and in the middle.
///
/// `quantile(p, q)`, for the probability p below and q = 1 − p above (the smaller one is exact), must increase with p.
/// Its values are clamped to least…most and rounded to integers.
QuantileTable tabulate(const std::function<double(double p, double q)>& quantile, std::int64_t least,
                       std::int64_t most);

}  // namespace tendon::injector
