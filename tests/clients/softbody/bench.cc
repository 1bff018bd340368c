// SPDX-License-Identifier: Apache-2.0
// What an answer costs, beside its error: the pressed block B1 at ν = 0.45, a tool that goes up and down and to and
// fro. The counter error_percent is of the stiffness, against 420.2 N/m. What is measured is in
// clients/softbody/README.md.
#include <benchmark/benchmark.h>

#include <cmath>
#include <string>

#include "clients/softbody/body.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody {
namespace {

void answer(benchmark::State& state, ModelKind model, Element element) {
  const auto n = static_cast<int>(state.range(0));
  BodyConfig config;
  config.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {n, n, n / 2}};
  config.material = {.young = 1e4, .poisson = 0.45};
  config.element = element;
  config.model = model;
  config.patch_radius = testing::kB1PatchRadius;
  config.reach = 0.005;
  Body body(config);
  const double stiffness = body.press(Given::kDepth, 1e-6).stiffness;
  double time = 0;
  for (auto _ : state) {
    time += 0.01;  // a hand's motion, looked at 100 times a second
    const Vec3 tool(0.003 * std::sin(2 * time), 0.002 * std::cos(3 * time), 0.0485 + 0.001 * std::sin(5 * time));
    benchmark::DoNotOptimize(body.touch(tool));
  }
  state.counters["error_percent"] = 100 * (stiffness / testing::kB1 - 1);
  state.counters["free"] = static_cast<double>(body.size().free);
  state.counters["model_mb"] = static_cast<double>(body.size().bytes) / 1e6;
}

BENCHMARK_CAPTURE(answer, condensed_hex8_sri, ModelKind::kCondensed, Element::kHex8Sri)->Arg(8)->Arg(16);
BENCHMARK_CAPTURE(answer, condensed_hex27, ModelKind::kCondensed, Element::kHex27)->Arg(4)->Arg(8)->Arg(10);
BENCHMARK_CAPTURE(answer, linear_hex8_sri, ModelKind::kLinear, Element::kHex8Sri)->Arg(8)->Arg(16);
BENCHMARK_CAPTURE(answer, corotational_tet4, ModelKind::kCorotational, Element::kTet4)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(answer, corotational_hex8_sri, ModelKind::kCorotational, Element::kHex8Sri)->Arg(4)->Arg(8);
BENCHMARK_CAPTURE(answer, neo_hookean_hex8_sri, ModelKind::kNeoHookean, Element::kHex8Sri)->Arg(4)->Arg(8);

}  // namespace
}  // namespace tendon::softbody

BENCHMARK_MAIN();
