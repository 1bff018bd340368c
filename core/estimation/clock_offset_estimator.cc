// SPDX-License-Identifier: Apache-2.0
#include "core/estimation/clock_offset_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/base/expect.h"

namespace tendon {
namespace {

/// ns, because four time stamps and the midpoint are each truncated.
constexpr double kRounding = 3;

double ns_between(LocalTime from, LocalTime to) noexcept { return static_cast<double>((to - from).count()); }

}  // namespace

ClockOffsetEstimator::ClockOffsetEstimator(double fastest_drift) : fastest_drift_(fastest_drift) {
  expect(fastest_drift >= 0 && fastest_drift <= 0.01, "fastest_drift", fastest_drift, "0 to 0.01 s/s");
}

std::optional<ClockOffsetEstimator::Sample> ClockOffsetEstimator::sample_of(const ClockExchange& e) const noexcept {
  const Duration ours = e.answered_at - e.sent;
  const Duration theirs = e.answered - e.received;
  if (ours < Duration::zero() || theirs < Duration::zero()) return std::nullopt;
  Duration round_trip = ours - theirs;
  // The difference is slightly negative if the clock of the peer is faster.
  const auto ns = [](Duration time) { return static_cast<double>(time.count()); };
  if (ns(round_trip) < -fastest_drift_ * ns(theirs)) return std::nullopt;
  const double doubt = ns(round_trip) + fastest_drift_ * ns(ours);
  round_trip = std::max(round_trip, Duration::zero());
  const std::int64_t there = (e.received.time_since_epoch() - e.sent.time_since_epoch()).count();
  const std::int64_t back = (e.answered.time_since_epoch() - e.answered_at.time_since_epoch()).count();
  return Sample{e.sent + ours / 2, there + (back - there) / 2, round_trip.count(),
                static_cast<std::int64_t>(std::ceil(std::max(doubt, 0.0) + kRounding))};
}

template <class Visit>
void ClockOffsetEstimator::for_each(Visit visit) const noexcept {
  for (std::size_t i = 0; i < std::min(finished_, kBlocks); ++i) visit(blocks_[i]);
  if (best_) visit(*best_);
}

ClockOffsetEstimator::Interval ClockOffsetEstimator::permitted(LocalTime at, std::int64_t reference) const noexcept {
  Interval interval{-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  for_each([&](const Sample& sample) {
    const double slack = static_cast<double>(sample.doubt) / 2 + fastest_drift_ * std::abs(ns_between(sample.at, at));
    const auto offset = static_cast<double>(sample.offset_ns - reference);
    interval.low = std::max(interval.low, offset - slack);
    interval.high = std::min(interval.high, offset + slack);
  });
  return interval;
}

void ClockOffsetEstimator::observe(const ClockExchange& exchange) noexcept {
  const auto sample = sample_of(exchange);
  if (!sample) return;

  const Interval before = permitted(sample->at, sample->offset_ns);
  const double slack = static_cast<double>(sample->doubt) / 2;
  if (before.low > slack || before.high < -slack) {
    ++steps_;
    finished_ = 0;
    best_.reset();
  }

  if (!best_) {
    block_started_ = sample->at;
    exchanges_ = 0;
  }
  if (!best_ || sample->doubt < best_->doubt) best_ = sample;
  ++exchanges_;
  if (exchanges_ >= kExchangesPerBlock && sample->at - block_started_ >= kLeastBlock) {
    blocks_[finished_++ % kBlocks] = *best_;
    best_.reset();
  }
}

std::optional<ClockOffsetEstimator::Estimate> ClockOffsetEstimator::estimate(LocalTime at) const noexcept {
  std::int64_t least = std::numeric_limits<std::int64_t>::max();
  const Sample* anchor = nullptr;
  for_each([&](const Sample& sample) {
    if (sample.doubt >= least) return;
    least = sample.doubt;
    anchor = &sample;
  });
  if (anchor == nullptr) return std::nullopt;

  // Offsets are relative to the best sample, because a double cannot represent every offset with a resolution of 1 ns.
  struct Point {
    double weight, t, offset;
  };
  std::array<Point, kBlocks + 1> points;
  std::size_t count = 0;
  Point sum{};
  for_each([&](const Sample& sample) {
    const double weight = 1 / static_cast<double>(kResolution.count() + sample.doubt - least);
    const Point point{weight, ns_between(anchor->at, sample.at),
                      static_cast<double>(sample.offset_ns - anchor->offset_ns)};
    sum = {sum.weight + weight, sum.t + weight * point.t, sum.offset + weight * point.offset};
    points[count++] = point;
  });
  const double mean_t = sum.t / sum.weight;
  const double mean_o = sum.offset / sum.weight;
  double tt = 0;
  double to = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const double t = points[i].t - mean_t;
    tt += points[i].weight * t * t;
    to += points[i].weight * t * points[i].offset;
  }
  const double drift = tt > 0 ? std::clamp(to / tt, -fastest_drift_, fastest_drift_) : 0;

  const Interval interval = permitted(at, anchor->offset_ns);
  const double line = mean_o + drift * (ns_between(anchor->at, at) - mean_t);
  // std::clamp cannot be used, because contradictory samples (after an undetected step) result in an empty interval.
  const double offset = std::max(interval.low, std::min(interval.high, line));
  const double bound = std::max({offset - interval.low, interval.high - offset, 0.0});
  return Estimate{.offset = Duration(anchor->offset_ns + std::llround(offset)),
                  .drift = drift,
                  .error_bound = Duration(static_cast<std::int64_t>(std::ceil(bound))),
                  .least_round_trip = Duration(anchor->round_trip)};
}

}  // namespace tendon
