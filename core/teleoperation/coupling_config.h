// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/teleoperation/energy_tank.h"
#include "core/teleoperation/handle/grip_coupling.h"
#include "core/teleoperation/handle/turn_coupling.h"
#include "core/teleoperation/methods/coupling_method.h"
#include "core/teleoperation/methods/model_mediated.h"
#include "core/teleoperation/methods/position_position.h"
#include "core/teleoperation/phases/clutch.h"
#include "core/teleoperation/port_state.h"
#include "core/teleoperation/pose_map.h"

namespace tendon {

/// An absolute map, in which u is the position p at both ends and p_f = s_x R p_l. There is no clutch. Each act
/// (engagement) starts with the alignment of the leader (Alignment), in which the follower does not move. The limiter
/// only allows the motion of the leader if there is enough energy in the account. Each act adds `energy` to the
/// account, so L ≥ −energy · acts. If `energy` is 0, the hand has to move the handle.
struct CouplingAbsolute {
  double within = 0.02;  ///< m, > 0; the leader can engage if the distance is smaller
  double energy = 0;     ///< J, ≥ 0; added to the account of the leader at each act
};

struct CouplingConfig {
  PortRole role = PortRole::kLeader;
  CouplingMethod method = CouplingMethod::kPositionPosition;
  PoseMap::Config map{};
  /// `stiffness`, `damping`, and `own_damping` are the values of the leader. The other fields are used for this end.
  PositionPosition<3>::Config spring{};
  /// `start` is in joules of the leader, `max_power` and `max_account` of this end. The constructor sets the rest.
  std::optional<EnergyTank::Config> tank{};
  /// Used by the follower if the method is `surface`, in the scale of the follower.
  SurfaceEstimator<3>::Config surface{
      .contact_force = 0.1, .first_stiffness = 200, .max_stiffness = 5000, .least_travel = 2e-4, .memory = 300};
  /// Requires a method with positions (`has_places`) and no clutch. If it is empty, the map is relative.
  std::optional<CouplingAbsolute> absolute{};
  std::optional<CouplingButton> clutch{};               ///< leader only
  std::optional<std::uint32_t> engage_by{};             ///< the bit of a button that calls engage(), only at the leader
  Duration ramp = std::chrono::milliseconds(300);       ///< > 0
  Duration peer_period = std::chrono::milliseconds(1);  ///< > 0, time between two states of the peer
  double encoder_step = 0;                              ///< m, ≥ 0, or 0 if exact; used if the method is waves
  bool holds_place = false;                             ///< the device of the follower is a robot
  std::optional<double> share{};         ///< initial α (0 to 1) if the follower has several leaders (`can_be_shared`)
  double drift_rate = 100;               ///< λ, 1/s, ≥ 0; used if the method is passivity
  std::optional<RateControl> rate{};     ///< required if the method is rate
  double centring = 0;                   ///< K_c, N/m, ≥ 0; used by the leader if the method is rate
  Duration max_delay = Duration::max();  ///< > 0; links with a longer delay are not used
  std::optional<TurnCoupling::Config> turn{};  ///< couples the orientations
  std::optional<GripCoupling::Config> grip{};  ///< couples the grippers
};

struct CouplingReason {
  std::string_view key;
  std::string sentence;  ///< the expected value
};

/// Returns all errors in the combination of fields. The constructor of Coupling checks the bounds of each number.
std::vector<CouplingReason> check(const CouplingConfig& config);

}  // namespace tendon
