// SPDX-License-Identifier: Apache-2.0
#include "core/identification/ramp_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <stdexcept>
#include <string>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kDroppedCounts = 5;
constexpr double kFewestCounts = 50;
constexpr std::size_t kFewestSamples = 50;
constexpr double kRampTolerance = 0.02;

std::string text(const char* part) { return part; }
std::string text(double number) { return rounded(number, 6); }
std::string text(std::size_t count) { return std::to_string(count); }

template <typename... Parts>
[[noreturn]] void refuse(const Parts&... parts) {
  throw std::invalid_argument((text(parts) + ...));
}

void check(const RampRun& run, double encoder_step) {
  expect_not_negative(encoder_step, "encoder_step");
  const auto& samples = run.samples;
  if (samples.size() < kFewestSamples) {
    refuse("expected a run of ", kFewestSamples, " samples or more, found ", samples.size());
  }
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const RampSample& sample = samples[i];
    if (!std::isfinite(sample.t) || !std::isfinite(sample.position) || !std::isfinite(sample.force)) {
      refuse("sample ", i, ": expected finite numbers");
    }
    if (i > 0 && !(sample.t > samples[i - 1].t)) {
      refuse("sample ", i, ": expected a time later than that of the previous sample, found ", sample.t, " s");
    }
  }
}

/// Median of 5 neighbours. At the ends, the window is shifted inwards.
std::vector<double> without_glitches(const std::vector<RampSample>& samples) {
  std::vector<double> result;
  result.reserve(samples.size());
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const std::size_t first = std::min(i < 2 ? 0 : i - 2, samples.size() - 5);
    std::array<double, 5> near{};
    for (std::size_t j = 0; j < near.size(); ++j) near.at(j) = samples[first + j].position;
    std::ranges::nth_element(near, near.begin() + 2);
    result.push_back(near[2]);
  }
  return result;
}

}  // namespace

Slide slide_of(const RampRun& run, double encoder_step) {
  check(run, encoder_step);
  std::vector<double> path = without_glitches(run.samples);
  const double origin = path.front();
  double forth = 0;
  double back = 0;
  for (double& x : path) {
    x -= origin;
    forth = std::max(forth, x);
    back = std::max(back, -x);
  }
  const double travel = std::max(forth, back);
  if (!(travel > kFewestCounts * encoder_step)) {
    refuse("expected a handle that moves by more than ", kFewestCounts, " encoder counts, found ", travel);
  }
  Slide slide;
  slide.direction = forth > back ? 1 : -1;
  for (double& x : path) x *= slide.direction;

  const double margin = kDroppedCounts * encoder_step;
  std::size_t i = 0;
  while (!(path[i] > margin)) ++i;
  double fastest = 0;  // m per sample
  for (std::size_t j = 1; j < path.size(); ++j) fastest = std::max(fastest, path[j] - path[j - 1]);
  const double end = travel - margin - 2 * fastest;  // the median cuts off the peak of a rebound (2 samples)
  double farthest = path[i];
  for (; path[i] < end; ++i) {
    farthest = std::max(farthest, path[i]);
    if (path[i] < farthest - std::max(margin, 1e-9 * travel)) {
      refuse("sample ", i, ": expected a handle that only moves ", slide.direction > 0 ? "forward" : "backward",
             ", found a reversal");
    }
    const RampSample& sample = run.samples[i];
    slide.samples.push_back({sample.t, slide.direction * (sample.position - origin), slide.direction * sample.force});
  }
  if (slide.samples.size() < kFewestSamples) {
    refuse("expected ", kFewestSamples, " samples or more while the handle slides, found ", slide.samples.size());
  }
  if (!(slide.samples.back().force > 0))
    refuse("expected motion in the direction of the force, found motion against it");
  return slide;
}

Ramp ramp_of(const Slide& slide) {
  const auto& samples = slide.samples;
  const auto n = static_cast<double>(samples.size());
  double mean_t = 0;
  double mean_f = 0;
  for (const RampSample& sample : samples) {
    mean_t += sample.t / n;
    mean_f += sample.force / n;
  }
  double tt = 0;
  double tf = 0;
  for (const RampSample& sample : samples) {
    tt += (sample.t - mean_t) * (sample.t - mean_t);
    tf += (sample.t - mean_t) * (sample.force - mean_f);
  }
  const Ramp ramp{.rate = tf / tt, .start = mean_t - mean_f / (tf / tt)};
  const double rise = ramp.rate * (samples.back().t - samples.front().t);
  if (!(rise > 0)) refuse("expected a force that rises while the handle slides");
  double squares = 0;
  for (const RampSample& sample : samples) {
    const double off = sample.force - ramp.rate * (sample.t - ramp.start);
    squares += off * off / n;
  }
  if (std::sqrt(squares) > kRampTolerance * rise) {
    refuse("expected a force that rises at a constant rate, found ", 100 * std::sqrt(squares) / rise,
           " % deviation from a line");
  }
  return ramp;
}

}  // namespace tendon
