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

/// Two coupled ends together, as time goes on. Times are s from the first step of either, in the leader's clock.
struct PairRun {
  using Line = std::vector<std::pair<double, double>>;  ///< s, value
  struct End {
    Line position;             ///< m, along the end's own main axis
    Line account;              ///< J, what it may still give out
    double least_account = 0;  ///< J
    double largest_force = 0;  ///< N, given out by its motors
  };
  std::string label;
  std::string recording;
  End leader;
  End follower;
  Line felt;              ///< N, given out by the leader's motors, along its main axis
  Line contact;           ///< N, of the surroundings on the follower's tool, along its main axis; empty: not measured
  Line pair;              ///< J, both ledgers: what hands and surroundings have put in at both ends and not got back
  double least_pair = 0;  ///< J; below zero: so much came from nowhere
};

/// Joins what two ends recorded. At each step
///
///     ledger = account − Σ credit + Σ withdraw    of the settlements of all steps before it
///
/// so what one end has paid and the other has not heard of yet is in the sum of both. What a limiter discarded is in
/// neither: the sum may be less than the work that was put in, and never more. Joules of both are added as they are,
/// which is right where position and force scale are equal.
///
/// Memory: 300 bytes a step. Thread-safe: no. Realtime-safe: no.
class PairObserver {
 public:
  enum class Which : std::uint8_t { kLeader, kFollower };

  void observe(Which which, const StepRecord& step);
  void observe(Which which, const PortRecord& port);

  /// Throws std::runtime_error when one of the two has no step.
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
    double net;  ///< J, credited less withdrawn
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

/// `tendon-report --pairs`: the recordings are those that `tendon-replay --merge` has written. Writes a table, or JSON,
/// and a sentence about each pair to `out`, and draws two panels in a row: a column for each of at most two pairs; from
/// top to bottom where both ends are, what is felt and touched, and the accounts of both and of the pair.
///
/// Throws as `report`, and std::runtime_error when a recording is not such a merge.
void report_pairs(const ReportOptions& options, std::ostream& out);

}  // namespace tendon::lab
