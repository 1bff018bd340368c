// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/quantile_table.h"

#include <algorithm>
#include <bit>
#include <iterator>

#include "tests/tools/injector/models/exact_math.h"
#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {
namespace {

constexpr int kBodyBits = 12;
constexpr int kTailFrom = 8;     // from a tail probability of 2⁻⁸
constexpr int kTailTo = 40;      // down to 2⁻⁴⁰
constexpr int kTailCells = 16;   // for each halving of the tail probability
constexpr int kSlopeScale = 26;  // the bits left by a width below 2³⁷ and a normalized length of 2⁶³
constexpr std::size_t kMaxGuideBits = 13;

}  // namespace

QuantileTable::QuantileTable(const std::vector<Piece>& pieces) {
  pieces_.reserve(pieces.size());
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    const Piece& piece = pieces[i];
    const std::uint64_t last = i + 1 < pieces.size() ? pieces[i + 1].from - 1 : ~std::uint64_t{0};
    const int shift = std::min(63, std::countl_zero(last - piece.from));
    const Uint128 length = (Uint128{last - piece.from} + 1) << shift;  // 2⁶³ … 2⁶⁴
    const auto slope = static_cast<std::uint64_t>((Uint128{piece.width} << (64 + kSlopeScale)) / length);
    pieces_.push_back({piece.from, piece.width == 1 ? 0 : slope, piece.least * 64 + shift});
  }
  const auto bits = std::min<std::size_t>(kMaxGuideBits, static_cast<std::size_t>(std::bit_width(pieces.size())));
  guide_shift_ = 64 - static_cast<int>(bits);
  guide_.reserve((std::size_t{1} << bits) + 1);
  std::uint32_t piece = 0;
  for (std::uint64_t cell = 0; cell < std::uint64_t{1} << bits; ++cell) {
    while (piece + 1 < pieces.size() && pieces[piece + 1].from <= cell << guide_shift_) ++piece;
    guide_.push_back(piece);
  }
  guide_.push_back(static_cast<std::uint32_t>(pieces.size() - 1));
}

std::int64_t QuantileTable::operator()(std::uint64_t u) const noexcept {
  const std::size_t cell = u >> guide_shift_;
  const auto first = pieces_.begin() + guide_[cell] + 1;
  const auto last = pieces_.begin() + guide_[cell + 1] + 1;
  const auto next =
      std::upper_bound(first, last, u, [](std::uint64_t value, const Compiled& p) { return value < p.from; });
  const Compiled& piece = *std::prev(next);
  const std::uint64_t within = (u - piece.from) << (piece.least_and_shift & 63);
  return (piece.least_and_shift >> 6) + static_cast<std::int64_t>(high_half(within, piece.slope) >> kSlopeScale);
}

std::uint64_t QuantileTable::hash() const noexcept {
  std::uint64_t hash = 0xcbf29ce484222325;  // Fowler, Noll, Vo
  const auto feed = [&hash](std::uint64_t word) {
    for (int byte = 0; byte < 8; ++byte) {
      hash ^= (word >> (8 * byte)) & 0xff;
      hash *= 0x100000001b3;
    }
  };
  for (const Compiled& piece : pieces_) {
    feed(piece.from);
    feed(piece.slope);
    feed(static_cast<std::uint64_t>(piece.least_and_shift));
  }
  return hash;
}

QuantileTable tabulate(const std::function<double(double p, double q)>& quantile, std::int64_t least,
                       std::int64_t most) {
  const auto whole = [&](double p, double q) {
    const double x = quantile(p, q);
    if (!(x > static_cast<double>(least))) return least;
    if (x >= static_cast<double>(most)) return most;
    return exact::round(x);
  };
  std::vector<double> tail;
  for (int octave = kTailTo; octave > kTailFrom; --octave) {
    const double lower = 1 / static_cast<double>(std::uint64_t{1} << octave);
    for (int i = 0; i < kTailCells; ++i) tail.push_back(lower * (1 + i / double{kTailCells}));
  }
  std::vector<QuantileTable::Piece> knots;
  for (const double v : tail) knots.push_back({static_cast<std::uint64_t>(v * 0x1p64), whole(v, 1 - v), 1});
  constexpr int kCells = 1 << kBodyBits;
  for (int i = kCells >> kTailFrom; i <= kCells - (kCells >> kTailFrom); ++i) {
    const double p = i / double{kCells};
    knots.push_back({static_cast<std::uint64_t>(i) << (64 - kBodyBits), whole(p, 1 - p), 1});
  }
  for (auto v = tail.rbegin(); v != tail.rend(); ++v) {
    knots.push_back({0 - static_cast<std::uint64_t>(*v * 0x1p64), whole(1 - *v, *v), 1});
  }
  for (std::size_t i = 0; i + 1 < knots.size(); ++i) {
    knots[i + 1].least = std::max(knots[i].least, knots[i + 1].least);  // the last bit can be wrong
    knots[i].width = std::max<std::uint64_t>(1, static_cast<std::uint64_t>(knots[i + 1].least - knots[i].least));
  }
  knots.insert(knots.begin(), {0, knots.front().least, 1});
  return QuantileTable(knots);
}

}  // namespace tendon::injector
