// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/reference_spring.h"

namespace tendon {

/// The method `passivity`: the force of the leader is s_f Rᵀ(−F_follower) − (α + B) u̇_l (PassivityLeader), where
/// F_follower is the force of the follower on its tool. The spring of the follower has the stiffness K_f. Its reference
/// starts at u and moves with the velocity of PassivityFollower, where λ = drift_rate. The upper limit of α is B. (The
/// viscous friction of a device would be too small.) The law adds B, because otherwise E_in is 0 and the pair cannot
/// start to move. E_in is the energy of this coupling. The energy of the peer is counted from the first state of an
/// epoch on, because the energy before that state may already have been used. This law can generate some mJ because of
/// the mass of the tool and because both ends predict one period. It needs limiters and an energy tank.
class PassivityLaw : public CouplingLaw {
 public:
  PassivityLaw(const CouplingConfig& config, const MappedEnd& frame);

  void receive(const PortState& peer, const PortState& before, bool anew, const MappedEnd& frame) noexcept;
  void begin_act(const Vec3& u) noexcept;
  std::optional<EnergyTank::Settlement> observe(const LawInterval& ended) noexcept;
  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept;
  void conclude(const LawPeriod& period, const Vec3& applied, const std::optional<Vec3>& contact) noexcept;
  LawPart part() const noexcept { return {.energy_in = energy_in_}; }

 private:
  std::optional<PassivityLeader<3>> leader_;
  std::optional<PassivityFollower<3>> follower_;
  ReferenceSpring spring_;
  double heard_energy_ = 0;  ///< The energy of the peer in J.
  std::uint64_t heard_sequence_ = 0;
  double energy_in_ = 0;  ///< The energy of this end in J.
};

}  // namespace tendon
