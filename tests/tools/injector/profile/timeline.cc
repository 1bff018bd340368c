// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/profile/timeline.h"

#include <algorithm>
#include <vector>

#include "tests/tools/injector/models/exact_math.h"
#include "tests/tools/injector/models/wide.h"

namespace tendon::injector {
namespace {

/// A standard exponential in units of 2⁻³⁰.
constexpr int kUnitBits = 30;

const QuantileTable& exponential_table() {
  static const QuantileTable kTable =
      tabulate([](double, double q) { return -exact::log(q) * (1 << kUnitBits); }, 0, std::int64_t{1} << 36);
  return kTable;
}

/// value · numerator/denominator, rounded toward zero, without overflow.
Duration scaled(Duration value, Duration numerator, Duration denominator) {
  return Duration(static_cast<std::int64_t>(Int128{value.count()} * numerator.count() / denominator.count()));
}

}  // namespace

WindowState state_of(const Window& window, Duration since) noexcept {
  if (since < window.at) return {};
  if (window.every == Duration::zero()) {
    const Duration left = window.at + window.lasts - since;
    return {.open = left > Duration::zero(), .begun = 1, .until_end = left};
  }
  const Duration within = (since - window.at) % window.every;
  return {.open = within < window.lasts,
          .begun = static_cast<std::uint64_t>((since - window.at) / window.every) + 1,
          .until_end = window.lasts - within};
}

Duration extra_delay(const Profile& profile, Duration since, const Draws& draws) noexcept {
  Duration extra{};
  for (const Step& step : profile.steps) {
    if (since >= step.at) extra += step.change;
  }
  for (const Ramp& ramp : profile.ramps) {
    if (since > ramp.from) extra += scaled(ramp.change, std::min(since, ramp.to) - ramp.from, ramp.to - ramp.from);
  }
  for (const Spike& spike : profile.spikes) {
    if (state_of(spike.when, since).open) extra += spike.extra;
  }
  for (std::size_t i = 0; i < profile.handovers.size(); ++i) {
    const Handover& handover = profile.handovers[i];
    const std::uint64_t begun = state_of(handover.when, since).begun;
    if (begun == 0 || handover.change == Duration::zero()) continue;
    const auto choices = 2 * static_cast<std::uint64_t>(handover.change.count()) + 1;
    const std::uint64_t draw = draws(Purpose::kHandover, begun * kMaxEvents + i);
    extra += Duration(static_cast<std::int64_t>(one_of(choices, draw))) - handover.change;
  }
  return extra;
}

bool in_outage(const Profile& profile, Duration since) noexcept {
  return std::ranges::any_of(profile.outages, [&](const Outage& o) { return state_of(o.when, since).open; });
}

bool in_handover(const Profile& profile, Duration since) noexcept {
  return std::ranges::any_of(profile.handovers, [&](const Handover& h) { return state_of(h.when, since).open; });
}

Duration past_stalls(const Profile& profile, Duration since) noexcept {
  for (int moves = 0; moves < 1000; ++moves) {
    const auto open =
        std::ranges::find_if(profile.stalls, [&](const Stall& s) { return state_of(s.when, since).open; });
    if (open == profile.stalls.end()) break;
    since += state_of(open->when, since).until_end;
  }
  return since;
}

std::optional<LocalTime> OutageChain::end(LocalTime now, const QuantileTable& length, const Draws& draws) {
  while (now >= ends_ + clear_) {
    begins_ = ends_ + clear_;
    ends_ = begins_ + Duration(length(draws(Purpose::kOutage, ++begun_ * kMaxEvents + number_)));
  }
  if (now < begins_ || now >= ends_) return std::nullopt;
  return ends_;
}

RegimeChain::RegimeChain(const std::vector<Regime>& regimes, const Draws& draws, LocalTime start,
                         std::uint64_t first_visit)
    : draws_(draws), visit_(first_visit) {
  for (const Regime& regime : regimes) mean_dwell_.push_back(regime.dwell);
  ends_ = start + dwell();
}

Duration RegimeChain::dwell() const {
  const std::int64_t unit = exponential_table()(draws_(Purpose::kRegimeDwell, visit_));
  const auto ns = static_cast<std::int64_t>((Int128{mean_dwell_[regime_].count()} * unit) >> kUnitBits);
  return std::max(Duration(1), Duration(ns));
}

std::size_t RegimeChain::at(LocalTime now) {
  while (now >= ends_) {
    ++visit_;
    const std::uint64_t others = mean_dwell_.size() - 1;
    const std::uint64_t next = one_of(others, draws_(Purpose::kRegimeNext, visit_));
    regime_ = static_cast<std::size_t>(next < regime_ ? next : next + 1);
    ends_ += dwell();
  }
  return regime_;
}

}  // namespace tendon::injector
