// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/teleop.h"

#include <algorithm>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <string>

#include "tests/support/dice.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/experiments/pressing_by.h"
#include "tests/tools/lab/pictures/csv.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

constexpr int kRoundTrips[] = {0, 10, 20, 50, 100, 200, 400, 600};

std::vector<CouplingMethod> felt_methods() {
  std::vector<CouplingMethod> methods(kCouplingMethods.begin(), kCouplingMethods.end());
  std::erase_if(methods, [](CouplingMethod method) { return !info(method).is_felt; });
  return methods;
}

double median(std::vector<double>& of) {
  const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
  std::nth_element(of.begin(), middle, of.end());
  return *middle;
}

struct Trial {
  double first = 0;  ///< as in TeleopRow
  double second = 0;
  double buzz = 0;
  double pair = 0;
  bool live = false;  ///< engaged until the end
};

Trial trial(CouplingMethod method, int round_trip_ms, std::uint64_t seed) {
  Pressing with = pressing_by(method);
  with.one_way = round_trip_ms / 2;
  with.seed = seed;
  with.hand = Dice(seed).within(150, 600);
  const Felt felt = feel(with);
  return {.first = felt.first / rigid(with),
          .second = felt.second / rigid(with),
          .buzz = felt.buzz,
          .pair = felt.sum,
          .live = felt.live};
}

TeleopRow row_of(CouplingMethod method, int round_trip_ms, std::span<const Trial> trials) {
  TeleopRow row{.method = method, .round_trip_ms = round_trip_ms};
  std::vector<double> first;
  std::vector<double> second;
  for (const Trial& one : trials) {
    if (!one.live) throw std::runtime_error(std::string(to_string(method)) + ": the coupling did not stay engaged");
    first.push_back(one.first);
    second.push_back(one.second);
    row.buzz = std::max(row.buzz, one.buzz);
    row.pair = std::min(row.pair, one.pair);
  }
  row.first = median(first);
  row.second = median(second);
  return row;
}

class Trials {
 public:
  Trials(int hands, std::uint64_t seed, std::span<const int> round_trips_ms)
      : hands_(static_cast<std::size_t>(hands)), seed_(seed), round_trips_(round_trips_ms) {
    if (hands < 1 || hands > 1000) throw std::invalid_argument("hands: expected 1 to 1000");
  }

  std::uint64_t count() const { return methods_.size() * round_trips_.size() * hands_; }
  CouplingMethod method(std::uint64_t i) const { return methods_[i / hands_ / round_trips_.size()]; }
  int round_trip(std::uint64_t i) const { return round_trips_[i / hands_ % round_trips_.size()]; }
  std::uint64_t seed(std::uint64_t i) const { return seed_ + i % hands_; }
  Trial run(std::uint64_t i) const { return trial(method(i), round_trip(i), seed(i)); }

  std::vector<TeleopRow> rows(const std::vector<Trial>& trials) const {
    std::vector<TeleopRow> rows;
    for (std::size_t i = 0; i < trials.size(); i += hands_) {
      rows.push_back(row_of(method(i), round_trip(i), std::span(trials).subspan(i, hands_)));
    }
    return rows;
  }

 private:
  std::vector<CouplingMethod> methods_ = felt_methods();
  std::size_t hands_;
  std::uint64_t seed_;
  std::span<const int> round_trips_;
};

SweptWork<Trial> work_of(const Trials& trials) {
  return {.what = "trials",
          .units = trials.count(),
          .run = [trials](std::uint64_t unit) { return trials.run(unit); },
          .lines =
              [trials](std::uint64_t unit, const Trial& one) {
                std::vector<JsonLine> lines;
                lines.emplace_back()
                    .add("method", to_string(trials.method(unit)))
                    .add("round_trip_ms", trials.round_trip(unit))
                    .add("seed", trials.seed(unit))
                    .add("felt_first", one.first)
                    .add("felt_second", one.second)
                    .add("buzz_mps", one.buzz)
                    .add("pair_j", one.pair)
                    .add("engaged", one.live);
                return lines;
              },
          .read =
              [](std::uint64_t /*unit*/, const std::vector<nlohmann::json>& lines) {
                const nlohmann::json& line = lines.at(0);
                return Trial{.first = number_of(line, "felt_first"),
                             .second = number_of(line, "felt_second"),
                             .buzz = number_of(line, "buzz_mps"),
                             .pair = number_of(line, "pair_j"),
                             .live = line.at("engaged")};
              },
          .count =
              [](const Trial& one, ShardEnd& end) {
                end.count("trials", 1);
                end.count("engaged", one.live ? 1 : 0);
                end.lower("pair_j", one.pair);
                end.raise("buzz_mps", one.buzz);
              }};
}

