// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/delay_model.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "tests/tools/injector/models/exact_math.h"
#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {
namespace {

using Piece = QuantileTable::Piece;

constexpr std::int64_t kMost = kMaxDelay.count();

double ns(Duration d) { return static_cast<double>(d.count()); }

/// Standard normal quantile for the probability p below and q above.
double deviate(double p, double q) { return p < q ? exact::normal_quantile(p) : -exact::normal_quantile(q); }

/// One piece for each entry of positive weight, which covers `width(i)` integer values.
template <typename Width>
QuantileTable weighted(const std::vector<Weighted>& entries, Width width) {
  double total = 0;
  for (const Weighted& entry : entries) total += entry.weight;
  std::vector<Piece> pieces;
  double sum = 0;
  for (std::size_t i = 0; i < entries.size(); ++i) {
    // Scaling by 2⁶⁴ is exact, and the sum stays below the total before the last entry of positive weight.
    const double share = sum / total;
    sum += entries[i].weight;
    if (entries[i].weight == 0 || share >= 1) continue;
    const auto from = static_cast<std::uint64_t>(share * 0x1p64);
    if (!pieces.empty() && from <= pieces.back().from) pieces.pop_back();  // probability below 2⁻⁶⁴
    pieces.push_back({from, entries[i].value.count(), width(i)});
  }
  pieces.front().from = 0;
  return QuantileTable(pieces);
}

/// The x with S(x) = Σ wᵢ exp(−x/mᵢ) = q. ln S is convex, so Newton's method approaches x from below without overshoot.
double mixture_quantile(const std::vector<Weighted>& parts, double q) {
  double total = 0;
  for (const Weighted& part : parts) total += part.weight;
  double x = 0;
  for (int round = 0; round < 100; ++round) {
    double above = 0;  // S(x)
    double slope = 0;  // −S′(x)
    for (const Weighted& part : parts) {
      const double share = part.weight / total * exact::exp(-x / ns(part.value));
      above += share;
      slope += share / ns(part.value);
    }
    const double step = exact::log(above / q) * above / slope;
    x += step;
    if (!(step > 1e-3)) break;
  }
  return x;
}

struct Tabulate {
  QuantileTable operator()(const ConstantDelay& d) const { return QuantileTable({{0, d.value.count(), 1}}); }
  QuantileTable operator()(const UniformDelay& d) const {
    return QuantileTable({{0, d.low.count(), static_cast<std::uint64_t>((d.high - d.low).count()) + 1}});
  }
  QuantileTable operator()(const NormalDelay& d) const {
    return smooth([&](double p, double q) { return ns(d.mean) + ns(d.deviation) * deviate(p, q); });
  }
  QuantileTable operator()(const ExponentialDelay& d) const {
    return smooth([&](double, double q) { return ns(d.least) - ns(d.mean - d.least) * exact::log(q); });
  }
  QuantileTable operator()(const LognormalDelay& d) const {
    const double ratio = ns(d.deviation) / ns(d.mean);
    const double variance = exact::log(1 + ratio * ratio);
    const double sigma = std::sqrt(variance);
    const double mu = exact::log(ns(d.mean)) - variance / 2;
    return smooth([&](double p, double q) { return exact::exp(mu + sigma * deviate(p, q)); });
  }
  QuantileTable operator()(const ParetoDelay& d) const {
    return smooth(
        [&](double, double q) { return ns(d.least) * exact::exp(std::min(600.0, -exact::log(q) / d.shape)); });
  }
  QuantileTable operator()(const GammaDelay& d) const {
    const double ratio = ns(d.mean) / ns(d.deviation);
    const double shape = ratio * ratio;
    const double scale = ns(d.mean) / shape;
    return smooth([&](double p, double q) { return scale * exact::gamma_quantile(shape, p, q); });
  }
  QuantileTable operator()(const HistogramDelay& d) const {
    return weighted(d.bins, [&](std::size_t i) -> std::uint64_t {
      const std::size_t n = d.bins.size();
      if (n == 1) return 1;
      const std::size_t lower = std::min(i, n - 2);  // the last bin is as wide as its predecessor
      return static_cast<std::uint64_t>((d.bins[lower + 1].value - d.bins[lower].value).count());
    });
  }
  QuantileTable operator()(const SampledDelay& d) const {
    return weighted(d.values, [](std::size_t) -> std::uint64_t { return 1; });
  }
  QuantileTable operator()(const MixtureDelay& d) const {
    return smooth([&](double, double q) { return ns(d.least) + mixture_quantile(d.parts, q); });
  }
  template <typename Quantile>
  static QuantileTable smooth(Quantile quantile) {
    return tabulate(quantile, 0, kMost);
  }
};

constexpr int kZBits = 29;
constexpr std::int64_t kOneZ = std::int64_t{1} << kZBits;
constexpr int kRhoBits = 30;
constexpr std::int64_t kOneRho = std::int64_t{1} << kRhoBits;

/// Φ⁻¹ in units of 2⁻²⁹, within ±7.04 (the end of the table).
const QuantileTable& normal_table() {
  static const QuantileTable kTable =
      tabulate([](double p, double q) { return deviate(p, q) * static_cast<double>(kOneZ); }, -8 * kOneZ, 8 * kOneZ);
  return kTable;
}

/// 1 − Φ(z) in units of 2⁻⁶⁴ at z = i/256. Linear interpolation has an absolute error below 5e-7 and a relative error
/// below 1e-4.
constexpr int kTailStepBits = 8;
constexpr std::size_t kTailPoints = 8 * (1 << kTailStepBits) + 1;

const std::vector<std::uint64_t>& tail_table() {
  static const std::vector<std::uint64_t> kTable = [] {
    std::vector<std::uint64_t> table;
    for (std::size_t i = 0; i < kTailPoints; ++i) {
      const double tail = exact::normal_tail(static_cast<double>(i) / (1 << kTailStepBits));
      table.push_back(static_cast<std::uint64_t>(tail * 0x1p64));
    }
    return table;
  }();
  return kTable;
}

/// Φ(z) in units of 2⁻⁶⁴.
std::uint64_t normal_share(std::int64_t z) {
  constexpr int kFractionBits = kZBits - kTailStepBits;
  const auto size = static_cast<std::uint64_t>(std::min(z < 0 ? -z : z, 8 * kOneZ - 1));
  const std::uint64_t* const at = tail_table().data() + (size >> kFractionBits);
  const std::uint64_t fraction = (size & ((1U << kFractionBits) - 1)) << (64 - kFractionBits);
  const std::uint64_t tail = at[0] - high_half(at[0] - at[1], fraction);
  return z < 0 ? tail : ~tail;
}

/// 2⁻ᶠ for f = i/1024, in units of 2⁻³⁰.
const std::vector<std::int64_t>& power_table() {
  static const std::vector<std::int64_t> kTable = [] {
    std::vector<std::int64_t> table;
    for (int i = 0; i <= 1024; ++i) {
      const double power = exact::exp(-i / 1024.0 * 0.69314718055994530942);
      table.push_back(exact::round(power * kOneRho));
    }
    return table;
  }();
  return kTable;
}

/// ⌊√n⌋ by Newton's method from above.
std::uint64_t integer_root(std::uint64_t n) {
  if (n == 0) return 0;
  std::uint64_t root = std::uint64_t{1} << ((std::bit_width(n) + 1) / 2);
  for (;;) {
    const std::uint64_t better = (root + n / root) / 2;
    if (better >= root) return root;
    root = better;
  }
}

/// The parameters of a smooth distribution; none for the others, whose tables are cheap to build.
using Numbers = std::vector<std::int64_t>;
struct NumbersOf {
  Numbers operator()(const NormalDelay& d) const { return {d.mean.count(), d.deviation.count()}; }
  Numbers operator()(const ExponentialDelay& d) const { return {d.least.count(), d.mean.count()}; }
  Numbers operator()(const LognormalDelay& d) const { return {d.mean.count(), d.deviation.count()}; }
  Numbers operator()(const ParetoDelay& d) const { return {d.least.count(), std::bit_cast<std::int64_t>(d.shape)}; }
  Numbers operator()(const GammaDelay& d) const { return {d.mean.count(), d.deviation.count()}; }
  Numbers operator()(const MixtureDelay& d) const {
    Numbers numbers = {d.least.count()};
    for (const Weighted& part : d.parts) {
      numbers.insert(numbers.end(), {part.value.count(), std::bit_cast<std::int64_t>(part.weight)});
    }
    return numbers;
  }
  template <typename Other>
  Numbers operator()(const Other&) const {
    return {};
  }
};

}  // namespace

