// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/accuracy_pictures.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/build_info.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {

using namespace softbody;

namespace {

/// Just noticeable difference of the stiffness of a surface under a bare finger pad: Bergmann Tiest & Kappers 2009.
constexpr double kJustNoticeable = 15;  // %
constexpr double kApart = 0.65;         // ratio of errors below which two labels would overlap

const char* colour_of(std::size_t i) {
  constexpr std::array kColours{kBlue, kVermilion, kGreen, kPurple, kOrange, kSky, kPale};
  return kColours.at(i % kColours.size());
}

Curve curve_of(const Candidate& candidate) {
  const std::vector<AnyModel> models = all_models();
  const auto number = static_cast<std::size_t>(std::ranges::find(models, candidate.model) - models.begin()) +
                      3 * static_cast<std::size_t>(candidate.by);
  return {.name = candidate.way(),
          .colour = colour_of(number),
          .style = for_comparison(candidate.model) ? Curve::Style::kDashed : Curve::Style::kLine};
}

Curve::Style points_on(const Curve& line) {
  return line.style == Curve::Style::kDashed ? Curve::Style::kRings : Curve::Style::kPoints;
}

void add_with_points(Panel& panel, Curve curve) {
  Curve points{.name = "", .colour = curve.colour, .points = curve.points, .style = points_on(curve)};
  if (curve.points.size() < 2) {
    points.name = std::move(curve.name);
  } else {
    panel.curves.push_back(std::move(curve));
  }
  panel.curves.push_back(std::move(points));
}

bool same_way(const std::vector<AccuracyPoint>& ladder, const Candidate& candidate) {
  return ladder.front().candidate.way() == candidate.way();
}

std::vector<Candidate> ways_in(const Ladders& ladders) {
  std::vector<Candidate> ways;
  for (const auto& ladder : ladders) {
    if (std::ranges::none_of(ways, [&](const Candidate& way) { return same_way(ladder, way); })) {
      ways.push_back(ladder.front().candidate);
    }
  }
  return ways;
}

/// All points if `way` is empty.
std::vector<AccuracyPoint> points_of(const Ladders& ladders, const std::optional<Candidate>& way) {
  std::vector<AccuracyPoint> points;
  for (const auto& ladder : ladders) {
    if (!way || same_way(ladder, *way)) points.insert(points.end(), ladder.begin(), ladder.end());
  }
  return points;
}

std::string label_of(const Candidate& candidate) {
  return candidate.way() + " " + std::string(info(candidate.element).name) + " " + std::to_string(candidate.n);
}

/// A point for each candidate, a line through the Pareto-optimal ones of each source, and the labeled front of all.
Panel error_over_time(const std::string& title, const Ladders& ladders, double extra_ms, std::size_t load) {
  Panel panel{.title = title, .x_label = "ms", .log_x = true, .log_y = true};
  const auto place = [&](const AccuracyPoint& p) {
    return std::pair(p.update_ms_p50 + extra_ms, std::max(0.01, 100 * std::abs(p.at_load.at(load).total)));
  };
  const std::vector<AccuracyPoint> all = points_of(ladders, {});
  std::pair range{std::numeric_limits<double>::infinity(), 0.0};
  for (const AccuracyPoint& p : all) {
    range = {std::min(range.first, place(p).first), std::max(range.second, place(p).first)};
  }
  panel.x_range = {{range.first / 1.5, range.second * 1.5}};
  panel.curves.push_back({.name = "not noticed",
                          .colour = kGrey,
                          .points = {{panel.x_range->first, kJustNoticeable}, {panel.x_range->second, kJustNoticeable}},
                          .style = Curve::Style::kBelow});
  Curve front{.name = "best", .colour = kInk, .style = Curve::Style::kBold};
  for (const AccuracyPoint& p : pareto_front(all, load)) {
    // Of two points with almost equal error, only the more accurate one is labeled.
    if (!front.points.empty() && place(p).second > kApart * front.points.back().second) front.labels.back().clear();
    front.points.push_back(place(p));
    front.labels.push_back(label_of(p.candidate));
  }
  panel.curves.push_back(front);
  for (const Candidate& way : ways_in(ladders)) {
    Curve line = curve_of(way);
    Curve points{.name = "", .colour = line.colour, .style = points_on(line)};
    for (const AccuracyPoint& p : points_of(ladders, way)) points.points.push_back(place(p));
    // A model that collapses on a fine mesh has no Pareto points, but its name is still in the legend.
    for (const AccuracyPoint& p : pareto_front(points_of(ladders, way), load)) line.points.push_back(place(p));
    if (line.points.size() < 2) points.name = std::move(line.name);
    if (line.points.size() >= 2) panel.curves.push_back(std::move(line));
    panel.curves.push_back(std::move(points));
  }
  return panel;
}

Panel error_over_n(const Ladders& ladders) {
  const Candidate& first = ladders.front().front().candidate;
  std::pair range{std::numeric_limits<double>::infinity(), 0.0};
  Panel panel{
      .title = "|error| of K, %, over cells along x, an element each: " + first.way(), .x_label = "n", .log_y = true};
  std::size_t colour = 0;
  for (const auto& ladder : ladders) {
    if (!same_way(ladder, first)) continue;
    range = {std::min<double>(range.first, ladder.front().candidate.n),
             std::max<double>(range.second, ladder.back().candidate.n)};
    Curve curve{.name = std::string(info(ladder.front().candidate.element).name), .colour = colour_of(colour++)};
    for (const AccuracyPoint& p : ladder) {
      curve.points.emplace_back(p.candidate.n, std::max(0.01, 100 * std::abs(p.at_load[0].total)));
    }
    add_with_points(panel, std::move(curve));
  }
  panel.x_range = {{range.first - 0.5, range.second + 0.5}};
  return panel;
}

std::vector<const std::vector<AccuracyPoint>*> felt_best(const Ladders& ladders) {
  std::vector<const std::vector<AccuracyPoint>*> best;
  const auto least = [](const std::vector<AccuracyPoint>& ladder) {
    double error = std::numeric_limits<double>::infinity();
    for (const AccuracyPoint& p : ladder) error = std::min(error, p.felt->force_error);
    return error;
  };
  for (const auto& ladder : ladders) {
    const auto same =
        std::ranges::find_if(best, [&](const auto* known) { return same_way(*known, ladder.front().candidate); });
    if (same == best.end()) {
      best.push_back(&ladder);
    } else if (least(ladder) < least(**same)) {
      *same = &ladder;
    }
  }
  return best;
}

template <class X>
Panel felt_over(const std::string& title, const std::string& label, const Ladders& ladders, bool log_x, X x) {
  Panel panel{.title = title, .x_label = label, .log_x = log_x, .log_y = true};
  std::pair<double, double> range{std::numeric_limits<double>::infinity(), 0};
  for (const auto* ladder : felt_best(ladders)) {
    Curve curve = curve_of(ladder->front().candidate);
    for (const AccuracyPoint& p : *ladder) {
      range = {std::min<double>(range.first, x(p)), std::max<double>(range.second, x(p))};
      curve.points.emplace_back(x(p), 100 * p.felt->force_error);
    }
    add_with_points(panel, std::move(curve));
  }
  panel.x_range =
      log_x ? std::pair(range.first / 1.5, range.second * 1.5) : std::pair(range.first - 0.5, range.second + 0.5);
  return panel;
}

}  // namespace

