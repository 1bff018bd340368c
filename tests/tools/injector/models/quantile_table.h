// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <vector>

namespace tendon::injector {

/// The inverse of a cumulative distribution in integers: 64 uniform bits in, a whole number (of nanoseconds) out. It is
/// a chain of straight pieces: draws u in [from, next from) map to
///
///     least + ⌊width · (u − from)/(next from − from)⌋        so to least … least + width − 1
///
/// which takes one multiplication, and no floating point. Distributions that are straight in truth (constant,
/// uniform, histograms, samples) are exact; tabulate() cuts smooth ones into pieces.
///
/// Thread-safe: yes, once built.
class QuantileTable {
 public:
  struct Piece {
    std::uint64_t from = 0;  ///< the first piece has 0, the others more than the one before; the last goes on to 2⁶⁴
    std::int64_t least = 0;   ///< |least| below 2⁵⁵
    std::uint64_t width = 1;  ///< 1…2³⁷ − 1
    bool operator==(const Piece&) const = default;
  };

  /// `pieces` must be as said above, 1…2²⁰ of them.
  explicit QuantileTable(const std::vector<Piece>& pieces);

  std::int64_t operator()(std::uint64_t u) const noexcept;

  /// The same for every draw.
  bool constant() const noexcept { return pieces_.size() == 1 && pieces_.front().slope == 0; }

  /// FNV-1a of the pieces, for the trace: two tables with the same hash decide alike.
  std::uint64_t hash() const noexcept;

 private:
  struct Compiled {
    std::uint64_t from;
    std::uint64_t slope;           ///< ⌊width · 2⁹⁰/(length · 2^shift)⌋; 0 for width 1
    std::int64_t least_and_shift;  ///< least · 64 + shift: the leading zeros of the length
  };
  std::vector<Compiled> pieces_;
  /// For each value of the leading bits of u: the last piece that begins at or before it. Then few are left to search.
  std::vector<std::uint32_t> guide_;
  int guide_shift_ = 0;
};

/// A smooth quantile function as a table: 4096 equal cells, of which the outer 16 on either side are cut anew into 16
/// cells for each halving of the tail, down to 2⁻⁴⁰ (9e-13) where it ends. The error against the function is then below
/// 5e-4 of the distance over which the tail falls by e, far out as well as in the middle.
///
/// `quantile(p, q)` gets the share p below and q = 1 − p above (the smaller is exact) and must rise with p. Its values
/// are cut to least…most and rounded to whole numbers.
QuantileTable tabulate(const std::function<double(double p, double q)>& quantile, std::int64_t least,
                       std::int64_t most);

}  // namespace tendon::injector
