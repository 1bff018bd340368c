// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/support/json_line.h"

namespace tendon::bench {

/// The cost of a part of Tendon and the machine's minimum for the same work (the baseline), measured alternately.
struct Row {
  std::string section;
  std::string what;
  std::string unit;     ///< the unit of all times of the row: "ns", "µs", "ms"
  std::uint64_t n = 0;  ///< number of measurements
  double p50 = 0;
  double p99 = 0;

  std::string floor;  ///< description of the baseline
  std::optional<double> floor_p50{};
  std::optional<double> floor_p99{};
  std::optional<double> ratio{};  ///< cost / baseline; median over pairs of blocks if measured in pairs

  struct Target {
    std::string text;
    bool met = false;
  };
  std::optional<Target> target{};
  std::optional<double> instructions{};  ///< per call, in user space, if the kernel permits counting
  std::string note;
  /// The values of the note that are used in a chart, in this order.
  std::vector<std::pair<std::string, double>> figures{};
};

struct Circumstances {
  std::string machine;
  std::string kernel;
  std::string commit;
  std::string compiler;
  unsigned processors = 0;
  double load_before = 0;  ///< load average over the minute before the run
  double load_after = 0;
  std::uint64_t seed = 0;
  int priority = 0;  ///< SCHED_FIFO; 0: default scheduling
  bool quick = false;
  double seconds = 0;
  std::string command;
};

/// Describes this machine and this build. Load, times and options are left empty.
Circumstances look_around();
double load();

inline constexpr std::string_view kPageBegins = "# What things cost";

/// Returns the heading and the row of the table for a terminal. A note gets its own line.
std::string heading();
std::string to_text(const Row& row);
std::string to_text(const Circumstances& circumstances);
JsonLine line_of(const Row& row);
std::string to_json(const Circumstances& circumstances);
std::string to_markdown(const Circumstances& circumstances, const std::vector<Row>& rows);

}  // namespace tendon::bench
