// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/netem.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <numeric>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "core/base/expect.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/profile.h"
#include "tests/tools/injector/selftest/statistics.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

using injector::autocorrelation;

struct Losses {
  double rate = 0;
  double mean_burst = 0;
};

Losses losses(const std::vector<bool>& lost) {
  const auto bursts = injector::run_lengths(lost);
  double runs = 0;
  double in_runs = 0;
  for (std::size_t k = 0; k < bursts.size(); ++k) {
    runs += static_cast<double>(bursts[k]);
    in_runs += static_cast<double>((k + 1) * bursts[k]);
  }
  return {static_cast<double>(std::ranges::count(lost, true)) / static_cast<double>(lost.size()),
          runs > 0 ? in_runs / runs : std::nan("")};
}

/// `loss P CORRELATION`: lost if P · 2³² ≥ x.
Losses netem_losses(double probability, double correlation, const NetemOptions& options) {
  NetemRandom random(correlation, options.seed);
  const auto below = static_cast<std::uint32_t>(probability * 0x1p32);
  std::vector<bool> lost(options.count);
  for (std::size_t i = 0; i < options.count; ++i) lost[i] = below >= random.next();
  return losses(lost);
}

std::vector<injector::Decision> decisions(const std::string& line, const NetemOptions& options) {
  injector::Injector injector(injector::parse_profile(line), options.seed, 0, injector::Direction::kUp);
  std::vector<injector::Decision> result;
  result.reserve(options.count);
  for (std::size_t i = 0; i < options.count; ++i) {
    const LocalTime arrival{std::chrono::milliseconds(1) * static_cast<std::int64_t>(i)};
    result.push_back(injector.decide({.arrival = arrival, .size = 200}));
  }
  return result;
}

/// The correlation of a Gilbert chain is 1 − P(good → bad) − P(bad → good).
double mean_burst(double probability, double correlation) { return 1 / ((1 - correlation) * (1 - probability)); }

Losses our_losses(double probability, double correlation, const NetemOptions& options) {
  const std::string line =
      "loss=burst(" + shortest(probability) + "," + shortest(mean_burst(probability, correlation)) + ")";
  std::vector<bool> lost;
  for (const auto& decision : decisions(line, options)) lost.push_back(decision.verdict == injector::Verdict::kDrop);
  return losses(lost);
}

struct Delays {
  std::string name;
  const char* colour;
  std::vector<double> ms;
};

constexpr double kRho = 0.9;

/// The requested distribution: 2 ms plus an exponential of mean 6 ms.
double exponential_quantile(double u) { return 2 - 6 * std::log1p(-u); }

/// netem uses x % size as a table index and x % (2 · jitter) for uniform jitter: the uncorrelated low bits of x.
Delays netem_table(const NetemOptions& options) {
  constexpr std::uint32_t kSize = 4096;
  NetemRandom random(kRho, options.seed);
  Delays result{"netem, by a table", kVermilion, {}};
  for (std::size_t i = 0; i < options.count; ++i) {
    result.ms.push_back(exponential_quantile((random.next() % kSize + 0.5) / kSize));
  }
  return result;
}

/// A simulator that copies the recursion and treats x as uniform.
Delays mixed_uniforms(const NetemOptions& options) {
  NetemRandom random(kRho, options.seed);
  Delays result{"x of netem as uniform", kOrange, {}};
  for (std::size_t i = 0; i < options.count; ++i) {
    result.ms.push_back(exponential_quantile((random.next() + 0.5) * 0x1p-32));
  }
  return result;
}

Delays copula(const NetemOptions& options) {
  Delays result{"tendon-inject", kBlue, {}};
  for (const auto& decision : decisions("delay=exponential(2ms,8ms) rho=0.9 order=free", options)) {
    result.ms.push_back(seconds(decision.release - decision.arrival) * 1e3);
  }
  return result;
}

