// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// The environment of a simulated handle, or of a follower's tool: walls, which may move, appear and disappear, and a
/// viscous medium with friction:
///
///     F = Σ over walls in contact (F_n n − μ F_n sgn(v_t))  −  b v − f sgn(v)          N, on the handle
///     F_n = (k d − c v_n)₊ ,    d = n·(p − x) + s (t − t_from) > 0                      m, depth
///
/// n is the outward normal of a wall, p a point on it, s its speed along n; v_n = n·v − s and v_t = v − (n·v) n. sgn is
/// set-valued, so friction can hold the handle at rest.
///
/// **Integration.** In each substep of length h, SimulatedDevice calls `push` at the midpoint in time and at the
/// position x₀ + (h/2) v₀. For the springs of the walls this is a position Verlet step, whose energy error stays
/// bounded. Then `rub` subtracts the friction from the half-step momentum, before the friction of the device, and
/// `stop` ends motion that sticks.
///
/// Thread-safe: no. Realtime-safe: all except the constructor.
class SimulatedEnvironment {
 public:
  static constexpr std::size_t kMostWalls = 16;

  struct Wall {
    Vec3 point = Vec3::Zero();        ///< m, p: any point on the surface
    Vec3 normal = Vec3::Zero();       ///< n, pointing out of the wall; need not be normalized, but not zero
    double stiffness = 0;             ///< k, N/m, > 0
    double damping = 0;               ///< c, N·s/m, ≥ 0
    double friction = 0;              ///< μ, ≥ 0
    double speed = 0;                 ///< s, m/s
    Duration from{};                  ///< the wall exists from this time after the first `read` on; ≥ 0
    std::optional<Duration> until{};  ///< and until this time, > `from`
  };

  struct Config {
    double damping = 0;   ///< b, N·s/m, ≥ 0
    double friction = 0;  ///< f, N, ≥ 0
    std::vector<Wall> walls{};
  };

  /// Throws std::invalid_argument, naming the field ("environment.…"), its value and the expected range.
  explicit SimulatedEnvironment(Config config);

  double damping() const noexcept { return config_.damping; }

  /// Returns Σ F_n n at time `t` (s since the first read), position `x` and velocity `v`.
  Vec3 push(double t, const Vec3& x, const Vec3& v) noexcept;

  /// Applies the friction of the substep of length h for which `push` was called: subtracts it from the half-step
  /// momentum p (N·s), which determines the mean velocity. Returns the mean friction force, N.
  Vec3 rub(Vec3& momentum, double h) noexcept;

  /// Sets to zero, after that substep, the velocity components that friction holds.
  void stop(Vec3& velocity) const noexcept;

 private:
  Config config_;
  struct Touched {
    double pressed = 0;  ///< N, F_n
    bool sticks = false;
  };
  std::vector<Touched> touched_;  ///< for this substep, by wall
  bool sticks_ = false;           ///< held by the friction of the medium
};

}  // namespace tendon
