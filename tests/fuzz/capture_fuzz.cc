// SPDX-License-Identifier: Apache-2.0
#include <istream>
#include <sstream>
#include <stdexcept>
#include <string_view>

#include "tests/fuzz/target.h"
#include "tests/tools/injector/traces/import_capture.h"

// Rejected with the name of the file, or gives a trace that survives writing and parsing.

using namespace tendon;
using namespace tendon::injector;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::InputBuffer bytes(std::as_bytes(std::span(data, size)));
  std::istream file(&bytes);
  try {
    const Tap tap{.name = "t", .capture = read_capture(file, "t")};
    const Trace trace = size % 2 == 0 ? import_two_taps(tap, tap, {.port = 47100}).trace : import_echoes(tap, {});
    std::stringstream written;
    write_trace(written, trace);
    fuzz::require(read_trace(written, "t") == trace);
  } catch (const std::runtime_error& refused) {
    fuzz::require(std::string_view(refused.what()).find('t') != std::string_view::npos);
  }
  return 0;
}
