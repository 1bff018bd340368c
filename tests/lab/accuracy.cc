// SPDX-License-Identifier: Apache-2.0
#include "tests/lab/accuracy.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <limits>
#include <memory>
#include <stdexcept>
#include <utility>

#include "clients/softbody/explicit.h"
#include "clients/softbody/linear.h"
#include "clients/softbody/mesh.h"
#include "clients/softbody/quasi_static.h"
#include "clients/softbody/solid.h"
#include "server/build_info.h"
#include "tests/injector/injector.h"
#include "tests/injector/named_profiles.h"
#include "tests/lab/gnuplot.h"
#include "tests/lab/json.h"
#include "tests/lab/panels.h"

namespace tendon::lab {
namespace {

using namespace softbody;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kLeastUpdates = 400;  // timed, unless …
constexpr double kLongestTiming = 4;        // s
constexpr double kReach = 0.3;              // patch radii, that a table of the surface holds
constexpr int kStaticModes = 3;             // along each axis of that, of a modal body
/// Of the stiffness of a surface that a bare finger pad feels: Bergmann Tiest & Kappers 2009.
constexpr double kJustNoticeable = 15;  // %

std::array<int, 3> cells_of(const PressedBlock& block, int n) {
  const auto along = [&](int axis) {
    return std::max(1, static_cast<int>(std::lround(n * block.size[axis] / block.size.x())));
  };
  return {n, along(1), along(2)};
}

/// The block of water's density, cut up and held.
constexpr double kDensity = 1000;  // kg/m³

Solid solid_of(const PressedBlock& block, const Candidate& candidate) {
  Mesh mesh = softbody::block(info(candidate.element).shape, block.size, cells_of(block, candidate.n));
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  return {std::move(mesh), candidate.element, block.material, info(candidate.model).law, fixed};
}

BodyConfig body_of(const PressedBlock& block, const Candidate& candidate) {
  BodyConfig config;
  config.shape = BlockShape{block.size, cells_of(block, candidate.n)};
  config.element = candidate.element;
  config.material = block.material;
  config.model = candidate.model;
  config.patch_radius = block.patch_radius;
  config.reach = kReach * block.patch_radius;
  config.middle = block.touch_point();
  config.static_modes = kStaticModes;
  if (info(candidate.model).has_time()) {
    // Slowed enough to be at rest soon. Explicit steps as long as they may be, with something to spare for a body that
    // is pressed together, and none longer than a period of the device.
    const double step = std::min(1e-3, 0.7 * largest_step(solid_of(block, candidate), kDensity));
    config.effects = {.density = kDensity, .step = step, .inertia = true, .damping = 40};
  }
  return config;
}

/// Whether a model becomes its law as the mesh is refined. Springs along edges and elements that are each as rigid as
/// possible become something else, that has no name.
bool follows_its_law(ModelKind model) { return model != ModelKind::kMassSpring && model != ModelKind::kProjective; }

/// The same law on the same mesh, solved until rounding is all that is left.
std::array<Stiffness, 2> exact(const PressedBlock& block, const Candidate& candidate) {
  const Solid solid = solid_of(block, candidate);
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), block.patch_radius);
  const Patch patch = *top.patch(top.across(block.touch_point()));
  std::unique_ptr<Model> model;
  if (solid.law() == softbody::Law::kLinear) {
    model = std::make_unique<LinearModel>(solid, top);
  } else {
    model = std::make_unique<QuasiStaticModel>(solid, top, QuasiStaticModel::Config{.tolerance = 1e-10});
  }
  std::array<Stiffness, 2> result;
  for (std::size_t i = 0; i < result.size(); ++i) {
    const Reaction reaction = model->press(patch, Given::kForce, block.loads[i]);
    result[i] = {reaction.force / reaction.depth, reaction.stiffness};
  }
  return result;
}

