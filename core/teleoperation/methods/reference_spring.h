// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_law.h"

namespace tendon {

/// The spring of a follower between its tool and a reference position, which the method moves.
///     F = K_f (r − u) + D_f (ṙ − u̇) − B_f u̇                       in N, m, and m/s
struct ReferenceSpring {
  explicit ReferenceSpring(const CouplingConfig& config) noexcept
      : damping(config.spring.damping), own_damping(config.spring.own_damping) {}

  void begin(const Vec3& u) noexcept {
    place = u;
    velocity.setZero();
  }

  Demand<3> command(const LawPeriod& period, const Vec3& speed) const noexcept {
    const double stiffness = period.stiffness;
    const Vec3 tool = period.frame.coupled(period.u);
    const double mutual = period.frame.map().stiffness_at_follower(damping);
    const double own = period.frame.map().stiffness_at_follower(own_damping);
    return {stiffness * (place - tool) + mutual * (velocity - speed) - own * speed, stiffness * Mat3::Identity()};
  }

  double damping;      ///< D of the leader, N·s/m
  double own_damping;  ///< B of the leader, N·s/m
  Vec3 place = Vec3::Zero();
  Vec3 velocity = Vec3::Zero();
};

}  // namespace tendon
