// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/identify.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <functional>
#include <limits>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/base/expect.h"
#include "core/base/nearest_word.h"
#include "core/identification/friction_identification.h"
#include "devices/simulated/profiles.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/identify/ramp_csv.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab {
namespace {

constexpr double kMostInterval = 0.05;      // s; 20 Hz is too slow for this experiment
constexpr double kEncoderStep = 3e-5;       // m
constexpr double kAngularStep = 1e-4;       // rad
constexpr double kSimulatedMass = 0.075;    // kg
constexpr double kSimulatedInertia = 1e-4;  // kg·m²

double usual_step(Freedom freedom) { return freedom == Freedom::kRotation ? kAngularStep : kEncoderStep; }

struct Source {
  FreedomInfo freedom = info(Freedom::kMovement);
  std::vector<std::string> names{};  ///< names of the runs in messages
  std::vector<std::string> places{};
  IdentificationConfig config{};
  std::function<RampRun(std::size_t)> run{};
};

std::string inertia_bounds(const FreedomInfo& freedom) {
  return "expected " + shortest(freedom.bounds.least_inertia) + " to " + shortest(freedom.bounds.most_inertia) + " " +
         std::string(freedom.inertia_unit) + ", which is the range of handles";
}

void check(const IdentifyOptions& options) {
  const int sources =
      (options.files.empty() ? 0 : 1) + (options.profile ? 1 : 0) + (options.simulated_friction ? 1 : 0);
  if (sources == 0) throw std::invalid_argument("expected a CSV file, --simulate or --simulate-friction, found none");
  if (sources > 1) throw std::invalid_argument("expected either CSV files or one simulation, found several of them");
  if (!options.places.empty() && options.places.size() != options.files.size()) {
    throw std::invalid_argument("expected --axis once for each of " + std::to_string(options.files.size()) +
                                " files, found " + std::to_string(options.places.size()));
  }
  const auto check_positive = [](const std::optional<double>& value, const std::string& option) {
    if (value && (!(*value > 0) || !std::isfinite(*value))) {
      throw std::invalid_argument(option + " " + std::to_string(*value) + ": expected a finite number > 0");
    }
  };
  check_positive(options.mass, "--mass");
  check_positive(options.encoder_step, "--encoder-step");
  const FreedomInfo& freedom = info(options.freedom);
  const HandleBounds& bounds = freedom.bounds;
  if (options.mass && (*options.mass < bounds.least_inertia || *options.mass > bounds.most_inertia)) {
    throw std::invalid_argument("--mass " + shortest(*options.mass) + ": " + inertia_bounds(freedom) + "; is it in " +
                                std::string(freedom.wrong_inertia_unit) + "?");
  }
  if (options.encoder_step && *options.encoder_step > bounds.encoder_step) {
    throw std::invalid_argument("--encoder-step " + shortest(*options.encoder_step) + ": expected at most " +
                                shortest(bounds.encoder_step) + " " + std::string(freedom.position_unit) +
                                "; is it in " + std::string(freedom.wrong_step_unit) + "?");
  }
  if (options.profile && options.freedom != Freedom::kMovement) {
    throw std::invalid_argument("--simulate " + *options.profile + ": expected --of movement, because no profile " +
                                "has motors for rotation or a gripper; use --simulate-friction for them");
  }
}

SimulatedDevice::Config device_of(const IdentifyOptions& options) {
  if (options.profile) {
    const DeviceProfile* profile = find_device_profile(*options.profile);
    if (profile == nullptr) {
      std::string known;
      for (const DeviceProfile& each : device_profiles()) known += (known.empty() ? "" : ", ") + std::string(each.name);
      throw std::invalid_argument("--simulate " + *options.profile + ": expected one of " + known +
                                  did_you_mean(*options.profile, known));
    }
    SimulatedDevice::Config device = profile->device();
    device.amplifier_bandwidth.reset();  // a lag of a millisecond does not matter over seconds
    return device;
  }
  const Friction& friction = *options.simulated_friction;
  SimulatedDevice::Config device;
  device.mass = kSimulatedMass;
  const auto rubs = [&friction](auto& part) {
    if (friction.viscous != 0) part.viscous_friction = friction.viscous;
    if (friction.coulomb != 0) part.coulomb_friction = friction.coulomb;
  };
  switch (options.freedom) {
    case Freedom::kMovement:
      device.encoder_step = kEncoderStep;
      rubs(device);
      break;
    case Freedom::kRotation:
      device.rotation =
          SimulatedRotation::Config{.inertia = kSimulatedInertia, .max_torque = 1, .encoder_step = kAngularStep};
      rubs(*device.rotation);
      break;
    case Freedom::kGripper:
      device.gripper = SimulatedGripper::Config{.open = 10,
                                                .arm = 0.05,
                                                .mass = kSimulatedMass,
                                                .start = 5,
                                                .max_force = 10,
                                                .encoder_step = kEncoderStep / 0.05};
      rubs(*device.gripper);
      break;
  }
  return device;
}

/// Scales torques to 1/50 of the forces and angles to 8 times the travel, which suits a stylus.
RampExperiment experiment_of(const IdentifyOptions& options) {
  RampExperiment experiment{.device = device_of(options), .freedom = options.freedom, .seed = options.seed};
  if (options.freedom == Freedom::kRotation) {
    for (double& rate : experiment.rates) rate /= 50;
    experiment.force_noise /= 50;
    experiment.travel = 2;
  }
  return experiment;
}

Source simulated(const IdentifyOptions& options) {
  const RampExperiment experiment = experiment_of(options);
  Source source{.freedom = info(options.freedom)};
  const std::size_t runs = 2 * experiment.rates.size() * static_cast<std::size_t>(experiment.repeats);
  for (std::size_t i = 0; i < runs; ++i) source.names.push_back("simulated " + std::to_string(i + 1));
  source.places.resize(runs, "x");
  const bool turns = options.freedom == Freedom::kRotation;
  const bool moves = options.freedom == Freedom::kMovement;
  const double step = moves ? experiment.device.encoder_step.value_or(0) : usual_step(options.freedom);
  source.config = {.mass = options.mass.value_or(turns ? kSimulatedInertia : experiment.device.mass),
                   .encoder_step = options.encoder_step.value_or(step)};
  // The noise sequence continues from run to run, so any run requires all of them.
  source.run = [experiment, all = std::vector<RampRun>()](std::size_t i) mutable {
    if (all.empty()) all = simulated_ramps(experiment);
    return all.at(i);
  };
  return source;
}

Source recorded(const IdentifyOptions& options) {
  Source source{.freedom = info(options.freedom)};
  for (const std::filesystem::path& file : options.files) source.names.push_back(file.string());
  source.places = options.places;
  source.config = {.mass = options.mass, .encoder_step = options.encoder_step.value_or(usual_step(options.freedom))};
  source.run = [options](std::size_t i) { return load_ramp_csv(options.files.at(i), options.freedom); };
  return source;
}

std::string impossible(const FreedomInfo& freedom, const RampRun& run) {
  if (run.samples.size() < 2) return "";
  const auto count = static_cast<double>(run.samples.size() - 1);
  const double interval = (run.samples.back().t - run.samples.front().t) / count;
  if (interval > kMostInterval) {
    return "the samples are " + rounded(interval, 4) + " s apart, expected at most " + shortest(kMostInterval) +
           " s; are the times in ms?";
  }
  const auto [least, most] = std::ranges::minmax(run.samples, {}, &RampSample::position);
  const double travel = most.position - least.position;
  if (travel <= freedom.bounds.travel) return "";
  const std::string unit(freedom.position_unit);
  return "the travel is " + rounded(travel, 4) + " " + unit + ", expected at most " +
         rounded(freedom.bounds.travel, 4) + " " + unit + " for a handle; are the positions in " +
         std::string(freedom.wrong_position_unit) + "?";
}

/// Throws std::runtime_error naming a run that cannot be used.
RunEstimate fit_of(const Source& source, std::size_t i) {
  RampRun run = source.run(i);
  if (!source.places.empty()) run.place = source.places.at(i);
  if (const std::string why = impossible(source.freedom, run); !why.empty()) {
    throw std::runtime_error(source.names.at(i) + ": " + why);
  }
  try {
    return fit_run(run, source.config);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(source.names.at(i) + ": " + error.what());
  }
}

/// Throws std::runtime_error if no real handle can have these results.
void refuse_impossible(const Source& source, const Identification& result) {
  const FreedomInfo& freedom = source.freedom;
  const HandleBounds& bounds = freedom.bounds;
  const std::string position(freedom.position_unit);
  const std::string effort(freedom.effort_unit);
  if (!(result.mass >= bounds.least_inertia)) {
    throw std::runtime_error("the runs fit an inertia of " + rounded(result.mass, 4) + " " +
                             std::string(freedom.inertia_unit) + ", " + inertia_bounds(freedom) +
                             "; are the positions in " + std::string(freedom.wrong_position_unit) +
                             ", or the times in µs?");
  }
  if (!(result.mass <= bounds.most_inertia)) {
    throw std::runtime_error("the runs fit an inertia of " + rounded(result.mass, 4) + " " +
                             std::string(freedom.inertia_unit) + ", " + inertia_bounds(freedom) +
                             "; are the times in ms, or the efforts in m" + effort + "?");
  }
  const auto check_friction = [&](double found, double most, std::string_view unit) {
    if (std::abs(found) <= most) return;
    throw std::runtime_error("the runs fit a friction of " + rounded(found, 4) + " " + std::string(unit) +
                             ", expected at most " + shortest(most) + " " + std::string(unit) +
                             " for a handle; are all columns in s, " + position + " and " + effort +
                             ", and the mass in " + std::string(freedom.inertia_unit) + "?");
  };
  check_friction(result.estimate.viscous, bounds.friction.viscous, freedom.viscous_unit);
  check_friction(result.estimate.coulomb, bounds.friction.coulomb, freedom.effort_unit);
}

Friction bound_of(const Source& source, const Identification& result) {
  const double share = source.freedom.share;
  return {.coulomb = share * result.lower_bound.coulomb, .viscous = share * result.lower_bound.viscous};
}

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);  // NOLINT(cppcoreguidelines-pro-type-vararg): digits
  return text.data();
}

