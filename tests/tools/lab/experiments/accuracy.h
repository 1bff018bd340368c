// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "clients/softbody/body.h"
#include "tests/support/swept_work.h"
#include "tests/tools/lab/experiments/candidate.h"
#include "tests/tools/lab/experiments/felt.h"
#include "tests/tools/lab/experiments/meter.h"
#include "tests/tools/lab/experiments/pressed_block.h"

namespace tendon::lab {

/// Errors relative to the true stiffness: total = model + discretisation + solver. The parts are NaN if the model
/// cannot support the load on an infinitely fine mesh. For a worker, `solver` is the error bound that it sent.
///
/// Two models converge to another material: as-rigid-as-possible elements (projective) have µ but λ = 0; springs along
/// edges are, for small strains, a body with central forces: Cauchy's relations, ν = 1/4. The deviation of the spring
/// net from that body is in `model`, estimated as the ratio of both on the same mesh; it still depends on n.
struct Accuracy {
  double k = 0;               ///< N/m, force over depth
  double total = 0;           ///< k/truth − 1
  double model = 0;           ///< error of the law on an infinitely fine mesh
  double discretisation = 0;  ///< the error of the law on this mesh, solved exactly
  double solver = 0;          ///< the remainder
  double tangent = 0;         ///< error of the tangent stiffness

  /// The error if the parts did not cancel on this mesh.
  double without_luck() const noexcept { return std::abs(model) + std::abs(discretisation) + std::abs(solver); }
};

struct AccuracyPoint {
  Candidate candidate;
  bool timed = true;  ///< false: results that depend on a clock are missing (times, instructions, felt)
  softbody::Body::Size size{};
  std::array<Accuracy, 2> at_load{};  ///< PressedBlock::loads
  double lateral = 0;         ///< largest lateral error while pressing straight down, over the largest true force
  double force_error = 0;     ///< N, rms along the script
  double force_most = 0;      ///< N, largest
  double force_relative = 0;  ///< the rms of the error divided by the rms of the true force
  double measuring_s = 0;     ///< processor time of the whole measurement
  double setup_s = 0;         ///< processor time, as the next two; wall time for a worker
  double update_ms_p50 = 0;
  double update_ms_p99 = 0;
  double step_ms = 0;                    ///< the simulated time of an update, or 0 if the body is static
  std::optional<double> instructions{};  ///< per update, median; empty if the kernel does not count them
  std::optional<Felt> felt{};            ///< behind the network, if requested
};

struct Network {
  std::string name;
  std::uint64_t seed = 1;
};

/// TooSlow is thrown if updates take much longer than `update_ms`, or the loop of `felt` longer than `felt_s`.
struct Patience {
  double update_ms = std::numeric_limits<double>::infinity();
  double felt_s = std::numeric_limits<double>::infinity();
};

/// Throws the model's exception if it does not support the mesh, std::invalid_argument for an unknown network, and
/// TooSlow. `worker`: the command, for candidates answered by one.
AccuracyPoint measure(const Candidate& candidate, Truth& truth, const Meter& meter,
                      const std::optional<Network>& network = {}, const Patience& patience = {},
                      const std::string& worker = {});

/// Returns the points without a faster and more accurate (without luck) one, by time. Their parts must be known.
std::vector<AccuracyPoint> pareto_front(std::vector<AccuracyPoint> points, std::size_t load);

/// p in update ∝ unknowns^p, by least squares of the logarithms. NaN with fewer than two sizes.
double cost_exponent(const std::vector<AccuracyPoint>& ladder);

/// False if, under each load, one of `others` is as fast (to a tenth of a device period) and has a smaller error
/// without luck, or total error if its parts are not known. The loop need not be run for this point.
bool may_be_best(const AccuracyPoint& point, const std::vector<AccuracyPoint>& others);

/// The smallest force error at the hand among points that need at most `budget_ms` per update and keep a free hand
/// quiet; null if there is none. Requires `felt`.
const AccuracyPoint* closest_at_the_hand(const std::vector<AccuracyPoint>& points, double budget_ms);

struct AccuracyOptions {
  PressedBlock block;
  /// Empty: all models. With a budget, empty means condensed, corotational and neo-hookean.
  std::vector<AnyModel> models;
  std::vector<softbody::Element> elements;  ///< empty: all
  std::vector<int> resolutions{4, 6, 8, 10, 12, 16};
  /// Also measures this command with the linear block, without its scene. Cannot be combined with errors_only, because
  /// the last bits of the answers depend on the number of ranks.
  std::string worker{};
  /// Also the model `near` with learned shapes and with a table of answers. Cannot be combined with a budget.
  bool learned = false;
  Truth::Config truth;
  double slowest_ms = 200;                  ///< a refinement ladder ends where an update would take longer
  std::optional<double> longest_setup_s{};  ///< same for the setup; empty: 30, with a budget 5
  double longest_point_s = 20;              ///< same for the measurement of a point
  std::optional<Network> network{};         ///< network for `felt`
  /// Time per update. Skips the loop for candidates excluded by may_be_best.
  std::optional<double> budget_ms{};
  /// Deterministic: no clock and no time limit. Cannot be combined with a network or a budget.
  bool errors_only = false;
  std::optional<std::filesystem::path> out{};  ///< folder for accuracy.csv and the figures
  std::string command{};                       ///< repeats the run
  bool json = false;
  /// One unit for each n of each element of each model, in this order. Shards and their merged result have errors only.
  Part part{};
};

void accuracy(const AccuracyOptions& options, std::ostream& out);

/// Returns one line of JSON. The `commit` is the one of the build.
std::string to_json(const AccuracyPoint& point, Truth& truth);

}  // namespace tendon::lab
