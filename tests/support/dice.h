// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "core/base/motion.h"

namespace tendon {

/// This class has its own inverse CDFs, because std:: distributions differ between standard libraries.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : random_(seed) {}
  std::uint64_t bits() { return random_(); }
  double uniform() { return static_cast<double>(random_() >> 11) * 0x1p-53; }
  double within(double low, double high) { return low + (high - low) * uniform(); }
  /// 10^within(low, high)
  double decades(double low, double high) { return std::pow(10, within(low, high)); }
  bool chance(double p) { return uniform() < p; }
  Duration milliseconds(double low, double high) { return from_seconds(within(low, high) * 1e-3); }
  Vec3 direction() {
    Vec3 v;
    do {
      v = Vec3(within(-1, 1), within(-1, 1), within(-1, 1));
    } while (v.squaredNorm() < 1e-3 || v.squaredNorm() > 1);
    return v.normalized();
  }

 private:
  std::mt19937_64 random_;
};

}  // namespace tendon