/// Formats with four digits, rounded down so that a lower bound remains one.
std::string rounded_down(double value) {
  if (!(value > 0)) return "0.0";
  const double unit = std::pow(10, std::floor(std::log10(value)) - 3);
  return formatted("%.*f", std::max(1, -static_cast<int>(std::floor(std::log10(unit)))),
                   std::floor(value / unit) * unit);
}

void write_table(const Source& source, const Identification& result, std::ostream& out) {
  std::size_t width = 3;
  for (const std::string& name : source.names) width = std::max(width, name.size());
  const auto padded = [width](const std::string& text) {
    return text + std::string(width - std::min(width, text.size()), ' ');
  };
  const FreedomInfo& freedom = source.freedom;
  const std::string slope = "slope " + std::string(freedom.effort_unit) + "/s";
  const std::string travel = "travel " + std::string(freedom.position_unit);
  const auto right = [](const std::string& text, std::size_t columns) {
    const auto letters =
        static_cast<std::size_t>(std::ranges::count_if(text, [](char c) { return (c & 0xC0) != 0x80; }));
    return std::string(columns - std::min(columns, letters), ' ') + text;
  };
  out << padded("run") << right(slope, 13) << right(travel, 12)
      << "  b integral ± 1σ          Kelly b   f_c integral ± 1σ        Kelly f_c\n";
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const RunEstimate& run = result.runs[i];
    out << padded(source.names[i])
        << formatted("  %11.4g  %10.4f  %10.6f ± %9.6f  %11.6f  %10.6f ± %9.6f  %11.6f\n",
                     run.direction * run.kelly.rate, run.travel, run.integral.friction.viscous,
                     run.integral_error.viscous, run.kelly.friction.viscous, run.integral.friction.coulomb,
                     run.integral_error.coulomb, run.kelly.friction.coulomb);
  }
  out << '\n';
  for (const PlaceEstimate& place : result.places) {
    out << (place.place.empty() ? "all runs" : place.place)
        << formatted(": b = %.6f ± %.6f %s, f_c = %.6f ± %.6f %s; Kelly: b = %.6f, f_c = %.6f, ",
                     place.integral.viscous, place.integral_error.viscous, std::string(freedom.viscous_unit).c_str(),
                     place.integral.coulomb, place.integral_error.coulomb, std::string(freedom.effort_unit).c_str(),
                     place.kelly.viscous, place.kelly.coulomb)
        << (place.kelly_valid ? "valid" : "not valid") << '\n';
  }
  const bool turns = freedom.freedom == Freedom::kRotation;
  out << formatted("%s %.4g %s%s, noise %.2g %s\n\n", turns ? "inertia" : "mass", result.mass,
                   std::string(freedom.inertia_unit).c_str(), source.config.mass ? " (given)" : " (fitted)",
                   result.force_noise, std::string(freedom.effort_unit).c_str())
      << "Valid: " << to_string(result.trust) << ". " << result.reason << ".\n";
  for (const std::string& warning : result.warnings) out << "Warning: " << warning << ".\n";
  if (result.trust == Trust::kNeither) return;
  const Friction bound = bound_of(source, result);
  out << "\n# Lower bounds (3 standard deviations" << (freedom.share < 1 ? ", and 2 % for turns about moving axes" : "")
      << ") for a scene:\n[" << freedom.table << "]\n"
      << freedom.coulomb_key << " = " << rounded_down(bound.coulomb) << '\n'
      << freedom.viscous_key << " = " << rounded_down(bound.viscous) << '\n';
}