Accuracy accuracy_at(const Reaction& reaction, const Stiffness& mesh, Truth& truth, const Candidate& candidate,
                     std::size_t load) {
  const Stiffness right = truth.stiffness(load);
  Accuracy result;
  result.k = reaction.force / reaction.depth;
  result.total = result.k / right.secant - 1;
  result.tangent = reaction.stiffness / right.tangent - 1;
  result.solver = (result.k - mesh.secant) / right.secant;
  if (!follows_its_law(candidate.model)) {
    result.model = result.discretisation = result.solver = kNoNumber;
    return result;
  }
  const auto limit = truth.limit(info(candidate.model).law, load);
  result.model = limit ? limit->secant / right.secant - 1 : kNoNumber;
  result.discretisation = limit ? (mesh.secant - limit->secant) / right.secant : kNoNumber;
  return result;
}

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return kNoNumber;
  const auto at = values.begin() + std::lround(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

Route route_of(const Network& network, double update_ms) {
  return {.there = injector::resolve_profile(network.name, injector::Direction::kDown),
          .back = injector::resolve_profile(network.name, injector::Direction::kUp),
          .compute = from_seconds(1e-3 * update_ms)};
}

/// What the meter itself costs.
double floor_of(const Meter& meter) {
  std::vector<double> idle;
  for (int i = 0; i < 200; ++i) {
    const Meter::Reading before = meter.read();
    idle.push_back((meter.read() - before).processor);
  }
  return quantile(idle, 0.5);
}

/// The tool goes from one place of the script to the next, in as many steps as a body with time makes meanwhile.
template <class Touch>
void walk(const Body& body, const std::vector<Touched>& script, std::size_t to, Touch touch) {
  const int steps =
      body.step() > 0 ? std::max(1, static_cast<int>(std::lround(Truth::kScriptInterval / body.step()))) : 1;
  const Vec3& from = script[to == 0 ? 0 : to - 1].tool;
  for (int step = 1; step <= steps; ++step) touch(from + static_cast<double>(step) / steps * (script[to].tool - from));
}

void time_updates(Body& body, const std::vector<Touched>& script, const Meter& meter, AccuracyPoint& point) {
  const double floor = floor_of(meter);
  std::vector<double> times;
  std::vector<double> instructions;
  const Meter::Reading start = meter.read();
  do {
    for (std::size_t i = 0; i < script.size(); ++i) {
      walk(body, script, i, [&](const Vec3& tool) {
        const Meter::Reading before = meter.read();
        const Feel feel = body.touch(tool);
        const Meter::Reading took = meter.read() - before;
        if (!feel.touching) return;
        times.push_back(std::max(0.0, took.processor - floor));
        if (took.instructions) instructions.push_back(static_cast<double>(*took.instructions));
      });
    }
  } while (!times.empty() && times.size() < kLeastUpdates && (meter.read() - start).processor < kLongestTiming);
  point.update_ms_p50 = 1e3 * quantile(times, 0.5);
  point.update_ms_p99 = 1e3 * quantile(times, 0.99);
  if (!instructions.empty()) point.instructions = quantile(instructions, 0.5);
}

void follow_script(Body& body, const std::vector<Touched>& script, AccuracyPoint& point) {
  double squares = 0;
  double true_squares = 0;
  double largest = 0;
  double aside = 0;
  for (std::size_t i = 0; i < script.size(); ++i) {
    Vec3 force;
    walk(body, script, i, [&](const Vec3& tool) { force = body.touch(tool).force; });
    const Vec3 error = force - script[i].force;
    squares += error.squaredNorm();
    true_squares += script[i].force.squaredNorm();
    largest = std::max(largest, script[i].force.norm());
    point.force_most = std::max(point.force_most, error.norm());
    if (i < script.size() / 3) aside = std::max(aside, error.head<2>().norm());  // it still goes straight down
  }
  point.force_error = std::sqrt(squares / static_cast<double>(script.size()));
  point.force_relative = std::sqrt(squares / true_squares);
  point.lateral = aside / largest;
}

/// All that is known of a point, in the order of the columns of the CSV and the members of the JSON.
using Figures = std::vector<std::pair<const char*, double>>;
Figures figures(const AccuracyPoint& p, Truth& truth) {
  const Accuracy& small = p.at_load[0];
  const Accuracy& hard = p.at_load[1];
  const auto& loads = truth.block().loads;
  Figures all{{"n", p.candidate.n},
              {"nodes", static_cast<double>(p.size.nodes)},
              {"k_n_per_m", small.k},
              {"error_percent", 100 * small.total},
              {"update_ms_p50", p.update_ms_p50},
              {"setup_s", p.setup_s},
              {"bytes", static_cast<double>(p.size.bytes)},
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
              {"instructions", p.instructions.value_or(kNoNumber)},
              {"elements", static_cast<double>(p.size.elements)},
              {"free", static_cast<double>(p.size.free)},
              {"truth_k_n_per_m", truth.stiffness(0).secant},
              {"truth_uncertainty_percent", 100 * truth.uncertainty()}};
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

void write_csv(const std::filesystem::path& file, const std::vector<AccuracyPoint>& points, Truth& truth) {
  std::ofstream csv(file);
  csv << "model";
  if (!points.empty()) {
    for (const auto& [name, value] : figures(points.front(), truth)) csv << ',' << name;
  }
  csv << ",commit\n";
  for (const AccuracyPoint& point : points) {
    csv << point.candidate.name();
    for (const auto& [name, value] : figures(point, truth)) {
      csv << ',' << (std::isfinite(value) ? JsonLine::number(value) : std::string());
    }
    csv << ',' << kCommit << '\n';
  }
  if (!csv.flush()) throw std::runtime_error("cannot write " + file.string());
}

// ---- The refinement ladders -----------------------------------------------------------------------------------------

/// What a larger n would cost, from the last two: cost ∝ n^p. From one alone p = 6, which is a factor's.
double predicted(const std::vector<AccuracyPoint>& ladder, int n, double AccuracyPoint::*cost) {
  if (ladder.empty()) return 0;
  const AccuracyPoint& last = ladder.back();
  double power = 6;
  if (ladder.size() > 1) {
    const AccuracyPoint& before = ladder[ladder.size() - 2];
    power = std::log(last.*cost / before.*cost) / std::log(static_cast<double>(last.candidate.n) / before.candidate.n);
  }
  return last.*cost * std::pow(static_cast<double>(n) / last.candidate.n, power);
}

/// The same model and element on finer and finer meshes, up to what an update and a set-up may cost.
std::vector<AccuracyPoint> ladder(ModelKind model, Element element, const AccuracyOptions& options, Truth& truth,
                                  const Meter& meter, std::vector<std::string>& left_out) {
  std::vector<AccuracyPoint> points;
  if (info(model).tetrahedra && element != Element::kTet4) return points;
  for (const int n : options.resolutions) {
    const Candidate candidate{model, element, n};
    const std::string name = candidate.name() + " n=" + std::to_string(n);
    const double update = predicted(points, n, &AccuracyPoint::update_ms_p50);
    const double setup = predicted(points, n, &AccuracyPoint::setup_s);
    if (update > options.slowest_ms || setup > options.longest_setup_s) {
      left_out.push_back(name + ": would take too long");
      break;
    }
    if (options.progress) std::cerr << "\r" << name << "            " << std::flush;
    try {
      points.push_back(measure(candidate, truth, meter, options.network));
    } catch (const std::exception& error) {
      left_out.push_back(name + ": " + error.what());
    }
  }
  return points;
}

std::vector<ModelKind> models_of(const AccuracyOptions& options) {
  if (!options.models.empty()) return options.models;
  std::vector<ModelKind> all;
  for (const ModelInfo& model : models()) all.push_back(model.kind);
  return all;
}

std::vector<Element> elements_of(const AccuracyOptions& options) {
  if (!options.elements.empty()) return options.elements;
  std::vector<Element> all;
  for (const ElementInfo& element : elements()) all.push_back(element.element);
  return all;
}

// ---- Table and figures ----------------------------------------------------------------------------------------------

void write_row(std::ostream& out, const AccuracyPoint& p) {
  const Accuracy& small = p.at_load[0];
  const Accuracy& hard = p.at_load[1];
  std::array<char, 220> line{};
  std::snprintf(line.data(), line.size(),
                "%-24s %3d %6zu %8.1f %+8.1f %+8.1f | %+6.1f %+7.1f %+7.2f | %7.1f %7.1f %8.2f | %9.4f %9.4f %8.0f "
                "%8.2f %8.2f\n",
                p.candidate.name().c_str(), p.candidate.n, p.size.nodes, small.k, 100 * small.total, 100 * hard.total,
                100 * hard.model, 100 * hard.discretisation, 100 * hard.solver, 100 * hard.tangent,
                100 * p.force_relative, 100 * p.lateral, p.update_ms_p50, p.update_ms_p99, 1e3 / p.update_ms_p50,
                p.setup_s, static_cast<double>(p.size.bytes) / 1e6);
  out << line.data();
}

void write_felt(std::ostream& out, const AccuracyPoint& p) {
  std::array<char, 160> line{};
  std::snprintf(line.data(), line.size(), "%-24s %3d %9.4f %+8.1f %8.1f %8.1f %8.0f %8.0f %9.2f %9.0f\n",
                p.candidate.name().c_str(), p.candidate.n, p.update_ms_p50, 100 * p.at_load[0].total,
                100 * p.felt->force_error, 100 * p.felt->held_error, 100 * p.felt->displayed,
                100 * p.felt->limited_share, 1e3 * p.felt->vibration, 1e3 * p.felt->latency);
  out << line.data();
}

constexpr const char* kFeltHeading =
    "                              update  error %        felt error %   shows %  limited vibration   latency\n"
    "model                      n      ms    small  with K     held                     %      mm/s        ms\n";

constexpr const char* kHeading =
    "                                           error %   error % | of the hard load's    | tangent  script lateral |"
    "  update ms                        set-up      MB\n"
    "model                      n  nodes    K N/m   small     hard |  model    mesh  solver |       %       %        % "
    "|"
    "       p50       p99       Hz        s\n";

const char* colour_of(std::size_t i) {
  constexpr std::array kColours{kBlue, kVermilion, kGreen, kPurple, kOrange, kSky, kPale};
  return kColours.at(i % kColours.size());
}

/// |error| over time; a line per model and element, in its model's colour.
Panel error_over_time(const std::string& title, const std::vector<std::vector<AccuracyPoint>>& ladders, double extra_ms,
                      std::size_t load) {
  Panel panel{.title = title, .x_label = "ms", .log_x = true, .log_y = true};
  const auto place = [&](const AccuracyPoint& p) {
    return std::pair(p.update_ms_p50 + extra_ms, std::max(0.01, 100 * std::abs(p.at_load.at(load).total)));
  };
  double quickest = std::numeric_limits<double>::infinity();
  double slowest = 0;
  std::vector<AccuracyPoint> all;
  for (const auto& ladder : ladders) {
    for (const AccuracyPoint& p : ladder) {
      quickest = std::min(quickest, place(p).first);
      slowest = std::max(slowest, place(p).first);
      all.push_back(p);
    }
  }
  panel.x_range = {{quickest / 1.5, slowest * 1.5}};
  panel.curves.push_back({.name = "not noticed",
                          .colour = kGrey,
                          .points = {{quickest / 1.5, kJustNoticeable}, {slowest * 1.5, kJustNoticeable}},
                          .style = Curve::Style::kBelow});
  Curve front{.name = "best", .colour = kInk, .style = Curve::Style::kBold};
  for (const AccuracyPoint& p : pareto_front(all, load)) front.points.push_back(place(p));
  panel.curves.push_back(front);
  std::vector<ModelKind> seen;
  for (const auto& ladder : ladders) {
    const ModelKind kind = ladder.front().candidate.model;
    const auto known = std::ranges::find(seen, kind);
    const auto colour = colour_of(static_cast<std::size_t>(known - seen.begin()));
    Curve curve{.name = known == seen.end() ? std::string(info(kind).name) : std::string(), .colour = colour};
    if (known == seen.end()) seen.push_back(kind);
    for (const AccuracyPoint& p : ladder) curve.points.push_back(place(p));
    panel.curves.push_back(curve);
    curve.name.clear();
    curve.style = Curve::Style::kPoints;
    panel.curves.push_back(curve);
  }
  return panel;
}

/// |error| of each element over n, for the first model: what refining brings.
Panel error_over_n(const std::vector<std::vector<AccuracyPoint>>& ladders) {
  const ModelKind kind = ladders.front().front().candidate.model;
  double least = std::numeric_limits<double>::infinity();
  double most = 0;
  for (const auto& ladder : ladders) {
    least = std::min<double>(least, ladder.front().candidate.n);
    most = std::max<double>(most, ladder.back().candidate.n);
  }
  Panel panel{.title = "|error| of K, %, over cells along x: " + std::string(info(kind).name),
              .x_label = "n",
              .x_range = {{least - 0.5, most + 0.5}},
              .log_y = true};
  for (const auto& ladder : ladders) {
    if (ladder.front().candidate.model != kind) continue;
    Curve curve{.name = std::string(info(ladder.front().candidate.element).name),
                .colour = colour_of(panel.curves.size())};
    for (const AccuracyPoint& p : ladder) {
      curve.points.emplace_back(p.candidate.n, std::max(0.01, 100 * std::abs(p.at_load[0].total)));
    }
    panel.curves.push_back(curve);
  }
  return panel;
}

std::string load_text(double newtons) { return JsonLine::number(newtons) + " N"; }

}  // namespace

std::string Candidate::name() const { return std::string(info(model).name) + "-" + std::string(info(element).name); }

AccuracyPoint measure(const Candidate& candidate, Truth& truth, const Meter& meter,
                      const std::optional<Network>& network) {
  const PressedBlock& block = truth.block();
  AccuracyPoint point{.candidate = candidate};
  const Meter::Reading before = meter.read();
  Body body(body_of(block, candidate));
  point.setup_s = (meter.read() - before).processor;
  point.size = body.size();
  point.step_ms = 1e3 * body.step();
  time_updates(body, truth.script(), meter, point);
  follow_script(body, truth.script(), point);
  if (network)
    point.felt = felt(body, truth, route_of(*network, std::max(point.update_ms_p50, point.step_ms)), network->seed);
  const std::array<Stiffness, 2> mesh = exact(block, candidate);
  for (std::size_t load = 0; load < mesh.size(); ++load) {
    point.at_load[load] =
        accuracy_at(body.settle(Given::kForce, block.loads[load]), mesh[load], truth, candidate, load);
  }
  return point;
}

std::vector<AccuracyPoint> pareto_front(std::vector<AccuracyPoint> points, std::size_t load) {
  const auto error = [load](const AccuracyPoint& p) { return p.at_load.at(load).without_luck(); };
  std::erase_if(points, [&](const AccuracyPoint& p) { return !std::isfinite(error(p)); });
  std::ranges::sort(points, {}, &AccuracyPoint::update_ms_p50);
  double best = std::numeric_limits<double>::infinity();
  std::erase_if(points, [&](const AccuracyPoint& p) {
    if (error(p) > 0.999 * best) return true;  // the same mesh by another way is not closer
    best = error(p);
    return false;
  });
  return points;
}

const AccuracyPoint* closest_at_the_hand(const std::vector<AccuracyPoint>& points, double budget_ms) {
  const AccuracyPoint* best = nullptr;
  for (const AccuracyPoint& p : points) {
    if (!p.felt || !(p.update_ms_p50 <= budget_ms) || !(p.felt->vibration <= kMostVibration)) continue;
    if (best == nullptr || p.felt->force_error < best->felt->force_error) best = &p;
  }
  return best;
}

std::string to_json(const AccuracyPoint& point, Truth& truth) {
  JsonLine line;
  line.add("model", point.candidate.name());
  for (const auto& [name, value] : figures(point, truth)) line.add(name, value);
  return line.add("commit", kCommit).str();
}

namespace {

/// "420.2"
std::string with_tenths(double value) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f", value);
  return text.data();
}

void write_truth(std::ostream& out, Truth& truth) {
  const auto& loads = truth.block().loads;
  out << "The truth: " << with_tenths(truth.limit(softbody::Law::kLinear, 0)->secant)
      << " N/m while strains are small, " << with_tenths(truth.stiffness(0).secant) << " N/m under "
      << load_text(loads[0]) << ", " << with_tenths(truth.stiffness(1).secant) << " N/m under " << load_text(loads[1])
      << "; its own meshes leave " << with_tenths(100 * truth.uncertainty()) << " % open. Commit " << kCommit << "\n\n";
}

/// Which one to take.
void write_answer(std::ostream& out, const AccuracyOptions& options, const std::vector<AccuracyPoint>& points,
                  Truth& truth) {
  const double budget = options.budget_ms.value_or(std::numeric_limits<double>::infinity());
  const AccuracyPoint* const best = closest_at_the_hand(points, budget);
  if (options.json) {
    if (!options.budget_ms) return;  // all points are there to choose from
    JsonLine line;
    line.add("budget_ms", budget).add("network", options.network->name);
    if (best != nullptr) {
      line.add("model", best->candidate.name());
      for (const auto& [name, value] : figures(*best, truth)) line.add(name, value);
    } else {
      line.add("model", std::optional<double>());
    }
    out << line.add("commit", kCommit).str() << "\n";
  } else if (best == nullptr) {
    out << "\nNo model and mesh is quick enough and leaves the hand quiet.\n";
  } else {
    out << "\nClosest to the truth at the hand, on this machine and behind " << options.network->name;
    if (options.budget_ms) out << ", in " << JsonLine::number(budget) << " ms";
    out << ": " << best->candidate.name() << " with n = " << best->candidate.n << ", "
        << with_tenths(100 * best->felt->force_error) << " % off where its own error is "
        << with_tenths(100 * best->at_load[0].total) << " %.\n";
  }
}

/// ms, the median of both ways.
double round_trip_ms(const Network& network) {
  const Route route = route_of(network, 0);
  std::vector<double> ms;
  injector::Injector there(route.there, network.seed, 0, injector::Direction::kDown, LocalTime{});
  injector::Injector back(route.back, network.seed, 0, injector::Direction::kUp, LocalTime{});
  for (int i = 0; i < 2000; ++i) {
    const LocalTime sent{std::chrono::milliseconds(i)};
    const LocalTime arrived = there.decide({.arrival = sent, .size = 200}).release;
    ms.push_back(1e3 * seconds(back.decide({.arrival = arrived, .size = 200}).release - sent));
  }
  return quantile(ms, 0.5);
}

/// Of all elements of a model the ladder with the point that is felt best.
std::vector<const std::vector<AccuracyPoint>*> felt_best(const std::vector<std::vector<AccuracyPoint>>& ladders) {
  std::vector<const std::vector<AccuracyPoint>*> best;
  const auto least = [](const std::vector<AccuracyPoint>& ladder) {
    double error = std::numeric_limits<double>::infinity();
    for (const AccuracyPoint& p : ladder) error = std::min(error, p.felt->force_error);
    return error;
  };
  for (const auto& ladder : ladders) {
    const auto same = std::ranges::find_if(
        best, [&](const auto* known) { return known->front().candidate.model == ladder.front().candidate.model; });
    if (same == best.end()) {
      best.push_back(&ladder);
    } else if (least(ladder) < least(**same)) {
      *same = &ladder;
    }
  }
  return best;
}

/// What refining a model brings to the hand, over `x` of its points.
template <class X>
Panel felt_over(const std::string& title, const std::string& label,
                const std::vector<std::vector<AccuracyPoint>>& ladders, bool log_x, X x) {
  Panel panel{.title = title, .x_label = label, .log_x = log_x, .log_y = true};
  std::pair<double, double> range{std::numeric_limits<double>::infinity(), 0};
  for (const auto* ladder : felt_best(ladders)) {
    Curve curve{.name = ladder->front().candidate.name(), .colour = colour_of(panel.curves.size() / 2)};
    for (const AccuracyPoint& p : *ladder) {
      range = {std::min<double>(range.first, x(p)), std::max<double>(range.second, x(p))};
      curve.points.emplace_back(x(p), 100 * p.felt->force_error);
    }
    panel.curves.push_back(curve);
    curve.name.clear();
    curve.style = Curve::Style::kPoints;
    panel.curves.push_back(curve);
  }
  panel.x_range = {{range.first / 1.1, range.second * 1.1}};
  return panel;
}

void draw(const AccuracyOptions& options, const std::vector<std::vector<AccuracyPoint>>& ladders) {
  const auto& loads = options.block.loads;
  std::vector<Panel> panels{
      error_over_time("|error| of K, %, under " + load_text(loads[0]) + ", over the time of an update", ladders, 0, 0),
      error_over_time("… under " + load_text(loads[1]), ladders, 0, 1), error_over_n(ladders)};
  if (options.network) {
    panels.push_back(error_over_time(
        "… under " + load_text(loads[0]) + ", over that and " + options.network->name + ", there and back", ladders,
        round_trip_ms(*options.network), 0));
    panels.push_back(felt_over("Error at the hand, %, over cells along x", "n", ladders, false,
                               [](const AccuracyPoint& p) { return p.candidate.n; }));
    panels.push_back(felt_over("… over the time of an update", "ms", ladders, true,
                               [](const AccuracyPoint& p) { return p.update_ms_p50; }));
  }
  draw_panels(*options.out / "accuracy", "What accuracy costs in time",
              "processor time of one core; commit " + std::string(kCommit), panels);
}

}  // namespace

