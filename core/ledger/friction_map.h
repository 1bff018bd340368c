// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "core/base/motion.h"
#include "core/ledger/friction.h"

namespace tendon {

/// Lower bounds of friction that differ over the workspace, from an identification at several places. Cables and gears
/// do not slide alike everywhere, and one bound for the whole workspace would have to be the least.
///
/// At x, each bound is the least of the place nearest to x and of all places within `reach` of x.
///
/// Thread-safe: yes, it never changes. Realtime-safe: `at` is; it looks at every place.
class FrictionMap {
 public:
  struct Place {
    Vec3 position;  ///< m
    Friction friction;
  };
  struct Config {
    std::vector<Place> places;  ///< 1 to kMostPlaces
    double reach = 0.05;        ///< m, ≥ 0: about the distance of neighbouring places
  };
  /// 4 to each edge of a cube: some 0.2 µs per haptic step.
  static constexpr std::size_t kMostPlaces = 64;

  /// Throws std::invalid_argument naming the field when there is no place, or too many, or an impossible value.
  explicit FrictionMap(Config config);

  Friction at(const Vec3& position) const noexcept;

 private:
  Config config_;
};

}  // namespace tendon
