// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <istream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "tests/fuzz/target.h"
#include "tests/tools/injector/traces/trace.h"
#include "tests/tools/injector/traces/trace_player.h"

// A trace is rejected with file and line, or is unchanged by writing and parsing and has no release before its arrival.

using namespace tendon;
using namespace tendon::injector;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::InputBuffer bytes(std::as_bytes(std::span(data, size)));
  std::istream file(&bytes);
  Trace trace;
  try {
    trace = read_trace(file, "t");
  } catch (const std::runtime_error& refused) {
    fuzz::require(std::string_view(refused.what()).starts_with("t:"));
    return 0;
  }
  std::stringstream written;
  write_trace(written, trace);
  fuzz::require(read_trace(written, "t") == trace);

  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    TracePlayer player(trace, direction, 0, TracePlayer::By::kIndex);
    for (std::uint64_t i = 0; i < 4; ++i) {
      const LocalTime arrival{std::chrono::milliseconds(i)};
      const Decision fate = player.decide({.arrival = arrival, .size = 100});
      fuzz::require(fate.arrival == arrival && fate.release >= arrival);
      fuzz::require(!fate.duplicate || *fate.duplicate >= arrival);
    }
  }
  return 0;
}
