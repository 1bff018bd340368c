// SPDX-License-Identifier: Apache-2.0
// Cost of an answer and its error on the pressed block B1 at ν = 0.45. The tool moves vertically and sideways and is
// sampled at 100 Hz; dynamic bodies take the time steps in between. error_percent: static stiffness against 420.2 N/m.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <cmath>
#include <ctime>
#include <future>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/models/linear.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/plain_usage.h"
#include "tests/tools/lab/models/pressed_b1.h"

namespace tendon::softbody {
namespace {

template <class AnyBody>
void answer_with(benchmark::State& state, AnyBody& body) {
  const Reaction rest = body.settle(Prescribed::kForce, 0.3);
  const int steps = body.step() > 0 ? static_cast<int>(std::lround(0.01 / body.step())) : 1;
  double time = 0;
  for (auto _ : state) {
    for (int i = 0; i < steps; ++i) {
      time += 0.01 / steps;
      const Vec3 tool(0.003 * std::sin(2 * time), 0.002 * std::cos(3 * time), 0.0485 + 0.001 * std::sin(5 * time));
      benchmark::DoNotOptimize(body.touch(tool));
    }
  }
  state.counters["error_percent"] = 100 * (rest.force / rest.depth / testing::kB1 - 1);
  state.counters["free"] = static_cast<double>(body.size().free);
  state.counters["model_mb"] = static_cast<double>(body.size().bytes) / 1e6;
}

void answer(benchmark::State& state, const BodyConfig& config) {
  Body body(config);
  answer_with(state, body);
}

void still(benchmark::State& state, ModelKind model, Element element) {
  BodyConfig config = testing::pressed_body(model, element, static_cast<int>(state.range(0)));
  config.reach = 0.005;
  answer(state, config);
}

void within_half_a_percent(benchmark::State& state, ModelKind model) {
  BodyConfig config = testing::pressed_body(model, Element::kHex8Sri, static_cast<int>(state.range(0)));
  newton_of(config.model)->tolerance = 5e-3;
  answer(state, config);
}

/// CPU time of this thread, ms.
double processor_time() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return 1e3 * static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_nsec);
}

/// Simulates a second thread with its own processor and answers 1 ms apart: a field is finished after as many answers
/// as the previous one took milliseconds.
struct Beside {
  explicit Beside(Body& body) {
    body.prepare_by([this](std::packaged_task<void()> work) { given.push_back(std::move(work)); });
  }
  void answered() {
    if (given.empty() || ++waited < times.back()) return;
    const double start = processor_time();
    std::exchange(given, {}).front()();
    times.push_back(processor_time() - start);
    waited = 0;
  }
  std::vector<std::packaged_task<void()>> given{};
  std::vector<double> times{20};  ///< CPU time of each field, ms; the first is a guess
  double waited = 0;
};

/// Measures a path 5 mm deep, 20 mm sideways and back, in steps of state.range(1) µm, with a tolerance of 0.5 %.
/// Reports all answers together, and the slowest of those that compute a piece of a near field. `with_thread`: a
/// simulated second thread computes the fields.
void path(benchmark::State& state, ModelKind model, Law law, bool with_thread) {
  BodyConfig config = testing::pressed_body(model, Element::kHex8Sri, static_cast<int>(state.range(0)));
  newton_of(config.model)->tolerance = 5e-3;
  if (auto* near = std::get_if<NearConfig>(&config.model)) near->law = law;
  Body body(config);
  std::optional<Beside> beside;
  if (with_thread) beside.emplace(body);
  const double step = 1e-6 * static_cast<double>(state.range(1));
  std::vector<double> times;
  double with_pieces = 0;
  double slowest_with_pieces = 0;
  double said = 0;
  const auto touch = [&](double aside, double depth) {
    const auto pieces = [&] { return body.near_field().value_or(NearModel::Size{}).pieces; };
    const int before = pieces();
    const double start = processor_time();
    const Feel feel = body.touch(Vec3(aside, 0, 0.05 - depth));
    const double time = processor_time() - start;
    if (beside) beside->answered();
    times.push_back(time);
    said = std::max(said, feel.error / feel.force.z());
    if (pieces() == before) return;
    ++with_pieces;
    slowest_with_pieces = std::max(slowest_with_pieces, time);
  };
  for (auto _ : state) {
    for (double depth = step; depth < 5e-3; depth += step) touch(0, depth);
    for (double aside = 0; aside < 0.02; aside += step) touch(aside, 5e-3);
    for (double aside = 0.02; aside > 0; aside -= step) touch(aside, 5e-3);
  }
  std::ranges::sort(times);
  state.counters["answers"] = static_cast<double>(times.size());
  state.counters["p50_ms"] = times[times.size() / 2];
  state.counters["p99_ms"] = times[times.size() * 99 / 100];
  state.counters["slowest_ms"] = times.back();
  if (with_pieces > 0) {
    state.counters["with_pieces"] = with_pieces;
    state.counters["slowest_with_pieces_ms"] = slowest_with_pieces;
  }
  state.counters["said_percent"] = 100 * said;
  if (beside) {
    const NearModel::Size fields = body.near_field().value_or(NearModel::Size{});
    state.counters["field_ms"] = *std::ranges::max_element(beside->times);
    state.counters["fields"] = fields.made;
    state.counters["late"] = fields.late;
    state.counters["linear"] = fields.linear;
  }
  state.counters["model_mb"] = static_cast<double>(body.size().bytes) / 1e6;
}