void add(JsonLine& line, const std::string& prefix, const Friction& friction, bool turns) {
  line.add(prefix + (turns ? "viscous_nm_s_per_rad" : "viscous_n_s_per_m"), friction.viscous)
      .add(prefix + (turns ? "coulomb_nm" : "coulomb_n"), friction.coulomb);
}

void write_json(const Source& source, const Identification& result, std::ostream& out) {
  const bool turns = source.freedom.freedom == Freedom::kRotation;
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const RunEstimate& run = result.runs[i];
    JsonLine line;
    line.add("run", source.names[i])
        .add("place", run.place)
        .add(turns ? "slope_nm_per_s" : "slope_n_per_s", run.direction * run.kelly.rate)
        .add(turns ? "travel_rad" : "travel_m", run.travel);
    add(line, "integral_", run.integral.friction, turns);
    add(line, "integral_sigma_", run.integral_error, turns);
    add(line, "kelly_", run.kelly.friction, turns);
    out << line.add("kelly_long_enough", run.kelly.long_enough()).str() << '\n';
  }
  JsonLine line;
  line.add("result", to_string(result.trust)).add("of", source.freedom.name).add("reason", result.reason);
  add(line, "estimate_", result.estimate, turns);
  if (result.trust != Trust::kNeither) add(line, "lower_bound_", bound_of(source, result), turns);
  line.add(turns ? "inertia_kg_m2" : "mass_kg", result.mass)
      .add(turns ? "torque_noise_nm" : "force_noise_n", result.force_noise)
      .add("warnings", result.warnings);
  out << line.str() << '\n';
}

