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

constexpr double kEncoderStep = 3e-5;  // m

struct Source {
  std::vector<RampRun> runs;
  std::vector<std::string> names;  ///< of the runs, for people
  IdentificationConfig config;
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
  check_positive(options.mass, "--mass-kg");
  check_positive(options.encoder_step, "--encoder-step-m");
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
  device.mass = 0.075;
  device.encoder_step = kEncoderStep;
  if (friction.viscous != 0) device.viscous_friction = friction.viscous;
  if (friction.coulomb != 0) device.coulomb_friction = friction.coulomb;
  return device;
}

Source simulated(const IdentifyOptions& options) {
  RampExperiment experiment{.device = device_of(options), .seed = options.seed};
  Source source;
  source.runs = simulated_ramps(experiment);
  for (std::size_t i = 0; i < source.runs.size(); ++i) {
    source.names.push_back("simulated " + std::to_string(i + 1));
    source.runs[i].place = "x";
  }
  source.config = {.mass = options.mass.value_or(experiment.device.mass),
                   .encoder_step = options.encoder_step.value_or(experiment.device.encoder_step.value_or(0))};
  return source;
}

Source recorded(const IdentifyOptions& options) {
  Source source;
  for (std::size_t i = 0; i < options.files.size(); ++i) {
    RampRun run = load_ramp_csv(options.files[i]);
    if (!options.places.empty()) run.place = options.places[i];
    source.runs.push_back(std::move(run));
    source.names.push_back(options.files[i].string());
  }
  source.config = {.mass = options.mass, .encoder_step = options.encoder_step.value_or(kEncoderStep)};
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
  out << padded("run") << "   slope N/s  travel m  b integral ± 1σ      Kelly b   f_c integral ± 1σ    Kelly f_c\n";
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const RunEstimate& run = result.runs[i];
    out << padded(source.names[i])
        << formatted("  %9.4g  %8.4f  %8.5f ± %7.5f  %9.5f  %8.5f ± %7.5f  %9.5f\n", run.direction * run.kelly.rate,
                     run.travel, run.integral.friction.viscous, run.integral_error.viscous, run.kelly.friction.viscous,
                     run.integral.friction.coulomb, run.integral_error.coulomb, run.kelly.friction.coulomb);
  }
  out << '\n';
  for (const PlaceEstimate& place : result.places) {
    out << (place.place.empty() ? "all runs" : place.place)
        << formatted(": b = %.5f ± %.5f N·s/m, f_c = %.5f ± %.5f N; Kelly: b = %.5f, f_c = %.5f, ",
                     place.integral.viscous, place.integral_error.viscous, place.integral.coulomb,
                     place.integral_error.coulomb, place.kelly.viscous, place.kelly.coulomb)
        << (place.kelly_valid ? "valid" : "not valid") << '\n';
  }
  out << formatted("mass %.4f kg%s, force noise %.2g N\n\n", result.mass, source.config.mass ? " (given)" : " (fitted)",
                   result.force_noise)
      << "Trusted: " << to_string(result.trust) << ". " << result.reason << ".\n";
  for (const std::string& warning : result.warnings) out << "Warning: " << warning << ".\n";
  out << "\n# Lower bounds (3 standard deviations) for a scene:\n[limiter]\ncoulomb_friction_n = "
      << rounded_down(result.lower_bound.coulomb)
      << "\nviscous_friction_n_s_per_m = " << rounded_down(result.lower_bound.viscous) << '\n';
}

// ---- JSON -------------------------------------------------------------------------------------------------------

/// `viscous_…` and `coulomb_…`, with a prefix to the keys.
void add(JsonLine& line, const std::string& prefix, const Friction& friction) {
  line.add(prefix + "viscous_n_s_per_m", friction.viscous).add(prefix + "coulomb_n", friction.coulomb);
}

void write_json(const Source& source, const Identification& result, std::ostream& out) {
  for (std::size_t i = 0; i < result.runs.size(); ++i) {
    const RunEstimate& run = result.runs[i];
    JsonLine line;
    line.add("run", source.names[i])
        .add("place", run.place)
        .add("slope_n_per_s", run.direction * run.kelly.rate)
        .add("travel_m", run.travel);
    add(line, "integral_", run.integral.friction);
    add(line, "integral_sigma_", run.integral_error);
    add(line, "kelly_", run.kelly.friction);
    out << line.add("kelly_long_enough", run.kelly.long_enough()).str() << '\n';
  }
  JsonLine line;
  line.add("result", to_string(result.trust)).add("reason", result.reason);
  add(line, "estimate_", result.estimate);
  add(line, "lower_bound_", result.lower_bound);
  line.add("mass_kg", result.mass).add("force_noise_n", result.force_noise).add("warnings", result.warnings);
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
