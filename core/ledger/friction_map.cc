// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/friction_map.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>

#include "core/base/expect.h"

namespace tendon {

FrictionMap::FrictionMap(Config config) : config_(std::move(config)) {
  expect(!config_.places.empty() && config_.places.size() <= kMostPlaces, "places",
         static_cast<double>(config_.places.size()), "1 to " + std::to_string(kMostPlaces));
  expect_not_negative(config_.reach, "reach");
  for (const Place& place : config_.places) {
    expect_finite(place.position, "places.position");
    expect_not_negative(place.friction.coulomb, "places.friction.coulomb");
    expect_not_negative(place.friction.viscous, "places.friction.viscous");
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
