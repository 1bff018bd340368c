// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/scripted_motion.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <string>
#include <utility>

#include "core/base/expect.h"
#include "core/base/portable_math.h"

namespace tendon {
namespace {

using Point = ScriptedMotion::Point;
using Recorded = ScriptedMotion::Recorded;

Vec3 unit(const Vec3& direction, const std::string& field) {
  expect_finite(direction, field);
  expect(direction.norm() > 0, field + " (its length)", direction.norm(), "a vector that is not zero");
  return direction.stableNormalized();
}

/// Checks a script and normalizes directions.
struct Prepare {
  void operator()(ScriptedMotion::Sine& s) const {
    expect(s.amplitude >= 0 && std::isfinite(s.amplitude), "sine.amplitude", s.amplitude, "0 m or more");
    expect(s.frequency >= 0 && std::isfinite(s.frequency), "sine.frequency", s.frequency, "0 Hz or more");
    expect_finite(s.centre, "sine.centre");
    s.direction = unit(s.direction, "sine.direction");
  }

  void operator()(ScriptedMotion::RampHold& s) const {
    expect_finite(s.from, "ramp_hold.from");
    expect_finite(s.to, "ramp_hold.to");
    expect(s.ramp > Duration::zero(), "ramp_hold.ramp", seconds(s.ramp), "a duration above 0 s");
    if (s.hold) expect(*s.hold >= Duration::zero(), "ramp_hold.hold", seconds(*s.hold), "0 s or more");
  }

  void operator()(ScriptedMotion::MinimumJerk& s) const {
    expect(s.points.size() >= 2, "minimum_jerk.points (their number)", static_cast<double>(s.points.size()),
           "2 or more");
    expect(s.durations.size() + 1 == s.points.size(), "minimum_jerk.durations (their number)",
           static_cast<double>(s.durations.size()), "one fewer than points");
    for (const Vec3& p : s.points) expect_finite(p, "minimum_jerk.points");
    for (const Duration d : s.durations) {
      expect(d > Duration::zero(), "minimum_jerk.durations", seconds(d), "durations above 0 s");
    }
  }

  void operator()(Recorded& s) const {
    expect(s.samples.size() >= 2, "recorded.samples (their number)", static_cast<double>(s.samples.size()),
           "2 or more");
    for (std::size_t i = 0; i < s.samples.size(); ++i) {
      expect(std::isfinite(s.samples[i].x), "recorded.samples.x", s.samples[i].x, "a finite number");
      expect(std::isfinite(s.samples[i].t) && (i == 0 || s.samples[i].t > s.samples[i - 1].t), "recorded.samples.t",
             s.samples[i].t, "a time later than that of the previous sample");
    }
    expect_finite(s.origin, "recorded.origin");
    s.direction = unit(s.direction, "recorded.direction");
  }

  void operator()(const ScriptedMotion::Guided& s) const {
    expect(s.point != nullptr, "guided.point", 0, "the address of a point");
  }
};

Point point_at(const ScriptedMotion::Sine& s, double t) {
  const double omega = 2 * std::numbers::pi * s.frequency;
  return {s.centre + s.direction * (s.amplitude * portable::sin(omega * t)),
          s.direction * (s.amplitude * omega * portable::cos(omega * t))};
}

Point point_at(const ScriptedMotion::RampHold& s, double t) {
  const double ramp = seconds(s.ramp);
  const Vec3 way = s.to - s.from;
  bool back = false;
  if (s.hold) {
    const double half_cycle = ramp + seconds(*s.hold);
    t = std::fmod(t, 2 * half_cycle);
    back = t >= half_cycle;
    if (back) t -= half_cycle;
  }
  const double done = std::min(t / ramp, 1.0);
  const double speed = t < ramp ? 1 / ramp : 0.0;
  if (back) return {s.to - way * done, way * -speed};
  return {s.from + way * done, way * speed};
}

Point point_at(const ScriptedMotion::MinimumJerk& s, double t) {
  const double total = seconds(std::accumulate(s.durations.begin(), s.durations.end(), Duration::zero()));
  double sign = 1;
  if (s.back_and_forth) {
    t = std::fmod(t, 2 * total);
    if (t > total) {
      t = 2 * total - t;
      sign = -1;
    }
  }
  std::size_t leg = 0;
  while (leg + 1 < s.durations.size() && t >= seconds(s.durations[leg])) t -= seconds(s.durations[leg++]);

  const double duration = seconds(s.durations[leg]);
  const double u = std::min(t / duration, 1.0);
  const Vec3 way = s.points[leg + 1] - s.points[leg];
  return {s.points[leg] + way * (u * u * u * (10 + u * (6 * u - 15))),
          way * (sign * 30 * u * u * (1 - u) * (1 - u) / duration)};
}

/// Fritsch and Butland's slope: the weighted harmonic mean of both secants, or 0 at ends and extrema (opposite signs).
double slope(const std::vector<Recorded::Sample>& s, std::size_t i) {
  if (i == 0 || i + 1 == s.size()) return 0;
  const double h0 = s[i].t - s[i - 1].t;
  const double h1 = s[i + 1].t - s[i].t;
  const double d0 = (s[i].x - s[i - 1].x) / h0;
  const double d1 = (s[i + 1].x - s[i].x) / h1;
  if (!(d0 * d1 > 0)) return 0;
  return 3 * (h0 + h1) / ((2 * h1 + h0) / d0 + (h1 + 2 * h0) / d1);
}

Point point_at(const Recorded& s, double t) {
  const double length = s.samples.back().t - s.samples.front().t;
  if (s.at_end == Recorded::AtEnd::kRepeat) {
    t = std::fmod(t, length);
  } else if (t >= length) {
    return {s.origin + s.direction * s.samples.back().x, Vec3::Zero()};
  }
  t += s.samples.front().t;
  const auto after = std::upper_bound(s.samples.begin() + 1, s.samples.end() - 1, t,
                                      [](double value, const Recorded::Sample& sample) { return value < sample.t; });
  const auto i = static_cast<std::size_t>(after - s.samples.begin()) - 1;

  const double h = s.samples[i + 1].t - s.samples[i].t;
  const double u = (t - s.samples[i].t) / h;
  const double rise = s.samples[i + 1].x - s.samples[i].x;
  const double m0 = h * slope(s.samples, i);
  const double m1 = h * slope(s.samples, i + 1);
  const double x = s.samples[i].x + u * (m0 + u * (3 * rise - 2 * m0 - m1 + u * (m0 + m1 - 2 * rise)));
  const double v = (m0 + u * (2 * (3 * rise - 2 * m0 - m1) + u * 3 * (m0 + m1 - 2 * rise))) / h;
  return {s.origin + s.direction * x, s.direction * v};
}

Point point_at(const ScriptedMotion::Guided& s, double /*t*/) { return *s.point; }

}  // namespace

ScriptedMotion::ScriptedMotion(Script script) : script_(std::move(script)) { std::visit(Prepare{}, script_); }

ScriptedMotion::Point ScriptedMotion::at(double t) const noexcept {
  return std::visit([t](const auto& script) { return point_at(script, t); }, script_);
}

}  // namespace tendon
