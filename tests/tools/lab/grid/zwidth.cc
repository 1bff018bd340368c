// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/grid/zwidth.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <map>
#include <set>
#include <utility>

#include "core/base/expect.h"
#include "core/control/catalogue.h"
#include "tests/tools/lab/pictures/gnuplot.h"
#include "tests/tools/lab/pictures/panels.h"

namespace tendon::lab {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

/// The cells of one wall: all seeds and rates.
struct Wall {
  bool holds = true;  ///< every cell is quiet and passive
  std::vector<double> felt{};
};

/// "0.1 mJ" is −0.0001 J in the figure's words.
std::string energy_in_words(double joule) {
  constexpr std::array<std::pair<double, const char*>, 4> kUnits = {
      {{1e-9, " nJ"}, {1e-6, " µJ"}, {1e-3, " mJ"}, {1, " J"}}};
  const auto* unit = kUnits.begin();
  while (unit + 1 != kUnits.end() && joule >= (unit + 1)->first) ++unit;
  return rounded(joule / unit->first, 3) + unit->second;
}

}  // namespace

std::vector<WidthOfLaw> widths_of(const std::vector<GridRow>& rows, const Thresholds& thresholds) {
  std::vector<std::string> laws;
  std::map<std::string, std::vector<double>> round_trips;
  std::map<std::string, std::map<std::string, std::map<double, Wall>>> walls;  // by law, network and stiffness
  for (const auto& [cell, measured] : rows) {
    if (std::ranges::find(laws, cell.law) == laws.end()) laws.push_back(cell.law);
    if (measured.round_trip) round_trips[cell.network].push_back(*measured.round_trip);
    Wall& wall = walls[cell.law][cell.network][cell.stiffness];
    wall.holds =
        wall.holds && quiet(measured, thresholds).value_or(false) && passive(measured, thresholds).value_or(false);
    wall.felt.push_back(measured.felt_stiffness.value_or(0));
  }
  std::vector<WidthOfLaw> widths;
  for (const std::string& law : laws) {
    WidthOfLaw& width = widths.emplace_back(WidthOfLaw{.law = law, .walls = {}});
    for (const auto& [network, times] : round_trips) {
      StiffestWall& stiffest = width.walls.emplace_back(StiffestWall{.round_trip = median(times)});
      for (const auto& [stiffness, wall] : walls[law][network]) {
        if (!wall.holds) continue;
        stiffest.commanded = std::max(stiffest.commanded, stiffness);
        stiffest.felt = std::max(stiffest.felt, median(wall.felt));
      }
    }
    std::ranges::sort(width.walls, {}, &StiffestWall::round_trip);
  }
  return widths;
}

std::vector<std::filesystem::path> draw_zwidth(const std::filesystem::path& stem, const std::vector<GridRow>& rows,
                                               const Thresholds& thresholds, const Origin& origin) {
  constexpr std::array kColours = {kBlue, kVermilion, kGreen, kPurple, kOrange, kSky, kPale, kInk};
  constexpr double kMsPerS = 1e3;
  Panel felt{.title = "Stiffest quiet and passive wall as the hand feels it, N/m", .x_label = "round trip, ms"};
  Panel asked{.title = {}, .x_label = "round trip, ms"};
  const std::vector<WidthOfLaw> widths = widths_of(rows, thresholds);
  for (std::size_t i = 0; i < widths.size(); ++i) {
    Curve shown{.name = widths[i].law, .colour = kColours.at(i % kColours.size()), .style = Curve::Style::kBold};
    Curve points{.name = "", .colour = shown.colour, .style = Curve::Style::kPoints};
    Curve thin{.name = widths[i].law, .colour = shown.colour};
    for (const StiffestWall& wall : widths[i].walls) {
      points.points.emplace_back(wall.round_trip * kMsPerS, wall.felt);
      thin.points.emplace_back(wall.round_trip * kMsPerS, wall.commanded);
    }
    shown.points = points.points;
    felt.curves.push_back(shown);
    felt.curves.push_back(points);
    asked.curves.push_back(thin);
  }
  std::set<std::uint64_t> seeds;
  double stiffest = 0;
  for (const GridRow& row : rows) {
    seeds.insert(row.cell.seed);
    stiffest = std::max(stiffest, row.cell.stiffness);
  }
  asked.title = "Stiffness that the engine commands for it, N/m (up to " + shortest(stiffest) + " was tried)";
  for (Panel* const panel : {&felt, &asked}) {
    constexpr double kMargin = 1.05;
    double right = 0;
    double top = 0;
    for (const Curve& curve : panel->curves) {
      for (const auto& [x, y] : curve.points) {
        right = std::max(right, x);
        top = std::max(top, y);
      }
    }
    panel->x_range = {0, kMargin * std::max(right, 1.0)};
    panel->y_range = {0, kMargin * std::max(top, 1.0)};
  }
  const std::string figures = "quiet: vibration of at most " + rounded(thresholds.vibration * kMsPerS, 3) +
                              " mm/s; passive: gives out at most " + energy_in_words(thresholds.given_out) + "; " +
                              std::to_string(seeds.size()) + (seeds.size() == 1 ? " seed" : " seeds") + "; commit " +
                              origin.commit + "; scene " + origin.scene_sha256.substr(0, 12);
  std::vector<std::string> below;
  const bool aol_fails = std::ranges::any_of(rows, [&thresholds](const GridRow& row) {
    return row.cell.law == info(Law::kAol).name && passive(row.measured, thresholds) == false;
  });
  if (aol_fails) {
    below.push_back(
        "Plain aol accounts for the motion of the encoder, which differs from that of the hand by up to half a count "
        "per "
        "period. It can give out this energy, so it needs a larger limit of passivity, or the robust ledger.");
  }
  return draw_panels(stem, "Z-width over delay", figures, {felt, asked}, origin.command, below);
}

}  // namespace tendon::lab
