// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <ostream>

#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/worlds/explore.h"

namespace tendon::simulation {

/// What the network decided in a world of this seed.
injector::Trace record_network(const DrawnWorld& world);

/// The same world with the network of a trace: datagram i of each link and direction meets the fate of the trace's.
/// Everything else is as the seed draws it.
Outcome run_with_network(const DrawnWorld& world, const injector::Trace& trace);

/// Reduces the network of a broken world to the few datagrams that matter for the promise that it breaks, writes them
/// as a sparse trace (a test: EXPECT_FALSE(run_with_network(draw_world(seed), read_trace(file)).breach)) and says what
/// it came to. False when the world breaks no promise, or not because of what happened to single datagrams.
bool shrink_world(std::uint64_t seed, const std::filesystem::path& file, std::ostream& out);

}  // namespace tendon::simulation
