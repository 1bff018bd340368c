// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/accuracy_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "core/base/expect.h"
#include "server/build_info.h"
#include "tests/support/json_line.h"

namespace tendon::lab {
namespace {

using Figure = std::variant<std::int64_t, double>;
using Figures = std::vector<std::pair<const char*, Figure>>;
std::int64_t count(std::size_t n) { return static_cast<std::int64_t>(n); }
Figures figures(const AccuracyPoint& p, const TruthFigures& truth, const PressedBlock& block) {
  const Accuracy& small = p.at_load[0];
  const Accuracy& hard = p.at_load[1];
  const auto& loads = block.loads;
  Figures all{{"n", p.candidate.n},
              {"nodes", count(p.size.nodes)},
              {"k_n_per_m", small.k},
              {"error_percent", 100 * small.total},
              {"update_ms_p50", p.update_ms_p50},
              {"setup_s", p.setup_s},
              {"bytes", count(p.size.bytes)},
              {"load_n", loads[0]},
              {"error_n", loads[0] * small.total},
              {"model_percent", 100 * small.model},
              {"discretisation_percent", 100 * small.discretisation},
              {"solver_percent", 100 * small.solver},
              {"tangent_error_percent", 100 * small.tangent},
              {"hard_load_n", loads[1]},
              {"hard_k_n_per_m", hard.k},
              {"hard_error_percent", 100 * hard.total},
              {"hard_error_n", loads[1] * hard.total},
              {"hard_model_percent", 100 * hard.model},
              {"hard_discretisation_percent", 100 * hard.discretisation},
              {"hard_solver_percent", 100 * hard.solver},
              {"hard_tangent_error_percent", 100 * hard.tangent},
              {"script_rms_error_n", p.force_error},
              {"script_largest_error_n", p.force_most},
              {"script_rms_error_percent", 100 * p.force_relative},
              {"spurious_lateral_percent", 100 * p.lateral},
              {"update_ms_p99", p.update_ms_p99},
              {"hz", 1e3 / p.update_ms_p50},
              {"step_ms", p.step_ms},
              {"instructions", p.instructions.value_or(std::numeric_limits<double>::quiet_NaN())},
              {"elements", count(p.size.elements)},
              {"free", count(p.size.free)},
              {"truth_k_n_per_m", truth.small},
              {"truth_uncertainty_percent", 100 * truth.uncertainty}};
  if (!p.timed) {
    constexpr std::array kOfAClock = {"update_ms_p50", "setup_s", "update_ms_p99", "hz", "instructions"};
    std::erase_if(
        all, [&](const auto& figure) { return std::ranges::count(kOfAClock, std::string_view(figure.first)) > 0; });
  }
  if (p.felt) {
    all.insert(all.end(), {{"felt_error_percent", 100 * p.felt->force_error},
                           {"felt_error_held_percent", 100 * p.felt->held_error},
                           {"felt_stiffness_percent", 100 * p.felt->displayed},
                           {"felt_limited_percent", 100 * p.felt->limited_share},
                           {"felt_vibration_m_s", p.felt->vibration},
                           {"felt_latency_ms", 1e3 * p.felt->latency}});
  }
  return all;
}

void add(JsonLine& line, const char* name, const Figure& figure) {
  std::visit([&](auto value) { line.add(name, value); }, figure);
}

std::string with_tenths(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

constexpr double kUnfeltMs = 0.1;  // a tenth of a device period; smaller differences are not felt

double at_the_hand_ms(const AccuracyPoint& p) { return std::max({p.update_ms_p50, p.step_ms, kUnfeltMs}); }

template <class Errors, class Visit>
void visit_numbers(Errors& errors, Visit visit) {
  auto& p = errors.point;
  for (std::size_t load = 0; load < p.at_load.size(); ++load) {
    const std::string which = load == 0 ? "small_" : "hard_";
    auto& at = p.at_load[load];
    visit(which + "k_n_per_m", at.k);
    visit(which + "error", at.total);
    visit(which + "model", at.model);
    visit(which + "discretisation", at.discretisation);
    visit(which + "solver", at.solver);
    visit(which + "tangent", at.tangent);
  }
  visit("lateral", p.lateral);
  visit("script_rms_error_n", p.force_error);
  visit("script_largest_error_n", p.force_most);
  visit("script_rms_error", p.force_relative);
  visit("step_ms", p.step_ms);
  visit("nodes", p.size.nodes);
  visit("elements", p.size.elements);
  visit("free", p.size.free);
  visit("bytes", p.size.bytes);
  visit("truth_linear_k_n_per_m", errors.truth.linear);
  visit("truth_k_n_per_m", errors.truth.small);
  visit("truth_hard_k_n_per_m", errors.truth.hard);
  visit("truth_uncertainty", errors.truth.uncertainty);
}

}  // namespace

TruthFigures figures_of(Truth& truth) {
  return {.linear = truth.limit(softbody::Law::kLinear, 0)->secant,
          .small = truth.stiffness(0).secant,
          .hard = truth.stiffness(1).secant,
          .uncertainty = truth.uncertainty()};
}

const char* const kFeltHeading =
    "                              update  error %        felt error %   shows %  limited vibration   latency\n"
    "model                      n      ms    small  with K     held                     %      mm/s        ms\n";

std::string heading(bool timed) {
  const std::string above =
      "                                           error %   error % | of the hard load's    | tangent"
      "  script lateral |";
  const std::string below =
      "model                      n  nodes    K N/m   small     hard |  model    mesh  solver |       %"
      "       %        % |";
  return above + (timed ? "  update ms                        set-up" : "") + "      MB\n" + below +
         (timed ? "       p50       p99       Hz        s" : "") + "\n";
}

void write_row(std::ostream& out, const AccuracyPoint& p) {
  const Accuracy& small = p.at_load[0];
  const Accuracy& hard = p.at_load[1];
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "%-24s %3d %6zu %8.1f %+8.1f %+8.1f | %+6.1f %+7.1f %+7.2f | %7.1f %7.1f %8.2f |",
                p.candidate.name().c_str(), p.candidate.n, p.size.nodes, small.k, 100 * small.total, 100 * hard.total,
                100 * hard.model, 100 * hard.discretisation, 100 * hard.solver, 100 * hard.tangent,
                100 * p.force_relative, 100 * p.lateral);
  out << text.data();
  if (p.timed) {
    std::snprintf(text.data(), text.size(), " %9.4f %9.4f %8.0f %8.2f", p.update_ms_p50, p.update_ms_p99,
                  1e3 / p.update_ms_p50, p.setup_s);
    out << text.data();
  }
  std::snprintf(text.data(), text.size(), " %8.2f\n", static_cast<double>(p.size.bytes) / 1e6);
  out << text.data();
}

void write_felt(std::ostream& out, const AccuracyPoint& p) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "%-24s %3d %9.4f %+8.1f %8.1f %8.1f %8.0f %8.0f %9.2f %9.0f\n",
                p.candidate.name().c_str(), p.candidate.n, p.update_ms_p50, 100 * p.at_load[0].total,
                100 * p.felt->force_error, 100 * p.felt->held_error, 100 * p.felt->displayed,
                100 * p.felt->limited_share, 1e3 * p.felt->vibration, 1e3 * p.felt->latency);
  out << line.data();
}

