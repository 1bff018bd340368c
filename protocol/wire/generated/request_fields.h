// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once

#include "protocol/messages.h"
#include "protocol/wire/fields/field.h"
#include "protocol/wire/frame.h"

// Lists of fields for requests and their answers; see fields/field.h.

namespace tendon::wire {

inline constexpr auto kSetStateRateFields = [](auto& way, auto& rate) TENDON_INLINE {
  way.count(field<1>, "hz", rate.hz);
  way.count(field<2>, "device", rate.device, Counts{.most = 15});
};

inline constexpr auto kRearmFields = [](auto& way, auto& rearm) TENDON_INLINE {
  way.count(field<1>, "device", rearm.device, Counts{.most = 15});
};

inline constexpr auto kDescribeFields = [](auto& way, auto& describe) TENDON_INLINE {
  way.count(field<1>, "device", describe.device, Counts{.most = 15});
  way.flag(field<2>, "handle", describe.handle);
};

inline constexpr auto kTakeLeaseFields = [](auto& way, auto& lease) TENDON_INLINE {
  way.count(field<1>, "device", lease.device, Counts{.most = 15});
  way.count(field<2>, "channel", lease.channel, Counts{.most = 7});
};

inline constexpr auto kGiveLeaseFields = [](auto& way, auto& lease) TENDON_INLINE {
  way.count(field<1>, "device", lease.device, Counts{.most = 15});
  way.count(field<2>, "channel", lease.channel, Counts{.most = 7});
};

inline constexpr auto kLeaseLostFields = [](auto& way, auto& lost) TENDON_INLINE {
  way.count(field<1>, "device", lost.device, Counts{.most = 15});
  way.count(field<2>, "channel", lost.channel, Counts{.most = 7});
  way.text(field<3>, "to", lost.to, 64);
};

inline constexpr auto kSetStateDeadbandFields = [](auto& way, auto& deadband) TENDON_INLINE {
  way.number(field<1>, "share", deadband.share);
  way.number(field<2>, "floor_mps", deadband.floor);
  way.period(field<3>, "max_silence_us", deadband.max_silence, kMaxSilence);
};

inline constexpr auto kDisarmFields = [](auto& way, auto& disarm) TENDON_INLINE {
  way.count(field<1>, "device", disarm.device, Counts{.most = 15});
};

inline constexpr auto kVibrationFields = [](auto& way, auto& vibration) TENDON_INLINE {
  way.number(field<1>, "vibration.amplitude", vibration.amplitude, Within{0, 1});
  way.number(field<2>, "vibration.frequency_hz", vibration.frequency, Within{0, 1000});
  way.require("vibration.frequency_hz", [&] { return vibration.frequency == 0 || vibration.frequency >= 20; });
  way.period(field<3>, "vibration.duration_ms", vibration.duration, kPulse);
};

inline constexpr auto kLampColourFields = [](auto& way, auto& lamp) TENDON_INLINE {
  way.present(field<3>, "rgb", lamp.rgb, Counts{.most = 16'777'215});
};

inline constexpr auto kSetOutputFields = [](auto& way, auto& output) TENDON_INLINE {
  way.count(field<1>, "device", output.device, Counts{.most = 15});
  way.count(field<2>, "output", output.output);
  way.one_of("setting", field<3, kFixed32>, field<4, kLength>);
  way.require("output", [&] { return output.output <= 7; });
  static_cast<void>(way.arm(field<3, kFixed32>, "rgb", kind<LampColour>, output.setting, kLampColourFields) ||
                    way.arm(field<4, kLength>, "vibration", kind<Vibration>, output.setting, kVibrationFields));
};

inline constexpr auto kRateControlFields = [](auto& way, auto& control) TENDON_INLINE {
  way.number(field<1>, "rate.dead_zone_m", control.dead_zone, Within{.least = 0});
  way.number(field<2>, "rate.gain_per_s", control.gain, Within{.least = 0, .beyond = true});
  way.number(field<3>, "rate.max_speed_mps", control.max_speed, Within{.least = 0, .beyond = true});
};

inline constexpr auto kCoupleFields = [](auto& way, auto& couple) TENDON_INLINE {
  way.count(field<1>, "device", couple.device, Counts{.most = 15});
  way.count(field<2>, "channel", couple.channel, Counts{.most = 7});
  way.choice(field<3>, "role", couple.role, PortRole::kLeader, PortRole::kFollower, 1);
  way.choice(field<4>, "method", couple.method, CouplingMethod::kPositionPosition, CouplingMethod::kRate);
  way.number(field<5>, "position_scale", couple.position_scale, Within{0.01, 100});
  way.number(field<6>, "force_scale", couple.force_scale, Within{0.01, 100});
  way.rotation(field<7>, "rotation", couple.rotation);
  way.count(field<8>, "axes", couple.axes, Counts{.least = 1, .most = 7});
  way.number(field<9>, "stiffness_npm", couple.stiffness, Within{.least = 0});
  way.number(field<10>, "mutual_damping_nspm", couple.mutual_damping, Within{.least = 0});
  way.number(field<11>, "damping_nspm", couple.damping, Within{.least = 0});
  way.flag(field<12>, "adapt_to_delay", couple.adapt_to_delay);
  way.flag(field<13>, "purse", couple.purse);
  way.period(field<14>, "period_us", couple.period, kValidity);
  way.flag(field<15>, "absolute", couple.absolute);
  way.number(field<16>, "turn_stiffness_nmprad", couple.turn_stiffness, Within{.least = 0});
  way.number(field<17>, "turn_damping_nmsprad", couple.turn_damping, Within{.least = 0});
  way.number(field<18>, "grip_stiffness_npm", couple.grip_stiffness, Within{.least = 0});
  way.number(field<19>, "grip_damping_nspm", couple.grip_damping, Within{.least = 0});
  way.number(field<20>, "drift_rate_per_s", couple.drift_rate, Within{.least = 0});
  way.message(field<21>, "rate", couple.rate, kRateControlFields);
};

inline constexpr auto kEngageFields = [](auto& way, auto& engage) TENDON_INLINE {
  way.count(field<1>, "device", engage.device, Counts{.most = 15});
};

inline constexpr auto kDisengageFields = [](auto& way, auto& disengage) TENDON_INLINE {
  way.count(field<1>, "device", disengage.device, Counts{.most = 15});
};

inline constexpr auto kSetScaleFields = [](auto& way, auto& scale) TENDON_INLINE {
  way.count(field<1>, "device", scale.device, Counts{.most = 15});
  way.number(field<2>, "position_scale", scale.position_scale, Within{0.01, 100});
  way.number(field<3>, "force_scale", scale.force_scale, Within{0.01, 100});
};

inline constexpr auto kSetShareFields = [](auto& way, auto& share) TENDON_INLINE {
  way.count(field<1>, "device", share.device, Counts{.most = 15});
  way.count(field<2>, "channel", share.channel, Counts{.most = 7});
  way.number(field<3>, "share", share.share, Within{0, 1});
};

inline constexpr auto kOfferFieldFields = [](auto& way, auto& wanted) TENDON_INLINE {
  way.bytes(field<1>, "field", wanted.field, Entries{32, 32});
  way.count(field<2>, "size", wanted.size, Counts{.least = 1, .most = 65535});
  way.count(field<3>, "offset", wanted.offset, Counts{.most = 65535});
  way.bytes(field<4>, "part", wanted.part, Entries{1, 1000});
};

inline constexpr auto kFieldMaterialFields = [](auto& way, auto& material) TENDON_INLINE {
  way.number(field<1>, "materials.stiffness_npm", material.stiffness, Within{.least = 0, .beyond = true});
  way.number(field<2>, "materials.branch_stiffness_npm", material.branch_stiffness, Within{.least = 0});
  way.number(field<3>, "materials.relaxation_s", material.relaxation, Within{.least = 0.01, .most = 10, .zero = true});
  way.number(field<4>, "materials.friction", material.friction, Within{0, 2});
};

inline constexpr auto kFieldFixtureFields = [](auto& way, auto& fixture) TENDON_INLINE {
  way.choice(field<1>, "fixtures.kind", fixture.kind, FieldFixtureKind::kPoint, FieldFixtureKind::kPlane);
  way.vector(field<2>, "fixtures.at_m", fixture.at);
  way.normal(field<3>, "fixtures.normal", fixture.normal);
  way.number(field<4>, "fixtures.stiffness_npm", fixture.stiffness, Within{.least = 0, .beyond = true});
  way.maybe(field<5>, "fixtures.most_force_n", fixture.most_force, Within{.least = 0, .beyond = true});
};

inline constexpr auto kFieldDepthTableFields = [](auto& way, auto& table) TENDON_INLINE {
  way.count(field<1>, "tables.material", table.material, Counts{.most = 7});
  way.number(field<2>, "tables.step_m", table.step, Within{0.0001, 0.1});
  way.numbers(field<3>, "tables.force_n", table.force, table.size, 1);
};

inline constexpr auto kUseFieldFields = [](auto& way, auto& wanted) TENDON_INLINE {
  way.count(field<1>, "device", wanted.device, Counts{.most = 15});
  way.count(field<2>, "channel", wanted.channel, Counts{.most = 7});
  way.count(field<3>, "generation", wanted.generation, Counts{.least = 1});
  way.bytes(field<4>, "field", wanted.field, Entries{32, 32});
  way.messages(field<5>, "materials", wanted.materials, Entries{1, 8}, kFieldMaterialFields);
  way.messages(field<6>, "fixtures", wanted.fixtures, Entries{0, 4}, kFieldFixtureFields);
  way.messages(field<7>, "tables", wanted.tables, Entries{0, 3}, kFieldDepthTableFields);
};

inline constexpr auto kDropFieldFields = [](auto& way, auto& wanted) TENDON_INLINE {
  way.bytes(field<1>, "field", wanted.field, Entries{32, 32});
};

inline constexpr auto kControlFields = [](auto& way, auto& control) TENDON_INLINE {
  way.count(field<1>, "id", control.id, Counts{.least = 1});
  static_cast<void>(
      way.arm(field<2, kLength>, "set_state_rate", kind<SetStateRate>, control.request, kSetStateRateFields) ||
      way.arm(field<3, kLength>, "rearm", kind<Rearm>, control.request, kRearmFields) ||
      way.arm(field<4, kLength>, "describe", kind<Describe>, control.request, kDescribeFields) ||
      way.arm(field<5, kLength>, "take_lease", kind<TakeLease>, control.request, kTakeLeaseFields) ||
      way.arm(field<6, kLength>, "give_lease", kind<GiveLease>, control.request, kGiveLeaseFields) ||
      way.arm(field<7, kLength>, "lease_lost", kind<LeaseLost>, control.request, kLeaseLostFields) ||
      way.arm(field<8, kLength>, "set_state_deadband", kind<SetStateDeadband>, control.request,
              kSetStateDeadbandFields) ||
      way.arm(field<9, kLength>, "disarm", kind<Disarm>, control.request, kDisarmFields) ||
      way.arm(field<10, kLength>, "set_output", kind<SetOutput>, control.request, kSetOutputFields) ||
      way.arm(field<11, kLength>, "couple", kind<Couple>, control.request, kCoupleFields) ||
      way.arm(field<12, kLength>, "engage", kind<Engage>, control.request, kEngageFields) ||
      way.arm(field<13, kLength>, "disengage", kind<Disengage>, control.request, kDisengageFields) ||
      way.arm(field<14, kLength>, "set_scale", kind<SetScale>, control.request, kSetScaleFields) ||
      way.arm(field<15, kLength>, "set_share", kind<SetShare>, control.request, kSetShareFields) ||
      way.arm(field<16, kLength>, "offer_field", kind<OfferField>, control.request, kOfferFieldFields) ||
      way.arm(field<17, kLength>, "use_field", kind<UseField>, control.request, kUseFieldFields) ||
      way.arm(field<18, kLength>, "drop_field", kind<DropField>, control.request, kDropFieldFields));
};

inline constexpr auto kChannelDescriptionFields = [](auto& way, auto& description) TENDON_INLINE {
  way.text(field<1>, "name", description.name, 24);
  way.choice(field<2>, "rule", description.rule, ChannelRule::kSum, ChannelRule::kPriority);
  way.period(field<3>, "lease_ms", description.lease, kWait);
  way.text(field<4>, "holder", description.holder, 24);
};

inline constexpr auto kDeviceDescriptionFields = [](auto& way, auto& description) TENDON_INLINE {
  way.count(field<1>, "device", description.device, Counts{.most = 15});
  way.text(field<2>, "name", description.name, 24);
  way.text(field<3>, "model", description.model, 64);
  way.count(field<4>, "position_dof", description.position_dof, Counts{.least = 1, .most = 6});
  way.count(field<5>, "force_dof", description.force_dof, Counts{.least = 1, .most = 6});
  way.box(field<6>, field<7>, "workspace_min_m", description.workspace);
  way.number(field<8>, "max_force_n", description.max_force, Within{.least = 0});
  way.number(field<9>, "continuous_force_n", description.continuous_force, Within{.least = 0});
  way.number(field<10>, "max_stiffness_npm", description.max_stiffness, Within{.least = 0});
  way.number(field<11>, "position_resolution_m", description.position_resolution, Within{.least = 0});
  way.count(field<12>, "loop_hz", description.loop_hz, Counts{.least = 1, .most = 1'000'000});
  way.messages(field<13>, "channels", description.channels, Entries{1, 8}, kChannelDescriptionFields);
};

inline constexpr auto kOutputDescriptionFields = [](auto& way, auto& description) TENDON_INLINE {
  way.text(field<1>, "name", description.name, 24);
  way.choice(field<2>, "kind", description.kind, OutputKind::kLamp, OutputKind::kVibration);
};

inline constexpr auto kHandleDescriptionFields = [](auto& way, auto& description) TENDON_INLINE {
  way.count(field<1>, "device", description.device, Counts{.most = 15});
  way.maybe(field<2>, "operator_from_device", description.operator_from_device);
  way.texts(field<3>, "buttons", description.buttons, Entries{0, 16}, 24);
  way.flag(field<4>, "orientation_measured", description.orientation_measured);
  way.number(field<5>, "max_torque_nm", description.max_torque, Within{.least = 0});
  way.maybe(field<6>, "gripper_open_rad", description.gripper_open, Within{.least = 0});
  way.number(field<7>, "max_gripper_force_n", description.max_gripper_force, Within{.least = 0});
  way.text(field<8>, "group", description.group, 24);
  way.choice(field<9>, "hand", description.hand, Hand::kAny, Hand::kRight);
  way.texts(field<10>, "joints", description.joints, Entries{0, 8}, 24);
  way.messages(field<11>, "outputs", description.outputs, Entries{0, 8}, kOutputDescriptionFields);
};

inline constexpr auto kControlAckFields = [](auto& way, auto& ack) TENDON_INLINE {
  way.count(field<1>, "id", ack.id, Counts{.least = 1});
  way.choice(field<2>, "code", ack.code, Code::kOk, Code::kReplaced);
  way.text(field<3>, "detail", ack.detail, 128);
  way.period(field<4>, "wait_ms", ack.wait, kWait);
  way.message(field<5>, "device", ack.device, kDeviceDescriptionFields);
  way.message(field<6>, "handle", ack.handle, kHandleDescriptionFields);
};

inline constexpr auto kByeFields = [](auto& way, auto& bye) TENDON_INLINE {
  way.choice(field<1>, "code", bye.code, Code::kOk, Code::kReplaced);
  way.text(field<2>, "reason", bye.reason, 128);
};

}  // namespace tendon::wire