QuantileTable delay_table(const Delay& delay) {
  Numbers numbers = std::visit(NumbersOf{}, delay);
  if (numbers.empty()) return std::visit(Tabulate{}, delay);
  constexpr std::size_t kMostKept = 256;  // tables of 150 kB
  thread_local std::map<std::pair<std::size_t, Numbers>, QuantileTable> kept;
  const auto name = std::pair(delay.index(), std::move(numbers));
  const auto found = kept.find(name);
  if (found != kept.end()) return found->second;
  if (kept.size() >= kMostKept) kept.clear();
  return kept.emplace(name, std::visit(Tabulate{}, delay)).first->second;
}

Copula::Copula(double rho, Duration memory) {
  if (memory > Duration::zero()) {
    per_ns_ = static_cast<std::uint64_t>(1.44269504088896340736 / ns(memory) * 0x1p64);
  } else {
    set_rho(exact::round(rho * kOneRho));
  }
}

void Copula::set_rho(std::int64_t rho) noexcept {
  rho_ = rho;
  rest_ = static_cast<std::int64_t>(integer_root(static_cast<std::uint64_t>(kOneRho * kOneRho - rho * rho)));
}

std::uint64_t Copula::next(std::uint64_t draw, LocalTime at) noexcept {
  const std::int64_t e = normal_table()(draw);
  if (!started_) {
    started_ = true;
    z_ = e;
  } else {
    if (const Duration step = std::max(at - last_, Duration::zero()); per_ns_ != 0 && step != step_) {
      step_ = step;
      const Uint128 halvings = Uint128{static_cast<std::uint64_t>(step.count())} * per_ns_;  // in units of 2⁻⁶⁴
      const auto whole = static_cast<std::uint64_t>(halvings >> 64);
      const auto fraction = static_cast<std::uint64_t>(halvings);
      const std::int64_t* const power = power_table().data() + (fraction >> 54);
      const auto drop =
          static_cast<std::int64_t>(high_half(static_cast<std::uint64_t>(power[0] - power[1]), fraction << 10));
      set_rho(whole > kRhoBits ? 0 : (power[0] - drop) >> whole);
    }
    z_ = (rho_ * z_ + rest_ * e + kOneRho / 2) >> kRhoBits;
  }
  last_ = at;
  return normal_share(z_);
}

void Copula::continue_from(const Copula& before) noexcept {
  started_ = before.started_;
  z_ = before.z_;
  last_ = before.last_;
}

}  // namespace tendon::injector
