// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/teleop_matrix.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <stdexcept>
#include <string>

#include "devices/simulated/profiles.h"
#include "tests/support/json_line.h"
#include "tests/tools/injector/injector.h"
#include "tests/tools/injector/profile/named_profiles.h"
#include "tests/tools/lab/experiments/pressing_by.h"
#include "tests/tools/lab/pictures/csv.h"

namespace tendon::lab {
namespace {

using namespace std::chrono_literals;

constexpr std::string_view kDevices[] = {"falcon", "phantom-premium", "touch", "falcon/phantom-premium"};
constexpr std::string_view kBursts = "bursts";
constexpr std::string_view kBurstProfile = "delay=20ms stall(every=60ms,for=30ms)";
constexpr std::string_view kNetworks[] = {"lan",  "wifi-bad", "lte-driving", "leo-satellite", "wan-intercontinental",
                                          kBursts};
constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

constexpr int kPress = 3000;  // ms: the hand starts to press,
constexpr int kLeave = 7000;  // to leave the wall,
constexpr int kMove = 10000;  // and to move. The wall is then gone.
constexpr int kEnd = 75000;
constexpr int kMean = 2000;  // ms, two periods of the motion

double hand_at(double t) {
  constexpr double kPressed = (kLeave - kPress) * 1e-3;
  if (t >= kMove * 1e-3) {
    const double since = t - kMove * 1e-3;
    return 0.02 * std::min(since, 1.0) * std::sin(2 * std::numbers::pi * since);
  }
  const double into = t - kPress * 1e-3;
  return kPressingDepth * std::clamp(std::min(into / 0.5, (kPressed + 0.5 - into) / 0.5), 0.0, 1.0);
}

const DeviceProfile& profile_of(std::string_view name) {
  const DeviceProfile* const profile = find_device_profile(name);
  if (profile == nullptr) throw std::invalid_argument("unknown device \"" + std::string(name) + '"');
  return *profile;
}

Network network_of(std::string_view name, injector::Direction direction, std::uint64_t seed) {
  const injector::Profile profile = injector::resolve_profile(name == kBursts ? kBurstProfile : name, direction);
  return {.arrivals = [injector = injector::Injector(profile, seed, 0, direction, LocalTime{})](int now) mutable {
    const auto period = [](LocalTime at) { return static_cast<int>(std::ceil(at.time_since_epoch() / 1.0ms)); };
    const injector::Decision decision =
        injector.decide({.arrival = LocalTime(std::chrono::milliseconds(now)), .size = 200});
    std::vector<int> arrivals;
    if (decision.verdict != injector::Verdict::kDrop) arrivals.push_back(period(decision.release));
    if (decision.duplicate) arrivals.push_back(period(*decision.duplicate));
    return arrivals;
  }};
}

PortSetup end_of(const MatrixCase& of, PortRole role, const DeviceProfile& device, std::optional<Preset> preset) {
  PortSetup end = port_of(role);
  couple_by(of.method, end.coupling);
  const Pressing with = pressing_by(of.method);
  end.coupling.spring.own_damping = with.impedance;
  end.coupling.spring.stiffness = with.stiffness;
  if (!with.tank) end.coupling.tank.reset();
  end.coupling.spring.max_force = device.max_force.value;
  end.mass = device.mass.value;
  end.friction = device.friction_bounds();
  end.encoder_step = of.counts ? device.encoder_step.value : 0;
  end.motor = device.max_force.value;
  end.preset = preset;
  end.estimates = true;
  return end;
}

Ports ports_of(const MatrixCase& of, std::uint64_t seed, std::optional<Preset> preset) {
  const std::size_t slash = std::min(of.devices.find('/'), of.devices.size());
  PortSetup leader = end_of(of, PortRole::kLeader, profile_of(of.devices.substr(0, slash)), preset);
  PortSetup follower =
      end_of(of, PortRole::kFollower, profile_of(of.devices.substr(slash < of.devices.size() ? slash + 1 : 0)), preset);
  leader.around[0] = {.stiffness = kPressingHand, .damping = 3, .reference = hand_at};
  leader.around[1] = leader.around[2] = {.stiffness = 400, .damping = 3};
  follower.around[0] = {.stiffness = 500,
                        .damping = 1,
                        .reference = [](double) { return kPressingWallAt; },
                        .wall = true,
                        .until = kMove * 1e-3};
  follower.measures_contact = of.method != CouplingMethod::kWaves;
  return {leader, follower, network_of(of.network, injector::Direction::kUp, seed),
          network_of(of.network, injector::Direction::kDown, seed)};
}

/// The speed above 20 Hz of both handles while the hand rests.
class Vibration {
 public:
  void add(const Ports& ports) {
    leader_.add((ports.leader.x().x() - leader_before_) * 1e3);
    follower_.add((ports.follower.x().x() - follower_before_) * 1e3);
    follow(ports);
  }
  void follow(const Ports& ports) {
    leader_before_ = ports.leader.x().x();
    follower_before_ = ports.follower.x().x();
  }
  double worse() const { return std::max(leader_.rms(), follower_.rms()); }