JsonLine line_of(const std::string& name, const RunEstimate& run, bool turns) {
  const std::string effort = turns ? "_nm" : "_n";
  const std::string inertia = turns ? "inertia_kg_m2" : "mass_kg";
  JsonLine line;
  line.add("run", name).add("place", run.place).add("direction", run.direction);
  line.add(turns ? "travel_rad" : "travel_m", run.travel);
  add(line, "kelly_", run.kelly.friction, turns);
  line.add("kelly_rate" + effort + "_per_s", run.kelly.rate)
      .add("kelly_slide_s", run.kelly.slide_time)
      .add("kelly_time_constant_s", run.kelly.time_constant);
  add(line, "integral_", run.integral.friction, turns);
  line.add("integral_" + inertia, run.integral.mass)
      .add("viscous_variance_of_unit_noise", run.integral.unit_covariance(0, 0))
      .add("coulomb_variance_of_unit_noise", run.integral.unit_covariance(1, 1))
      .add("residual_squares", run.integral.residual_squares)
      .add("residual_squares_of_unit_noise", run.integral.unit_residual);
  return line;
}

/// Reads the fields that identify_friction needs; excludes the covariance of b and f_c.
RunEstimate estimate_of(const nlohmann::json& line, bool turns) {
  const std::string effort = turns ? "_nm" : "_n";
  const auto friction = [&](const std::string& prefix) {
    return Friction{.coulomb = number_of(line, prefix + "coulomb" + effort),
                    .viscous = number_of(line, prefix + (turns ? "viscous_nm_s_per_rad" : "viscous_n_s_per_m"))};
  };
  RunEstimate run;
  run.place = line.at("place");
  run.direction = number_of(line, "direction");
  run.travel = number_of(line, turns ? "travel_rad" : "travel_m");
  run.kelly = {.friction = friction("kelly_"),
               .rate = number_of(line, "kelly_rate" + effort + "_per_s"),
               .slide_time = number_of(line, "kelly_slide_s"),
               .time_constant = number_of(line, "kelly_time_constant_s")};
  // JSON has no infinity.
  if (std::isnan(run.kelly.time_constant)) run.kelly.time_constant = std::numeric_limits<double>::infinity();
  run.integral.friction = friction("integral_");
  run.integral.mass = number_of(line, turns ? "integral_inertia_kg_m2" : "integral_mass_kg");
  run.integral.unit_covariance(0, 0) = number_of(line, "viscous_variance_of_unit_noise");
  run.integral.unit_covariance(1, 1) = number_of(line, "coulomb_variance_of_unit_noise");
  run.integral.residual_squares = number_of(line, "residual_squares");
  run.integral.unit_residual = number_of(line, "residual_squares_of_unit_noise");
  return run;
}

