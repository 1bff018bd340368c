// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <variant>
#include <vector>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/wire/codec.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/read_back.h"
#include "tests/support/dice.h"

// Most of the random values are ordinary, and some are difficult.

namespace tendon::drawn {

using examples::Bytes;

inline double a_number(Dice& dice) {
  constexpr std::array kHard = {0.0,
                                -0.0,
                                limits::kMaxValue,
                                -limits::kMaxValue,
                                std::numeric_limits<double>::min(),
                                std::numeric_limits<double>::denorm_min()};
  return dice.chance(0.2) ? kHard[dice.bits() % kHard.size()] : dice.within(-10, 10);
}
inline Vec3 a_vector(Dice& dice) { return {a_number(dice), a_number(dice), a_number(dice)}; }
inline std::uint64_t a_count(Dice& dice) { return dice.chance(0.1) ? 0 : dice.bits() >> (dice.bits() % 64); }
inline Duration a_time(Dice& dice) {
  const auto ns = static_cast<std::int64_t>(a_count(dice) >> 4U);
  return Duration(dice.chance(0.2) ? -ns : ns);
}
inline Quat a_rotation(Dice& dice) {
  if (dice.chance(0.2)) return {.w = 0, .x = 1, .y = 0, .z = 0};
  return unit({dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1), dice.within(0.1, 1)});
}
inline Mat3 a_stiffness(Dice& dice) {
  if (dice.chance(0.3)) return a_number(dice) * Mat3::Identity();
  if (dice.chance(0.4)) return a_vector(dice).asDiagonal();
  Mat3 stiffness;
  stiffness << a_vector(dice), a_vector(dice), a_vector(dice);
  return stiffness;
}

inline DeviceState a_state(Dice& dice) {
  DeviceState state;
  state.tick = a_count(dice);
  state.sampled = PeerTime(a_time(dice));
  state.position = a_vector(dice);
  state.velocity = a_vector(dice);
  state.force_applied = a_vector(dice);
  state.energy = a_number(dice);
  state.permitted_force = dice.chance(0.1) ? kInf : std::abs(a_number(dice));
  state.reasons = static_cast<std::uint32_t>(a_count(dice));
  state.force_sequence = a_count(dice);
  state.force_age = std::chrono::abs(a_time(dice));
  state.mode = static_cast<Mode>(1 + dice.bits() % 6);
  state.device = static_cast<std::uint32_t>(dice.bits() % limits::kMaxDevices);
  state.channel = static_cast<std::uint32_t>(dice.bits() % limits::kMaxChannels);
  if (dice.chance(0.2)) state.force_wanted = a_vector(dice);
  if (dice.chance(0.05)) state.stiffness_wanted = a_stiffness(dice);
  if (dice.chance(0.3)) state.buttons = static_cast<std::uint32_t>(a_count(dice));
  if (dice.chance(0.3)) state.turning = Turning{a_rotation(dice), a_vector(dice)};
  if (dice.chance(0.3)) state.torque_applied = a_vector(dice);
  if (dice.chance(0.3)) state.grip = Grip{a_number(dice), a_number(dice)};
  if (dice.chance(0.3)) state.grip_applied = a_number(dice);
  if (dice.chance(0.3)) state.hand_force = a_vector(dice);
  if (dice.chance(0.05)) state.joints = Joints::three(a_vector(dice), a_vector(dice));
  return state;
}

