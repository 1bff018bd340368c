// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/clock_bound.h"

#include <algorithm>
#include <cstdlib>

namespace tendon::replay {
namespace {

Duration drifted(Duration time, double most_drift) {
  return Duration(static_cast<Duration::rep>(most_drift * std::abs(static_cast<double>(time.count()))) + 1);
}

/// Finds the crossing with the smallest bound at each later time of a sweep.
class Tightest {
 public:
  explicit Tightest(double most_drift) : most_drift_(most_drift) {}

  void pass(const Crossing& crossing) {
    if (!any_ || crossing.bound <= at(crossing.at)) best_ = crossing;
    any_ = true;
  }
  Duration at(LocalTime time) const {
    return any_ ? best_.bound + drifted(time - best_.at, most_drift_) : Duration::max();
  }

 private:
  double most_drift_;
  bool any_ = false;
  Crossing best_;
};

/// min_i (bound_i + ρ |t − t_i|) at each of `times`. Crossings and `times` must be sorted.
std::vector<Duration> tightest(const std::vector<Crossing>& crossings, const std::vector<LocalTime>& times,
                               double most_drift) {
  std::vector<Duration> least(times.size());
  Tightest before(most_drift);
  for (std::size_t i = 0, next = 0; i < times.size(); ++i) {
    for (; next < crossings.size() && crossings[next].at <= times[i]; ++next) before.pass(crossings[next]);
    least[i] = before.at(times[i]);
  }
  Tightest after(most_drift);
  std::size_t left = crossings.size();
  for (std::size_t i = times.size(); i-- > 0;) {
    for (; left > 0 && crossings[left - 1].at > times[i]; --left) after.pass(crossings[left - 1]);
    least[i] = std::min(least[i], after.at(times[i]));
  }
  return least;
}

}  // namespace

std::vector<ClockBound> clock_bounds(const std::vector<Crossing>& there, const std::vector<Crossing>& back,
                                     Duration every, double most_drift) {
  std::vector<ClockBound> bounds;
  if (there.empty() || back.empty()) return bounds;
  const LocalTime end = std::max(there.back().at, back.back().at);
  std::vector<LocalTime> times;
  for (LocalTime at = std::min(there.front().at, back.front().at); at < end + every; at += every) times.push_back(at);
  std::vector<Crossing> mirrored = back;
  for (Crossing& crossing : mirrored) crossing.bound = -crossing.bound;
  const auto upper = tightest(there, times, most_drift);
  const auto lower = tightest(mirrored, times, most_drift);
  for (std::size_t i = 0; i < times.size(); ++i) {
    const Duration width = upper[i] + lower[i];
    bounds.push_back({.at = times[i], .offset = (upper[i] - lower[i]) / 2, .error = (width + Duration(1)) / 2});
    if (width < Duration::zero()) bounds.back().error = width / 2 - Duration(1);
  }
  return bounds;
}

ClockDrift drift_over(const std::vector<ClockBound>& bounds) {
  const ClockBound& first = bounds.front();
  const ClockBound& last = bounds.back();
  const double time = std::max(seconds(last.at - first.at), 1e-9);
  return {.rate = seconds(last.offset - first.offset) / time, .error = seconds(first.error + last.error) / time};
}

bool is_possible(const std::vector<ClockBound>& bounds) {
  return std::ranges::none_of(bounds, [](const ClockBound& bound) { return bound.error < Duration::zero(); });
}

Duration offset_at(const std::vector<ClockBound>& bounds, LocalTime at) {
  const auto after = std::ranges::upper_bound(bounds, at, {}, &ClockBound::at);
  if (after == bounds.begin()) return after->offset;
  const ClockBound& before = *(after - 1);
  if (after == bounds.end()) return before.offset;
  const double share =
      static_cast<double>((at - before.at).count()) / static_cast<double>((after->at - before.at).count());
  return before.offset +
         Duration(static_cast<Duration::rep>(share * static_cast<double>((after->offset - before.offset).count())));
}

}  // namespace tendon::replay
