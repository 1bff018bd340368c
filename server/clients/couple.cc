// SPDX-License-Identifier: Apache-2.0
#include "server/clients/couple.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"
#include "core/base/rotation.h"

namespace tendon {
namespace {

constexpr double kAlike = 1e-9;

bool alike(double a, double b) { return std::abs(a - b) <= kAlike * std::max(std::abs(a), std::abs(b)); }

std::string name(PortRole role) { return role == PortRole::kLeader ? "leader" : "follower"; }
std::string name(CouplingMethod method) { return std::string(to_string(method)); }
std::string name(bool there) { return there ? "true" : "false"; }
std::string name(double value) { return shortest(value); }
std::string axes(std::uint32_t bits) {
  std::string text;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    if ((bits >> axis & 1) != 0) text += "xyz"[axis];
  }
  return text;
}

std::string differ(const std::string& key, const std::string& yours, const std::string& mine) {
  return key + ": " + yours + " in your scene, " + mine + " in the scene of the other server";
}

std::string difference_of_rates(const std::optional<RateControl>& theirs, const std::optional<RateControl>& mine) {
  if (theirs.has_value() != mine.has_value()) return differ("rate", name(theirs.has_value()), name(mine.has_value()));
  if (!theirs) return {};
  struct Row {
    const char* key;
    double RateControl::*value;
    double per_si;
  };
  constexpr Row kRows[] = {{"rate.dead_zone_mm", &RateControl::dead_zone, 1e3},
                           {"rate.gain_per_s", &RateControl::gain, 1},
                           {"rate.max_speed_mm_per_s", &RateControl::max_speed, 1e3}};
  for (const Row& row : kRows) {
    const double yours = *theirs.*row.value;
    const double ours = *mine.*row.value;
    if (!alike(yours, ours)) return differ(row.key, rounded(yours * row.per_si, 6), rounded(ours * row.per_si, 6));
  }
  return {};
}

}  // namespace

Couple couple_of(const Coupling::Config& config) {
  Couple couple;
  couple.role = config.role;
  couple.method = config.method;
  couple.position_scale = config.map.position_scale;
  couple.force_scale = config.map.force_scale;
  couple.rotation = config.map.rotation;
  couple.axes = 0;
  for (std::uint32_t axis = 0; axis < 3; ++axis) couple.axes |= config.map.axes[axis] ? 1U << axis : 0U;
  couple.stiffness = config.spring.stiffness;
  couple.mutual_damping = config.spring.damping;
  couple.damping = config.spring.own_damping;
  couple.adapt_to_delay = config.spring.adapt_to_delay;
  couple.purse = config.tank.has_value();
  couple.absolute = config.absolute.has_value();
  couple.period = config.spring.period;
  if (config.method == CouplingMethod::kPassivity) couple.drift_rate = config.drift_rate;
  couple.rate = config.rate;
  if (config.turn) {
    couple.turn_stiffness = config.turn->stiffness;
    couple.turn_damping = config.turn->damping;
  }
  if (config.grip) {
    couple.grip_stiffness = config.grip->stiffness;
    couple.grip_damping = config.grip->damping;
  }
  return couple;
}

std::string first_difference(const Couple& theirs, const Couple& mine) {
  if (theirs.role == mine.role) return "role: " + name(mine.role) + " in both scenes, expected a leader and a follower";
  if (theirs.method != mine.method) return differ("method", name(theirs.method), name(mine.method));
  struct Row {
    const char* key;
    double Couple::*value;
  };
  constexpr Row kRows[] = {{"map.position_scale", &Couple::position_scale},
                           {"map.force_scale", &Couple::force_scale},
                           {"coupling.stiffness_n_per_m", &Couple::stiffness},
                           {"coupling.damping_n_s_per_m", &Couple::damping},
                           {"coupling.mutual_damping_n_s_per_m", &Couple::mutual_damping},
                           {"coupling.drift_rate_per_s", &Couple::drift_rate},
                           {"turn.stiffness_nm_per_rad", &Couple::turn_stiffness},
                           {"turn.damping_nm_s_per_rad", &Couple::turn_damping},
                           {"grip.stiffness_n_per_m", &Couple::grip_stiffness},
                           {"grip.damping_n_s_per_m", &Couple::grip_damping}};
  for (const Row& row : kRows) {
    const double yours = theirs.*row.value;
    if (!alike(yours, mine.*row.value)) return differ(row.key, name(yours), name(mine.*row.value));
  }
  if (turn_between(theirs.rotation, mine.rotation).norm() > kAlike) {
    const auto degrees = [](const Quat& q) {
      const Vec3 turn = rotation_vector(q) * (180 / 3.14159265358979323846);
      return "[" + rounded(turn.x(), 6) + ", " + rounded(turn.y(), 6) + ", " + rounded(turn.z(), 6) + "]";
    };
    return differ("map.rotation_deg", degrees(theirs.rotation), degrees(mine.rotation));
  }
  if (theirs.axes != mine.axes) return differ("map.axes", axes(theirs.axes), axes(mine.axes));
  if (theirs.adapt_to_delay != mine.adapt_to_delay) {
    return differ("coupling.adapt_to_delay", name(theirs.adapt_to_delay), name(mine.adapt_to_delay));
  }
  if (theirs.absolute != mine.absolute) {
    return differ("map.absolute", name(theirs.absolute), name(mine.absolute));
  }
  if (theirs.purse != mine.purse) return differ("purse", name(theirs.purse), name(mine.purse));
  return difference_of_rates(theirs.rate, mine.rate);
}

}  // namespace tendon
