// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/teleoperation/coupling_config.h"
#include "core/teleoperation/mapped_end.h"
#include "core/teleoperation/methods/two_channel_passivity.h"
#include "core/teleoperation/methods/wave_variables.h"

namespace tendon {

/// The inputs of a law in one period. The references are only valid during the call.
struct LawPeriod {
  const MappedEnd& frame;
  const PortState& peer;  ///< The newest state. If its sequence is 0, there is none.
  Vec3 u;                 ///< The displacement of this end in m.
  bool live = false;
  bool clutched = false;
  bool fresh = false;    ///< See LossStages.
  bool serves = false;   ///< The peer is engaged in the same act.
  double payable = 0;    ///< The energy in the account in J.
  double stiffness = 0;  ///< The stiffness of the common spring in N/m.
};

/// The previous interval. All vectors are along the coupled axes.
struct LawInterval {
  Interval<3> interval;
  bool was_live = false;       ///< The end was live in the interval.
  Vec3 wanted = Vec3::Zero();  ///< The force that the coupling requested, in N.
  double payable = 0;          ///< The energy in the account in J.
  double reserve = 0;          ///< The energy that the limiter needs for this force, in J.
};

/// The values that a law adds to a PortState.
struct LawPart {
  std::optional<PortSurface> surface{};
  double energy_in = 0;  ///< In J.
  WaveMessage<3> wave{};
};

/// The base class of all laws. Its functions do nothing, and a law only defines the functions that it needs. There
/// are no virtual functions. In each period, the caller must call `receive` for each state, `observe`, `command`, and
/// `conclude`. If there is no position, the caller must call `skip` instead of `command`.
///
/// Thread-safe: no. Realtime-safe: all but the constructors.
struct CouplingLaw {
  static constexpr bool kUsesVelocity = true;    ///< The law uses the velocity of the peer.
  static constexpr bool kSpringPays = false;     ///< The account limits the energy of the common spring.
  static constexpr bool kHoldsSilent = true;     ///< A robot uses the law if the peer is silent.
  static constexpr bool kLeaderCentred = false;  ///< The displacement of the leader starts at 0.

  /// Uses a new state. `before` is the previous state, and `anew` is true if the epoch has changed.
  void receive(const PortState& /*peer*/, const PortState& /*before*/, bool /*anew*/,
               const MappedEnd& /*frame*/) noexcept {}
  /// Resets the law because the peer or the scales have changed.
  void forget() noexcept {}
  /// Starts an act at the displacement `u` in m.
  void begin_act(const Vec3& /*u*/) noexcept {}
  /// Returns the energy that the law has exchanged with the peer, or an empty value if it does not exchange energy.
  std::optional<EnergyTank::Settlement> observe(const LawInterval& /*ended*/) noexcept { return std::nullopt; }
  /// Returns the force of the law. `speed` is the velocity along the coupled axes in m/s, and `spring` is the force
  /// of the common spring.
  Demand<3> command(const LawPeriod& /*period*/, const Vec3& /*speed*/, const Demand<3>& spring) noexcept {
    return spring;
  }
  void skip(const LawPeriod& /*period*/, Duration /*elapsed*/) noexcept {}
  /// Ends the period. `applied` is the force of the device along the coupled axes in N, and `contact` is the force at
  /// the tool if it was measured.
  void conclude(const LawPeriod& /*period*/, const Vec3& /*applied*/, const std::optional<Vec3>& /*contact*/) noexcept {
  }
  LawPart part() const noexcept { return {}; }
  /// Returns the stiffness of the law in N/m.
  double stiffness(const LawPeriod& period, double share, Duration /*round_trip*/) const noexcept {
    return share * period.stiffness;
  }
};

}  // namespace tendon
