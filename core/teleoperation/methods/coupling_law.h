// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/teleoperation/coupling_config.h"
#include "core/teleoperation/mapped_end.h"
#include "core/teleoperation/methods/two_channel_passivity.h"
#include "core/teleoperation/methods/wave_variables.h"

namespace tendon {

/// The inputs of a law. The references are only valid during the call.
struct LawPeriod {
  const MappedEnd& frame;
  const PortState& peer;  ///< newest state, if its sequence is not 0
  Vec3 u;                 ///< m, displacement of this end
  bool live = false;
  bool clutched = false;
  bool fresh = false;    ///< see LossStages
  bool serves = false;   ///< the peer is engaged in the same act
  double payable = 0;    ///< J, in the account
  double stiffness = 0;  ///< N/m, of the common spring
};

/// The previous interval. All vectors are along the coupled axes.
struct LawInterval {
  Interval<3> interval;
  bool was_live = false;       ///< true if this end was live in the interval
  Vec3 wanted = Vec3::Zero();  ///< N, as requested by the coupling
  double payable = 0;          ///< J, in the account
  double reserve = 0;          ///< J, the reserve of the limiter for this force
};

struct LawPart {
  std::optional<PortSurface> surface{};
  double energy_in = 0;  ///< J
  WaveMessage<3> wave{};
};

/// The base class of all laws. Its functions do nothing and are not virtual; a law only defines the functions that it
/// needs. In each period, the caller must call `receive` for each state, `observe`, `command` (or `skip` if there is no
/// position), and `conclude`. Thread-safe: no. Realtime-safe: yes, except the constructors.
struct CouplingLaw {
  static constexpr bool kSpringPays = false;     ///< The account limits the energy of the common spring.
  static constexpr bool kHoldsSilent = true;     ///< A robot uses the law if the peer is silent.
  static constexpr bool kLeaderCentred = false;  ///< The displacement of the leader starts at 0.

  /// `before` is the previous state. `anew` is true if the epoch has changed.
  void receive(const PortState& /*peer*/, const PortState& /*before*/, bool /*anew*/,
               const MappedEnd& /*frame*/) noexcept {}
  void forget() noexcept {}  ///< resets the law because the peer or the scales have changed
  /// Starts an act at the displacement `u` in m.
  void begin_act(const Vec3& /*u*/) noexcept {}
  /// Returns the energy that the law has exchanged with the peer, or nothing if it does not exchange energy.
  std::optional<EnergyTank::Settlement> observe(const LawInterval& /*ended*/) noexcept { return std::nullopt; }
  /// `speed` is the velocity along the coupled axes in m/s, and `spring` is the force of the common spring.
  Demand<3> command(const LawPeriod& /*period*/, const Vec3& /*speed*/, const Demand<3>& spring) noexcept {
    return spring;
  }
  void skip(const LawPeriod& /*period*/, Duration /*elapsed*/) noexcept {}
  /// Ends the period. `applied` (N) is the force along the coupled axes, and `contact` the measured force at the tool.
  void conclude(const LawPeriod& /*period*/, const Vec3& /*applied*/, const std::optional<Vec3>& /*contact*/) noexcept {
  }
  LawPart part() const noexcept { return {}; }
  /// N/m
  double stiffness(const LawPeriod& period, double share, Duration /*round_trip*/) const noexcept {
    return share * period.stiffness;
  }
};

}  // namespace tendon