std::string load_text(double newtons) { return shortest(newtons) + " N"; }

JsonLine json_of(const AccuracyPoint& point, const TruthFigures& truth, const PressedBlock& block) {
  JsonLine line;
  line.add("model", point.candidate.name());
  for (const auto& [name, value] : figures(point, truth, block)) add(line, name, value);
  line.add("commit", kCommit);
  return line;
}

std::string to_json(const AccuracyPoint& point, Truth& truth) {
  return json_of(point, figures_of(truth), truth.block()).str();
}

void write_truth(std::ostream& out, const TruthFigures& truth, const PressedBlock& block) {
  out << "Reference: " << with_tenths(truth.linear) << " N/m for small strains, " << with_tenths(truth.small)
      << " N/m under " << load_text(block.loads[0]) << ", " << with_tenths(truth.hard) << " N/m under "
      << load_text(block.loads[1]) << "; uncertainty of the reference: " << with_tenths(100 * truth.uncertainty)
      << " %. Commit " << kCommit << "\n\n";
}

void write_exponents(std::ostream& out, const Ladders& ladders) {
  out << "\nThe time of an update is proportional to the number of unknowns to the power of\n";
  for (const auto& ladder : ladders) {
    if (ladder.size() < 2) continue;
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "%-24s %5.2f   n = %d to %d, %zu to %zu unknowns, %.4f to %.4f ms\n",
                  ladder.front().candidate.name().c_str(), cost_exponent(ladder), ladder.front().candidate.n,
                  ladder.back().candidate.n, ladder.front().size.free, ladder.back().size.free,
                  ladder.front().update_ms_p50, ladder.back().update_ms_p50);
    out << line.data();
  }
}

