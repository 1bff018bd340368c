// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/shrink_world.h"

#include <fstream>
#include <memory>
#include <stdexcept>
#include <string>

#include "tests/support/files.h"
#include "tests/tools/injector/profile/shrink.h"
#include "tests/tools/injector/traces/trace_player.h"

namespace tendon::simulation {

injector::Trace record_network(const DrawnWorld& world) {
  injector::Trace trace;
  trace.seed = world.seed;
  trace.up = to_string(world.config.weather.up);
  trace.down = to_string(world.config.weather.down);
  run(world, {.players = {},
              .watch = [&](injector::Direction direction, std::uint32_t link, const injector::Decision& decision) {
                injector::TraceRecord record;
                static_cast<injector::Decision&>(record) = decision;
                record.direction = direction;
                record.link = link;
                trace.records.push_back(record);
              }});
  return trace;
}

Outcome run_with_network(const DrawnWorld& world, const injector::Trace& trace) {
  return run(world, {.players =
                         [&](injector::Direction direction, std::uint32_t link) {
                           return std::make_unique<injector::TracePlayer>(trace, direction, link,
                                                                          injector::TracePlayer::By::kIndex);
                         },
                     .watch = {}});
}

bool shrink_world(std::uint64_t seed, const std::filesystem::path& file, std::ostream& out) {
  const DrawnWorld world = draw_world(seed);
  const Outcome outcome = run(world);
  if (!outcome.breach) {
    out << "seed " << seed << ": no violation, nothing to shrink\n";
    return false;
  }
  const Oracle oracle = outcome.breach->oracle;
  const auto fails = [&](const injector::Trace& trace) {
    const Outcome again = run_with_network(world, trace);
    return again.breach && again.breach->oracle == oracle;
  };
  const injector::Shrunk shrunk = injector::shrink(record_network(world), fails);
  expect_replaceable(file, {injector::kTraceBegins});
  std::ofstream stream(file, std::ios::binary);
  injector::write_trace(stream, shrunk.trace);
  if (!stream.flush()) throw std::runtime_error("cannot write " + file.string());
  out << "seed " << seed << " violates \"" << info(oracle).name << "\" still with " << shrunk.trace.records.size()
      << " of " << shrunk.from << " datagrams that were not benign (" << shrunk.runs << " runs"
      << (shrunk.minimal ? ", none of them can be omitted" : ", and a smaller set may exist") << "): " << file.string()
      << '\n';
  if (shrunk.trace.records.empty()) out << "the network is not the cause\n";
  return !shrunk.trace.records.empty();
}

}  // namespace tendon::simulation
