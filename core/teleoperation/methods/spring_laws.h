// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_law.h"

namespace tendon {

/// The method `position-position`: F = K(y − u) + D(ẏ − u̇) − B u̇ at both ends (PositionPosition). y is the mapped
/// displacement of the peer.
struct SpringLaw : CouplingLaw {
  SpringLaw(const CouplingConfig& /*config*/, const MappedEnd& /*frame*/) noexcept {}
};

/// The method `set-position`: F = K(ȳ − u) − B u̇ at both ends. ȳ is the nearest position to the mapped displacement
/// of the peer with ½ K ‖ȳ − u‖² ≤ payable (paid_stretch). K depends on the delay in the same way as for
/// position-position. The law does not use D or the velocity of the peer, so the states can be rare and irregular. If
/// the follower only follows, as in ContactLaw, its stiff spring uses the energy that the leader needs. In a test
/// with 50 ms, the force at the leader was then 0.17 N instead of 4.1 N.
struct SetPositionLaw : CouplingLaw {
  static constexpr bool kUsesVelocity = false;
  static constexpr bool kSpringPays = true;
  SetPositionLaw(const CouplingConfig& /*config*/, const MappedEnd& /*frame*/) noexcept {}
};

/// The method `position-force`: the follower uses the law of SpringLaw with a constant K, because the leader has no
/// spring. The force of the leader is s_f Rᵀ f_contact − B v. If the peer does not measure the contact force, it is
/// −B v.
class ContactLaw : public CouplingLaw {
 public:
  ContactLaw(const CouplingConfig& config, const MappedEnd& /*frame*/) noexcept : damping_(config.spring.own_damping) {}

  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept {
    if (!period.frame.leads()) return spring;
    return {period.frame.map().force_to_leader(period.peer.contact_force.value_or(Vec3::Zero())) - damping_ * speed};
  }

 private:
  double damping_;  ///< The damping B in N·s/m.
};

}  // namespace tendon
