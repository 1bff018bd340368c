// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <variant>
#include <vector>

#include "core/base/motion.h"

namespace tendon {

/// Where the operator wants the hand to be, as a function of the time since the start: the moving equilibrium point of
/// OperatorHand. m and m/s, device base frame.
///
/// Built before the loop runs; an impossible script throws std::invalid_argument that names the field, its value and
/// what was expected.
///
/// Thread-safe: yes, it never changes. Realtime-safe: `at` is.
class ScriptedMotion {
 public:
  struct Point {
    Vec3 position = Vec3::Zero();  ///< m
    Vec3 velocity = Vec3::Zero();  ///< m/s, the time derivative of `position`
  };

  /// position = centre + direction · amplitude · sin(2π · frequency · t)
  struct Sine {
    double amplitude = 0;  ///< m, ≥ 0
    double frequency = 0;  ///< Hz, ≥ 0
    Vec3 centre = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< its length does not count
  };

  /// Moves from `from` to `to` at constant speed and stays there. With `hold` it goes to and fro for ever, and stays at
  /// each end for that long. The velocity steps at the corners. With `from == to` the hand stands still from the start.
  struct RampHold {
    Vec3 from = Vec3::Zero();
    Vec3 to = Vec3::Zero();
    Duration ramp{};               ///< > 0
    std::optional<Duration> hold;  ///< ≥ 0; left out: stays at `to`
  };

  /// Reaching movements from point to point, each at rest at both of its ends:
  ///     position = p₀ + (p₁ − p₀)(10 s³ − 15 s⁴ + 6 s⁵),  s = (time in this leg) / (its duration)
  /// the trajectory of least jerk (Flash and Hogan, J. Neuroscience 5(7):1688, 1985).
  struct MinimumJerk {
    std::vector<Vec3> points;         ///< 2 or more
    std::vector<Duration> durations;  ///< of the legs: one fewer than points, each > 0
    bool back_and_forth = true;       ///< for ever; false: stays at the last point
  };

  /// A measured motion: position = origin + direction · x(t). x passes through the samples on cubic Hermite pieces with
  /// Fritsch and Butland's slopes (SIAM J. Sci. Stat. Comput. 5(2):300, 1984). The velocity is continuous, and between
  /// two samples x stays in the range that they span: quantised recordings do not overshoot. The slope at both ends is
  /// zero, so the velocity does not step when the motion holds or repeats.
  struct Recorded {
    struct Sample {
      double t;  ///< s, strictly increasing; the first one is the start
      double x;  ///< m
    };
    enum class AtEnd {
      kHold,    ///< stays at the last sample
      kRepeat,  ///< begins again with the first sample: the position jumps when the ends differ
    };
    std::vector<Sample> samples;  ///< 2 or more
    Vec3 origin = Vec3::Zero();
    Vec3 direction = Vec3::UnitX();  ///< its length does not count
    AtEnd at_end = AtEnd::kHold;
  };

  using Script = std::variant<Sine, RampHold, MinimumJerk, Recorded>;

  explicit ScriptedMotion(Script script);

  /// The point `t` seconds after the start, t ≥ 0.
  Point at(double t) const noexcept;

 private:
  Script script_;
};

}  // namespace tendon
