// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/identify/identify.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/identification/friction_identification.h"
#include "devices/simulated/profiles.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/identify/ramp_csv.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab {
namespace {

constexpr double kEncoderStep = 3e-5;       // m
constexpr double kAngularStep = 1e-4;       // rad
constexpr double kSimulatedMass = 0.075;    // kg
constexpr double kSimulatedInertia = 1e-4;  // kg·m²

double usual_step(Freedom freedom) { return freedom == Freedom::kRotation ? kAngularStep : kEncoderStep; }

struct Source {
  FreedomInfo freedom = info(Freedom::kMovement);
  std::vector<RampRun> runs{};
  std::vector<std::string> names{};  ///< of the runs, for people
  IdentificationConfig config{};
};

void check(const IdentifyOptions& options) {
  const int sources =
      (options.files.empty() ? 0 : 1) + (options.profile ? 1 : 0) + (options.simulated_friction ? 1 : 0);
  if (sources == 0) throw std::invalid_argument("expected a CSV file, --simulate or --simulate-friction, found none");
  if (sources > 1) throw std::invalid_argument("expected CSV files or one simulation, found more than one of them");
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
  if (options.profile && options.freedom != Freedom::kMovement) {
    throw std::invalid_argument("--simulate " + *options.profile + ": expected --of movement: no profile has motors " +
                                "that turn or grip; --simulate-friction simulates them");
  }
}

SimulatedDevice::Config device_of(const IdentifyOptions& options) {
  if (options.profile) {
    const DeviceProfile* profile = find_device_profile(*options.profile);
    if (profile == nullptr) {
      std::string known;
      for (const DeviceProfile& each : device_profiles()) known += (known.empty() ? "" : ", ") + std::string(each.name);
      throw std::invalid_argument("--simulate " + *options.profile + ": expected one of " + known);
    }
    SimulatedDevice::Config device = profile->device();
    device.amplifier_bandwidth.reset();  // the experiment takes seconds: a lag of a millisecond is none
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

/// What is asked of a device whose friction is of the size of a stylus's: torques are a fiftieth of forces, and turns
/// eight times the travel.
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
  source.runs = simulated_ramps(experiment);
  for (std::size_t i = 0; i < source.runs.size(); ++i) {
    source.names.push_back("simulated " + std::to_string(i + 1));
    source.runs[i].place = "x";
  }
  const bool turns = options.freedom == Freedom::kRotation;
  const bool moves = options.freedom == Freedom::kMovement;
  const double step = moves ? experiment.device.encoder_step.value_or(0) : usual_step(options.freedom);
  source.config = {.mass = options.mass.value_or(turns ? kSimulatedInertia : experiment.device.mass),
                   .encoder_step = options.encoder_step.value_or(step)};
  return source;
}

Source recorded(const IdentifyOptions& options) {
  Source source{.freedom = info(options.freedom)};
  for (std::size_t i = 0; i < options.files.size(); ++i) {
    RampRun run = load_ramp_csv(options.files[i], options.freedom);
    if (!options.places.empty()) run.place = options.places[i];
    source.runs.push_back(std::move(run));
    source.names.push_back(options.files[i].string());
  }
  source.config = {.mass = options.mass, .encoder_step = options.encoder_step.value_or(usual_step(options.freedom))};
  return source;
}

/// Which run it is that cannot be used is known by name here only: one by one first.
void check_runs(const Source& source) {
  for (std::size_t i = 0; i < source.runs.size(); ++i) {
    try {
      ramp_of(slide_of(source.runs[i], source.config.encoder_step));
    } catch (const std::invalid_argument& error) {
      throw std::runtime_error(source.names[i] + ": " + error.what());
    }
  }
}

Friction bound_of(const Source& source, const Identification& result) {
  const double share = source.freedom.share;
  return {.coulomb = share * result.lower_bound.coulomb, .viscous = share * result.lower_bound.viscous};
}

// ---- For people -------------------------------------------------------------------------------------------------

template <typename... Values>
std::string formatted(const char* format, Values... values) {
  std::array<char, 256> text{};
  std::snprintf(text.data(), text.size(), format, values...);  // NOLINT(cppcoreguidelines-pro-type-vararg): digits
  return text.data();
}

/// Shortest text that is not above `value`: four digits, rounded down. A bound is not rounded up.
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
      << "Trusted: " << to_string(result.trust) << ". " << result.reason << ".\n";
  for (const std::string& warning : result.warnings) out << "Warning: " << warning << ".\n";
  const Friction bound = bound_of(source, result);
  out << "\n# Lower bounds (3 standard deviations" << (freedom.share < 1 ? ", and 2 % for turns about moving axes" : "")
      << ") for a scene:\n[" << freedom.table << "]\n"
      << freedom.coulomb_key << " = " << rounded_down(bound.coulomb) << '\n'
      << freedom.viscous_key << " = " << rounded_down(bound.viscous) << '\n';
}

// ---- JSON -------------------------------------------------------------------------------------------------------

/// `viscous_…` and `coulomb_…`, with a prefix to the keys.
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
  add(line, "lower_bound_", bound_of(source, result), turns);
  line.add(turns ? "inertia_kg_m2" : "mass_kg", result.mass)
      .add(turns ? "torque_noise_nm" : "force_noise_n", result.force_noise)
      .add("warnings", result.warnings);
  out << line.str() << '\n';
}

}  // namespace

void identify(const IdentifyOptions& options, std::ostream& out) {
  check(options);
  const Source source = options.files.empty() ? simulated(options) : recorded(options);
  check_runs(source);
  Identification result;
  try {
    result = identify_friction(source.runs, source.config);
  } catch (const std::invalid_argument& error) {
    throw std::runtime_error(error.what());  // of the runs, not of the options
  }
  (options.json ? write_json : write_table)(source, result, out);
}

}  // namespace tendon::lab
