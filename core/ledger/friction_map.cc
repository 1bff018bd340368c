// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/friction_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

namespace tendon {

FrictionMap::FrictionMap(Config config) : config_(std::move(config)) {
  if (config_.places.empty() || config_.places.size() > kMostPlaces) {
    throw std::invalid_argument("friction places = " + std::to_string(config_.places.size()) + ": expected 1 to " +
                                std::to_string(kMostPlaces));
  }
  const auto possible = [](double value) { return std::isfinite(value) && value >= 0; };
  if (!possible(config_.reach)) throw std::invalid_argument("reach: expected a number of 0 m or more");
  for (const Place& place : config_.places) {
    if (!place.position.allFinite() || !possible(place.friction.coulomb) || !possible(place.friction.viscous)) {
      throw std::invalid_argument("a friction place: expected finite numbers, friction of 0 or more");
    }
  }
}

Friction FrictionMap::at(const Vec3& position) const noexcept {
  double nearest = std::numeric_limits<double>::infinity();
  Friction there;
  Friction least{.coulomb = nearest, .viscous = nearest};
  for (const Place& place : config_.places) {
    const double distance = (place.position - position).norm();
    if (distance < nearest) {
      nearest = distance;
      there = place.friction;
    }
    if (distance <= config_.reach) {
      least.coulomb = std::min(least.coulomb, place.friction.coulomb);
      least.viscous = std::min(least.viscous, place.friction.viscous);
    }
  }
  return {.coulomb = std::min(least.coulomb, there.coulomb), .viscous = std::min(least.viscous, there.viscous)};
}

}  // namespace tendon
