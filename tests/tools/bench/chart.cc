// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/chart.h"

#include <algorithm>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>

#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::bench {
namespace {

using lab::Curve;
using lab::Panel;

double figure(const Row& row, std::string_view name) {
  const auto found =
      std::ranges::find(row.figures, name, [](const auto& each) { return std::string_view(each.first); });
  return found == row.figures.end() ? 0 : found->second;
}

bool is_of_devices(const Row& row) {
  return figure(row, "devices") > 0 && row.what.find("states and forces at 1 kHz") != std::string::npos;
}

template <class Value>
Curve curve(const std::vector<Row>& rows, std::string name, const char* colour, Value value,
            Curve::Style style = Curve::Style::kLine) {
  Curve drawn{.name = std::move(name), .colour = colour, .points = {}, .style = style};
  for (const Row& row : rows) drawn.points.emplace_back(figure(row, "devices"), value(row));
  return drawn;
}

}  // namespace

std::vector<std::filesystem::path> draw_devices(const std::filesystem::path& stem, const Circumstances& circumstances,
                                                const std::vector<Row>& all) {
  std::vector<Row> rows;
  std::ranges::copy_if(all, std::back_inserter(rows), is_of_devices);
  if (rows.size() < 2) throw std::runtime_error("--plot: requires two counts of devices; --quick has one");
  const auto named = [](const char* name) { return [name](const Row& row) { return figure(row, name); }; };
  const auto level = [&](std::string name, double y) {
    return curve(
        rows, std::move(name), lab::kPale, [y](const Row&) { return y; }, Curve::Style::kDashed);
  };

  Panel cost{.title = "Processor time of the server, µs for each device and ms", .x_label = "devices", .curves = {}};
  cost.curves = {
      curve(
          rows, "all of it", lab::kInk,
          [](const Row& row) { return figure(row, "haptic_us") + figure(row, "network_us"); }, Curve::Style::kBold),
      curve(rows, "haptic", lab::kBlue, named("haptic_us")),
      curve(rows, "network", lab::kVermilion, named("network_us")),
      curve(rows, "floor, bare", lab::kGreen, named("floor_us"))};
  Panel cores{.title = "The same, in cores", .x_label = "devices", .curves = {}};
  cores.curves = {curve(rows, "server", lab::kInk, named("server_cores"), Curve::Style::kBold),
                  curve(rows, "floor", lab::kGreen, named("floor_cores")), level("goal at 512", 0.6)};
  Panel in_time{.title = "Answered in the next step, %", .x_label = "devices", .curves = {}, .y_range = {{80, 100.5}}};
  in_time.curves = {curve(rows, "of all steps", lab::kInk, named("answered_in_time_percent"), Curve::Style::kBold),
                    level("goal", 99.5)};
  Panel age{.title = "Age of a state when its guest has it, µs", .x_label = "devices", .curves = {}};
  age.curves = {curve(rows, "p99", lab::kVermilion, [](const Row& row) { return row.p99; }),
                curve(
                    rows, "p50", lab::kInk, [](const Row& row) { return row.p50; }, Curve::Style::kBold),
                curve(rows, "floor, p99", lab::kSky, [](const Row& row) { return row.floor_p99.value_or(0); }),
                curve(rows, "floor, p50", lab::kGreen, [](const Row& row) { return row.floor_p50.value_or(0); }),
                level("a period", 1000)};
  return lab::draw_panels(stem, "What devices cost, sealed, each with states and forces at 1 kHz",
                          to_text(circumstances), {cost, cores, in_time, age}, circumstances.command);
}

}  // namespace tendon::bench
