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

#include "tests/tools/bench/row.h"

namespace tendon::bench {

struct BenchOptions {
  std::vector<std::string> only{};               ///< names of sections; empty: all
  std::optional<std::filesystem::path> write{};  ///< a page in Markdown
  std::optional<std::filesystem::path> plot{};   ///< a chart of the section 512, without .svg or .png
  bool json = false;
  bool quick = false;     ///< only that it runs: the figures mean nothing
  bool progress = false;  ///< on standard error
  /// SCHED_FIFO priority of what is measured, so that other work on the machine does not come between; 0: as it is.
  /// Haptic threads ask for their own, as in tendond.
  int priority = 0;
  std::uint64_t seed = 1;
};

/// Where the sections put their lines.
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
  std::string_view title;  ///< of its table
  void (*measure)(Run& run);
};

// In the order of the table. Each forks and starts threads as it likes; there is one thread when it begins and when it
// ends.
void measure_steps(Run& run);       ///< steps.cc
void measure_datagrams(Run& run);   ///< datagrams.cc
void measure_round_trip(Run& run);  ///< round_trip.cc
void measure_wake_ups(Run& run);    ///< wake_ups.cc
void measure_proxy(Run& run);       ///< proxy.cc
void measure_worlds(Run& run);      ///< worlds.cc
void measure_devices(Run& run);     ///< devices.cc
void measure_sessions(Run& run);    ///< sessions.cc
void measure_512(Run& run);         ///< sessions.cc
const std::vector<Section>& sections();

/// In a child, right after fork(): it does not outlive its parent, however that ends.
void end_with_parent();

/// While it lives, the calling thread has that real-time priority, and no timer slack. 0: nothing.
class AtPriority {
 public:
  /// Throws std::system_error when the kernel refuses.
  explicit AtPriority(int priority);
  ~AtPriority();
  AtPriority(const AtPriority&) = delete;
  AtPriority& operator=(const AtPriority&) = delete;

 private:
  bool raised_ = false;
};

/// `tendon-lab bench`: every line with its floor, to `out` as it is measured. Throws std::invalid_argument for a
/// section that does not exist, std::runtime_error when something cannot be measured or written.
void bench(const BenchOptions& options, std::ostream& out);

}  // namespace tendon::bench