/// Measures learned shapes or tables for B1 within 12 mm of (10, 0) mm: 5 mm deep, 20 mm sideways and back, in steps of
/// 0.2 mm, with a tolerance of 2 % and a simulated second thread. The true error is measured at every millimeter,
/// against Newton's method on the whole mesh with a tolerance of 1e-9.
void learned(benchmark::State& state, Law law, bool tabulate) {
  BodyConfig config = testing::pressed_body(ModelKind::kNear, Element::kHex8Sri, static_cast<int>(state.range(0)));
  NearConfig near{.newton = {.tolerance = 0.02}, .law = law, .learn = !tabulate, .tabulate = tabulate};
  config.model = near;
  config.middle = Vec3(0.01, 0, 0);
  config.reach = 0.012;
  const double start = processor_time();
  near.learned = learn(config, {});
  const double set_up = processor_time() - start;
  config.model = near;
  Body body(config);
  Beside beside(body);
  BodyConfig exact = config;
  exact.model = model_config(law == Law::kNeoHookean ? ModelKind::kNeoHookean : ModelKind::kCorotational);
  *newton_of(exact.model) = {.max_iterations = 200, .tolerance = 1e-9};
  Body truth(exact);
  constexpr int kAside = 100;
  constexpr double kStep = 2e-4;
  std::vector<double> times;
  double said = 0;
  double wrong = 0;
  for (auto _ : state) {
    for (int i = 0; i <= 2 * kAside; ++i) {
      const Vec3 tool(kStep * std::min(i, 2 * kAside - i), 0, 0.045);
      const double before = processor_time();
      const Feel feel = body.touch(tool);
      times.push_back(processor_time() - before);
      beside.answered();
      said = std::max(said, feel.error / feel.force.z());
      if (i > kAside || i % 5 != 0) continue;
      wrong = std::max(wrong, std::abs(feel.force.z() / truth.touch(tool).force.z() - 1));
    }
  }
  const FallbackModel::Step step = body.fallbacks().front();
  std::ranges::sort(times);
  state.counters["answers"] = static_cast<double>(times.size());
  state.counters["by_it"] = step.answers;
  state.counters["p50_ms"] = times[times.size() / 2];
  state.counters["p99_ms"] = times[times.size() * 99 / 100];
  state.counters["wrong_percent"] = 100 * wrong;
  state.counters["said_percent"] = 100 * said;
  state.counters["set_up_s"] = 1e-3 * set_up;
  state.counters["shapes"] = step.size.shapes;
  state.counters["elements"] = static_cast<double>(step.size.elements);
  state.counters["mb"] = static_cast<double>(step.size.bytes) / 1e6;
}

