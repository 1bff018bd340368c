// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/accuracy.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <limits>
#include <map>
#include <memory>
#include <new>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <tuple>
#include <utility>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/quasi_static.h"
#include "core/base/expect.h"
#include "server/build_info.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/experiments/accuracy_pictures.h"
#include "tests/tools/lab/experiments/accuracy_table.h"
#include "tests/tools/lab/experiments/pressed_engine.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::lab {
namespace {

using namespace softbody;

constexpr double kNoNumber = std::numeric_limits<double>::quiet_NaN();
constexpr std::size_t kManyUpdates = 400;  // timed updates; fewer after kSettled or kLongestTiming
constexpr double kSettled = 0.03;          // relative difference of the medians of two passes
constexpr double kLongestTiming = 4;       // s
constexpr std::size_t kFirstUpdates = 10;  // enough to detect a far too slow candidate

/// Returns the material to which a model converges on a fine mesh; see Accuracy.
Material material_of(const PressedBlock& block, const AnyModel& model) {
  if (model == AnyModel(compared::Kind::kProjective)) return {.young = 2 * block.material.mu(), .poisson = 0};
  if (model == AnyModel(compared::Kind::kMassSpring)) return {.young = block.material.young, .poisson = 0.25};
  return block.material;
}

/// Exact solution of a model's law on its mesh, up to rounding. Models with the same law share results.
class OnMesh {
 public:
  explicit OnMesh(const PressedBlock& block) : block_(block) {}

  const std::array<Stiffness, 2>& of(const Candidate& candidate) {
    const Material material = material_of(block_, candidate.model);
    const Key key{law_of(candidate.model), candidate.element, candidate.n, material.young, material.poisson};
    const auto known = known_.find(key);
    return known != known_.end() ? known->second : known_.emplace(key, found(candidate, material)).first->second;
  }

 private:
  using Key = std::tuple<softbody::Law, Element, int, double, double>;

  std::array<Stiffness, 2> found(const Candidate& candidate, const Material& material) const {
    const Solid solid = solid_of(block_, candidate, law_of(candidate.model), material);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), block_.patch_radius);
    const Patch patch = *top.patch(top.across(block_.touch_point()));
    std::unique_ptr<Model> model;
    if (solid.law() == softbody::Law::kLinear) {
      model = std::make_unique<LinearModel>(solid, top);
    } else {
      model = std::make_unique<QuasiStaticModel>(solid, top, QuasiStaticModel::Config{.tolerance = 1e-10});
    }
    std::array<Stiffness, 2> result;
    for (std::size_t i = 0; i < result.size(); ++i) {
      const Reaction reaction = model->press(patch, Prescribed::kForce, block_.loads[i]);
      result[i] = {reaction.force / reaction.depth, reaction.stiffness};
    }
    return result;
  }

  const PressedBlock& block_;
  std::map<Key, std::array<Stiffness, 2>> known_;
};

Accuracy accuracy_of(const Reaction& reaction, const Stiffness& right, double solver) {
  const double k = reaction.force / reaction.depth;
  return {.k = k,
          .total = k / right.secant - 1,
          .model = kNoNumber,
          .discretisation = kNoNumber,
          .solver = solver,
          .tangent = reaction.stiffness / right.tangent - 1};
}

