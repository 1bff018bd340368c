// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>

#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/worlds/explore.h"

namespace tendon::simulation {

injector::Trace record_network(const DrawnWorld& world);

/// Datagram i of each link and direction gets the fate recorded for datagram i.
Outcome run_with_network(const DrawnWorld& world, const injector::Trace& trace);

/// Reduces the network of a failing world to the few datagrams that matter for its violation and writes them as a
/// sparse trace. A regression test is then EXPECT_FALSE(run_with_network(draw_world(seed), read_trace(file)).breach).
/// Returns false if the world violates nothing, or not because of single datagrams.
bool shrink_world(std::uint64_t seed, const std::filesystem::path& file, std::ostream& out);

}  // namespace tendon::simulation
