// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/friction_tables.h"

#include <array>
#include <cstdio>

#include "server/build_info.h"
#include "tests/support/json_line.h"
#include "tests/tools/lab/identify/simulated_ramps.h"

namespace tendon::lab {
namespace {

constexpr double kMass = 0.075;         // kg
constexpr double kEncoderStep = 30e-6;  // m
constexpr std::uint64_t kSeed = 1;

}  // namespace

std::vector<FrictionTable> friction_tables() {
  std::vector<FrictionTable> tables;
  for (const double viscous : {0.26, 0.05, 0.005}) {
    const Friction truth{.coulomb = 0.05, .viscous = viscous};
    SimulatedDevice::Config device;
    device.mass = kMass;
    device.viscous_friction = truth.viscous;
    device.coulomb_friction = truth.coulomb;
    device.encoder_step = kEncoderStep;
    RampExperiment ramps{.device = device};
    ramps.seed = kSeed;
    tables.push_back({.truth = truth,
                      .found = identify_friction(simulated_ramps(ramps), {.mass = kMass, .encoder_step = kEncoderStep}),
                      .seed = kSeed});
  }
  return tables;
}

void write(std::ostream& out, const std::vector<FrictionTable>& tables) {
  out << "II, III  friction from ramps of force, 30 runs of a device whose friction is known (seed " << kSeed << ")\n"
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
  out << "     assumed: Tables II and III are lost; ramps, travel, encoder and noise are control.md 2's\n";
}

std::string to_json(const FrictionTable& table) {
  const PlaceEstimate& place = table.found.places.front();
  return JsonLine()
      .add("experiment", "II/III")
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
      .add("commit", kCommit)
      .str();
}

}  // namespace tendon::lab