/// Measures a rigid tool of 20 mm. Its contact area changes as it moves.
void rigid(benchmark::State& state, const Tool& tool) {
  BodyConfig config = testing::pressed_body(ModelKind::kCondensed, Element::kHex8Sri, static_cast<int>(state.range(0)));
  config.tool = tool;
  Body body(config);
  const Vec3 up = -lowest_of_tool(config, Mat3::Identity());
  double time = 0;
  for (auto _ : state) {
    time += 0.01;
    const Vec3 way(0.003 * std::sin(2 * time), 0.002 * std::cos(3 * time), 0.0475 + 0.001 * std::sin(5 * time));
    benchmark::DoNotOptimize(body.touch(Pose{.position = way + up}));
  }
  state.counters["model_mb"] = static_cast<double>(body.size().bytes) / 1e6;
}

/// Dynamic models take steps of state.range(1) µs with one iteration each.
void compared_with(benchmark::State& state, compared::Kind kind) {
  compared::Config config = compared::testing::soon_at_rest(kind);
  if (compared::info(kind).has_time) {
    config.effects.step = 1e-6 * static_cast<double>(state.range(1));
    config.iterations = 1;
  }
  compared::PressedBody body =
      compared::testing::pressed_b1(kind, Element::kTet4, static_cast<int>(state.range(0)), config);
  answer_with(state, body);
}

/// Through half of the width, state.range(1) mm deep, with the existing factorization or a new one, without building
/// the new mesh, solid and surface.
template <class CutModel>
void cut(benchmark::State& state, Law law, bool anew) {
  const int n = static_cast<int>(state.range(0));
  const Solid whole = testing::pressed_block(Element::kHex8Sri, n, 0.45, law);
  const TouchSurface top(whole.mesh(), Vec3::UnitZ(), testing::kB1PatchRadius);
  const double depth = 1e-3 * static_cast<double>(state.range(1));
  const Cut made{Vec3(0, -0.025, 0.05 - depth), Vec3(0, 0.05, 0), Vec3(0, 0, depth)};
  const Division division = divide(whole.mesh(), whole.fixed(), {&made, 1});
  const Solid parted(division.mesh, whole.element(), whole.material(), law, division.fixed);
  const TouchSurface parted_top(parted.mesh(), Vec3::UnitZ(), testing::kB1PatchRadius);
  const auto construct = [&](const Solid& solid, const TouchSurface& surface) {
    if constexpr (std::is_same_v<CutModel, LinearModel>) {
      return std::make_unique<CutModel>(solid, surface);
    } else {
      return std::make_unique<CutModel>(solid, surface, QuasiStaticModel::Config{});
    }
  };
  double force = 0;
  for (auto _ : state) {
    state.PauseTiming();
    Solid solid = whole;
    std::unique_ptr<Model> model = construct(solid, top);
    model->press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 1e-3);
    solid = parted;
    state.ResumeTiming();
    if (anew) {
      model = construct(parted, parted_top);
    } else {
      model->cut(division, {});
    }
    force = model->press(*parted_top.patch(Vec2::Zero()), Prescribed::kDepth, 1e-3).force;
  }
  state.counters["force_n"] = force;
  state.counters["twins"] = static_cast<double>(twins(parted, division).size());
}

void cut_linear(benchmark::State& state, bool anew) { cut<LinearModel>(state, Law::kLinear, anew); }
void cut_neo_hookean(benchmark::State& state, bool anew) { cut<QuasiStaticModel>(state, Law::kNeoHookean, anew); }