SweptWork<RunEstimate> work_of(const Source& source) {
  const bool turns = source.freedom.freedom == Freedom::kRotation;
  return {.what = "runs",
          .units = source.names.size(),
          .run = [&source](std::uint64_t unit) { return fit_of(source, unit); },
          .lines =
              [&source, turns](std::uint64_t unit, const RunEstimate& run) {
                std::vector<JsonLine> lines;
                lines.push_back(line_of(source.names.at(unit), run, turns));
                return lines;
              },
          .read = [turns](std::uint64_t /*unit*/,
                          const std::vector<nlohmann::json>& lines) { return estimate_of(lines.at(0), turns); },
          .count =
              [](const RunEstimate& run, ShardEnd& end) {
                end.count("runs", 1);
                end.count("kelly_long_enough", run.kelly.long_enough() ? 1 : 0);
                end.lower("integral_viscous", run.integral.friction.viscous);
                end.lower("integral_coulomb", run.integral.friction.coulomb);
              }};
}

}  // namespace

void identify(const IdentifyOptions& options, std::ostream& out) {
  check(options);
  const Source source = options.files.empty() ? simulated(options) : recorded(options);
  const auto fits = outcomes(work_of(source), options.part, out);
  if (!fits) return;
  const Identification result = identify_friction(*fits);
  refuse_impossible(source, result);
  (options.json ? write_json : write_table)(source, result, out);
}

}  // namespace tendon::lab