double percentile(const std::vector<double>& ascending, double share) {
  return ascending[static_cast<std::size_t>(share * static_cast<double>(ascending.size() - 1))];
}

constexpr std::array kAsked = {0.01, 0.05, 0.1};
constexpr std::array kCorrelations = {0.0, 0.1, 0.25, 0.5, 0.75, 0.9};
constexpr std::array<std::size_t, 13> kLags = {1, 2, 3, 4, 5, 7, 10, 13, 16, 20, 25, 30, 40};

std::vector<Panel> loss_panels(const NetemOptions& options, CsvTable& table, std::ostream& out) {
  Panel rate{.title = "Loss: 10 % asked for, what comes, %", .x_label = "correlation asked for, %"};
  Panel bursts{.title = "Losses in a row, mean", .x_label = "correlation asked for, %", .log_y = true};
  rate.curves = {{"asked for", kPale, {{0, 10}, {90, 10}}, Curve::Style::kDashed},
                 {"netem", kVermilion},
                 {"tendon-inject", kBlue}};
  bursts.curves = {{"asked for", kPale, {}, Curve::Style::kDashed}, {"netem", kVermilion}, {"tendon-inject", kBlue}};
  if (!options.json)
    out << "asked for         netem              tendon-inject\nloss  correlation  loss     burst   loss     burst  "
           "(asked)\n";
  for (const double asked : kAsked) {
    for (const double correlation : kCorrelations) {
      const Losses theirs = netem_losses(asked, correlation, options);
      const Losses ours = our_losses(asked, correlation, options);
      const double burst = mean_burst(asked, correlation);
      if (asked == kAsked.back()) {
        rate.curves[1].points.emplace_back(100 * correlation, 100 * theirs.rate);
        rate.curves[2].points.emplace_back(100 * correlation, 100 * ours.rate);
        bursts.curves[0].points.emplace_back(100 * correlation, burst);
        bursts.curves[1].points.emplace_back(100 * correlation, theirs.mean_burst);
        bursts.curves[2].points.emplace_back(100 * correlation, ours.mean_burst);
      }
      JsonLine json;
      json.add("loss_asked", asked)
          .add("correlation_asked", correlation)
          .add("burst_asked", burst)
          .add("netem_loss", theirs.rate)
          .add("netem_burst", theirs.mean_burst)
          .add("inject_loss", ours.rate)
          .add("inject_burst", ours.mean_burst);
      table.add(json);
      if (options.json) {
        out << json.str() << "\n";
        continue;
      }
      std::array<char, 120> line{};
      std::snprintf(line.data(), line.size(), "%3.0f %%  %6.0f %%  %8.4f %%  %5.2f  %7.3f %%  %5.2f  %6.2f\n",
                    100 * asked, 100 * correlation, 100 * theirs.rate, theirs.mean_burst, 100 * ours.rate,
                    ours.mean_burst, burst);
      out << line.data();
    }
  }
  return {rate, bursts};
}