void draw(const AccuracyOptions& options, const Ladders& ladders, double round_trip_ms) {
  const std::string commit = "commit " + std::string(kCommit);
  if (options.errors_only) {
    draw_panels(*options.out / "accuracy", "What finer meshes bring", commit, {error_over_n(ladders)}, options.command);
    return;
  }
  const auto& loads = options.block.loads;
  std::vector<Panel> panels{
      error_over_time("|error| of K, %, under " + load_text(loads[0]) + ", over the time of an update", ladders, 0, 0),
      error_over_time("… under " + load_text(loads[1]), ladders, 0, 1), error_over_n(ladders)};
  if (options.network) {
    panels.push_back(error_over_time(
        "… under " + load_text(loads[0]) + ", over that and " + options.network->name + ", there and back", ladders,
        round_trip_ms, 0));
    panels.push_back(felt_over("Error at the hand, %, over cells along x, each model with its best element", "n",
                               ladders, false, [](const AccuracyPoint& p) { return p.candidate.n; }));
    panels.push_back(felt_over("… over the time of an update", "ms", ladders, true,
                               [](const AccuracyPoint& p) { return p.update_ms_p50; }));
  }
  draw_panels(*options.out / "accuracy", "What accuracy costs in time", "processor time of one core; " + commit, panels,
              options.command);
}

}  // namespace tendon::lab
