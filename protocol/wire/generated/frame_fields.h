// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once

#include "protocol/messages.h"
#include "protocol/wire/fields/field.h"
#include "protocol/wire/frame.h"

// Lists of fields for frames; see fields/field.h.

namespace tendon::wire {

inline constexpr auto kEchoFields = [](auto& way, auto& echo) TENDON_INLINE {
  way.time(field<1>, "peer_tx_time_ns", echo.sent);
  way.time(field<2>, "rx_time_ns", echo.received);
  way.count(field<3>, "peer_packet_number", echo.packet_number);
  way.bits(field<4>, "received_mask", echo.received_mask);
};

inline constexpr auto kDeviceStateFields = [](auto& way, auto& state) TENDON_INLINE {
  way.count(field<1>, "tick", state.tick);
  way.time(field<2>, "sampled_ns", state.sampled);
  way.vector(field<3>, "position_m", state.position);
  way.vector(field<4>, "velocity_mps", state.velocity);
  way.vector(field<5>, "force_applied_n", state.force_applied);
  way.number(field<6>, "energy_j", state.energy);
  way.number(field<7>, "permitted_force_n", state.permitted_force, Within{.least = 0, .infinity = true});
  way.bits(field<8>, "reasons", state.reasons);
  way.count(field<9>, "force_sequence", state.force_sequence);
  way.duration(field<10>, "force_age_ns", state.force_age);
  way.choice(field<11>, "mode", state.mode, Mode::kIdle, Mode::kFault);
  way.count(field<12>, "device", state.device, Counts{.most = 15});
  way.count(field<13>, "channel", state.channel, Counts{.most = 7});
  way.maybe(field<14>, "force_wanted_n", state.force_wanted);
  way.part(field<15, kLength>, state.turning,
           [&](auto& part) TENDON_INLINE { way.rotation(field<15>, "orientation", part.orientation); });
  way.rest(field<16, kLength>, state.turning,
           [&](auto& part) TENDON_INLINE { way.vector(field<16>, "angular_velocity_radps", part.angular_velocity); });
  way.bits(field<17>, "buttons", state.buttons);
  way.maybe(field<18>, "torque_applied_nm", state.torque_applied);
  way.part(field<19, kFixed64>, state.grip,
           [&](auto& part) TENDON_INLINE { way.present(field<19>, "gripper_rad", part.opening); });
  way.rest(field<20, kFixed64>, state.grip,
           [&](auto& part) TENDON_INLINE { way.present(field<20>, "gripper_velocity_radps", part.velocity); });
  way.maybe(field<21>, "gripper_force_applied_n", state.grip_applied);
  way.maybe(field<22>, "hand_force_n", state.hand_force);
  way.joints(field<23>, field<24>, "joint_rad", state.joints);
  way.matrix(field<25>, "stiffness_wanted_npm", state.stiffness_wanted);
  way.part(field<26, kVarint>, state.field,
           [&](auto& part) TENDON_INLINE { way.count(field<26>, "field", part.generation); });
  way.rest(field<27, kFixed64>, state.field,
           [&](auto& part) TENDON_INLINE { way.number(field<27>, "field_depth_m", part.depth, Within{.least = 0}); });
  way.rest(field<28, kLength>, state.field,
           [&](auto& part) TENDON_INLINE { way.vector(field<28>, "field_proxy_m", part.proxy); });
};

inline constexpr auto kForceTableFields = [](auto& way, auto& table) TENDON_INLINE {
  way.number(field<1>, "first_depth_m", table.first);
  way.number(field<2>, "step_m", table.step, Within{.least = 0, .beyond = true});
  way.numbers(field<3>, "force_n", table.force, table.size, 2);
};

inline constexpr auto kContactFields = [](auto& way, auto& contact) TENDON_INLINE {
  way.normal(field<1>, "normal", contact.normal);
  way.number(field<2>, "gap_m", contact.gap);
  way.message(field<3>, "table", contact.table, kForceTableFields);
};

inline constexpr auto kLocalModelFields = [](auto& way, auto& model) TENDON_INLINE {
  way.vector(field<1>, "at_m", model.at);
  way.matrix(field<2>, "stiffness_npm", model.stiffness);
  way.radius(field<3>, "valid_radius_m", model.valid_radius);
  way.message(field<4>, "contact", model.contact, kContactFields);
};

inline constexpr auto kRotationModelFields = [](auto& way, auto& model) TENDON_INLINE {
  way.rotation(field<1>, "at_orientation", model.at);
  way.matrix(field<2>, "angular_stiffness_nmprad", model.stiffness);
};

inline constexpr auto kForceCommandFields = [](auto& way, auto& command) TENDON_INLINE {
  way.count(field<1>, "sequence", command.sequence, Counts{.least = 1});
  way.count(field<2>, "based_on_tick", command.based_on_tick);
  way.vector(field<3>, "force_n", command.force);
  way.message(field<4>, "model", command.model, kLocalModelFields);
  way.period(field<5>, "valid_for_us", command.valid_for, kValidity);
  way.count(field<6>, "device", command.device, Counts{.most = 15});
  way.count(field<7>, "channel", command.channel, Counts{.most = 7});
  way.flag(field<8>, "topology_changed", command.topology_changed);
  way.maybe(field<9>, "error_n", command.error, Within{.least = 0});
  way.part(field<10, kLength>, command.torque,
           [&](auto& part) TENDON_INLINE { way.vector(field<10>, "torque_nm", part.torque); });
  way.maybe(field<11>, "gripper_force_n", command.grip_force);
  way.part(field<14, kLength>, command.torque, [&](auto& part) TENDON_INLINE {
    way.message(field<14>, "rotation_model", part.model, kRotationModelFields);
  });
  way.count(field<15>, "way", command.way, Counts{.most = 8});
  way.count(field<16>, "field", command.field);
};

inline constexpr auto kDelaysFields = [](auto& way, auto& delays) TENDON_INLINE {
  way.difference(field<1>, "median_ns", delays.median);
  way.difference(field<2>, "p99_ns", delays.p99);
};

inline constexpr auto kLinkReportFields = [](auto& way, auto& report) TENDON_INLINE {
  way.count(field<1>, "number", report.number, Counts{.least = 1});
  way.time(field<2>, "until_ns", report.until);
  way.duration(field<3>, "span_ns", report.span);
  way.count(field<4>, "forces", report.forces);
  way.count(field<5>, "late_server", report.late_server);
  way.count(field<6>, "late_network", report.late_network);
  way.count(field<7>, "late_engine", report.late_engine);
  way.duration(field<8>, "worst_late_ns", report.worst_late);
  way.duration(field<9>, "longest_gap_ns", report.longest_gap);
  way.message(field<10>, "round_trip", report.round_trip, kDelaysFields);
  way.message(field<11>, "to_server", report.to_server, kDelaysFields);
  way.message(field<12>, "to_client", report.to_client, kDelaysFields);
  way.difference(field<13>, "clock_offset_ns", report.clock_offset);
  way.number(field<14>, "clock_drift_ppm", report.clock_drift_ppm);
  way.duration(field<15>, "clock_error_ns", report.clock_error);
  way.count(field<16>, "received", report.received);
  way.count(field<17>, "lost", report.lost);
  way.count(field<18>, "reordered", report.reordered);
  way.count(field<19>, "duplicated", report.duplicated);
  way.text(field<20>, "words", report.words, 128);
  way.count(field<21>, "late_unknown", report.late_unknown);
  way.count(field<22>, "refused_not_finite", report.refused.not_finite);
  way.count(field<23>, "refused_out_of_bounds", report.refused.out_of_bounds);
  way.count(field<24>, "refused_unknown_tick", report.refused.unknown_tick);
  way.count(field<25>, "refused_old_sequence", report.refused.old_sequence);
};

inline constexpr auto kDeviceReportFields = [](auto& way, auto& report) TENDON_INLINE {
  way.count(field<1>, "number", report.number, Counts{.least = 1});
  way.time(field<2>, "until_ns", report.until);
  way.duration(field<3>, "span_ns", report.span);
  way.count(field<4>, "device", report.device, Counts{.most = 15});
  way.count(field<5>, "steps", report.steps);
  way.count(field<6>, "missed", report.missed);
  way.count(field<7>, "overruns", report.overruns);
  way.require("overruns", [&] { return report.overruns <= report.steps; });
  way.count(field<8>, "unseen", report.unseen);
  way.require("unseen", [&] { return report.unseen <= report.steps; });
  way.counts(field<9>, "lateness_us_log2", report.lateness);
  way.require("lateness_us_log2", [&] { return is_part(report.lateness, report.steps); });
  way.choice(field<10>, "safety", report.safety, Safety::kAbsent, Safety::kUnguarded);
  way.text(field<11>, "fault", report.fault, 128);
  way.text(field<12>, "degraded", report.degraded, 128);
};

inline constexpr auto kPeerReportFields = [](auto& way, auto& report) TENDON_INLINE {
  way.count(field<1>, "device", report.device, Counts{.most = 15});
  way.count(field<2>, "channel", report.channel, Counts{.most = 7});
  way.text(field<3>, "name", report.name, 64);
  way.count(field<4>, "state_one_in", report.state_one_in, Counts{.least = 1, .most = 1000});
  way.flag(field<5>, "forces_refused", report.forces_refused);
  way.message(field<6>, "link", report.link, kLinkReportFields);
  way.maybe(field<7>, "error_n", report.error, Within{.least = 0});
  way.text(field<8>, "way", report.way, 24);
};

inline constexpr auto kPortSurfaceFields = [](auto& way, auto& surface) TENDON_INLINE {
  way.vector(field<1>, "normal", surface.normal);
  way.number(field<2>, "offset_m", surface.offset);
  way.number(field<3>, "stiffness_npm", surface.stiffness, Within{.least = 0});
  way.require("normal", [&] { return is_sound(surface); });
};

inline constexpr auto kPortTurnFields = [](auto& way, auto& turn) TENDON_INLINE {
  way.rotation(field<1>, "turn", turn.turn);
  way.vector(field<2>, "angular_velocity_radps", turn.angular_velocity);
  way.vector(field<3>, "torque_nm", turn.torque);
};

inline constexpr auto kPortGripFields = [](auto& way, auto& grip) TENDON_INLINE {
  way.number(field<1>, "opening_m", grip.opening);
  way.number(field<2>, "velocity_mps", grip.velocity);
  way.number(field<3>, "force_n", grip.force);
  way.number(field<4>, "account_j", grip.account, Within{-1e3, 1e3});
  way.number(field<5>, "need_j", grip.need, Within{0, 1e3});
  way.number(field<6>, "given_j", grip.given, Within{0, 1e6});
  way.number(field<7>, "taken_j", grip.taken, Within{0, 1e6});
};

inline constexpr auto kPortStateFields = [](auto& way, auto& state) TENDON_INLINE {
  way.count(field<1>, "device", state.device, Counts{.most = 15});
  way.count(field<2>, "channel", state.channel, Counts{.most = 7});
  way.count(field<3>, "epoch", state.epoch, Counts{.least = 1});
  way.count(field<4>, "sequence", state.sequence, Counts{.least = 1});
  way.count(field<5>, "answers_epoch", state.answers_epoch);
  way.count(field<6>, "answers", state.answers);
  way.time(field<7>, "time_ns", state.time);
  way.duration(field<8>, "round_trip_ns", state.round_trip, Duration(10'000'000'000));
  way.choice(field<9>, "phase", state.phase, PortPhase::kAlone, PortPhase::kFault);
  way.count(field<10>, "engagement", state.engagement);
  way.bits(field<11>, "buttons", state.buttons);
  way.vector(field<12>, "position_m", state.position);
  way.vector(field<13>, "velocity_mps", state.velocity);
  way.vector(field<14>, "force_n", state.force);
  way.maybe(field<15>, "contact_force_n", state.contact_force);
  way.number(field<16>, "account_j", state.account, Within{-1e3, 1e3});
  way.number(field<17>, "need_j", state.need, Within{0, 1e3});
  way.number(field<18>, "given_j", state.given, Within{0, 1e6});
  way.number(field<19>, "taken_j", state.taken, Within{0, 1e6});
  way.vector_unless_zero(field<20>, "wave_integral", state.wave_integral);
  way.number(field<21>, "wave_energy_j", state.wave_energy, Within{0, 1e6});
  way.message(field<22>, "surface", state.surface, kPortSurfaceFields);
  way.message(field<23>, "turn", state.turn, kPortTurnFields);
  way.message(field<24>, "grip", state.grip, kPortGripFields);
  way.number(field<25>, "energy_in_j", state.energy_in, Within{0, 1e6});
  way.maybe(field<26>, "share", state.share, Within{0, 1});
  way.number(field<27>, "position_scale", state.position_scale, Within{.least = 0.01, .most = 100, .zero = true});
  way.number(field<28>, "force_scale", state.force_scale, Within{.least = 0.01, .most = 100, .zero = true});
  way.flag(field<29>, "of_peer", state.of_peer);
};

inline constexpr auto kFieldBrickFields = [](auto& way, auto& brick) TENDON_INLINE {
  way.bytes(field<1>, "hash", brick.hash, Entries{16, 16});
  way.bytes(field<2>, "weights", brick.weights, Entries{1024, 1024});
};

inline constexpr auto kFieldStatusFields = [](auto& way, auto& status) TENDON_INLINE {
  way.bytes(field<1>, "field", status.field, Entries{32, 32});
  way.bytes(field<2>, "missing", status.missing, Entries{0, 128});
};

inline constexpr auto kFieldPoseFields = [](auto& way, auto& pose) TENDON_INLINE {
  way.count(field<1>, "device", pose.device, Counts{.most = 15});
  way.count(field<2>, "channel", pose.channel, Counts{.most = 7});
  way.count(field<3>, "sequence", pose.sequence, Counts{.least = 1});
  way.time(field<4>, "time_ns", pose.time);
  way.vector(field<5>, "position_m", pose.position);
  way.rotation(field<6>, "orientation", pose.orientation);
  way.vector(field<7>, "velocity_mps", pose.velocity);
  way.vector(field<8>, "angular_velocity_radps", pose.angular_velocity);
};

}  // namespace tendon::wire
