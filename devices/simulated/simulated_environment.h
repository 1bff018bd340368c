// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// What the handle of a simulated device runs into: the surroundings of a follower's tool. Walls, which may move, come
/// and go, and a medium that brakes:
///
///     F = Σ over walls in contact (F_n n − μ F_n sgn(v_t))  −  b v − f sgn(v)          N, on the handle
///     F_n = (k d − c v_n)₊ ,    d = n·(p − x) + s (t − t_from) > 0                      m, depth
///
/// n is the outward normal of a wall, p a point of it, s its speed along n; v_n = n·v − s and v_t = v − (n·v) n. sgn is
/// set-valued: friction holds what it can hold.
///
/// **Integration.** SimulatedDevice calls, in each substep of length h, `push` at the middle in time and at the place
/// x₀ + (h/2) v₀, which makes the springs of the walls a position Verlet step: no energy comes or goes for ever. Then
/// `rub` takes the friction out of the half-step momentum, before that of the device, and `stop` ends what sticks.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
class SimulatedEnvironment {
 public:
  static constexpr std::size_t kMostWalls = 16;

  struct Wall {
    Vec3 point = Vec3::Zero();        ///< m, p: any point of the surface
    Vec3 normal = Vec3::Zero();       ///< n, out of the wall; its length does not count, > 0
    double stiffness = 0;             ///< k, N/m, > 0
    double damping = 0;               ///< c, N·s/m, ≥ 0
    double friction = 0;              ///< μ, ≥ 0
    double speed = 0;                 ///< s, m/s
    Duration from{};                  ///< it is there from this time on, since the first `read`; ≥ 0
    std::optional<Duration> until{};  ///< … and gone from this one on, > `from`
  };

  struct Config {
    double damping = 0;   ///< b, N·s/m, ≥ 0
    double friction = 0;  ///< f, N, ≥ 0
    std::vector<Wall> walls{};
  };

  /// Throws std::invalid_argument naming the field ("environment.…"), its value and what was expected.
  explicit SimulatedEnvironment(Config config);

  /// b.
  double damping() const noexcept { return config_.damping; }

  /// Σ F_n n at the time `t` (s since the first read), the place `x` and the velocity `v`.
  Vec3 push(double t, const Vec3& x, const Vec3& v) noexcept;

  /// Friction of the substep of length h whose `push` came before: taken out of the half-step momentum p (N·s), from
  /// which the mean velocity follows. Returns its mean force, N.
  Vec3 rub(Vec3& momentum, double h) noexcept;

  /// Ends, with that substep, the motion that friction holds.
  void stop(Vec3& velocity) const noexcept;

 private:
  Config config_;
  struct Touched {
    double pressed = 0;  ///< N, F_n
    bool sticks = false;
  };
  std::vector<Touched> touched_;  ///< in this substep, by wall
  bool sticks_ = false;           ///< in the medium
};

}  // namespace tendon
