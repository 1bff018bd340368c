// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <deque>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/base/expect.h"
#include "core/stability/passivity_boundary.h"
#include "core/stability/stability_boundary.h"
#include "devices/simulated/simulated_device.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

constexpr double kOff = 1e-3;  // m

/// Mean of the squared distance from the spring's rest in the last quarter over that in the second.
bool grows(const SampledSpring& spring) {
  SimulatedDevice::Config config;
  config.mass = spring.mass;
  config.viscous_friction = spring.viscous;
  config.start_position = Vec3(kOff, 0, 0);
  SimulatedDevice device(config);
  const double own_period = 6.2832 * std::sqrt(spring.mass / spring.stiffness);
  const auto steps = static_cast<std::size_t>(std::max(60 * own_period / seconds(spring.period), 400.0));
  std::deque<double> under_way(static_cast<std::size_t>(spring.delay_samples), kOff);
  double early = 0;
  double late = 0;
  LocalTime now{};
  for (std::size_t k = 0; k < steps; ++k, now += spring.period) {
    const double x = device.read(now)->position.x();
    under_way.push_back(x);
    device.apply(Vec3(-spring.stiffness * under_way.front(), 0, 0));
    under_way.pop_front();
    if (k >= steps / 4 && k < steps / 2) early += x * x;
    if (k >= steps - steps / 4) late += x * x;
    if (std::abs(x) > 1e3 * kOff) return true;
  }
  return late > early;
}

struct Point {
  SampledSpring spring;
  double simulated, eigenvalues, linear, passive;
};

Point point(const SampledSpring& spring) {
  return {spring, simulated_stiffness_limit(spring), largest_stable_stiffness(spring), gil_stiffness(spring).stiffness,
          largest_passive_stiffness(spring)};
}

/// What SimulatedDevice does below and above the boundary: the map over which the curves are drawn.
std::pair<Curve, Curve> field(const std::vector<Point>& points, double (*x)(const SampledSpring&)) {
  Curve rests{.name = "comes to rest", .colour = kSky, .style = Curve::Style::kPoints};
  Curve swings{.name = "swings up", .colour = kOrange, .style = Curve::Style::kPoints};
  for (const Point& p : points) {
    SampledSpring spring = p.spring;
    for (int i = -6; i <= 6; ++i) {  // a quarter to four times the exact limit
      spring.stiffness = p.eigenvalues * std::pow(4, i / 6.0);
      (grows(spring) ? swings : rests).points.emplace_back(x(spring), spring.stiffness);
    }
  }
  return {rests, swings};
}

Panel panel(const std::string& title, const std::string& label, const std::vector<Point>& points,
            double (*x)(const SampledSpring&)) {
  Panel result{.title = title, .x_label = label, .log_x = true, .log_y = true};
  const auto [rests, swings] = field(points, x);
  result.curves = {rests, swings};
  const auto curve = [&](const char* name, const char* colour, double Point::*member, Curve::Style style) {
    Curve drawn{.name = name, .colour = colour, .style = style};
    for (const Point& p : points) drawn.points.emplace_back(x(p.spring), p.*member);
    result.curves.push_back(drawn);
  };
  curve("eigenvalues", kBlue, &Point::eigenvalues, Curve::Style::kLine);
  curve("(b + B)/(T/2 + t_d)", kPurple, &Point::linear, Curve::Style::kDashed);
  curve("passive (Colgate)", kGreen, &Point::passive, Curve::Style::kLine);
  curve("simulated limit", kVermilion, &Point::simulated, Curve::Style::kPoints);
  return result;
}

}  // namespace

double simulated_stiffness_limit(const SampledSpring& spring) {
  SampledSpring tried = spring;
  double stable = 0;
  double unstable = 1;
  for (tried.stiffness = unstable; !grows(tried); tried.stiffness = unstable) {
    stable = unstable;
    unstable *= 2;
    if (unstable > 1e7) throw std::runtime_error("no spring up to 10 MN/m is unstable");
  }
  while (unstable > stable * 1.005 && unstable > 1e-3) {
    tried.stiffness = (stable + unstable) / 2;
    (grows(tried) ? unstable : stable) = tried.stiffness;
  }
  return (stable + unstable) / 2;
}

void boundary(const BoundaryOptions& options, std::ostream& out) {
  SampledSpring base{.mass = options.mass, .viscous = options.viscous, .period = std::chrono::milliseconds(1)};
  check(base);
  std::vector<Point> delays;
  for (const int d : {0, 1, 2, 3, 5, 8, 13, 20, 32, 50}) {
    base.delay_samples = d;
    delays.push_back(point(base));
  }
  base.delay_samples = 0;
  std::vector<Point> rates;
  for (const double hz : {25.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 4000.0}) {
    base.period = from_seconds(1 / hz);
    rates.push_back(point(base));
  }

  if (!options.json) {
    out << "The stiffest spring, N/m: " << options.mass << " kg, " << options.viscous
        << " N s/m, nobody holds it; commit " << kCommit
        << "\n\n   rate Hz  delay ms   simulated  eigenvalues  b/(T/2+t_d)   passive\n";
  }
  for (const auto* const points : {&delays, &rates}) {
    for (const Point& p : *points) {
      const double hz = 1 / seconds(p.spring.period);
      const double ms = seconds(p.spring.period) * p.spring.delay_samples * 1e3;
      if (options.json) {
        out << JsonLine()
                   .add("rate_hz", hz)
                   .add("delay_ms", ms)
                   .add("mass_kg", p.spring.mass)
                   .add("b_n_s_per_m", p.spring.viscous)
                   .add("simulated_n_per_m", p.simulated)
                   .add("eigenvalues_n_per_m", p.eigenvalues)
                   .add("gil_n_per_m", p.linear)
                   .add("passive_n_per_m", p.passive)
                   .add("commit", kCommit)
                   .str()
            << "\n";
        continue;
      }
      std::array<char, 120> line{};
      std::snprintf(line.data(), line.size(), "%10.0f %9.0f %11.1f %12.1f %12.1f %9.1f\n", hz, ms, p.simulated,
                    p.eigenvalues, p.linear, p.passive);
      out << line.data();
    }
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    delays.erase(delays.begin());  // no delay has no place on a logarithmic axis
    const auto files = draw_panels(
        *options.out / "boundary", "How stiff a sampled spring may be",
        shortest(options.mass) + " kg, " + shortest(options.viscous) + " N s/m; commit " + std::string(kCommit),
        {panel("Stiffness, N/m, over delay at 1 kHz", "delay, ms", delays,
               [](const SampledSpring& s) { return seconds(s.period) * s.delay_samples * 1e3; }),
         panel("Stiffness, N/m, over rate without delay", "rate, Hz", rates,
               [](const SampledSpring& s) { return 1 / seconds(s.period); })});
    if (!options.json) {
      for (const auto& file : files) out << "picture: " << file.string() << "\n";
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
