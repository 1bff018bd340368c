// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/friction_tables.h"

#include <array>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <string>

#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/support/swept_work.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab {
namespace {

constexpr double kMass = 0.075;         // kg
constexpr double kEncoderStep = 30e-6;  // m
constexpr std::uint64_t kSeed = 1;

}  // namespace

FrictionTable friction_table(double damping) {
  const Friction truth{.coulomb = 0.05, .viscous = damping};
  SimulatedDevice::Config device;
  device.mass = kMass;
  device.viscous_friction = truth.viscous;
  device.coulomb_friction = truth.coulomb;
  device.encoder_step = kEncoderStep;
  RampExperiment ramps{.device = device};
  ramps.seed = kSeed;
  return {.truth = truth,
          .found = identify_friction(simulated_ramps(ramps), {.mass = kMass, .encoder_step = kEncoderStep}),
          .seed = kSeed};
}

void write(std::ostream& out, const std::vector<FrictionTable>& tables) {
  out << "II, III  friction from ramps of force, 30 runs of a device with known friction (seed " << kSeed << ")\n"
      << "       true b, N s/m   Kelly b   integral b   at least   true f_c, N   Kelly f_c   integral f_c   trust\n";
  for (const FrictionTable& table : tables) {
    const PlaceEstimate& place = table.found.places.front();
    std::array<char, 160> line{};
    std::snprintf(line.data(), line.size(), "%20.3f %9.4f %12.4f %10.4f %13.3f %11.4f %14.4f   %s\n",
                  table.truth.viscous, place.kelly.viscous, place.integral.viscous, table.found.lower_bound.viscous,
                  table.truth.coulomb, place.kelly.coulomb, place.integral.coulomb,
                  std::string(to_string(table.found.trust)).c_str());
    out << line.data() << "       " << table.found.reason << "\n";
  }
  out << "     assumed: ramps, travel, encoder and noise, because Tables II and III are not available\n";
}

JsonLine json_of(const FrictionTable& table) {
  const PlaceEstimate& place = table.found.places.front();
  JsonLine line;
  line.add("experiment", "II/III")
      .add("b_true_n_s_per_m", table.truth.viscous)
      .add("b_kelly_n_s_per_m", place.kelly.viscous)
      .add("b_integral_n_s_per_m", place.integral.viscous)
      .add("b_at_least_n_s_per_m", table.found.lower_bound.viscous)
      .add("fc_true_n", table.truth.coulomb)
      .add("fc_kelly_n", place.kelly.coulomb)
      .add("fc_integral_n", place.integral.coulomb)
      .add("fc_at_least_n", table.found.lower_bound.coulomb)
      .add("trust", to_string(table.found.trust))
      .add("reason", table.found.reason)
      .add("seed", table.seed)
      .add("scene", "ramps of 0.05, 0.1, 0.5 N/s, 5 each way, 0.25 m, 75 g, 30 um, 5 mN")
      .add("commit", kCommit);
  return line;
}

FrictionTable friction_table_of(const nlohmann::json& line) {
  const auto friction = [&line](const std::string& which) {
    return Friction{.coulomb = number_of(line, "fc_" + which + "_n"),
                    .viscous = number_of(line, "b_" + which + "_n_s_per_m")};
  };
  FrictionTable table{.truth = friction("true"), .found = {}, .seed = line.at("seed")};
  PlaceEstimate& place = table.found.places.emplace_back();
  place.integral = friction("integral");
  place.kelly = friction("kelly");
  table.found.lower_bound = friction("at_least");
  table.found.reason = line.at("reason");
  for (const Trust trust : {Trust::kIntegral, Trust::kBoth, Trust::kNeither}) {
    if (line.at("trust") == to_string(trust)) table.found.trust = trust;
  }
  return table;
}

}  // namespace tendon::lab
