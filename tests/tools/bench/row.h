// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace tendon::bench {

/// One line of the table: what something of Tendon's costs, and beside it what the machine itself takes for the least
/// of it, measured in turns within the same run.
struct Row {
  std::string section;
  std::string what;
  std::string unit;     ///< of all times of the line: "ns", "µs", "ms"
  std::uint64_t n = 0;  ///< single measurements
  double p50 = 0;
  double p99 = 0;

  std::string floor;  ///< what it is
  std::optional<double> floor_p50{};
  std::optional<double> floor_p99{};
  std::optional<double> ratio{};  ///< of one to the other; the median over pairs of blocks where there are pairs

  struct Target {
    std::string text;
    bool met = false;
  };
  std::optional<Target> target{};
  std::optional<double> instructions{};  ///< of one, in user space, where the kernel lets us count them
  std::string note;
  /// What the note says in words, where a chart wants it: a name and its value, in the order of the chart.
  std::vector<std::pair<std::string, double>> figures{};
};

/// Where, what of, and how the lines came about.
struct Circumstances {
  std::string machine;
  std::string kernel;
  std::string commit;
  std::string compiler;
  unsigned processors = 0;
  double load_before = 0;  ///< mean number of threads that wanted to run in the minute before
  double load_after = 0;
  std::uint64_t seed = 0;
  int priority = 0;  ///< SCHED_FIFO; 0: none was asked for
  bool quick = false;
  double seconds = 0;
  std::string command;
};

/// What this machine and this build are; without load, times and what was asked for.
Circumstances look_around();
/// Of the last minute.
double load();

/// The first line of the page.
inline constexpr std::string_view kPageBegins = "# What things cost";

/// Heading and line of the table for a terminal; a note follows on a line of its own.
std::string heading();
std::string to_text(const Row& row);
std::string to_text(const Circumstances& circumstances);
/// One line of JSON without its end.
std::string to_json(const Row& row);
std::string to_json(const Circumstances& circumstances);
/// All of it as a page.
std::string to_markdown(const Circumstances& circumstances, const std::vector<Row>& rows);

}  // namespace tendon::bench
