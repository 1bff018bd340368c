// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/teleoperation/methods/coupling_law.h"

namespace tendon {

/// The method `waves` uses a WavePort at both ends. The impedance is B at the leader and B/(s_f s_x) at the follower. K
/// and D are only used for the position of a robot.
///
/// The energy that the line sends is taken from the account of the limiter, and the energy of the peer is added to it.
/// The pair is therefore passive even if a limiter reduces the force. The line uses the force that remains after
/// max_force, the limiter and the motors, and sends the difference later (WavePort::SharedAccount). The ramp does not
/// count as such a difference, so the two positions do not drift. If the leader is clutched, its end of the line does
/// not move, and the follower stays at its position. The interval before the clutch was pressed is not part of u, so the
/// line takes its motion back; otherwise, each press would shift the two positions. Waves are only sent by an engaged
/// end, but are always received.
class WaveLaw : public CouplingLaw {
 public:
  /// The delay of the line without the network and the playout: W and a period.
  static constexpr Duration kLineWaits = WavePort<3>::kSmoothing + std::chrono::milliseconds(1);
  static constexpr bool kHoldsSilent = false;

  WaveLaw(const CouplingConfig& config, const MappedEnd& frame);

  void receive(const PortState& peer, const PortState& before, bool anew, const MappedEnd& frame) noexcept;
  void forget() noexcept { joined_ = false; }
  void begin_act(const Vec3& /*u*/) noexcept { port_.forgive(); }
  std::optional<EnergyTank::Settlement> observe(const LawInterval& ended) noexcept;
  Demand<3> command(const LawPeriod& period, const Vec3& speed, const Demand<3>& spring) noexcept;
  void skip(const LawPeriod& period, Duration elapsed) noexcept;
  LawPart part() const noexcept { return {.wave = sent_}; }
  /// Returns B/d. The delay of one direction is half of the round trip.
  double stiffness(const LawPeriod& period, double share, Duration round_trip) const noexcept;

 private:
  double damping_;  ///< B of the leader, N·s/m
  double max_force_;
  WavePort<3> port_;
  WaveMessage<3> sent_;
  Vec3 line_ = Vec3::Zero();        ///< N, that the line wants in this period
  Vec3 force_ = Vec3::Zero();       ///< N, of the line in this period, at most max_force
  bool moves_ = false;              ///< the line moves with the handle
  Vec3 last_dx_ = Vec3::Zero();     ///< m, motion of the line in the last interval with the handle
  Vec3 takes_back_ = Vec3::Zero();  ///< m, of that motion, in the next interval
  bool joined_ = false;             ///< the port has joined the epoch of the peer
};

}  // namespace tendon
