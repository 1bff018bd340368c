// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/boundary.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <deque>
#include <nlohmann/json.hpp>
#include <span>
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
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

constexpr double kOff = 1e-3;  // m, initial displacement

/// Returns whether the mean squared distance from equilibrium is larger in the last quarter than in the second.
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

constexpr std::array kDelays = {0, 1, 2, 3, 5, 8, 13, 20, 32, 50};                        // samples of 1 ms
constexpr std::array kRates = {25.0, 50.0, 100.0, 200.0, 500.0, 1000.0, 2000.0, 4000.0};  // Hz
constexpr int kMapped = 6;  // springs above and below the exact limit, within a factor of 4

struct Point {
  SampledSpring spring;
  double simulated = 0, eigenvalues = 0, linear = 0, passive = 0;
  std::string map{};  ///< 'x' if the spring diverges, '.' if it comes to rest. It is empty if there is no figure.
};

double mapped_stiffness(const Point& point, int i) { return point.eigenvalues * std::pow(4, i / 6.0); }

Point point(const SampledSpring& spring, bool mapped) {
  Point p{.spring = spring,
          .simulated = simulated_stiffness_limit(spring),
          .eigenvalues = largest_stable_stiffness(spring),
          .linear = gil_stiffness(spring).stiffness,
          .passive = largest_passive_stiffness(spring)};
  SampledSpring tried = spring;
  for (int i = -kMapped; mapped && i <= kMapped; ++i) {
    tried.stiffness = mapped_stiffness(p, i);
    p.map += grows(tried) ? 'x' : '.';
  }
  return p;
}

/// Returns the simulated results below and above the limit, which are shown behind the curves.
std::pair<Curve, Curve> field(std::span<const Point> points, double (*x)(const SampledSpring&)) {
  Curve rests{.name = "comes to rest", .colour = kSky, .style = Curve::Style::kPoints};
  Curve swings{.name = "swings up", .colour = kOrange, .style = Curve::Style::kPoints};
  for (const Point& p : points) {
    for (int i = -kMapped; i <= kMapped; ++i) {
      const int place = i + kMapped;
      const bool swung = p.map.at(static_cast<std::size_t>(place)) == 'x';
      (swung ? swings : rests).points.emplace_back(x(p.spring), mapped_stiffness(p, i));
    }
  }
  return {rests, swings};
}

Panel panel(const std::string& title, const std::string& label, std::span<const Point> points,
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

namespace {

/// The rows with delays at 1 kHz are first, followed by the rows with rates and no delay.
SampledSpring spring_of(const BoundaryOptions& options, std::uint64_t unit) {
  SampledSpring spring{.mass = options.mass, .viscous = options.viscous, .period = std::chrono::milliseconds(1)};
  if (unit < kDelays.size()) {
    spring.delay_samples = kDelays.at(unit);
  } else {
    spring.period = from_seconds(1 / kRates.at(unit - kDelays.size()));
  }
  return spring;
}

double hz_of(const Point& p) { return 1 / seconds(p.spring.period); }
double ms_of(const Point& p) { return seconds(p.spring.period) * p.spring.delay_samples * 1e3; }

JsonLine json_of(const Point& p) {
  JsonLine line;
  line.add("rate_hz", hz_of(p))
      .add("delay_ms", ms_of(p))
      .add("mass_kg", p.spring.mass)
      .add("b_n_s_per_m", p.spring.viscous)
      .add("simulated_n_per_m", p.simulated)
      .add("eigenvalues_n_per_m", p.eigenvalues)
      .add("gil_n_per_m", p.linear)
      .add("passive_n_per_m", p.passive)
      .add("commit", kCommit);
  return line;
}

SweptWork<Point> work_of(const BoundaryOptions& options) {
  const bool mapped = options.out || options.part.units;
  return {.what = "rows",
          .units = kDelays.size() + kRates.size(),
          .run = [options, mapped](std::uint64_t unit) { return point(spring_of(options, unit), mapped); },
          .lines =
              [](std::uint64_t /*unit*/, const Point& p) {
                std::vector<JsonLine> lines;
                lines.push_back(json_of(p));
                lines.back().add("swings_up", p.map);
                return lines;
              },
          .read =
              [options](std::uint64_t unit, const std::vector<nlohmann::json>& lines) {
                const nlohmann::json& line = lines.at(0);
                Point p{.spring = spring_of(options, unit),
                        .simulated = number_of(line, "simulated_n_per_m"),
                        .eigenvalues = number_of(line, "eigenvalues_n_per_m"),
                        .linear = number_of(line, "gil_n_per_m"),
                        .passive = number_of(line, "passive_n_per_m"),
                        .map = line.at("swings_up")};
                if (p.map.size() != 2 * kMapped + 1)
                  throw std::invalid_argument("expected a different number of points");
                return p;
              },
          .count =
              [](const Point& p, ShardEnd& end) {
                end.count("rows", 1);
                end.lower("simulated_n_per_m", p.simulated);
                end.raise("simulated_n_per_m", p.simulated);
              }};
}

}  // namespace

void boundary(const BoundaryOptions& options, std::ostream& out) {
  check(spring_of(options, 0));
  const auto points = outcomes(work_of(options), options.part, out);
  if (!points) return;
  if (!options.json) {
    out << "Stiffest stable spring, N/m: " << options.mass << " kg, " << options.viscous
        << " N s/m, without a hand; commit " << kCommit
        << "\n\n   rate Hz  delay ms   simulated  eigenvalues  b/(T/2+t_d)   passive\n";
  }
  CsvTable table(options.command);
  for (const Point& p : *points) {
    table.add(json_of(p));
    if (options.json) {
      out << json_of(p).str() << "\n";
      continue;
    }
    std::array<char, 120> line{};
    std::snprintf(line.data(), line.size(), "%10.0f %9.0f %11.1f %12.1f %12.1f %9.1f\n", hz_of(p), ms_of(p),
                  p.simulated, p.eigenvalues, p.linear, p.passive);
    out << line.data();
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    table.write(*options.out / "boundary.csv");
    const std::span<const Point> all(*points);
    const auto files = draw_panels(
        *options.out / "boundary", "How stiff a sampled spring may be",
        shortest(options.mass) + " kg, " + shortest(options.viscous) + " N s/m; commit " + std::string(kCommit),
        {panel("Stiffness, N/m, over delay at 1 kHz", "delay, ms",
               all.subspan(1, kDelays.size() - 1),  // zero cannot be shown on a logarithmic axis
               [](const SampledSpring& s) { return seconds(s.period) * s.delay_samples * 1e3; }),
         panel("Stiffness, N/m, over rate without delay", "rate, Hz", all.subspan(kDelays.size()),
               [](const SampledSpring& s) { return 1 / seconds(s.period); })},
        options.command);
    if (!options.json) {
      for (const auto& file : files) out << "picture: " << file.string() << "\n";
    }
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