std::vector<Panel> delay_panels(const NetemOptions& options, CsvTable& table, std::ostream& out) {
  Panel law{.title = "Delays: 2 ms + exponential of 6 ms: the share below",
            .x_label = "delay, ms",
            .x_range = {{0, 30}},
            .y_range = {{0, 1}}};
  Panel memory{
      .title = "… and their autocorrelation, 90 % asked for", .x_label = "datagrams apart", .y_range = {{-0.05, 1}}};
  Curve asked_law{"asked for", kInk, {}, Curve::Style::kDashed};
  for (int i = 0; i <= 120; ++i) asked_law.points.emplace_back(i / 4.0, i < 8 ? 0 : -std::expm1((2 - i / 4.0) / 6));
  Curve asked_memory{"asked for", kInk, {}, Curve::Style::kDashed};
  for (const auto lag : kLags)
    asked_memory.points.emplace_back(static_cast<double>(lag), std::pow(kRho, static_cast<double>(lag)));
  if (!options.json)
    out << "\ndelay exponential(2 ms, 8 ms), correlation 90 %   mean ms  p50 ms  p99 ms  autocorrelation at 1, 10\n";
  for (Delays delays : {netem_table(options), mixed_uniforms(options), copula(options)}) {
    Curve remembered{delays.name, delays.colour, {}};
    for (const auto lag : kLags)
      remembered.points.emplace_back(static_cast<double>(lag), autocorrelation(delays.ms, lag));
    const double first = autocorrelation(delays.ms, 1);
    const double tenth = autocorrelation(delays.ms, 10);
    const double mean =
        std::accumulate(delays.ms.begin(), delays.ms.end(), 0.0) / static_cast<double>(delays.ms.size());
    std::ranges::sort(delays.ms);
    Curve share{delays.name, delays.colour, {}};
    for (int i = 1; i < 500; ++i) share.points.emplace_back(percentile(delays.ms, i / 500.0), i / 500.0);
    law.curves.push_back(share);
    memory.curves.push_back(remembered);
    const double median = percentile(delays.ms, 0.5);
    const double late = percentile(delays.ms, 0.99);
    JsonLine json;
    json.add("delays", delays.name)
        .add("mean_ms", mean)
        .add("p50_ms", median)
        .add("p99_ms", late)
        .add("autocorrelation_1", first)
        .add("autocorrelation_10", tenth);
    table.add(json);
    if (options.json) {
      out << json.str() << "\n";
      continue;
    }
    std::array<char, 120> line{};
    std::snprintf(line.data(), line.size(), "%-48s %8.3f %7.3f %7.2f %10.3f %7.3f\n", delays.name.c_str(), mean, median,
                  late, first, tenth);
    out << line.data();
  }
  if (!options.json) {
    std::array<char, 120> line{};
    std::snprintf(line.data(), line.size(), "%-48s %8.3f %7.3f %7.2f %10.3f %7.3f\n", "asked for", 8.0,
                  exponential_quantile(0.5), exponential_quantile(0.99), kRho, std::pow(kRho, 10));
    out << line.data();
  }
  law.curves.push_back(asked_law);
  memory.curves.push_back(asked_memory);
  return {law, memory};
}

}  // namespace

NetemRandom::NetemRandom(double correlation, std::uint64_t seed)
    : rho_(correlation > 0 ? static_cast<std::uint64_t>(correlation * 0x1p32) : 0), random_(seed) {}

std::uint32_t NetemRandom::next() {
  const std::uint64_t value = random_() >> 32;
  if (rho_ == 0) return static_cast<std::uint32_t>(value);
  last_ = static_cast<std::uint32_t>((value * ((std::uint64_t{1} << 32) - rho_) + last_ * rho_) >> 32);
  return last_;
}

void netem(const NetemOptions& options, std::ostream& out) {
  if (options.count < 1000)
    throw std::invalid_argument("--count is " + std::to_string(options.count) + ", expected at least 1000");
  if (!options.json) {
    out << options.count << " datagrams for each line, seed " << options.seed << ", commit " << kCommit << "\n\n";
  }
  CsvTable table(options.command);
  std::vector<Panel> panels = loss_panels(options, table, out);
  for (Panel& panel : delay_panels(options, table, out)) panels.push_back(std::move(panel));
  if (!options.out) return;
  std::filesystem::create_directories(*options.out);
  table.write(*options.out / "netem.csv");
  const auto files =
      draw_panels(*options.out / "netem", "What is left of a network that is asked for with a correlation",
                  std::to_string(options.count) + " datagrams for each point, seed " + std::to_string(options.seed) +
                      "; netem: its arithmetic, Linux net/sched/sch_netem.c",
                  panels, options.command);
  if (!options.json) {
    out << "\n";
    for (const auto& file : files) out << file.string() << "\n";
  }
}

}  // namespace tendon::lab