void write_answer(std::ostream& out, const AccuracyOptions& options, const std::optional<AccuracyPoint>& best,
                  Truth& truth) {
  if (options.json) {
    JsonLine line;
    line.add("budget_ms", *options.budget_ms).add("network", options.network->name);
    if (best) {
      line.add("model", best->candidate.name());
      for (const auto& [name, value] : figures(*best, figures_of(truth), truth.block())) add(line, name, value);
    } else {
      line.add("model", std::optional<double>());
    }
    out << line.add("commit", kCommit).str() << "\n";
  } else if (!best) {
    out << "\nNo model and mesh is fast enough and does not vibrate.\n";
  } else {
    out << "\nMost accurate at the hand, on this machine and with the network " << options.network->name;
    if (options.budget_ms) out << ", in " << shortest(*options.budget_ms) << " ms";
    out << ": " << best->candidate.name() << " with n = " << best->candidate.n << ", "
        << with_tenths(100 * best->felt->force_error) << " % error at the hand, and an own error of "
        << with_tenths(100 * best->at_load[0].total) << " %.\n";
  }
}

JsonLine line_of(const MeshErrors& errors) {
  JsonLine line;
  line.add("model", errors.point.candidate.name()).add("n", errors.point.candidate.n);
  line.add("left_out", errors.left_out);
  visit_numbers(errors, [&](const std::string& name, const auto& value) { line.add(name, value); });
  line.add("commit", kCommit);
  return line;
}

MeshErrors read_errors(const Candidate& candidate, const nlohmann::json& line) {
  MeshErrors errors{.point = {.candidate = candidate, .timed = false}, .left_out = line.at("left_out")};
  visit_numbers(errors, [&](const std::string& name, auto& value) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, double>) {
      value = number_of(line, name);
    } else {
      line.at(name).get_to(value);
    }
  });
  return errors;
}

bool may_be_best(const AccuracyPoint& point, const std::vector<AccuracyPoint>& others) {
  for (std::size_t load = 0; load < point.at_load.size(); ++load) {
    const Accuracy& own = point.at_load[load];
    const double error = std::isfinite(own.without_luck()) ? own.without_luck() : std::abs(own.total);
    const bool beaten = std::ranges::any_of(others, [&](const AccuracyPoint& other) {
      // Equal up to rounding: the same mesh solved by another method.
      return at_the_hand_ms(other) <= at_the_hand_ms(point) && 0.999 * other.at_load[load].without_luck() <= error;
    });
    if (!beaten && std::isfinite(error)) return true;
  }
  return false;
}

std::vector<AccuracyPoint> pareto_front(std::vector<AccuracyPoint> points, std::size_t load) {
  const auto error = [load](const AccuracyPoint& p) { return p.at_load.at(load).without_luck(); };
  std::erase_if(points, [&](const AccuracyPoint& p) { return !std::isfinite(error(p)); });
  std::ranges::sort(points, {}, &AccuracyPoint::update_ms_p50);
  double best = std::numeric_limits<double>::infinity();
  std::erase_if(points, [&](const AccuracyPoint& p) {
    if (error(p) > 0.999 * best) return true;  // same mesh solved by another method
    best = error(p);
    return false;
  });
  return points;
}

double cost_exponent(const std::vector<AccuracyPoint>& ladder) {
  const auto count = static_cast<double>(ladder.size());
  double x = 0;
  double y = 0;
  double xx = 0;
  double xy = 0;
  for (const AccuracyPoint& p : ladder) {
    const double unknowns = std::log(static_cast<double>(p.size.free));
    const double cost = std::log(p.update_ms_p50);
    x += unknowns;
    y += cost;
    xx += unknowns * unknowns;
    xy += unknowns * cost;
  }
  const double spread = count * xx - x * x;
  return spread > 1e-9 * count * xx ? (count * xy - x * y) / spread : std::numeric_limits<double>::quiet_NaN();
}

const AccuracyPoint* closest_at_the_hand(const std::vector<AccuracyPoint>& points, double budget_ms) {
  const AccuracyPoint* best = nullptr;
  for (const AccuracyPoint& p : points) {
    if (!p.felt || !(p.update_ms_p50 <= budget_ms) || !(p.felt->vibration <= kMostVibration)) continue;
    if (best == nullptr || p.felt->force_error < best->felt->force_error) best = &p;
  }
  return best;
}

}  // namespace tendon::lab
