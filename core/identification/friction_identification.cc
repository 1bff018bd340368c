// SPDX-License-Identifier: Apache-2.0
#include "core/identification/friction_identification.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kSigmas = 3;
constexpr double kAgreement = 0.1;
constexpr double kOtherSlope = 1.5;
constexpr std::size_t kEnoughRuns = 3;

using Runs = std::vector<const RunEstimate*>;

struct Mean {
  double value = 0;
  double error = 0;  ///< one standard deviation
};

/// Mean weighted by the errors. Its error increases if the runs scatter more than their errors.
Mean mean_of(const Runs& runs, double Friction::*which) {
  double weights = 0;
  double sum = 0;
  const auto weight = [which](const RunEstimate& run) {
    return 1 / std::max(run.integral_error.*which * run.integral_error.*which, std::numeric_limits<double>::min());
  };
  for (const RunEstimate* run : runs) {
    weights += weight(*run);
    sum += weight(*run) * run->integral.friction.*which;
  }
  Mean mean{sum / weights, 1 / std::sqrt(weights)};
  double scatter = 0;
  for (const RunEstimate* run : runs) {
    const double off = run->integral.friction.*which - mean.value;
    scatter += weight(*run) * off * off;
  }
  if (runs.size() > 1) mean.error *= std::sqrt(std::max(1.0, scatter / static_cast<double>(runs.size() - 1)));
  return mean;
}

std::string number(double value) { return rounded(value, 3); }

struct KellyVerdict {
  Friction friction;
  std::string flaw;  ///< empty if valid
};

/// Determines if the runs of one direction at one place are valid.
KellyVerdict kelly_verdict(const Runs& runs) {
  const KellyFit& slow =
      (*std::ranges::min_element(runs, {}, [](const RunEstimate* run) { return run->kelly.rate; }))->kelly;
  // Use the mean if there are several runs with this slope.
  KellyVerdict verdict;
  double count = 0;
  const KellyFit* fast = nullptr;
  for (const RunEstimate* run : runs) {
    const KellyFit& kelly = run->kelly;
    if (kelly.rate < 1.1 * slow.rate) {
      verdict.friction.viscous += kelly.friction.viscous;
      verdict.friction.coulomb += kelly.friction.coulomb;
      ++count;
    } else if (kelly.rate >= kOtherSlope * slow.rate && (fast == nullptr || kelly.rate < fast->rate)) {
      fast = &kelly;
    }
  }
  verdict.friction.viscous /= count;
  verdict.friction.coulomb /= count;

  const double b = verdict.friction.viscous;
  if (!slow.long_enough()) {
    verdict.flaw = "the slide of " + number(slow.slide_time) +
                   " s is shorter than 4 m/b = " + number(4 * slow.time_constant) + " s";
  } else if (!(slow.friction.coulomb > 0)) {
    verdict.flaw = "f_c = " + number(slow.friction.coulomb) + " is not positive";
  } else if (fast == nullptr) {
    verdict.flaw = "expected a second slope that is at least 1.5 times as steep, found none";
  } else if (!fast->plausible()) {
    verdict.flaw = "at the second slope the slide of " + number(fast->slide_time) +
                   " s is shorter than 4 m/b = " + number(4 * fast->time_constant) + " s or f_c is not positive";
  } else if (std::abs(fast->friction.viscous - b) > kAgreement * b) {
    verdict.flaw = "the two slopes differ, b = " + number(b) + " and " + number(fast->friction.viscous);
  }
  return verdict;
}

PlaceEstimate place_estimate(const std::string& place, const std::vector<RunEstimate>& all) {
  PlaceEstimate result;
  result.place = place;
  result.kelly_valid = true;
  result.integral.viscous = result.kelly.viscous = std::numeric_limits<double>::infinity();
  double lowest = std::numeric_limits<double>::infinity();
  double directions = 0;
  double coulomb_variance = 0;
  for (const double direction : {1.0, -1.0}) {
    Runs runs;
    for (const RunEstimate& run : all) {
      if (run.place == place && run.direction == direction) runs.push_back(&run);
    }
    if (runs.empty()) continue;
    ++directions;
    const Mean viscous = mean_of(runs, &Friction::viscous);
    const Mean coulomb = mean_of(runs, &Friction::coulomb);
    if (viscous.value - kSigmas * viscous.error < lowest) {
      lowest = viscous.value - kSigmas * viscous.error;
      result.integral.viscous = viscous.value;
      result.integral_error.viscous = viscous.error;
    }
    result.integral.coulomb += coulomb.value;
    coulomb_variance += coulomb.error * coulomb.error;
    const KellyVerdict kelly = kelly_verdict(runs);
    result.kelly.viscous = std::min(result.kelly.viscous, kelly.friction.viscous);
    result.kelly.coulomb += kelly.friction.coulomb;
    if (!kelly.flaw.empty() && result.kelly_valid) {
      result.kelly_valid = false;
      result.kelly_flaw = kelly.flaw;
    }
  }
  result.both_directions = directions == 2;
  result.integral.coulomb /= directions;
  result.integral_error.coulomb = std::sqrt(coulomb_variance) / directions;
  result.kelly.coulomb /= directions;
  return result;
}

std::string at(const PlaceEstimate& place) { return place.place.empty() ? "" : " at " + place.place; }

