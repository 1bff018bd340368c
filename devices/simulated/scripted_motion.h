// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "core/base/motion.h"

namespace tendon {

/// The motion of an operator's hand: the moving equilibrium point of OperatorHand, in m, device base frame. Throws
/// std::invalid_argument if a value of the script is out of range, naming the field.
/// Thread-safe: yes, immutable, except for Guided. Realtime-safe: `at`.
class ScriptedMotion {
 public:
  struct Point {
    Vec3 position = Vec3::Zero();  ///< m
    Vec3 velocity = Vec3::Zero();  ///< m/s
  };

  /// position = centre + direction · amplitude · sin(2π · frequency · t)
  struct Sine {
    double amplitude = 0;  ///< m, ≥ 0
    double frequency = 0;  ///< Hz, ≥ 0
    Vec3 centre = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< normalized automatically
  };

  /// Moves from `from` to `to` at a constant speed and stops there. If `hold` is set, it moves back and forth, and
  /// waits for this time at each end. The velocity is discontinuous. If both points are equal, the hand does not move.
  struct RampHold {
    Vec3 from = Vec3::Zero();
    Vec3 to = Vec3::Zero();
    Duration ramp{};               ///< > 0
    std::optional<Duration> hold;  ///< ≥ 0; optional
  };

  /// Minimum-jerk movements, which start and end at rest (Flash and Hogan, J. Neuroscience 5(7):1688, 1985):
  ///
  ///     position = p₀ + (p₁ − p₀)(10 s³ − 15 s⁴ + 6 s⁵),  s = (time in this leg) / (its duration)
  struct MinimumJerk {
    std::vector<Vec3> points;         ///< 2 or more
    std::vector<Duration> durations;  ///< for each leg, > 0
    bool back_and_forth = true;       ///< repeatedly, or only once
  };

  /// A recording: position = origin + direction · x(t), using cubic Hermite interpolation with Fritsch and Butland's
  /// slopes (SIAM J. Sci. Stat. Comput. 5(2):300, 1984). The velocity is continuous, even if the motion is repeated,
  /// because the slope is zero at both ends. Between two samples, x does not leave the range of their values, so that
  /// quantized recordings do not overshoot.
  struct Recorded {
    struct Sample {
      double t;  ///< s, strictly increasing
      double x;  ///< m
    };
    enum class AtEnd {
      kHold,
      kRepeat,  ///< the position jumps if the ends are different
    };
    std::vector<Sample> samples;  ///< 2 or more
    Vec3 origin = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< normalized automatically
    AtEnd at_end = AtEnd::kHold;
  };

  /// Another part of the program moves this point between two reads of the device, for example with a mouse.
  struct Guided {
    const Point* point = nullptr;  ///< must outlive the motion
  };

  using Script = std::variant<Sine, RampHold, MinimumJerk, Recorded, Guided>;

  explicit ScriptedMotion(Script script);

  Point at(double t) const noexcept;  ///< `t` in s, since the start, ≥ 0

 private:
  Script script_;
};

}  // namespace tendon