void accuracy(const AccuracyOptions& options, std::ostream& out) {
  if (options.resolutions.empty() || options.resolutions.front() < 1 ||
      !std::ranges::is_sorted(options.resolutions, std::less_equal<>())) {
    throw std::invalid_argument("--n: expected ascending numbers of cells, as in 4,8,16");
  }
  if (options.budget_ms && !options.network) throw std::invalid_argument("--budget-ms: say --network too");
  if (options.network) route_of(*options.network, 0);  // an unknown one is refused before anything is measured
  if (options.progress) std::cerr << "the truth …" << std::flush;
  Truth truth(options.block, options.truth);
  const Meter meter;
  const bool rows = !options.json && !options.budget_ms;
  if (rows) {
    write_truth(out, truth);
    out << kHeading;
  }
  std::vector<std::string> left_out;
  std::vector<std::vector<AccuracyPoint>> ladders;
  std::vector<AccuracyPoint> all;
  for (const ModelKind model : models_of(options)) {
    for (const Element element : elements_of(options)) {
      std::vector<AccuracyPoint> points = ladder(model, element, options, truth, meter, left_out);
      for (const AccuracyPoint& point : points) {
        if (rows) {
          write_row(out, point);
        } else if (!options.budget_ms) {
          out << to_json(point, truth) << std::endl;
        }
      }
      all.insert(all.end(), points.begin(), points.end());
      if (!points.empty()) ladders.push_back(std::move(points));
    }
  }
  if (options.progress) std::cerr << "\n";
  if (rows) {
    out << "\nThe best, small load: nothing else is both quicker and closer (errors that cancel do not count):\n"
        << kHeading;
    for (const AccuracyPoint& point : pareto_front(all, 0)) write_row(out, point);
    if (options.network) {
      out << "\nAt the hand, behind " << options.network->name << ":\n" << kFeltHeading;
      for (const AccuracyPoint& point : all) write_felt(out, point);
    }
    for (const std::string& one : left_out) out << "left out: " << one << "\n";
  }
  if (options.network) write_answer(out, options, all, truth);
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    write_csv(*options.out / "accuracy.csv", all, truth);
    if (!ladders.empty()) draw(options, ladders);
    if (rows) out << "written: " << (*options.out / "accuracy.csv").string() << " and a figure\n";
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