inline ForceCommand a_force(Dice& dice) {
  ForceCommand command;
  command.sequence = a_count(dice) | 1U;
  command.based_on_tick = a_count(dice);
  command.force = a_vector(dice);
  command.valid_for = Duration(1 + static_cast<std::int64_t>(dice.bits() % 10'000'000'000));
  command.device = static_cast<std::uint32_t>(dice.bits() % limits::kMaxDevices);
  command.channel = static_cast<std::uint32_t>(dice.bits() % limits::kMaxChannels);
  command.topology_changed = dice.chance(0.1);
  if (dice.chance(0.4)) {
    command.model = LocalModel{.at = a_vector(dice), .stiffness = a_stiffness(dice)};
    if (dice.chance(0.5)) command.model->valid_radius = std::abs(a_number(dice));
    if (dice.chance(0.1)) command.model->contact = examples::force_with_all().model->contact;
  }
  if (dice.chance(0.2)) command.error = std::abs(a_number(dice));
  if (dice.chance(0.3)) {
    command.torque = RemoteTorque{.torque = a_vector(dice)};
    if (dice.chance(0.5)) command.torque->model = RotationModel{a_rotation(dice), a_stiffness(dice)};
  }
  if (dice.chance(0.3)) command.grip_force = a_number(dice);
  if (dice.chance(0.3)) command.way = static_cast<std::uint32_t>(dice.bits() % (limits::kMaxWays + 1));
  return command;
}

// These values are as long as possible: eight bytes for every component, and ten for every counter.

inline const Vec3 kThirds = Vec3::Constant(-1.0 / 3);
inline const Mat3 kNineEntries{{1.1, 2.1, 3.1}, {4.1, 5.1, 6.1}, {7.1, 8.1, 9.1}};
inline constexpr Quat kTurned{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5};

inline DeviceState fullest_state() {
  DeviceState state{.tick = ~std::uint64_t{0},
                    .sampled = PeerTime{limits::kMaxTime},
                    .position = kThirds,
                    .velocity = kThirds,
                    .force_applied = kThirds,
                    .energy = -0.1,
                    .permitted_force = kInf,
                    .reasons = ~0U,
                    .force_sequence = ~std::uint64_t{0},
                    .force_age = limits::kMaxTime,
                    .mode = Mode::kFault,
                    .device = limits::kMaxDevices - 1,
                    .channel = limits::kMaxChannels - 1,
                    .force_wanted = kThirds,
                    .stiffness_wanted = kNineEntries,
                    .buttons = ~0U,
                    .turning = Turning{.orientation = kTurned, .angular_velocity = kThirds},
                    .torque_applied = kThirds,
                    .grip = Grip{.opening = 0.1, .velocity = -0.1},
                    .grip_applied = 0.1,
                    .hand_force = kThirds,
                    .joints = Joints{.count = Joints::kMost, .angle = {}, .velocity = {}}};
  state.joints->angle.fill(-0.1);
  state.joints->velocity.fill(0.1);
  return state;
}

inline ForceCommand fullest_force() {
  ForceTable table{.first = -0.1, .step = 0.1, .size = ForceTable::kMaxEntries, .force = {}};
  table.force.fill(0.1);
  ForceCommand force{.sequence = ~std::uint64_t{0},
                     .based_on_tick = ~std::uint64_t{0},
                     .force = kThirds,
                     .model = LocalModel{.at = kThirds,
                                         .stiffness = kNineEntries,
                                         .valid_radius = 0.1,
                                         .contact = Contact{.normal = {0.6, 0.64, 0.48}, .gap = -0.1, .table = table}},
                     .valid_for = limits::kMaxValidFor,
                     .device = limits::kMaxDevices - 1,
                     .channel = limits::kMaxChannels - 1,
                     .topology_changed = true,
                     .error = 0.1,
                     .torque = RemoteTorque{.torque = kThirds, .model = RotationModel{}},
                     .grip_force = -0.1};
  force.torque->model->at = kTurned;
  force.torque->model->stiffness = kNineEntries;
  return force;
}

inline void spoil(Dice& dice, DeviceState& state) {
  constexpr std::array kBad = {kNan, kInf, -kInf, 2 * limits::kMaxValue};
  const double bad = kBad[dice.bits() % kBad.size()];
  const std::array<double*, 4> places = {&state.position.y(), &state.velocity.z(), &state.energy,
                                         &state.permitted_force};
  *places[dice.bits() % places.size()] = bad;
  if (dice.chance(0.2)) state.mode = static_cast<Mode>(dice.bits() % 256);
  if (dice.chance(0.2)) state.device = static_cast<std::uint32_t>(dice.bits());
  if (dice.chance(0.2)) state.force_age = -state.force_age;
}
inline void spoil(Dice& dice, ForceCommand& command) {
  constexpr std::array kBad = {kNan, kInf, -kInf, -2 * limits::kMaxValue};
  command.force.x() = kBad[dice.bits() % kBad.size()];
  if (dice.chance(0.2)) command.sequence = 0;
  if (dice.chance(0.2)) command.valid_for = -command.valid_for;
  if (dice.chance(0.2)) command.channel = static_cast<std::uint32_t>(dice.bits());
  if (command.model && dice.chance(0.5)) command.model->stiffness(1, 2) = kNan;
}

inline std::optional<OutgoingEcho> an_echo(Dice& dice) {
  if (dice.chance(0.1)) return {};
  return OutgoingEcho{.sent = PeerTime(a_time(dice)),
                      .received = LocalTime(a_time(dice)),
                      .packet_number = a_count(dice),
                      .received_mask = static_cast<std::uint32_t>(a_count(dice))};
}

/// Returns the states of one, two or all devices in the same step, for columns. A share `spoilt` of them is invalid.
inline std::vector<DeviceState> states_of_a_step(Dice& dice, double spoilt) {
  DeviceState common = a_state(dice);
  std::vector<DeviceState> states;
  const double share = dice.chance(0.5) ? 1 : 0.2;
  const bool usual = dice.chance(0.5);
  for (std::uint32_t device = 0; device < limits::kMaxDevices; ++device) {
    if (!dice.chance(share) && device > 0) continue;
    DeviceState state = a_state(dice);
    if (usual) {
      state.reasons = 1;
      state.force_sequence = 1'000'000 + device;
      state.force_age = Duration(1'500'000);
      state.channel = state.buttons = 0;
    }
    state.tick = common.tick;
    state.sampled = common.sampled;
    state.device = device;
    if (dice.chance(spoilt)) spoil(dice, state);
    state.device = device;
    state.force_wanted.reset();
    state.stiffness_wanted.reset();
    state.turning.reset();
    state.torque_applied.reset();
    state.grip.reset();
    state.grip_applied.reset();
    state.hand_force.reset();
    state.joints.reset();
    states.push_back(state);
  }
  return states;
}

inline const std::vector<Frame>& others() {
  static const std::vector<Frame> all = [] {
    std::vector<Frame> out = {
        examples::report(),     examples::device_report(),      examples::peer_report(),
        examples::port(),       examples::port_in_contact(),    examples::port_by_model(),
        examples::described(7), examples::handle_described(7),  examples::joints_described(7),
        examples::busy(7),      examples::outputs_described(7), Bye{.code = Code::kOk, .reason = "µ"}};
    out.emplace_back(examples::port_with_all());
    out.emplace_back(examples::peer_report_with_way());
    for (const Request& request :
         {Request(SetStateRate{.hz = 500, .device = 2}), Request(Rearm{1}), Request(Disarm{2}),
          Request(Describe{3, true}), Request(TakeLease{1, 2}), Request(GiveLease{2, 1}),
          Request(LeaseLost{1, 2, "other"}), Request(SetStateDeadband{0.1, 0.01, std::chrono::milliseconds(7)}),
          Request(examples::couple_with_all()), Request(Engage{1}), Request(Disengage{2}), Request(examples::lamp()),
          Request(examples::vibration()), Request(examples::set_scale()), Request(examples::set_share())}) {
      out.emplace_back(Control{.id = 9, .request = request});
    }
    return out;
  }();
  return all;
}

/// Returns a few frames. A share `spoilt` of the states and forces is invalid.
inline Bytes a_datagram(Dice& dice, double spoilt) {
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  writer.begin(buffer, {.connection_id = 7}, LocalTime(a_time(dice)), an_echo(dice));
  const std::vector<DeviceState> together =
      dice.chance(0.2) ? states_of_a_step(dice, 0.1 * spoilt) : std::vector<DeviceState>();
  std::vector<const DeviceState*> columns;
  for (const DeviceState& state : together) columns.push_back(&state);
  if (!columns.empty()) writer.add(std::span<const DeviceState* const>(columns));
  for (std::uint64_t left = dice.chance(0.8) ? 1 : dice.bits() % 9; left > 0; --left) {
    if (dice.chance(0.2)) {
      std::visit([&](const auto& frame) { writer.add(frame); }, others()[dice.bits() % others().size()]);
    } else if (dice.chance(0.5)) {
      DeviceState state = a_state(dice);
      if (dice.chance(spoilt)) spoil(dice, state);
      writer.add(state);
    } else {
      ForceCommand command = a_force(dice);
      if (dice.chance(spoilt)) spoil(dice, command);
      writer.add(command);
    }
  }
  return {buffer.begin() + kHeaderSize, buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())};
}

}  // namespace tendon::drawn
