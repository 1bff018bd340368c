// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/injector.h"

#include <algorithm>

namespace tendon::injector {
namespace {

__extension__ typedef unsigned __int128 Uint128;  // NOLINT(modernize-use-using): `using` cannot carry __extension__

constexpr double kTwo64 = 18446744073709551616.0;
constexpr std::uint64_t kTwo63 = std::uint64_t{1} << 63;

const Profile& checked(const Profile& profile) {
  check(profile);
  return profile;
}

}  // namespace

// Scaling by 2⁶⁴ is exact: only the exponent changes.
Injector::Chance::Chance(double probability)
    : certain(probability >= 1), below(certain ? 0 : static_cast<std::uint64_t>(probability * kTwo64)) {}

std::vector<Injector::Piece> Injector::inverse_cdf(const Profile& profile) {
  const auto ns = [](Duration d) { return static_cast<std::uint64_t>(d.count()); };
  const std::vector<Profile::Bin>& bins = profile.histogram;
  if (bins.empty()) return {{kTwo63, (profile.delay - profile.jitter).count(), 2 * ns(profile.jitter) + 1}};

  double total = 0;
  for (const Profile::Bin& bin : bins) total += bin.weight;
  std::vector<Piece> pieces;
  double sum = 0;
  std::uint64_t width_ns = 1;
  for (std::size_t i = 0; i < bins.size(); ++i) {
    if (i + 1 < bins.size()) width_ns = ns(bins[i + 1].lower - bins[i].lower);
    sum += bins[i].weight;
    if (bins[i].weight == 0) continue;
    const auto below = static_cast<std::uint64_t>(sum / total * static_cast<double>(kTwo63));
    pieces.push_back({below, (profile.delay + bins[i].lower).count(), width_ns});
  }
  return pieces;  // the last `below` is exactly 2⁶³: the last `sum` is the very same sum as `total`
}

Injector::Injector(const Profile& profile, std::uint64_t seed)
    : loss_(checked(profile).loss), duplicate_(profile.duplicate), inverse_cdf_(inverse_cdf(profile)), random_(seed) {}

Duration Injector::drawn_delay(std::uint64_t draw) const {
  const std::uint64_t u = draw >> 1;  // 0 … 2⁶³ − 1
  const auto piece = std::upper_bound(inverse_cdf_.begin(), inverse_cdf_.end(), u,
                                      [](std::uint64_t value, const Piece& p) { return value < p.below; });
  const std::uint64_t from = piece == inverse_cdf_.begin() ? 0 : std::prev(piece)->below;
  const auto offset_ns = static_cast<std::int64_t>(Uint128{u - from} * piece->width_ns / (piece->below - from));
  return Duration(std::max<std::int64_t>(0, piece->lower_ns + offset_ns));
}

Fate Injector::next(LocalTime arrival) {
  // All four, in this order, for every datagram: see the header.
  const std::uint64_t loss_draw = random_();
  const std::uint64_t delay_draw = random_();
  const std::uint64_t duplicate_draw = random_();
  const std::uint64_t second_delay_draw = random_();

  last_release_ = std::max(last_release_, arrival + drawn_delay(delay_draw));
  Fate fate{.lost = loss_.happens(loss_draw), .delay = last_release_ - arrival, .duplicate = std::nullopt};
  if (!fate.lost && duplicate_.happens(duplicate_draw)) {
    fate.duplicate = std::max(fate.delay, drawn_delay(second_delay_draw));
  }
  return fate;
}

}  // namespace tendon::injector