void split_error(AccuracyPoint& point, Truth& truth, OnMesh& on_mesh) {
  const AnyModel& model = point.candidate.model;
  const Material material = material_of(truth.block(), model);
  for (std::size_t load = 0; load < point.at_load.size(); ++load) {
    const auto limit = truth.limit(law_of(model), material, load);
    if (!limit) continue;
    Accuracy& error = point.at_load[load];
    const double right = truth.stiffness(load).secant;
    if (point.candidate.elsewhere()) {
      error.model = limit->secant / right - 1;
      error.discretisation = error.total - error.model - error.solver;
      continue;
    }
    const double mesh = on_mesh.of(point.candidate)[load].secant;
    if (model == AnyModel(compared::Kind::kMassSpring)) {
      // These models have converged; the mesh's error is that of the body with ν = 1/4.
      error.model = limit->secant * error.k / mesh / right - 1;
      error.discretisation = error.total - error.model;
      error.solver = 0;
    } else {
      error.model = limit->secant / right - 1;
      error.discretisation = (mesh - limit->secant) / right;
      error.solver = (error.k - mesh) / right;
    }
  }
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

double floor_of(const Meter& meter) {
  std::vector<double> idle;
  for (int i = 0; i < 200; ++i) {
    const Meter::Reading before = meter.read();
    idle.push_back((meter.read() - before).processor);
  }
  return quantile(idle, 0.5);
}

/// Moves the tool to the next position of the script. The number of steps is that of a dynamic body in the same time.
template <class Touch>
void walk(const PressedEngine& engine, const std::vector<Touched>& script, std::size_t to, Touch touch) {
  const int steps =
      engine.step() > 0 ? std::max(1, static_cast<int>(std::lround(Truth::kScriptInterval / engine.step()))) : 1;
  const Vec3& from = script[to == 0 ? 0 : to - 1].tool;
  for (int step = 1; step <= steps; ++step) touch(from + static_cast<double>(step) / steps * (script[to].tool - from));
}

/// Follows the script once. With a meter, times the updates and repeats the script until their median is stable.
void follow_script(PressedEngine& engine, const std::vector<Touched>& script, const Meter* meter, double slowest_ms,
                   AccuracyPoint& point) {
  const double floor = meter != nullptr ? floor_of(*meter) : 0;
  std::vector<double> times;
  std::vector<double> instructions;
  const auto touch = [&](const Vec3& tool) {
    if (meter == nullptr) return engine.touch(tool).force;
    const Meter::Reading before = meter->read();
    const Feel feel = engine.touch(tool);
    const Meter::Reading took = meter->read() - before;
    if (feel.touching) {
      times.push_back(std::max(0.0, engine.took(took) - floor));
      if (took.instructions && !point.candidate.elsewhere())
        instructions.push_back(static_cast<double>(*took.instructions));
      if (times.size() == kFirstUpdates && 1e3 * quantile(times, 0.5) > 2 * slowest_ms) {
        throw TooSlow("an update takes more than " + shortest(slowest_ms) + " ms");
      }
    }
    return feel.force;
  };

  const Meter::Reading start = meter != nullptr ? meter->read() : Meter::Reading{};
  double squares = 0;
  double true_squares = 0;
  double largest = 0;
  double aside = 0;
  for (std::size_t i = 0; i < script.size(); ++i) {
    Vec3 force = Vec3::Zero();
    walk(engine, script, i, [&](const Vec3& tool) { force = touch(tool); });
    const Vec3 error = force - script[i].force;
    squares += error.squaredNorm();
    true_squares += script[i].force.squaredNorm();
    largest = std::max(largest, script[i].force.norm());
    point.force_most = std::max(point.force_most, error.norm());
    if (i < script.size() / 3) aside = std::max(aside, error.head<2>().norm());  // while pressing straight down
  }
  point.force_error = std::sqrt(squares / static_cast<double>(script.size()));
  point.force_relative = std::sqrt(squares / true_squares);
  point.lateral = aside / largest;

  if (meter == nullptr) return;
  bool settled = times.empty();
  while (!settled && times.size() < kManyUpdates && engine.took(meter->read() - start) < kLongestTiming) {
    const double before = quantile(times, 0.5);
    for (std::size_t i = 0; i < script.size(); ++i) walk(engine, script, i, touch);
    settled = std::abs(quantile(times, 0.5) / before - 1) < kSettled;
  }
  point.update_ms_p50 = 1e3 * quantile(times, 0.5);
  point.update_ms_p99 = 1e3 * quantile(times, 0.99);
  if (!instructions.empty()) point.instructions = quantile(instructions, 0.5);
}

/// From the last two points with cost ∝ n^p, or from one with the given p.
double predicted(const std::vector<AccuracyPoint>& ladder, int n, double AccuracyPoint::*cost, double power) {
  if (ladder.empty()) return 0;
  const AccuracyPoint& last = ladder.back();
  if (ladder.size() > 1) {
    const AccuracyPoint& before = ladder[ladder.size() - 2];
    power = std::log(last.*cost / before.*cost) / std::log(static_cast<double>(last.candidate.n) / before.candidate.n);
  }
  return last.*cost * std::pow(static_cast<double>(n) / last.candidate.n, power);
}

constexpr double kPowerOfFactors = 6;
constexpr double kPowerOfSolutions = 4;
constexpr double kPowerOfMeasuring = 2;  // the loop at the hand does not depend on the mesh

/// On increasingly fine meshes, within the limits on update, setup and total time. `measured` returns a point or
/// throws.
template <class Measured>
std::vector<AccuracyPoint> ladder(Candidate candidate, const AccuracyOptions& options,
                                  std::vector<std::string>& left_out, Measured measured) {
  std::vector<AccuracyPoint> points;
  const double longest_setup = options.longest_setup_s.value_or(options.budget_ms ? 5 : 30);
  for (const int n : options.resolutions) {
    candidate.n = n;
    const std::string name = candidate.name() + " n=" + std::to_string(n);
    if (predicted(points, n, &AccuracyPoint::update_ms_p50, kPowerOfSolutions) > options.slowest_ms ||
        predicted(points, n, &AccuracyPoint::setup_s, kPowerOfFactors) > longest_setup ||
        predicted(points, n, &AccuracyPoint::measuring_s, kPowerOfMeasuring) > options.longest_point_s) {
      left_out.push_back(name + ": takes too long");
      break;
    }
    if (options.part.progress) std::cerr << "\r" << name << "            " << std::flush;
    try {
      points.push_back(measured(candidate));
    } catch (const TooSlow& error) {
      left_out.push_back(name + ": " + error.what());
      break;
    } catch (const std::exception& error) {
      left_out.push_back(name + ": " + error.what());
    }
  }
  return points;
}

std::vector<AnyModel> models_of(const AccuracyOptions& options) {
  if (!options.models.empty()) return options.models;
  // The fastest first, because it sets the error that the others must beat.
  if (options.budget_ms) return {ModelKind::kCondensed, ModelKind::kCorotational, ModelKind::kNeoHookean};
  return all_models();
}

std::vector<Element> elements_of(const AccuracyOptions& options) {
  if (!options.elements.empty()) return options.elements;
  std::vector<Element> all;
  for (const ElementInfo& element : elements()) all.push_back(element.element);
  return all;
}

/// Returns each model with each element, but without a mesh. The workers are last.
std::vector<Candidate> families(const AccuracyOptions& options) {
  std::vector<Candidate> all;
  for (const AnyModel& model : models_of(options)) {
    for (const Element element : elements_of(options)) {
      if (wants_tetrahedra(model) && element != Element::kTet4) continue;
      all.push_back({model, element, 0});
      if (!options.learned || model != AnyModel(ModelKind::kNear)) continue;
      all.push_back({model, element, 0, Candidate::By::kLearned});
      all.push_back({model, element, 0, Candidate::By::kTable});
    }
  }
  if (!options.worker.empty()) {
    for (const Element element : elements_of(options))
      all.push_back({ModelKind::kLinear, element, 0, Candidate::By::kWorker});
  }
  return all;
}

struct Trial {
  AccuracyPoint point;
  std::unique_ptr<PressedEngine> engine;
};

/// Measures the answers and, with a meter, their cost; neither splits the errors nor runs the loop at the hand.
Trial tried(const Candidate& candidate, Truth& truth, const Meter* meter, double slowest_ms,
            const std::string& worker = {}) {
  const PressedBlock& block = truth.block();
  const Meter::Reading before = meter != nullptr ? meter->read() : Meter::Reading{};
  Trial trial{.point = {.candidate = candidate, .timed = meter != nullptr},
              .engine = engine_of(block, candidate, worker)};
  AccuracyPoint& point = trial.point;
  PressedEngine& engine = *trial.engine;
  if (meter != nullptr) point.setup_s = engine.took(meter->read() - before);
  point.size = engine.size();
  point.step_ms = 1e3 * engine.step();
  follow_script(engine, truth.script(), meter, slowest_ms, point);
  for (std::size_t load = 0; load < point.at_load.size(); ++load) {
    const Reaction reaction = engine.under(block.loads[load]);
    point.at_load[load] = accuracy_of(reaction, truth.stiffness(load),
                                      candidate.elsewhere() ? reaction.error / reaction.force : kNoNumber);
  }
  return trial;
}

void feel(Trial& trial, Truth& truth, const Network& network, double longest_s) {
  AccuracyPoint& point = trial.point;
  point.felt = felt(*trial.engine, truth, route_of(network, std::max(point.update_ms_p50, point.step_ms)), network.seed,
                    longest_s);
}

AccuracyPoint measure(const Candidate& candidate, Truth& truth, OnMesh& on_mesh, const Meter& meter,
                      const std::optional<Network>& network, const Patience& patience, const std::string& worker) {
  truth.script();
  truth.limit(law_of(candidate.model), material_of(truth.block(), candidate.model), 0);
  const Meter::Reading before = meter.read();
  Trial trial = tried(candidate, truth, &meter, patience.update_ms, worker);
  split_error(trial.point, truth, on_mesh);
  if (network) feel(trial, truth, *network, patience.felt_s);
  trial.point.measuring_s = trial.engine->took(meter.read() - before);
  return trial.point;
}

}  // namespace

