// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/dashboard/board.h"
#include "core/base/reason.h"

namespace tendon::dash {

/// The scales are 1. The leader gave 30 mJ, of which the follower received 25 mJ.
inline Board::Ports both_ends() {
  Board::Ports ports;
  PortFrame& leader = ports.own;
  leader.epoch = 7;
  leader.answers_epoch = 9;
  leader.phase = PortPhase::kEngaged;
  leader.account = 0.125;
  leader.need = 1e-3;
  leader.given = 0.03;
  leader.round_trip = std::chrono::milliseconds(40);
  leader.position_scale = leader.force_scale = 1;
  PortFrame& follower = ports.peer.emplace();
  follower.of_peer = true;
  follower.epoch = 9;
  follower.answers_epoch = 7;
  follower.phase = PortPhase::kEngaged;
  follower.account = 0.25;
  follower.need = 1e-3;
  follower.taken = 0.025;
  follower.round_trip = std::chrono::milliseconds(41);
  return ports;
}

inline Board full_board() {
  Board board;
  Welcome welcome;
  welcome.server = "tendond";
  board.welcomed(welcome);
  board.tell(Contact::kOpen, "connected");
  board.described({.device = 0,
                   .name = "left",
                   .model = "falcon",
                   .loop_hz = 1000,
                   .channels = {{.name = "main", .holder = "wall"}}});
  DeviceState state;
  state.position = Vec3(0, -0.5, 0);
  state.force_wanted = Vec3(3, 4, 0);
  state.force_applied = Vec3(0, 0, 2);
  state.permitted_force = 2.5;
  state.energy = 0.125;
  state.field = FieldState{.generation = 3, .depth = 0.0015, .proxy = Vec3(0, -0.4985, 0)};
  state.mode = Mode::kHolding;
  state.reasons = Reasons(Reason::kEnergy).bits();
  board.observe(state);
  DeviceReport report;
  report.steps = 1000;
  report.missed = 3;
  report.lateness[3] = 990;
  report.lateness[23] = 7;
  report.safety = Safety::kArmed;
  report.degraded = "recording has fallen behind";
  board.observe(report);
  PeerReport peer;
  peer.name = "wall";
  peer.link.forces = 97;
  peer.link.late_network = 4;
  peer.link.round_trip = Delays{std::chrono::milliseconds(40), std::chrono::milliseconds(125)};
  peer.link.to_server = peer.link.round_trip;
  peer.link.to_client = peer.link.round_trip;
  peer.link.received = 3000;
  peer.link.lost = 12;
  peer.error = 0.25;
  peer.way = "near";
  board.observe(peer);
  board.observe(both_ends().own);
  board.observe(*both_ends().peer);
  return board;
}

}  // namespace tendon::dash
