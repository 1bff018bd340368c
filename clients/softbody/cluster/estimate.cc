// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/cluster/estimate.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <sstream>

namespace tendon::softbody {
namespace {

constexpr double kMeasured = 55'539;  // unknowns of the measured block

double multigrid_seconds(double unknowns, int ranks) {
  constexpr double kRounds = 3.3;
  constexpr double kWork = 1.3e-6;
  constexpr double kExchange = 10e-6;
  constexpr double kCoarse = 100e-6;
  constexpr double kHop = 1.5e-6;
  const double cells = std::cbrt(unknowns / 3) / 2;
  const double levels = std::max(1.0, std::log2(cells / 4));
  const double shared = ranks > 1 ? 6 * levels * kExchange + kCoarse + 3 * kHop * std::log2(ranks) : 0;
  return kRounds * (unknowns * kWork / ranks + shared);
}

std::string_view name_of(Estimate::Take take) {
  switch (take) {
    case Estimate::Take::kTable:
      return "table";
    case Estimate::Take::kFactor:
      return "factor";
    case Estimate::Take::kMultigrid:
      break;
  }
  return "multigrid";
}

}  // namespace

Estimate estimate(const Body::Size& size, int under_patch, std::vector<int> ranks) {
  std::ranges::sort(ranks);
  const auto unknowns = static_cast<double>(size.free);
  const auto columns = static_cast<double>(size.touchable);
  const double larger = unknowns / kMeasured;
  Estimate e{.size = size, .table = {}, .factor = {}, .multigrid = {}};
  e.factor = {.answer_s = 0.028 * std::pow(larger, 4.0 / 3),
              .set_up_s = 2.8 * larger * larger,
              .bytes = 320e6 * std::pow(larger, 4.0 / 3)};
  e.table = {.answer_s = 2e-6 * std::pow(under_patch / 63.0, 2),
             .set_up_s = e.factor.set_up_s + columns * e.factor.answer_s / 4,  // columns are solved in blocks
             .bytes = 4 * columns * (columns + 1)};
  for (const int count : ranks) e.multigrid.push_back({count, multigrid_seconds(unknowns, count)});
  const auto soonest = std::ranges::min_element(e.multigrid, {}, &Estimate::Spread::answer_s);
  const auto enough = std::ranges::find_if(e.multigrid, [](const auto& each) { return each.answer_s <= kFeltLate; });
  if (e.table.bytes <= kMostTableBytes) {
    e.take = Estimate::Take::kTable;
  } else if (e.factor.bytes <= kMostFactorBytes &&
             (soonest == e.multigrid.end() || e.factor.answer_s <= soonest->answer_s)) {
    e.take = Estimate::Take::kFactor;
  } else {
    e.take = Estimate::Take::kMultigrid;
    e.ranks = enough != e.multigrid.end() ? enough->ranks : soonest->ranks;
  }
  return e;
}

std::string in_words(const Estimate& e) {
  std::ostringstream text;
  const auto way = [&](std::string_view name, double answer, double set_up, double bytes) {
    text << "  " << std::left << std::setw(22) << name << std::right << std::setw(11) << std::setprecision(3)
         << 1000 * answer << " ms";
    if (set_up > 0) text << std::setw(11) << set_up << " s to create" << std::setw(11) << bytes / 1e6 << " MB";
    text << '\n';
  };
  text << e.size.free << " unknowns, " << e.size.elements << " elements, " << e.size.touchable
       << " touchable nodes\n\nPredicted times, within a factor of two or three:\n";
  way("table", e.table.answer_s, e.table.set_up_s, e.table.bytes);
  way("factor", e.factor.answer_s, e.factor.set_up_s, e.factor.bytes);
  for (const auto& each : e.multigrid) {
    way("multigrid, " + std::to_string(each.ranks) + (each.ranks == 1 ? " rank" : " ranks"), each.answer_s, 0, 0);
  }
  text << "\nRecommended: ";
  switch (e.take) {
    case Estimate::Take::kTable:
      text << "the table. Create it with tendon-fem condense, and use it with tendon-softbody; this does not require a "
              "cluster\n";
      break;
    case Estimate::Take::kFactor:
      text << "the factor, in tendon-softbody with the model linear, because the table is too large\n";
      break;
    case Estimate::Take::kMultigrid:
      text << "multigrid on " << e.ranks << " ranks: tendon-fem serve\n";
      break;
  }
  return text.str();
}

std::string in_json(const Estimate& e) {
  nlohmann::ordered_json json = {
      {"unknowns", e.size.free}, {"elements", e.size.elements}, {"touchable", e.size.touchable}};
  const auto cost = [](const Estimate::Cost& c) {
    return nlohmann::ordered_json{{"answer_s", c.answer_s}, {"set_up_s", c.set_up_s}, {"bytes", c.bytes}};
  };
  json["table"] = cost(e.table);
  json["factor"] = cost(e.factor);
  for (const auto& each : e.multigrid)
    json["multigrid"].push_back({{"ranks", each.ranks}, {"answer_s", each.answer_s}});
  json["take"] = name_of(e.take);
  if (e.take == Estimate::Take::kMultigrid) json["ranks"] = e.ranks;
  return json.dump() + "\n";
}

}  // namespace tendon::softbody