/// Sets `trust` and `reason`. Where Kelly's fit is valid, it limits the published value.
void judge(Identification& result) {
  const auto flawed = std::ranges::find(result.places, false, &PlaceEstimate::kelly_valid);
  const auto apart = std::ranges::find_if(result.places, [](const PlaceEstimate& place) {
    return std::abs(place.kelly.viscous - place.integral.viscous) > kAgreement * place.integral.viscous;
  });
  if (flawed != result.places.end()) {
    result.trust = Trust::kIntegral;
    result.reason = "Kelly's fit is not valid" + at(*flawed) + ": " + flawed->kelly_flaw +
                    " (it gives b = " + number(flawed->kelly.viscous) + ", the integral " +
                    number(flawed->integral.viscous) + ")";
  } else if (apart != result.places.end()) {
    result.trust = Trust::kNeither;
    result.reason = "Kelly's fit is valid, but the two methods differ" + at(*apart) +
                    ": b = " + number(apart->kelly.viscous) + " and " + number(apart->integral.viscous) +
                    ". Check the mass. Neither value is a bound";
  } else {
    result.trust = Trust::kBoth;
    result.reason = "Kelly's fit is valid and agrees with the integral. The smaller value is used";
  }
  for (const PlaceEstimate& place : result.places) {
    if (!place.kelly_valid) continue;
    result.lower_bound.viscous = std::min(result.lower_bound.viscous, place.kelly.viscous);
    result.lower_bound.coulomb = std::min(result.lower_bound.coulomb, place.kelly.coulomb);
  }
}

void warn(Identification& result) {
  for (const PlaceEstimate& place : result.places) {
    if (!place.both_directions) {
      result.warnings.push_back("only one direction" + at(place) +
                                ": a constant force cannot be distinguished from friction");
    }
    const auto runs = std::ranges::count(result.runs, place.place, &RunEstimate::place);
    if (static_cast<std::size_t>(runs) < 2 * kEnoughRuns) {
      result.warnings.push_back(std::to_string(runs) + " runs" + at(place) +
                                ": use 3 slopes, repeated, in both directions to estimate the scatter");
    }
  }
  if (result.places.size() == 1) {
    result.warnings.emplace_back(
        "only one place: friction differs between axes and poses, and the lowest value is required");
  }
  if (result.lower_bound.viscous == 0) {
    result.warnings.emplace_back("viscous friction cannot be distinguished from zero: its bound is 0");
  }
  if (result.lower_bound.coulomb == 0) {
    result.warnings.emplace_back("Coulomb friction cannot be distinguished from zero: its bound is 0");
  }
}

}  // namespace

std::string_view to_string(Trust trust) noexcept {
  switch (trust) {
    case Trust::kIntegral:
      return "integral";
    case Trust::kBoth:
      return "both";
    case Trust::kNeither:
      return "neither";
  }
  return "unknown";
}

RunEstimate fit_run(const RampRun& run, const IdentificationConfig& config) {
  const Slide slide = slide_of(run, config.encoder_step);
  RunEstimate estimate;
  estimate.place = run.place;
  estimate.direction = slide.direction;
  estimate.travel = slide.samples.back().position;
  estimate.integral = integral_fit(slide, config.mass);
  if (!(estimate.integral.mass > 0)) {
    throw std::invalid_argument("the mass cannot be determined from this run: use --mass");
  }
  estimate.kelly = kelly_fit(slide, estimate.integral.mass);
  return estimate;
}

Identification identify_friction(std::span<const RampRun> runs, const IdentificationConfig& config) {
  std::vector<RunEstimate> fits;
  for (const RampRun& run : runs) {
    try {
      fits.push_back(fit_run(run, config));
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument("run " + std::to_string(fits.size() + 1) + ": " + error.what());
    }
  }
  return identify_friction(std::move(fits));
}

Identification identify_friction(std::vector<RunEstimate> runs) {
  if (runs.empty()) throw std::invalid_argument("expected at least one run, found none");
  Identification result;
  double squares = 0;
  double unit = 0;
  for (const RunEstimate& run : runs) {
    squares += run.integral.residual_squares;
    unit += run.integral.unit_residual;
    result.mass += run.integral.mass / static_cast<double>(runs.size());
  }
  result.runs = std::move(runs);
  // All runs of a device share one noise, because the estimate of a single run is rough.
  result.force_noise = std::sqrt(squares / unit);
  for (RunEstimate& run : result.runs) {
    run.integral_error.viscous = result.force_noise * std::sqrt(run.integral.unit_covariance(0, 0));
    run.integral_error.coulomb = result.force_noise * std::sqrt(run.integral.unit_covariance(1, 1));
    if (std::ranges::find(result.places, run.place, &PlaceEstimate::place) == result.places.end()) {
      result.places.emplace_back().place = run.place;
    }
  }
  for (PlaceEstimate& place : result.places) place = place_estimate(place.place, result.runs);

  const auto least = [&result](double Friction::*which, double sigmas) {
    double value = std::numeric_limits<double>::infinity();
    for (const PlaceEstimate& place : result.places) {
      value = std::min(value, place.integral.*which - sigmas * place.integral_error.*which);
    }
    return value;
  };
  result.estimate = {.coulomb = least(&Friction::coulomb, 0), .viscous = least(&Friction::viscous, 0)};
  result.lower_bound = {.coulomb = std::max(0.0, least(&Friction::coulomb, kSigmas)),
                        .viscous = std::max(0.0, least(&Friction::viscous, kSigmas))};
  judge(result);
  warn(result);
  return result;
}

}  // namespace tendon
