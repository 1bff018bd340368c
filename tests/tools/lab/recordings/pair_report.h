// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <ostream>
#include <string>
#include <utility>
#include <vector>

#include "server/recording/records.h"
#include "tests/tools/lab/recordings/report.h"

namespace tendon::lab {

/// Times in seconds since the first step of either device, in the clock of the leader.
struct PairRun {
  using Line = std::vector<std::pair<double, double>>;  ///< s, value
  struct End {
    Line position;             ///< m, along the end's main axis
    Line account;              ///< J, energy that it may still output
    double least_account = 0;  ///< J
    double largest_force = 0;  ///< N, of the motors
  };
  std::string label;
  std::string recording;
  End leader;
  End follower;
  Line felt;              ///< N, motor force of the leader along its main axis
  Line contact;           ///< N, contact force on the follower's tool along its main axis; empty: not measured
  Line pair;              ///< J, the sum of both ledgers, which is the net energy put in at both ends
  double least_pair = 0;  ///< J; negative: the pair generated energy
};

/// Joins the recordings of two coupled devices. At each step
///
///     ledger = account − Σ credit + Σ withdraw    over the settlements of all previous steps
///
/// so the sum of both ledgers includes payments in flight. Energy discarded by a limiter is in neither: the sum is a
/// lower bound of the net work put in. It has no scaling, so position times force scale must be equal at both ends.
///
/// Memory: 300 bytes a step. Thread-safe: no. Realtime-safe: no.
class PairObserver {
 public:
  enum class Which : std::uint8_t { kLeader, kFollower };

  void observe(Which which, const StepRecord& step);
  void observe(Which which, const PortRecord& port);

  /// Throws std::runtime_error if either end has no steps.
  PairRun run() const;

 private:
  struct Step {
    LocalTime at;
    std::uint64_t tick;
    Vec3 position;
    Vec3 force;
    double account;
    bool seen;
  };
  struct Port {
    std::uint64_t tick;
    double net;  ///< J, credited minus withdrawn
    LocalTime at;
    std::optional<Vec3> contact;
  };
  struct Seen {
    std::vector<Step> steps;
    std::vector<Port> ports;
  };

  const Seen& of(Which which) const { return ends_[static_cast<std::size_t>(which)]; }

  std::array<Seen, 2> ends_;
};

/// Reports recordings written by `tendon-replay --merge`: a table or JSON, a sentence about each pair, and a column for
/// each of at most two pairs with positions, forces, and the accounts of both ends and of the pair. Throws the
/// exceptions of `report`, and std::runtime_error if a recording is not such a merge.
void report_pairs(const ReportOptions& options, std::ostream& out);

}  // namespace tendon::lab