std::string table_of(const std::vector<TeleopRow>& rows) {
  std::ostringstream text;
  text << "method              round trip ms  felt 1st  felt 2nd  buzz mm/s  pair J\n" << std::fixed;
  CouplingMethod before = rows.front().method;
  for (const TeleopRow& row : rows) {
    if (row.method != before) text << '\n';
    before = row.method;
    text << std::left << std::setw(20) << to_string(row.method) << std::right << std::setw(13) << row.round_trip_ms
         << std::setprecision(2) << std::setw(10) << row.first << std::setw(10) << row.second << std::setw(11)
         << row.buzz * 1e3 << std::setw(8) << std::setprecision(3) << row.pair << '\n';
  }
  return text.str();
}

void draw(const std::vector<TeleopRow>& rows, const TeleopOptions& options, std::ostream& out) {
  Panel press[2] = {{.title = "First press: share of a rigid link's force", .x_label = "round trip, ms"},
                    {.title = "Second press", .x_label = "round trip, ms"}};
  for (Panel& panel : press) panel.y_range = {0, 1.05};
  const char* const colours[] = {kBlue, kOrange, kGreen, kVermilion, kSky, kPurple, kInk};
  for (const CouplingMethod method : felt_methods()) {
    const char* const colour = colours[press[0].curves.size() % std::size(colours)];
    const Curve begun{.name = std::string(to_string(method)), .colour = colour, .style = Curve::Style::kBold};
    Curve curve[2] = {begun, begun};
    for (const TeleopRow& row : rows) {
      if (row.method != method) continue;
      curve[0].points.emplace_back(row.round_trip_ms, row.first);
      curve[1].points.emplace_back(row.round_trip_ms, row.second);
    }
    press[0].curves.push_back(curve[0]);
    press[1].curves.push_back(curve[1]);
  }
  const std::string figures = "median of n = " + std::to_string(options.hands) + " hands from seed " +
                              std::to_string(options.seed) + "; each way varies by 20 %, 10 % lost; every pair passive";
  for (const auto& file : draw_panels(*options.out / "teleop", "What a hand feels of a wall behind a network", figures,
                                      {press[0], press[1]}, options.command)) {
    out << "picture: " << file.string() << '\n';
  }
}

}  // namespace

std::vector<TeleopRow> teleop_rows(int hands, std::uint64_t seed, std::span<const int> round_trips_ms) {
  const Trials trials(hands, seed, round_trips_ms);
  std::vector<Trial> all;
  for (std::uint64_t i = 0; i < trials.count(); ++i) all.push_back(trials.run(i));
  return trials.rows(all);
}

void teleop(const TeleopOptions& options, std::ostream& out) {
  const Trials trials(options.hands, options.seed, kRoundTrips);
  const auto all = outcomes(work_of(trials), options.part, out);
  if (!all) return;
  const auto rows = trials.rows(*all);
  CsvTable table(options.command);
  for (const TeleopRow& row : rows) {
    JsonLine json;
    json.add("method", to_string(row.method))
        .add("round_trip_ms", row.round_trip_ms)
        .add("felt_first", row.first)
        .add("felt_second", row.second)
        .add("buzz_mps", row.buzz)
        .add("pair_j", row.pair)
        .add("hands", options.hands)
        .add("seed", options.seed);
    table.add(json);
    if (options.json) out << json.str() << '\n';
  }
  if (!options.json) out << table_of(rows);
  if (!options.out) return;
  std::filesystem::create_directories(*options.out);
  table.write(*options.out / "teleop.csv");
  draw(rows, options, out);
}

}  // namespace tendon::lab
