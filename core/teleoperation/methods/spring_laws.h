// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_law.h"

namespace tendon {

/// The method `position-position`: F = K(y − u) + D(ẏ − u̇) − B u̇ at both ends (PositionPosition). y is the mapped
/// displacement of the peer.
struct SpringLaw : CouplingLaw {
  SpringLaw(const CouplingConfig& /*config*/, const MappedEnd& /*frame*/) noexcept {}
};

/// The method `set-position`: F = K(ȳ − u) − B u̇ at both ends. ȳ is the nearest position to the mapped displacement of
/// the peer with ½ K ‖ȳ − u‖² ≤ payable (paid_stretch). K depends on the delay as for position-position. D and the
/// velocity of the peer are not used, so the states can be rare and irregular. If the leader had no spring, as in
/// ContactLaw, the stiff spring of the follower would use the energy that is needed by the leader. In a test with 50
/// ms, this reduced the force at the leader from 4.1 N to 0.17 N.
struct SetPositionLaw : CouplingLaw {
  static constexpr bool kSpringPays = true;
  SetPositionLaw(const CouplingConfig& /*config*/, const MappedEnd& /*frame*/) noexcept {}
};

/// The method `position-force`: the follower uses the law of SpringLaw with a constant K, because the leader has no
/// spring. The force of the leader is s_f Rᵀ f_contact − B v, or −B v if the peer does not measure the contact force.
class ContactLaw : public CouplingLaw {
 public:
  ContactLaw(const CouplingConfig& config, const MappedEnd& /*frame*/) noexcept : damping_(config.spring.own_damping) {}

  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept {
    if (!period.frame.leads()) return spring;
    return {period.frame.map().force_to_leader(period.peer.contact_force.value_or(Vec3::Zero())) - damping_ * speed};
  }

 private:
  double damping_;  ///< B, N·s/m
};

}  // namespace tendon
