// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "protocol/wire/codec.h"
#include "protocol/wire/handshake_codec.h"
#include "tests/protocol/field_examples.h"

// These examples are shown in protocol/vectors/golden.md.

namespace tendon::examples {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint32_t kConnection = 0x11223344;

inline std::string hex(std::span<const std::byte> bytes, std::string_view between = {}) {
  constexpr std::string_view kDigits = "0123456789abcdef";
  std::string out;
  for (const std::byte b : bytes) {
    if (!out.empty()) out += between;
    out += kDigits[std::to_integer<unsigned>(b) >> 4U];
    out += kDigits[std::to_integer<unsigned>(b) & 15U];
  }
  return out;
}

inline std::array<std::byte, 16> sixteen(unsigned first) {
  std::array<std::byte, 16> out;
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::byte>(first + i);
  return out;
}
inline ClientRandom random() { return sixteen(0xA0); }
inline Cookie cookie() { return sixteen(0xC0); }

inline DeviceState state() {
  return {.tick = 1000,
          .sampled = PeerTime{Duration{1'000'000'000}},
          .position = {0.01, 0, -0.02},
          .velocity = {0.5, 0, 0},
          .force_applied = {-2, 0, 0},
          .energy = 0.25,
          .permitted_force = 8,
          .reasons = 3,
          .force_sequence = 99,
          .force_age = Duration{1'500'000},
          .mode = Mode::kActive};
}

inline ForceCommand force() {
  LocalModel wall{.at = {0.01, 0, 0}, .stiffness = Mat3::Zero()};
  wall.stiffness(0, 0) = 2000;
  return {.sequence = 100,
          .based_on_tick = 1000,
          .force = {-2, 0, 0},
          .model = wall,
          .valid_for = std::chrono::milliseconds(20)};
}

/// All fields are set. The tool is 2 mm deep in a surface with the normal −x, with a table for other depths.
inline ForceCommand force_with_all() {
  ForceCommand all = force();
  all.sequence = 101;
  all.model->valid_radius = 0.0025;
  all.model->contact =
      Contact{.normal = {-1, 0, 0},
              .gap = -0.002,
              .table = ForceTable{.first = -0.002, .step = 0.001, .size = 4, .force = {0, 0.75, 2, 3.5}}};
  all.topology_changed = true;
  all.error = 0.125;
  return all;
}

/// This uses the second solver path of its Hello.
inline ForceCommand force_with_way() {
  ForceCommand command = force();
  command.sequence = 102;
  command.model.reset();
  command.error = 0.125;
  command.way = 2;
  return command;
}

inline Control state_deadband() {
  return {.id = 9,
          .request = SetStateDeadband{.share = 0.1, .floor = 0.001, .max_silence = std::chrono::milliseconds(20)}};
}

inline LinkReport report() {
  return {.number = 3,
          .until = PeerTime{Duration{1'000'000'000}},
          .span = Duration{1'000'000'000},
          .forces = 97,
          .late_server = 0,
          .late_network = 2,
          .late_engine = 1,
          .worst_late = Duration{75'000'000},
          .longest_gap = Duration{90'000'000},
          .round_trip = Delays{Duration{41'000'000}, Duration{131'000'000}},
          .to_server = Delays{Duration{20'500'000}, Duration{110'000'000}},
          .to_client = Delays{Duration{20'500'000}, Duration{22'000'000}},
          .clock_offset = Duration{-5'000'000},
          .clock_drift_ppm = 16,
          .clock_error = Duration{250'000},
          .received = 3000,
          .lost = 12,
          .reordered = 1,
          .duplicated = 0,
          .words = "forces were late 3 times, by up to 75 ms: the network (round trip 131 ms, usually 41 ms)"};
}

// This is sent to an observer with the feature "diagnostics".

/// A wall along x demands four times the permitted force.
inline DeviceState state_with_wanted() {
  DeviceState diagnosed = state();
  diagnosed.force_wanted = Vec3(-8, 0, 0.5);
  diagnosed.stiffness_wanted = Vec3(800, 0, 0).asDiagonal();
  return diagnosed;
}

/// The device was armed and has tripped. Three steps were not counted.
inline DeviceReport device_report() {
  DeviceReport report{.number = 7,
                      .until = PeerTime{Duration{1'000'000'000}},
                      .span = Duration{1'000'000'000},
                      .device = 1,
                      .steps = 990,
                      .missed = 10,
                      .overruns = 2,
                      .unseen = 1};
  report.lateness[0] = 3;
  report.lateness[6] = 981;  // up to 64 µs
  report.lateness[13] = 3;   // up to 8.2 ms
  report.safety = Safety::kFault;
  report.fault = "the handle was faster than a hand";
  report.degraded = "the log thread does not follow";
  return report;
}

inline PeerReport peer_report() {
  return {.device = 1, .channel = 1, .name = "wall", .state_one_in = 4, .forces_refused = true, .link = report()};
}

/// The engine reports the accuracy of its forces.
inline PeerReport peer_report_with_way() {
  PeerReport told = peer_report();
  told.error = 0.125;
  told.way = "near";
  return told;
}

inline Hello hello() {
  return {.version_min = 1, .version_max = 1, .role = Role::kController, .name = "wall", .features = {"local-model"}};
}

inline Welcome welcome() {
  return {.version = 1,
          .features = {"local-model"},
          .role = Role::kController,
          .device_name = "simulated",
          .max_force = 8,
          .position_resolution = 0,
          .loop_hz = 1000,
          .timeout = std::chrono::seconds(2),
          .server = "tendond"};
}

// There are two devices, and the second one has two channels.

/// Observes the first device and claims the channel "tissue" of the second one.
inline Hello hello_with_claims() {
  Hello hello = examples::hello();
  hello.features.emplace_back(kFeatureChannels);
  hello.claims = {{.device = {}, .channel = {}, .role = Role::kObserver},
                  {.device = "right", .channel = "tissue", .role = Role::kController}};
  return hello;
}

/// An engine that has two solver paths and names the path of each force.
inline Hello hello_with_ways() {
  Hello hello = examples::hello();
  hello.features.emplace_back(kFeatureWays);
  hello.ways = {"tabulated", "near"};
  return hello;
}

inline Welcome welcome_with_grants() {
  Welcome welcome = examples::welcome();
  welcome.features.emplace_back(kFeatureChannels);
  welcome.grants = {{.device = 0, .channel = 0, .role = Role::kObserver},
                    {.device = 1, .channel = 1, .role = Role::kController}};
  return welcome;
}

inline DeviceState state_of_the_second_device() {
  DeviceState second = state();
  second.tick = 2000;
  second.device = 1;
  second.channel = 1;
  return second;
}

inline ForceCommand force_to_a_channel() {
  ForceCommand command = force();
  command.model.reset();
  command.device = 1;
  command.channel = 1;
  return command;
}

inline DeviceDescription description() {
  return {.device = 1,
          .name = "right",
          .model = "simulated",
          .position_dof = 3,
          .force_dof = 3,
          .workspace = DeviceDescription::Box{.min = {-0.08, -0.06, -0.035}, .max = {0.08, 0.06, 0.035}},
          .max_force = 8,
          .continuous_force = 1.75,
          .max_stiffness = 2000,
          .position_resolution = 0.000055,
          .loop_hz = 1000,
          .channels = {{.name = "guidance", .rule = ChannelRule::kSum, .lease = {}, .holder = {}},
                       {.name = "tissue",
                        .rule = ChannelRule::kPriority,
                        .lease = std::chrono::milliseconds(500),
                        .holder = "wall"}}};
}

// This is sent to a client with the feature "handle".

inline DeviceState state_with_buttons() {
  DeviceState state = examples::state();
  state.buttons = 0b1001;
  return state;
}

/// All parts are set. The handle is moving, and it is rotated by 106° about y. The fingers close on a soft object.
inline DeviceState state_with_handle() {
  DeviceState state = examples::state();
  state.buttons = 1;
  state.turning = Turning{.orientation = {.w = 0.6, .x = 0, .y = 0.8, .z = 0}, .angular_velocity = {0, 1.5, 0}};
  state.torque_applied = Vec3(0, -0.0625, 0);
  state.grip = Grip{.opening = 0.25, .velocity = -0.5};
  state.grip_applied = 0.75;
  state.hand_force = Vec3(1.5, 0, -0.25);
  return state;
}

/// This is sent to a client with the feature "joints". Two of the three joints are moving.
inline DeviceState state_with_joints() {
  DeviceState state = examples::state();
  state.joints = Joints::three({0.5, -0.25, 1.5}, {0.125, 0, -2});
  return state;
}

/// This is a detent about one axis, with soft fingers.
inline ForceCommand force_with_torque() {
  ForceCommand command = force();
  command.sequence = 102;
  command.torque = RemoteTorque{.torque = {0, -0.0625, 0}, .model = RotationModel{}};
  command.torque->model->at = {.w = 0.6, .x = 0, .y = 0.8, .z = 0};
  command.torque->model->stiffness(1, 1) = 0.25;
  command.grip_force = 0.75;
  return command;
}

/// The handle has the axes of a WoodenHaptics, the buttons of a Falcon, and motors for all degrees of freedom.
inline HandleDescription handle_description() {
  return {.device = 1,
          .operator_from_device = Quat{.w = 0.5, .x = -0.5, .y = 0.5, .z = 0.5},
          .buttons = {"right", "forward", "centre", "left"},
          .orientation_measured = true,
          .max_torque = 0.125,
          .gripper_open = 0.5,
          .max_gripper_force = 8,
          .group = "arms",
          .hand = Hand::kRight};
}

/// This is sent to a client with the feature "joints". The device is a Phantom.
inline ControlAck joints_described(std::uint32_t id) {
  ControlAck ack{.id = id, .code = Code::kOk, .detail = {}};
  ack.handle = HandleDescription{.device = 1, .joints = {"turntable", "upper arm", "forearm"}};
  return ack;
}

/// This is sent to a client with the feature "outputs".
inline ControlAck outputs_described(std::uint32_t id) {
  ControlAck ack{.id = id, .code = Code::kOk, .detail = {}};
  ack.handle = HandleDescription{.device = 1};
  ack.handle->outputs = {{.name = "ring", .kind = OutputKind::kLamp}, {.name = "tip", .kind = OutputKind::kVibration}};
  return ack;
}

inline SetOutput lamp() { return {.device = 1, .output = 0, .setting = LampColour{0xFF8000}}; }

inline SetOutput vibration() {
  const Vibration pulse{.amplitude = 0.5, .frequency = 200, .duration = std::chrono::milliseconds(40)};
  return {.device = 1, .output = 1, .setting = pulse};
}

// This is sent between peers with the feature "teleoperation".

/// The leader pulls by 2 mm. There is no measured contact.
inline PortFrame port() {
  PortFrame port;
  port.device = 1;
  port.channel = 1;
  port.epoch = 5;
  port.sequence = 1000;
  port.answers_epoch = 3;
  port.answers = 960;
  port.time = Duration{1'000'000'000};
  port.round_trip = std::chrono::milliseconds(40);
  port.phase = PortPhase::kEngaged;
  port.engagement = 2;
  port.buttons = 0b10;
  port.position = {0.01, 0, -0.02};
  port.velocity = {0.5, 0, 0};
  port.force = {-0.75, 0, 0};
  port.account = 0.125;
  port.need = 0.0625;
  port.given = 1.5;
  port.taken = 0.5;
  return port;
}

/// This is a follower that presses with its tool. It does not have an energy tank.
inline PortFrame port_in_contact() {
  PortFrame port = examples::port();
  port.contact_force = Vec3(-2, 0, 0.5);
  port.account = -0.25;
  port.need = port.given = port.taken = 0;
  return port;
}

/// A follower that uses one of the other methods. It has found a floor, and it has sent waves.
inline PortFrame port_by_model() {
  PortFrame port = port_in_contact();
  port.surface = {.normal = {0, 0.6, 0.8}, .offset = -0.125, .stiffness = 500};
  port.wave_integral = {0.25, 0, -1};
  port.wave_energy = 0.5;
  return port;
}

/// The scale for the motion of the other end is 1/2, and the rotation is 106° about y.
inline Couple couple() {
  return {.device = 1,
          .channel = 1,
          .role = PortRole::kFollower,
          .method = CouplingMethod::kPositionForce,
          .position_scale = 0.5,
          .force_scale = 2,
          .rotation = {.w = 0.6, .x = 0, .y = 0.8, .z = 0},
          .axes = 5,
          .stiffness = 400,
          .mutual_damping = 2,
          .damping = 4,
          .adapt_to_delay = true,
          .purse = true,
          .period = std::chrono::milliseconds(1)};
}

/// This is sent to an observer. No single end can send these fields of a whole aligned handle together.
inline PortFrame port_with_all() {
  PortFrame port = port_by_model();
  port.phase = PortPhase::kAligning;
  port.turn = {.turn = {.w = 0.6, .x = 0, .y = 0.8, .z = 0}, .angular_velocity = {0, 0.25, 0}, .torque = {0, -0.5, 0}};
  port.grip = {
      .opening = 0.0625, .velocity = -0.125, .force = 2, .account = -0.25, .need = 0.5, .given = 0.75, .taken = 1.25};
  port.energy_in = 3.5;
  port.share = 0.25;
  port.position_scale = 0.5;
  port.force_scale = 2;
  port.of_peer = true;
  return port;
}

/// Two whole handles with an absolute map in rate control.
inline Couple couple_with_all() {
  Couple couple = examples::couple();
  couple.method = CouplingMethod::kRate;
  couple.absolute = true;
  couple.turn_stiffness = 0.5;
  couple.turn_damping = 0.0625;
  couple.grip_stiffness = 200;
  couple.grip_damping = 1.5;
  couple.drift_rate = 0.25;
  couple.rate = {.dead_zone = 0.125, .gain = 2.5, .max_speed = 0.75};
  return couple;
}

inline SetScale set_scale() { return {.device = 1, .position_scale = 0.25, .force_scale = 4}; }

inline SetShare set_share() { return {.device = 1, .channel = 1, .share = 0.75}; }

inline DeviceState state_with_field() {
  DeviceState state = examples::state();
  state.field = FieldState{.generation = 3, .depth = 0.0015, .proxy = {0.0115, 0, -0.02}};
  return state;
}
inline ForceCommand truth() {
  ForceCommand force = examples::force();
  force.model.reset();
  force.field = 3;
  return force;
}

inline ControlAck handle_described(std::uint32_t id) {
  ControlAck ack{.id = id, .code = Code::kOk, .detail = {}};
  ack.handle = handle_description();
  return ack;
}

inline ControlAck described(std::uint32_t id) {
  return {.id = id, .code = Code::kOk, .detail = {}, .wait = {}, .device = description()};
}
inline ControlAck busy(std::uint32_t id) {
  return {.id = id, .code = Code::kBusy, .detail = "\"wall\" holds it", .wait = std::chrono::milliseconds(180)};
}

inline Refused refused() {
  return {.code = Code::kBusy, .detail = "one controller", .version_min = 1, .version_max = 1};
}

inline OutgoingEcho echo() {
  return {.sent = PeerTime{Duration{5'000'000}},
          .received = LocalTime{Duration{999'000'000}},
          .packet_number = 3,
          .received_mask = 0b101};
}

template <class... Frames>
Bytes data(std::uint64_t packet_number, const std::optional<OutgoingEcho>& with_echo, const Frames&... frames) {
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(buffer, {.connection_id = kConnection, .packet_number = packet_number},
               LocalTime{Duration{1'000'100'000}}, with_echo);
  (writer.add(frames), ...);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())};
}

/// Sent to a client with the feature "state-columns": the first and the third device at one step, with all columns.
/// Every value is exact in single precision.
inline std::array<DeviceState, 2> states_in_columns() {
  DeviceState first = state();
  first.channel = 1;
  DeviceState third = state();
  third.device = 2;
  third.position = {0.03, -0.01, 0.02};
  third.velocity = {0, 0.25, -0.5};
  third.force_applied = {0, 0, 0.5};
  third.energy = 0.125;
  third.permitted_force = std::numeric_limits<double>::infinity();
  third.force_sequence = 100;
  third.mode = Mode::kHolding;
  third.buttons = 1;
  return {first, third};
}
inline Bytes data_in_columns(std::uint64_t packet_number, std::span<const DeviceState> states) {
  std::array<std::byte, kMaxDatagram> buffer;
  DataWriter writer;
  writer.begin(buffer, {.connection_id = kConnection, .packet_number = packet_number},
               LocalTime{Duration{1'000'100'000}}, {});
  std::vector<const DeviceState*> each;
  for (const DeviceState& state : states) each.push_back(&state);
  writer.add(each);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())};
}

template <class Handshake>
Bytes encoded(const Handshake& message) {
  std::array<std::byte, kMaxDatagram> buffer;
  const std::size_t size = encode(message, buffer);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
}

/// Suite 0.
inline Bytes hello_datagram(const Hello& hello) {
  return encoded(HelloDatagram{.random = random(), .cookie = {}, .body = write_body(hello)});
}
inline Bytes answer_datagram(std::uint32_t connection_id, const Answer& answer) {
  return encoded(AnswerDatagram{.connection_id = connection_id, .random = random(), .body = write_body(answer)});
}

struct Named {
  std::string name;
  Bytes bytes;
};

inline std::vector<Named> datagrams() {
  const Control control{.id = 7, .request = SetStateRate{.hz = 500}};
  const ControlAck ack{.id = 7, .code = Code::kOk, .detail = "500 Hz"};
  const Bye bye{.code = Code::kShutdown, .reason = "SIGTERM"};
  return {
      {"hello", hello_datagram(hello())},
      {"retry", encoded(RetryDatagram{.random = random(), .cookie = cookie()})},
      {"welcome", answer_datagram(kConnection, welcome())},
      {"refused", answer_datagram(0, refused())},
      {"keep-alive", data(0, {})},
      {"state", data(42, echo(), state())},
      {"force", data(43, echo(), force())},
      {"control", data(44, {}, control)},
      {"control-ack", data(45, {}, ack)},
      {"bye", data(46, {}, bye)},
      {"hello-claims", hello_datagram(hello_with_claims())},
      {"welcome-grants", answer_datagram(kConnection, welcome_with_grants())},
      {"states", data(47, {}, state(), state_of_the_second_device())},
      {"force-channel", data(48, {}, force_to_a_channel())},
      {"control-rate-device", data(49, {}, Control{.id = 8, .request = SetStateRate{.hz = 250, .device = 1}})},
      {"control-rearm-device", data(50, {}, Control{.id = 9, .request = Rearm{.device = 1}})},
      {"control-describe", data(51, {}, Control{.id = 10, .request = Describe{.device = 1}})},
      {"control-ack-description", data(52, {}, described(10))},
      {"control-take-lease", data(53, {}, Control{.id = 11, .request = TakeLease{.device = 1, .channel = 1}})},
      {"control-ack-busy", data(54, {}, busy(11))},
      {"control-give-lease", data(55, {}, Control{.id = 12, .request = GiveLease{.device = 1, .channel = 1}})},
      {"control-lease-lost",
       data(56, {}, Control{.id = 1, .request = LeaseLost{.device = 1, .channel = 1, .to = "wall"}})},
      {"report", data(57, {}, report())},
      {"state-deadband", data(58, {}, state_deadband())},
      {"force-with-all", data(59, {}, force_with_all())},
      {"state-wanted", data(60, {}, state_with_wanted())},
      {"device-report", data(61, {}, device_report())},
      {"peer-report", data(62, {}, peer_report())},
      {"control-disarm", data(63, {}, Control{.id = 13, .request = Disarm{.device = 1}})},
      {"state-buttons", data(64, {}, state_with_buttons())},
      {"control-describe-handle", data(65, {}, Control{.id = 14, .request = Describe{.device = 1, .handle = true}})},
      {"control-ack-handle", data(66, {}, handle_described(14))},
      {"state-handle", data(67, {}, state_with_handle())},
      {"force-torque", data(68, {}, force_with_torque())},
      {"state-joints", data(69, {}, state_with_joints())},
      {"control-ack-joints", data(70, {}, joints_described(14))},
      {"port", data(71, {}, port())},
      {"port-contact", data(72, {}, port_in_contact())},
      {"port-model", data(90, {}, port_by_model())},
      {"control-couple", data(73, {}, Control{.id = 15, .request = couple()})},
      {"control-engage", data(74, {}, Control{.id = 16, .request = Engage{.device = 1}})},
      {"control-disengage", data(75, {}, Control{.id = 17, .request = Disengage{.device = 1}})},
      {"control-set-output-lamp", data(76, {}, Control{.id = 18, .request = lamp()})},
      {"control-set-output-vibration", data(77, {}, Control{.id = 19, .request = vibration()})},
      {"control-ack-outputs", data(78, {}, outputs_described(14))},
      {"port-all", data(91, {}, port_with_all())},
      {"control-couple-all", data(92, {}, Control{.id = 20, .request = couple_with_all()})},
      {"control-set-scale", data(93, {}, Control{.id = 21, .request = set_scale()})},
      {"control-set-share", data(94, {}, Control{.id = 22, .request = set_share()})},
      {"state-columns", data_in_columns(95, states_in_columns())},
      {"hello-ways", hello_datagram(hello_with_ways())},
      {"force-way", data(96, {}, force_with_way())},
      {"peer-report-way", data(97, {}, peer_report_with_way())},
      {"control-offer-field", data(98, {}, Control{.id = 23, .request = offer_field()})},
      {"control-use-field", data(99, {}, Control{.id = 24, .request = use_field()})},
      {"control-drop-field", data(100, {}, Control{.id = 25, .request = drop_field()})},
      {"field-brick", data(101, {}, field_brick())},
      {"field-status", data(102, {}, field_status())},
      {"field-pose", data(103, {}, field_pose())},
      {"state-field", data(104, {}, state_with_field())},
      {"force-truth", data(105, {}, truth())},
  };
}

}  // namespace tendon::examples