BENCHMARK_CAPTURE(cut_linear, kept, false)->ArgsProduct({{8, 16}, {12, 25}});
BENCHMARK_CAPTURE(cut_linear, anew, true)->ArgsProduct({{8, 16}, {12, 25}});
BENCHMARK_CAPTURE(cut_neo_hookean, kept, false)->ArgsProduct({{8}, {12, 25}});
BENCHMARK_CAPTURE(cut_neo_hookean, anew, true)->ArgsProduct({{8}, {12, 25}});
BENCHMARK_CAPTURE(still, condensed_hex8_sri, ModelKind::kCondensed, Element::kHex8Sri)->Arg(8)->Arg(16);
BENCHMARK_CAPTURE(rigid, sphere, SphereTool{0.02})->Arg(16)->Arg(24);
BENCHMARK_CAPTURE(rigid, capsule, CapsuleTool{0.02, 0.015, Vec3(0.96, 0, 0.28)})->Arg(16)->Arg(24);
BENCHMARK_CAPTURE(still, condensed_hex27, ModelKind::kCondensed, Element::kHex27)->Arg(4)->Arg(8)->Arg(10);
BENCHMARK_CAPTURE(still, linear_hex8_sri, ModelKind::kLinear, Element::kHex8Sri)->Arg(8)->Arg(16);
BENCHMARK_CAPTURE(still, corotational_tet4, ModelKind::kCorotational, Element::kTet4)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(still, corotational_hex8_sri, ModelKind::kCorotational, Element::kHex8Sri)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(still, neo_hookean_hex8_sri, ModelKind::kNeoHookean, Element::kHex8Sri)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(within_half_a_percent, corotational_hex8_sri, ModelKind::kCorotational)->Arg(8)->Arg(12);
BENCHMARK_CAPTURE(within_half_a_percent, neo_hookean_hex8_sri, ModelKind::kNeoHookean)->Arg(8)->Arg(12);
BENCHMARK_CAPTURE(path, near_neo_hookean, ModelKind::kNear, Law::kNeoHookean, false)
    ->ArgsProduct({{8, 12, 16}, {1000, 100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(path, near_corotational, ModelKind::kNear, Law::kCorotational, false)
    ->ArgsProduct({{8, 12, 16}, {1000, 100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(path, near_beside_neo_hookean, ModelKind::kNear, Law::kNeoHookean, true)
    ->ArgsProduct({{8, 12, 16}, {100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(path, near_beside_corotational, ModelKind::kNear, Law::kCorotational, true)
    ->ArgsProduct({{8, 12, 16}, {100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(path, whole_neo_hookean, ModelKind::kNeoHookean, Law::kNeoHookean, false)
    ->ArgsProduct({{8, 12, 16}, {1000, 100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(path, whole_corotational, ModelKind::kCorotational, Law::kCorotational, false)
    ->ArgsProduct({{8, 12, 16}, {1000, 100}})
    ->Iterations(2);
BENCHMARK_CAPTURE(learned, shapes_neo_hookean, Law::kNeoHookean, false)->Arg(8)->Arg(12)->Arg(16)->Iterations(2);
BENCHMARK_CAPTURE(learned, shapes_corotational, Law::kCorotational, false)->Arg(8)->Arg(12)->Arg(16)->Iterations(2);
BENCHMARK_CAPTURE(learned, table_neo_hookean, Law::kNeoHookean, true)->Arg(8)->Arg(12)->Arg(16)->Iterations(2);
BENCHMARK_CAPTURE(learned, table_corotational, Law::kCorotational, true)->Arg(8)->Arg(12)->Arg(16)->Iterations(2);
BENCHMARK_CAPTURE(compared_with, mass_spring, compared::Kind::kMassSpring)->Arg(8);
BENCHMARK_CAPTURE(compared_with, projective, compared::Kind::kProjective)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(compared_with, modal, compared::Kind::kModal)->Arg(8);
BENCHMARK_CAPTURE(compared_with, tensor_mass, compared::Kind::kTensorMass)->Args({8, 1000})->Args({16, 500});
BENCHMARK_CAPTURE(compared_with, tled, compared::Kind::kTled)->Args({8, 1000});
BENCHMARK_CAPTURE(compared_with, xpbd, compared::Kind::kXpbd)->Args({8, 10'000})->Args({8, 1000})->Args({8, 200});

}  // namespace
}  // namespace tendon::softbody

int main(int argc, char** argv) {
  const tendon::PlainUsage usage{.help =
                                     "Usage: tendon-bench-softbody [--benchmark_…]\n\n"
                                     "Measures what an answer of each model costs. The options are those of Google's\n"
                                     "benchmark library.\n\n"
                                     "Example: tendon-bench-softbody --benchmark_filter=path/\n"
                                     "Exit: 0 success; 2 wrong usage.\n",
                                 .options = {"--benchmark_", "--v="}};
  if (const auto code = tendon::answer(usage, argc, argv)) return *code;
  benchmark::Initialize(&argc, argv);
  if (benchmark::ReportUnrecognizedArguments(argc, argv)) return 2;
  benchmark::RunSpecifiedBenchmarks();
  benchmark::Shutdown();
  return 0;
}
