// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// The environment of a simulated handle or a follower's tool: a medium, and walls that can move, appear and disappear.
///
///     F = Σ over walls in contact (F_n n − μ F_n sgn(v_t))  −  b v − f sgn(v)          N, on the handle
///     F_n = (k d − c v_n)₊ ,    d = n·(p − x) + s (t − t_from) > 0                      m, depth
///
/// n is the outward normal of a wall, p a point on it, s its speed along n; v_n = n·v − s and v_t = v − (n·v) n. sgn is
/// set-valued, so friction can hold the handle at rest.
///
/// **Integration.** In each substep of length h, SimulatedDevice calls `push` in the middle, at x₀ + (h/2) v₀. For the
/// walls' springs, this is a position Verlet step, which does not gain or lose energy in the long run. `rub` then
/// subtracts friction from the half-step momentum, before the friction of the device, and `stop` is used for sticking.
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedEnvironment {
 public:
  static constexpr std::size_t kMostWalls = 16;

  struct Wall {
    Vec3 point = Vec3::Zero();        ///< m, p
    Vec3 normal = Vec3::Zero();       ///< n, outwards; normalized automatically
    double stiffness = 0;             ///< k, N/m, > 0
    double damping = 0;               ///< c, N·s/m, ≥ 0
    double friction = 0;              ///< μ, ≥ 0
    double speed = 0;                 ///< s, m/s
    Duration from{};                  ///< since the first `read`; ≥ 0
    std::optional<Duration> until{};  ///< > `from`
  };

  struct Config {
    double damping = 0;   ///< b, N·s/m, ≥ 0
    double friction = 0;  ///< f, N, ≥ 0
    std::vector<Wall> walls{};
  };

  /// Throws std::invalid_argument if a value is out of range, naming the field ("environment.…").
  explicit SimulatedEnvironment(Config config);

  double damping() const noexcept { return config_.damping; }

  /// Returns Σ F_n n. `t` in s, since the first `read`.
  Vec3 push(double t, const Vec3& x, const Vec3& v) noexcept;

  /// Subtracts friction from the half-step momentum p (N·s) in the substep of `push`. Returns its mean force in N.
  Vec3 rub(Vec3& momentum, double h) noexcept;

  void stop(Vec3& velocity) const noexcept;  ///< stops the motion if it is held by friction

 private:
  Config config_;
  struct Touched {
    double pressed = 0;  ///< N, F_n
    bool sticks = false;
  };
  std::vector<Touched> touched_;
  bool sticks_ = false;  ///< in the medium
};

}  // namespace tendon