AccuracyPoint measure(const Candidate& candidate, Truth& truth, const Meter& meter,
                      const std::optional<Network>& network, const Patience& patience, const std::string& worker) {
  OnMesh on_mesh(truth.block());
  return measure(candidate, truth, on_mesh, meter, network, patience, worker);
}

namespace {

std::optional<AccuracyPoint> best_within(const AccuracyOptions& options, Truth& truth, OnMesh& on_mesh,
                                         const Meter& meter) {
  std::vector<Trial> kept;
  std::vector<AccuracyPoint> rivals;
  const auto keep = [&](Trial trial) {
    if (!may_be_best(trial.point, rivals)) return;  // does not depend on the division of its errors
    split_error(trial.point, truth, on_mesh);
    if (!may_be_best(trial.point, rivals)) return;
    std::erase_if(kept, [&](const Trial& one) { return !may_be_best(one.point, {trial.point}); });
    kept.push_back(std::move(trial));
    rivals.clear();
    for (const Trial& one : kept) rivals.push_back(one.point);
  };
  std::vector<std::string> left_out;
  for (const Candidate& family : families(options)) {
    ladder(family, options, left_out, [&](const Candidate& candidate) {
      const Meter::Reading before = meter.read();
      Trial trial = tried(candidate, truth, &meter, *options.budget_ms, options.worker);
      trial.point.measuring_s = trial.engine->took(meter.read() - before);
      AccuracyPoint point = trial.point;
      if (point.update_ms_p50 <= *options.budget_ms) keep(std::move(trial));
      return point;
    });
  }
  std::vector<AccuracyPoint> at_hand;
  for (Trial& trial : kept) {
    if (options.part.progress) {
      std::cerr << "\rerror at the hand: " << trial.point.candidate.name() << " n=" << trial.point.candidate.n
                << "            " << std::flush;
    }
    feel(trial, truth, *options.network, std::numeric_limits<double>::infinity());
    at_hand.push_back(trial.point);
  }
  if (options.part.progress) std::cerr << "\n";
  const AccuracyPoint* const best = closest_at_the_hand(at_hand, *options.budget_ms);
  return best == nullptr ? std::nullopt : std::optional(*best);
}

/// ms, median, both directions.
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

void check(const AccuracyOptions& options) {
  if (options.resolutions.empty() || options.resolutions.front() < 1 ||
      !std::ranges::is_sorted(options.resolutions, std::less_equal<>())) {
    throw std::invalid_argument("--n: expected ascending numbers of cells, for example 4,8,16");
  }
  if (options.budget_ms && !options.network) throw std::invalid_argument("--budget-ms: requires --network");
  if (options.budget_ms && options.out) {
    throw std::invalid_argument("--out: cannot be used with --budget-ms, which draws no figure");
  }
  options.block.check();
  if (options.learned && options.budget_ms) throw std::invalid_argument("--learned: cannot be used with --budget-ms");
  if (options.learned && std::ranges::count(models_of(options), AnyModel(ModelKind::kNear)) == 0) {
    throw std::invalid_argument("--learned: expected the model near in --models, because only its bodies learn");
  }
  if (options.errors_only && (options.network || options.budget_ms)) {
    throw std::invalid_argument(
        "--errors-only, --units and --from: cannot be used with --network or --budget-ms, whose results depend on "
        "times");
  }
  if (options.errors_only && !options.worker.empty()) {
    throw std::invalid_argument(
        "--worker: cannot be used with --errors-only, --units or --from, whose results must be identical in each run");
  }
  if (options.network) route_of(*options.network, 0);  // rejects an unknown network before measuring
}

std::vector<Candidate> candidates(const AccuracyOptions& options) {
  std::vector<Candidate> all;
  for (Candidate candidate : families(options)) {
    for (const int n : options.resolutions) {
      candidate.n = n;
      all.push_back(candidate);
    }
  }
  return all;
}

struct Bench {
  explicit Bench(const AccuracyOptions& options) : truth(options.block, options.truth), on_mesh(truth.block()) {
    truth.script();
  }
  Truth truth;
  OnMesh on_mesh;
};

MeshErrors errors_of(const Candidate& candidate, Bench& bench) {
  MeshErrors errors{.point = {.candidate = candidate, .timed = false}, .truth = figures_of(bench.truth)};
  try {
    Trial trial = tried(candidate, bench.truth, nullptr, 0);
    split_error(trial.point, bench.truth, bench.on_mesh);
    errors.point = trial.point;
  } catch (const std::bad_alloc&) {
    throw;  // another machine may have enough memory
  } catch (const std::exception& error) {
    errors.left_out = error.what();
  }
  return errors;
}

void write_csv(const AccuracyOptions& options, const std::vector<AccuracyPoint>& points, const TruthFigures& truth) {
  CsvTable table(options.command);
  for (const AccuracyPoint& point : points) table.add(json_of(point, truth, options.block));
  table.write(*options.out / "accuracy.csv");
}

void errors_only(const AccuracyOptions& options, std::ostream& out) {
  const std::vector<Candidate> meshes = candidates(options);
  if (meshes.empty()) throw std::invalid_argument("--models, --elements: none of these models has such an element");
  std::unique_ptr<Bench> bench;
  const SweptWork<MeshErrors> work{
      .what = "meshes",
      .units = meshes.size(),
      .run =
          [&](std::uint64_t unit) {
            if (!bench) bench = std::make_unique<Bench>(options);
            return errors_of(meshes.at(unit), *bench);
          },
      .lines =
          [](std::uint64_t /*unit*/, const MeshErrors& errors) {
            std::vector<JsonLine> lines;
            lines.push_back(line_of(errors));
            return lines;
          },
      .read = [&](std::uint64_t unit,
                  const std::vector<nlohmann::json>& lines) { return read_errors(meshes.at(unit), lines.at(0)); },
      .count =
          [](const MeshErrors& errors, ShardEnd& end) {
            end.count("meshes", 1);
            end.count("left_out", errors.left_out.empty() ? 0 : 1);
            end.count("unknowns", errors.point.size.free);
          }};
  const auto all = outcomes(work, options.part, out);
  if (!all) return;
  Ladders ladders;
  std::vector<AccuracyPoint> points;
  for (const MeshErrors& one : *all) {
    if (!one.left_out.empty()) continue;
    if (points.empty() || points.back().candidate.name() != one.point.candidate.name()) ladders.emplace_back();
    ladders.back().push_back(one.point);
    points.push_back(one.point);
  }
  const TruthFigures& truth = all->front().truth;
  if (options.json) {
    for (const AccuracyPoint& point : points) out << json_of(point, truth, options.block).str() << "\n";
  } else {
    write_truth(out, truth, options.block);
    out << heading(false);
    for (const AccuracyPoint& point : points) write_row(out, point);
    for (const MeshErrors& one : *all) {
      if (one.left_out.empty()) continue;
      out << "omitted: " << one.point.candidate.name() << " n=" << one.point.candidate.n << ": " << one.left_out
          << "\n";
    }
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    write_csv(options, points, truth);
    if (!ladders.empty()) draw(options, ladders, 0);
    if (!options.json) out << "written: " << (*options.out / "accuracy.csv").string() << " and a figure\n";
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace

void accuracy(const AccuracyOptions& given, std::ostream& out) {
  AccuracyOptions options = given;
  options.errors_only = given.errors_only || given.part.units || given.part.from;
  check(options);
  if (options.errors_only) return errors_only(options, out);
  if (options.part.progress) std::cerr << "computing the reference …" << std::flush;
  Truth truth(options.block, options.truth);
  truth.script();  // computed now, so that it is not charged to the first point
  const Meter meter;
  OnMesh on_mesh(options.block);
  if (options.budget_ms) {
    write_answer(out, options, best_within(options, truth, on_mesh, meter), truth);
    return;
  }
  const bool rows = !options.json;
  if (rows) {
    write_truth(out, figures_of(truth), options.block);
    out << heading(true);
  }
  std::vector<std::string> left_out;
  Ladders ladders;
  std::vector<AccuracyPoint> all;
  for (const Candidate& family : families(options)) {
    std::vector<AccuracyPoint> points = ladder(family, options, left_out, [&](const Candidate& candidate) {
      const AccuracyPoint point =
          measure(candidate, truth, on_mesh, meter, options.network,
                  {.update_ms = options.slowest_ms, .felt_s = options.longest_point_s}, options.worker);
      if (rows) {
        write_row(out, point);
      } else {
        out << to_json(point, truth) << "\n";
      }
      out.flush();
      return point;
    });
    all.insert(all.end(), points.begin(), points.end());
    if (!points.empty()) ladders.push_back(std::move(points));
  }
  if (options.part.progress) std::cerr << "\n";
  if (rows) {
    out << "\n"
           "Best for the small load: no other mesh is both faster and more accurate (without the cancellation of "
           "errors):\n"
        << heading(true);
    for (const AccuracyPoint& point : pareto_front(all, 0)) write_row(out, point);
    write_exponents(out, ladders);
    if (options.network) {
      out << "\nAt the hand, with the network " << options.network->name << ", seed " << options.network->seed << ":\n"
          << kFeltHeading;
      for (const AccuracyPoint& point : all) write_felt(out, point);
    }
    if (!options.worker.empty()) {
      out << "\nworker: " << options.worker
          << "; its times are elapsed times, and its solver error is the bound that it sends\n";
    }
    for (const std::string& one : left_out) out << "omitted: " << one << "\n";
  }
  if (options.network && rows) {
    std::vector<AccuracyPoint> asked = all;
    if (options.models.empty()) std::erase_if(asked, [](const auto& p) { return for_comparison(p.candidate.model); });
    if (const AccuracyPoint* const best = closest_at_the_hand(asked, std::numeric_limits<double>::infinity())) {
      write_answer(out, options, *best, truth);
    }
  }
  if (options.out) {
    std::filesystem::create_directories(*options.out);
    write_csv(options, all, figures_of(truth));
    if (!ladders.empty()) draw(options, ladders, options.network ? round_trip_ms(*options.network) : 0);
    if (rows) out << "written: " << (*options.out / "accuracy.csv").string() << " and a figure\n";
  }
  if (!out.flush()) throw std::runtime_error("cannot write the table: is the disk full?");
}

}  // namespace tendon::lab