 private:
  Fast leader_{20};
  Fast follower_{20};
  double leader_before_ = 0;
  double follower_before_ = 0;
};

/// m: mean over two periods of the motion.
double offset(Ports& ports) {
  double sum = 0;
  ports.run(kMean, [&](int) { sum += ports.leader.x().x() - ports.follower.x().x(); });
  return sum / kMean;
}

/// Empty for NaN. Zero has no sign.
std::string rounded(double value, int digits) {
  if (std::isnan(value)) return {};
  const double scale = std::pow(10.0, digits);
  std::ostringstream text;
  text << std::fixed << std::setprecision(digits) << std::round(value * scale) / scale + 0.0;
  return text.str();
}

SweptWork<MatrixResult> work_of(const std::vector<MatrixCase>& cases, const MatrixOptions& options) {
  return {
      .what = "rows",
      .units = cases.size(),
      .run = [cases, options](std::uint64_t unit) { return matrix_result(cases[unit], options.seed, options.preset); },
      .lines =
          [cases](std::uint64_t unit, const MatrixResult& result) {
            std::vector<JsonLine> lines;
            lines.emplace_back()
                .add("method", to_string(cases[unit].method))
                .add("held", result.held)
                .add("drift_m", result.drift)
                .add("vibration_mps", result.vibration)
                .add("energy_j", result.energy)
                .add("engaged", result.engaged);
            return lines;
          },
      .read =
          [](std::uint64_t /*unit*/, const std::vector<nlohmann::json>& lines) {
            const nlohmann::json& line = lines.at(0);
            return MatrixResult{.held = number_of(line, "held"),
                                .drift = number_of(line, "drift_m"),
                                .vibration = number_of(line, "vibration_mps"),
                                .energy = number_of(line, "energy_j"),
                                .engaged = line.at("engaged")};
          },
      .count =
          [](const MatrixResult& result, ShardEnd& end) {
            end.count("rows", 1);
            end.count("engaged", result.engaged ? 1 : 0);
            end.lower("energy_j", result.energy);
          }};
}

}  // namespace

std::vector<MatrixCase> matrix_cases() {
  std::vector<MatrixCase> cases;
  for (const std::string_view network : kNetworks) {
    for (const std::string_view devices : kDevices) {
      for (const bool counts : {false, true}) {
        for (const CouplingMethod method : kCouplingMethods) cases.push_back({method, devices, network, counts});
      }
    }
  }
  return cases;
}

MatrixResult matrix_result(const MatrixCase& of, std::uint64_t seed, std::optional<Preset> preset) {
  Ports ports = ports_of(of, seed, preset);
  ports.run(1000);
  if (!ports.engage()) return {.held = kNoValue, .drift = kNoValue, .vibration = kNoValue, .energy = ports.least_sum};
  const bool comparable = info(of.method).is_felt;
  Vibration vibration;
  double force = 0;
  ports.run(kLeave - 500 - ports.now, [&](int) { vibration.follow(ports); });
  ports.run(500, [&](int) {
    force -= ports.leader.applied.x() / 500;
    vibration.add(ports);
  });
  ports.run(kMove - 500 - ports.now, [&](int) { vibration.follow(ports); });
  ports.run(500, [&](int) { vibration.add(ports); });
  ports.run(3000);
  const double before = offset(ports);
  ports.run(kEnd - kMean - ports.now);
  const double drift = offset(ports) - before;
  return {.held = comparable ? force / rigid({}) : kNoValue,
          .drift = comparable ? drift : kNoValue,
          .vibration = vibration.worse(),
          .energy = ports.least_sum,
          .engaged = ports.leader.coupling->live() && ports.follower.coupling->live()};
}

void teleop_matrix(const MatrixOptions& options, std::ostream& out) {
  const std::vector<MatrixCase> cases = matrix_cases();
  const auto results = outcomes(work_of(cases, options), options.part, out);
  if (!results) return;
  CsvTable table;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const auto& [held, drift, vibration, energy, engaged] = (*results)[i];
    table.add(JsonLine()
                  .add("network", cases[i].network)
                  .add("devices", cases[i].devices)
                  .add("counts", cases[i].counts)
                  .add("method", to_string(cases[i].method))
                  .add("held", engaged ? rounded(held, 2) : "lost")
                  .add("drift_mm", engaged ? rounded(drift * 1e3, 3) : "")
                  .add("vibration_mm_s", engaged ? rounded(vibration * 1e3, 1) : "")
                  .add("energy_uj", engaged ? rounded(energy * 1e6, 1) : ""));
  }
  out << table.str();
}

}  // namespace tendon::lab
