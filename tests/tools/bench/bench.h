// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "core/base/time.h"
#include "tests/tools/bench/row.h"

namespace tendon::bench {

struct BenchOptions {
  std::vector<std::string> only{};               ///< names of sections; empty: all
  std::optional<std::filesystem::path> write{};  ///< Markdown page
  std::optional<std::filesystem::path> csv{};    ///< CSV file
  std::optional<std::filesystem::path> plot{};   ///< file name without extension of the chart of section 512
  bool json = false;
  bool quick = false;     ///< for smoke tests only
  bool progress = false;  ///< prints to standard error
  /// SCHED_FIFO priority of the measured threads; 0: default scheduling. Haptic threads set their own, as in tendond.
  int priority = 0;
  std::uint64_t seed = 1;
  Duration reply_delay{};  ///< added to each reply in the section peers
  std::string command{};   ///< command that repeats the run
};

class Run {
 public:
  Run(const BenchOptions& the_options, std::function<void(const Row&)> tell)
      : options(the_options), tell_(std::move(tell)) {}

  const BenchOptions& options;
  std::string section;
  void add(Row row) {
    row.section = section;
    rows.push_back(std::move(row));
    tell_(rows.back());
  }
  std::vector<Row> rows{};

 private:
  std::function<void(const Row&)> tell_;
};

struct Section {
  std::string_view name;   ///< for --only
  std::string_view title;  ///< heading of the section's table
  void (*measure)(Run& run);
};

// The sections in the order of the table. Each function may fork. It starts and returns with a single thread.
void measure_steps(Run& run);       ///< steps.cc
void measure_datagrams(Run& run);   ///< datagrams.cc
void measure_round_trip(Run& run);  ///< round_trip.cc
void measure_peers(Run& run);       ///< peers/peers.cc
void measure_wake_ups(Run& run);    ///< wake_ups.cc
void measure_proxy(Run& run);       ///< proxy.cc
void measure_worlds(Run& run);      ///< worlds.cc
void measure_devices(Run& run);     ///< devices.cc
void measure_sessions(Run& run);    ///< sessions.cc
void measure_512(Run& run);         ///< sessions.cc
const std::vector<Section>& sections();

/// `tendon-lab bench`: writes each row and its baseline to `out` when it has been measured. Throws
/// std::invalid_argument for an unknown section, std::runtime_error if a measurement or a write fails.
void bench(const BenchOptions& options, std::ostream& out);

}  // namespace tendon::bench
