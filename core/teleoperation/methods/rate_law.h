// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/reference_spring.h"

namespace tendon {

/// The method `rate`: the displacement of the leader sets the velocity of the follower. Each act starts with u_l = 0.
/// In the scale of the leader:
///     F_l = −K_c u_l − B u̇_l + f,     f = s_f Rᵀ f_contact, ‖f‖ ≤ K_c · dead_zone
///     v = gain (‖u_l‖ − dead_zone)₊ û_l,  ‖v‖ ≤ max_speed;     the follower's reference moves by s_x R v T per period
/// The spring of the follower has the stiffness K_f and pulls the tool to the reference, which is at most max_force/K_f
/// away. f cannot move the handle out of the dead zone, so a contact does not move the follower. The reference does not
/// move if the handle is in the dead zone, if the leader is not live, or if its state is not fresh (LossStages). A hand
/// that holds the handle does not do work. If the follower has a limiter, it can therefore only move as long as there
/// is enough energy in its account for the friction that exceeds the lower bounds of the limiter.
class RateLaw : public CouplingLaw {
 public:
  static constexpr bool kLeaderCentred = true;

  /// Throws std::invalid_argument if config.rate is missing or not valid.
  RateLaw(const CouplingConfig& config, const MappedEnd& frame);

  void begin_act(const Vec3& u) noexcept { spring_.begin(u); }
  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept;
  double stiffness(const LawPeriod& period, double share, Duration round_trip) const noexcept;

 private:
  Demand<3> centred(const LawPeriod& period, const Vec3& speed) const noexcept;
  Vec3 asked_velocity(const LawPeriod& period) const noexcept;

  RateControl rate_;
  double centring_;  ///< The stiffness K_c in N/m.
  double max_force_;
  Duration period_;
  ReferenceSpring spring_;
};

}  // namespace tendon
