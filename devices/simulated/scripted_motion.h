// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "core/base/motion.h"

namespace tendon {

/// The target position of the operator's hand as a function of the time since the start, i.e. the moving equilibrium
/// point of OperatorHand. m and m/s, device base frame.
///
/// It is constructed before the loop runs. An invalid script throws std::invalid_argument, naming the field, its value
/// and the expected range.
///
/// Thread-safe: yes, immutable. Realtime-safe: `at`.
class ScriptedMotion {
 public:
  struct Point {
    Vec3 position = Vec3::Zero();  ///< m
    Vec3 velocity = Vec3::Zero();  ///< m/s, time derivative of `position`
  };

  /// position = centre + direction · amplitude · sin(2π · frequency · t)
  struct Sine {
    double amplitude = 0;  ///< m, ≥ 0
    double frequency = 0;  ///< Hz, ≥ 0
    Vec3 centre = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< need not be normalized
  };

  /// Moves from `from` to `to` at constant speed and stays there. With `hold`, it moves back and forth forever and
  /// stays at each end for that long. The velocity is discontinuous at the corners. With `from == to`, the hand does
  /// not move.
  struct RampHold {
    Vec3 from = Vec3::Zero();
    Vec3 to = Vec3::Zero();
    Duration ramp{};               ///< > 0
    std::optional<Duration> hold;  ///< ≥ 0; empty: stays at `to`
  };

  /// Reaching movements from point to point, each of which starts and ends at rest:
  ///
  ///     position = p₀ + (p₁ − p₀)(10 s³ − 15 s⁴ + 6 s⁵),  s = (time in this leg) / (its duration)
  ///
  /// This is the minimum-jerk trajectory (Flash and Hogan, J. Neuroscience 5(7):1688, 1985).
  struct MinimumJerk {
    std::vector<Vec3> points;         ///< 2 or more
    std::vector<Duration> durations;  ///< of the legs: one fewer than points, each > 0
    bool back_and_forth = true;       ///< forever; false: stays at the last point
  };

  /// A recorded motion: position = origin + direction · x(t). x interpolates the samples by cubic Hermite splines with
  /// the slopes of Fritsch and Butland (SIAM J. Sci. Stat. Comput. 5(2):300, 1984). The velocity is continuous, and
  /// between two samples x stays within their range, so that quantized recordings do not overshoot. The slope is zero
  /// at both ends, so the velocity is continuous when the motion holds or repeats.
  struct Recorded {
    struct Sample {
      double t;  ///< s, strictly increasing; the first one is the start
      double x;  ///< m
    };
    enum class AtEnd {
      kHold,    ///< stays at the last sample
      kRepeat,  ///< starts again with the first sample: the position jumps if the ends differ
    };
    std::vector<Sample> samples;  ///< 2 or more
    Vec3 origin = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< need not be normalized
    AtEnd at_end = AtEnd::kHold;
  };

  using Script = std::variant<Sine, RampHold, MinimumJerk, Recorded>;

  explicit ScriptedMotion(Script script);

  /// Returns the point `t` seconds after the start, t ≥ 0.
  Point at(double t) const noexcept;

 private:
  Script script_;
};

}  // namespace tendon
