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

/// How a model answers one load. Shares, of the true stiffness: total = model + discretisation + solver. The parts are
/// NaN where on an endlessly fine mesh the model does not stand the load. A worker's `solver` is the bound of its error
/// that it has sent.
///
/// Of two models the law on a fine mesh is that of another material: elements that are as rigid as possible
/// (projective) have µ, but λ = 0. Springs along the edges are, where strains are small, a body whose forces are all
/// central: Cauchy's, ν = 1/4. What their net makes of that body is the model's part too; it is measured as the ratio
/// of both on the same mesh, and therefore an estimate that still drifts with n.
struct Accuracy {
  double k = 0;               ///< N/m, force over depth
  double total = 0;           ///< k/truth − 1
  double model = 0;           ///< of its law, on an endlessly fine mesh
  double discretisation = 0;  ///< of its law on its mesh, solved exactly
  double solver = 0;          ///< what it answers, less that
  double tangent = 0;         ///< error of the tangent stiffness

  /// |model| + |discretisation| + |solver|: what is left when errors do not happen to cancel each other on this mesh.
  double without_luck() const noexcept { return std::abs(model) + std::abs(discretisation) + std::abs(solver); }
};

/// A candidate, measured.
struct AccuracyPoint {
  Candidate candidate;
  bool timed = true;  ///< else what depends on a clock is not there: times, instructions, what is felt
  softbody::Body::Size size{};
  std::array<Accuracy, 2> at_load{};  ///< PressedBlock::loads
  double lateral = 0;                 ///< largest error across of a press straight down, over the largest true force
  double force_error = 0;             ///< N, rms along the script
  double force_most = 0;              ///< N, largest
  double force_relative = 0;          ///< rms, over that of the true force
  double measuring_s = 0;             ///< of processor time for all of this
  double setup_s = 0;                 ///< of processor time, as are the next two; of a worker, on the wall
  double update_ms_p50 = 0;
  double update_ms_p99 = 0;
  double step_ms = 0;                    ///< of the body's own time, that an update lasts; 0: it has none
  std::optional<double> instructions{};  ///< of an update, median; empty when the kernel does not count them
  std::optional<Felt> felt{};            ///< behind the network, if one was asked for
};

/// A network by its name in tendon-inject, or a line of its profiles.
struct Network {
  std::string name;
  std::uint64_t seed = 1;
};

/// How long a measurement may last before it ends with TooSlow: as soon as updates plainly take longer than the first,
/// or the loop of `felt` longer than the second.
struct Patience {
  double update_ms = std::numeric_limits<double>::infinity();
  double felt_s = std::numeric_limits<double>::infinity();
};

/// Measures one. Throws what the model throws when there is none of that kind on that mesh, std::invalid_argument when
/// there is no such network, and TooSlow.
/// `worker`: its command, for a candidate that is answered elsewhere.
AccuracyPoint measure(const Candidate& candidate, Truth& truth, const Meter& meter,
                      const std::optional<Network>& network = {}, const Patience& patience = {},
                      const std::string& worker = {});

/// The points that no other is both quicker and closer than, by time; closer without luck, so that whose parts are not
/// known is not among them.
std::vector<AccuracyPoint> pareto_front(std::vector<AccuracyPoint> points, std::size_t load);

/// p of update ∝ unknowns^p, as the points of a ladder have it (least squares of the logarithms); NaN of fewer than two
/// sizes.
double cost_exponent(const std::vector<AccuracyPoint>& ladder);

/// Whether a point may be the best one at the hand, by what is known of it without the loop: no, if under each load one
/// of `others` is as quick and closer without luck. Quicker by less than a tenth of a period of the device is no
/// quicker at the hand. A point whose parts are not known yet counts as if its total error were all of them.
bool may_be_best(const AccuracyPoint& point, const std::vector<AccuracyPoint>& others);

/// Of those that need at most `budget_ms` for an update and leave a free hand quiet, the one whose force at the hand
/// is closest to the truth; none when there is none. For points with `felt`.
const AccuracyPoint* closest_at_the_hand(const std::vector<AccuracyPoint>& points, double budget_ms);

struct AccuracyOptions {
  PressedBlock block;
  /// Empty: all models. With a budget, empty means condensed, corotational and neo-hookean.
  std::vector<AnyModel> models;
  std::vector<softbody::Element> elements;  ///< none: all
  std::vector<int> resolutions{4, 6, 8, 10, 12, 16};
  /// The command of a worker that answers for the linear block as well, without its scene; empty: none. Not with
  /// errors_only: its last bits depend on how many ranks it has.
  std::string worker{};
  /// Bodies of the model `near` that have learned shapes, and that have a table of answers, as well. Not with a budget.
  bool learned = false;
  Truth::Config truth;
  double slowest_ms = 200;                  ///< a refinement ladder ends where an update would take longer …
  std::optional<double> longest_setup_s{};  ///< … or the set-up; none: 30, with a budget 5
  double longest_point_s = 20;              ///< … or to measure a point, all in all
  std::optional<Network> network{};         ///< what is left at the hand behind it
  /// Answers one question: what is best at the hand of that which needs at most so long for an update. Of those that
  /// are beaten without the loop (may_be_best) the loop is not run.
  std::optional<double> budget_ms{};
  /// No clock is looked at: errors and sizes alone, which are the same each time, of all that is asked for, however long
  /// it takes. Not with a network or a budget, which ask for times.
  bool errors_only = false;
  std::optional<std::filesystem::path> out{};  ///< folder for accuracy.csv and the figures
  bool json = false;
  /// Its units are the meshes: each n of each element of each model, in that order, where there is such a model. A shard
  /// of them, and what is made of shards, has errors only.
  Part part{};
};

/// `tendon-lab accuracy`: what accuracy costs in time, model by model and mesh by mesh.
void accuracy(const AccuracyOptions& options, std::ostream& out);

/// One line of JSON; `commit` is that of the build.
std::string to_json(const AccuracyPoint& point, Truth& truth);

}  // namespace tendon::lab
