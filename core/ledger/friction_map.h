// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Lower bounds of friction that depend on the position, which was identified at several places. The bound at x is the
/// minimum over the nearest place and all places within `reach` of x.
/// Thread-safe: yes (immutable). Realtime-safe: `at`, which is linear in the number of places.
class FrictionMap {
 public:
  struct Place {
    Vec3 position;  ///< m
    Friction friction;
  };
  struct Config {
    std::vector<Place> places;  ///< 1 to kMostPlaces
    double reach = 0.05;        ///< m, ≥ 0; should be similar to the distance between neighboring places
  };
  static constexpr std::size_t kMostPlaces = 64;  ///< four along each edge of a cube, using about 0.2 µs per step

  /// Throws std::invalid_argument with the name of the field if the number of places or a value is out of range.
  explicit FrictionMap(Config config);

  Friction at(const Vec3& position) const noexcept;

 private:
  Config config_;
};

}  // namespace tendon
