// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/second_look.h"

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "core/base/nearest_word.h"
#include "server/scene/scene.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/injector/traces/trace_player.h"
#include "tests/tools/lab/pictures/table.h"
#include "tests/tools/lab/recordings/run_summary.h"
#include "tests/tools/worlds/world.h"

namespace tendon::simulation {

namespace {

std::vector<Law> asked_laws(const std::vector<std::string>& names) {
  std::vector<Law> asked;
  for (const std::string& name : names) {
    const auto law = law_named(name);
    if (!law) {
      std::string known;
      for (const LawInfo& each : laws()) known += (known.empty() ? "" : ", ") + std::string(each.name);
      throw std::invalid_argument("--law: expected one of " + known + ", got \"" + name + '"' +
                                  did_you_mean(name, known));
    }
    asked.push_back(*law);
  }
  if (!asked.empty()) return asked;
  for (const LawInfo& law : laws()) {
    if (law.passive) asked.push_back(law.law);
  }
  return asked;
}

Duration length_of(const injector::Trace& trace) {
  LocalTime end = trace.start;
  for (const injector::TraceRecord& record : trace.records) end = std::max(end, record.arrival);
  return end - trace.start;
}

lab::Run run(const Scene& scene, const injector::Trace& trace, Law law, Duration length,
             const SecondLookOptions& options) {
  SimulatedDevice device(scene.simulated());
  World::Config config;
  config.seed = trace.seed;
  config.loop = scene.loop;
  config.loop.control.limiter.law = law;
  config.loop.control.limiter.environment_stiffness = options.stiffness;
  config.mail.flight = 1;
  // Worlds start at one second; shift the trace to match.
  constexpr LocalTime kBegin{std::chrono::seconds(1)};
  config.players = [&](injector::Direction direction, std::uint32_t link) {
    return std::make_unique<injector::TracePlayer>(trace, direction, link, injector::TracePlayer::By::kTime, kBegin);
  };
  World world(config, device);
  ForceClient::Config client;
  client.name = "wall";
  client.rate_hz = options.rate_hz;
  world.add_controller(client, [&options](const DeviceState& hand) -> Touch {
    return Vec3(-options.stiffness * std::max(0.0, hand.position.x()), 0, 0);
  });
  lab::RunObserver observer;
  world.watch_steps([&observer](const StepRecord& step) { observer.observe(step); });
  world.run_for(length);
  lab::Run result;
  result.label = info(law).name;
  result.recording = options.trace.string();
  result.summary = observer.summary();
  return result;
}

}  // namespace

void second_look(const SecondLookOptions& options, std::ostream& out) {
  const std::vector<Law> asked = asked_laws(options.laws);
  if (!(options.stiffness > 0)) throw std::invalid_argument("--stiffness: expected a number above 0 N/m");
  if (!(options.rate_hz >= ForceClient::kMinRateHz && options.rate_hz <= ForceClient::kMaxRateHz)) {
    throw std::invalid_argument("--rate-hz: expected 0.001 to 100000");
  }
  const Scene scene = read_scene(options.scene);
  const injector::Trace trace = injector::read_trace(options.trace);
  const Duration length = options.length_s ? from_seconds(*options.length_s) : length_of(trace);
  if (length <= Duration::zero()) throw std::invalid_argument("--for-s: expected a time, because the trace is empty");
  std::vector<lab::Run> runs;
  for (const Law law : asked) runs.push_back(run(scene, trace, law, length, options));
  if (!options.json) {
    out << lab::to_table(runs);
    return;
  }
  for (const lab::Run& one : runs) out << lab::to_json(one) << '\n';
}

}  // namespace tendon::simulation
