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

struct RunEstimate {
  std::string place;
  double direction = 0;  ///< +1 or −1
  double travel = 0;     ///< m, of the slide
  KellyFit kelly;
  IntegralFit integral;
  Friction integral_error;  ///< one standard deviation of `integral.friction`, N and N·s/m
};

struct PlaceEstimate {
  std::string place;
  bool both_directions = false;  ///< if false, f_c includes any constant force (gravity, bias)
  /// b is the minimum of both directions, and f_c the mean of both, in which a constant force cancels.
  Friction integral;
  Friction integral_error;   ///< one standard deviation, increased if the runs scatter more
  Friction kelly;            ///< Kelly's estimate from the slowest ramp of each direction, combined in the same way
  bool kelly_valid = false;  ///< the validity test passed in all directions
  std::string kelly_flaw;    ///< otherwise: place and cause
};

enum class Trust {
  kIntegral,  ///< Kelly's validity test failed
  kBoth,      ///< the test passed and both agree, so the smaller value is published
  kNeither,   ///< the test passed but they disagree, so none of them is a bound; the mass may be wrong
};

std::string_view to_string(Trust trust) noexcept;

struct Identification {
  std::vector<RunEstimate> runs;      ///< in the order given
  std::vector<PlaceEstimate> places;  ///< in the order of the first runs
  double force_noise = 0;             ///< N, one standard deviation of a sample, from all runs
  double mass = 0;                    ///< kg, the specified mass or the mean of the fitted masses
  Friction estimate;                  ///< minimum over the places: best estimate of the friction
  /// The bounds for a limiter are the minimum over all places of the integral estimate − 3 standard deviations and of
  /// Kelly's estimate if it is valid, or 0 if that is negative. Unlike Kelly's b, the b of the integral fit depends on
  /// the mass. For example, if the mass is 30 % too small, b is 9 % too large at 0.26 N·s/m.
  Friction lower_bound;
  Trust trust = Trust::kIntegral;
  std::string reason;                 ///< of `trust`, as a sentence
  std::vector<std::string> warnings;  ///< conditions that are missing for lower bounds
};

/// Identifies viscous and Coulomb friction from runs of the ramp experiment (RampRun) with Kelly's procedure and the
/// integral fit, and selects the method to trust.
///
/// Kelly's fit is valid at a place if there are two ramps in each direction, the slowest and one that is at least 1.5
/// times as fast. In both, the handle must slide for 4 m/b after break-away and f_c must be positive. The values of b
/// must agree within 10 %. (On 0.25 m of travel the difference is 1.5 % at b = 0.26 N·s/m, and 19 % or more where the
/// fit is wrong.) The two methods agree if their b differ by at most 10 %. Friction that depends on the direction
/// cannot be distinguished from a constant force without another experiment, and its mean is published as f_c.
struct IdentificationConfig {
  std::optional<double> mass;  ///< kg, of the handle and the mechanism, or empty if it is fitted
  double encoder_step = 0;     ///< m, one count
};

/// Fits one run. RunEstimate::integral_error is not set, because it needs all runs. Throws the std::invalid_argument of
/// slide_of, kelly_fit or integral_fit. Thread-safe: yes. Realtime-safe: no.
RunEstimate fit_run(const RampRun& run, const IdentificationConfig& config);

/// Throws std::invalid_argument if there are no runs. Thread-safe: yes. Realtime-safe: no.
Identification identify_friction(std::vector<RunEstimate> runs);

/// Fits and combines all runs. Throws std::invalid_argument if there are no runs, or "run i: …" (counted from 1) with
/// the message of fit_run. Thread-safe: yes. Realtime-safe: no.
Identification identify_friction(std::span<const RampRun> runs, const IdentificationConfig& config);

}  // namespace tendon
