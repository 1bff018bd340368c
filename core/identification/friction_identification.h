// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/identification/integral_fit.h"
#include "core/identification/kelly_fit.h"
#include "core/identification/ramp_run.h"
#include "core/ledger/friction.h"

namespace tendon {

/// The result of one run.
struct RunEstimate {
  std::string place;
  double direction = 0;  ///< +1 or −1
  double travel = 0;     ///< m, of the slide
  KellyFit kelly;
  IntegralFit integral;
  Friction integral_error;  ///< one standard deviation of `integral.friction`, N and N·s/m
};

/// The result of all runs of one place.
struct PlaceEstimate {
  std::string place;
  bool both_directions = false;  ///< else a constant force (gravity, bias) is in f_c, by its full size
  /// b of the direction that has less, f_c the mean of both, in which a constant force cancels.
  Friction integral;
  Friction integral_error;  ///< one standard deviation, widened when the runs scatter more than it says
  /// Kelly's, of the slowest ramp of each direction, combined in the same way.
  Friction kelly;
  bool kelly_valid = false;  ///< its validity test passed, in all directions
  std::string kelly_flaw;    ///< when it did not: where and why
};

/// Which of the two methods is believed.
enum class Trust {
  kIntegral,  ///< Kelly's validity test failed
  kBoth,      ///< it passed, and the two agree: the lesser of the two is published
  kNeither,   ///< the test passed, but the two do not agree; the mass may be wrong, and neither is a bound
};

/// "integral", "both" or "neither".
std::string_view to_string(Trust trust) noexcept;

struct Identification {
  std::vector<RunEstimate> runs;      ///< in the order given
  std::vector<PlaceEstimate> places;  ///< in the order of their first run
  double force_noise = 0;             ///< N, one standard deviation of a sample, from all runs
  double mass = 0;                    ///< kg, given or the mean of the fitted ones
  Friction estimate;                  ///< least of the places: the best estimate of the device's friction
  /// Bounds for a limiter: the least of the places of the integral's estimate − 3 standard deviations and, where
  /// it is valid, of Kelly's estimate; never negative. A mass 30 % too small makes the integral's b 9 % too large at
  /// 0.26 N·s/m: Kelly's b, which needs no mass, stands against that.
  Friction lower_bound;
  Trust trust = Trust::kIntegral;
  std::string reason;                 ///< for `trust`: a sentence for people
  std::vector<std::string> warnings;  ///< what is missing before these are lower bounds
};

/// Viscous and Coulomb friction of a device from runs of the ramp experiment (RampRun), by Kelly's procedure and by the
/// integral fit, and which of the two to believe.
///
/// Kelly's fit is valid at a place when, in each direction, the slowest ramp s and one at least 1.5 times as fast both
/// slide for 4 m/b after break-away and give f_c > 0, and their b agree within 10 % (assumed: on 0.25 m of travel it
/// parts 1.5 % at b = 0.26 N·s/m from 19 % and more where the fit is wrong). The two methods agree when b differs by no
/// more than 10 %.
///
/// A friction that differs between the directions looks like a constant force: its mean is published as f_c. Only a
/// stop of a free handle in both directions could tell.
struct IdentificationConfig {
  std::optional<double> mass;  ///< kg, of handle and mechanism; left out: fitted
  double encoder_step = 0;     ///< m, one count
};

/// The fits of one run, which know nothing of the others: without RunEstimate::integral_error, which takes all. Throws
/// std::invalid_argument with the message of slide_of, kelly_fit or integral_fit.
/// Thread-safe: yes. Realtime-safe: no.
RunEstimate fit_run(const RampRun& run, const IdentificationConfig& config);

/// What the runs say together, by their fits. Throws std::invalid_argument when there are no runs.
/// Thread-safe: yes. Realtime-safe: no.
Identification identify_friction(std::vector<RunEstimate> runs);

/// Both. Throws std::invalid_argument when there are no runs, or "run i: …" (counted from 1) with the message of fit_run.
/// Thread-safe: yes. Realtime-safe: no.
Identification identify_friction(std::span<const RampRun> runs, const IdentificationConfig& config);

}  // namespace tendon
