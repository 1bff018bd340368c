// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "core/base/motion.h"
#include "core/field/material.h"

namespace tendon::field {

/// Corrects the errors of a field. A true force F_k is compared with the force of the field in the same step k, so the
/// result does not depend on the delay. With the depth d, the direction n of the force and the spring part f of step k,
/// without the table c of its material:
///     e = F_k·n − f − c(d)             N, if the depth was above 0.2 mm
///     c_i ← c_i + 0.3 w_i e/Σw²        for the two knots beside d with the weights w of the interpolation; c₀ = 0
///     r = F_k − (f + c(d)) n           N, the rest, with the new table
/// The table does not depend on time, so it is the same for every delay. The rest is held:
///     F = min(1, d/0.3 mm) (r e^(−age/0.1 s − ‖x − x_k‖²/2(3 mm)²) + r₀)
/// The age is the time since step k, so the rest of a late truth is small. r₀ is chosen such that F does not jump at a
/// truth, and fades with 12 ms. The table belongs to the material, so the energy gate and `most_stiffness` cover it. The
/// held rest is only bounded by the limiter.
/// Realtime-safe: yes.
class Residual {
 public:
  static constexpr std::size_t kSteps = 1024;  ///< a truth for an older step is not used
  static constexpr double kGain = 0.3;
  static constexpr double kLeastDepth = 2e-4;  ///< m
  static constexpr double kFullDepth = 3e-4;   ///< m
  static constexpr double kAge = 0.1;          ///< s
  static constexpr double kReach = 3e-3;       ///< m
  static constexpr double kEase = 0.012;       ///< s

  /// The force of the field in one step.
  struct Given {
    std::uint64_t tick = 0;
    LocalTime at{};
    Vec3 hand = Vec3::Zero();
    double depth = 0;               ///< d, m; 0 without contact
    Vec3 direction = Vec3::Zero();  ///< n, or zero without contact
    double spring = 0;              ///< f, N
    std::uint8_t material = 0;
  };

  /// Stores a step. Ticks must increase.
  void note(const Given& given) noexcept;

  /// Learns from the truth for step `tick`; `max_stiffness` (N/m) bounds the materials with their tables. If `teaches` is
  /// false, the tables are not changed. Returns false and does nothing if the truth is not finite, or if the step is
  /// unknown or not newer than that of the last truth.
  bool learn(std::uint64_t tick, const Vec3& truth, LocalTime now, double max_stiffness, std::span<Material> materials,
             bool teaches = true) noexcept;

  /// Forgets the rest of the last truth.
  void forget() noexcept { rest_ = ease_ = given_ = Vec3::Zero(); }

  /// Returns the held force (N, on the hand) at `hand.position`. Must be called once per haptic step of `period` s.
  Vec3 held(const Motion& hand, double depth, double period) noexcept;

 private:
  Vec3 faded(const Vec3& x, LocalTime now) const noexcept;

  std::array<Given, kSteps> steps_{};
  std::optional<std::uint64_t> learned_;  ///< tick of the last truth
  Vec3 rest_ = Vec3::Zero();              ///< r
  Vec3 place_ = Vec3::Zero();             ///< x_k
  LocalTime rest_at_{};                   ///< time of step k
  Vec3 ease_ = Vec3::Zero();              ///< r₀
  Vec3 given_ = Vec3::Zero();             ///< N, before it is scaled with the depth
};

}  // namespace tendon::field
