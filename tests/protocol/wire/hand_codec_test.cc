// SPDX-License-Identifier: Apache-2.0
//
// States and forces by hand are those of protobuf: the same bytes out, and of any bytes the same values in. Protobuf is
// the reference: `add_by_protobuf`, `read_by_protobuf`, and its own view of what was written. The fuzz target `payload`
// compares the two on bytes that nobody planned.
#include "protocol/wire/hand_codec.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "tendon.pb.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/raw_protobuf.h"
#include "tests/protocol/wire/read_back.h"
#include "tests/protocol/wire/told.h"
#include "tests/support/dice.h"

namespace tendon::hand_codec_test {
namespace {

using Bytes = std::vector<std::byte>;

constexpr int kDatagrams = 100'000;  ///< drawn by each of the tests that draw any

/// A number as engines and devices send them, and sometimes one that is hard to get right.
double a_number(Dice& dice) {
  constexpr std::array kHard = {0.0,
                                -0.0,
                                limits::kMaxValue,
                                -limits::kMaxValue,
                                std::numeric_limits<double>::min(),
                                std::numeric_limits<double>::denorm_min()};
  return dice.chance(0.2) ? kHard[dice.bits() % kHard.size()] : dice.within(-10, 10);
}
Vec3 a_vector(Dice& dice) { return {a_number(dice), a_number(dice), a_number(dice)}; }
/// Of any length as a varint.
std::uint64_t a_count(Dice& dice) { return dice.chance(0.1) ? 0 : dice.bits() >> (dice.bits() % 64); }
Duration a_time(Dice& dice) {
  const auto ns = static_cast<std::int64_t>(a_count(dice) >> 4U);
  return Duration(dice.chance(0.2) ? -ns : ns);
}
Quat a_rotation(Dice& dice) {
  if (dice.chance(0.2)) return {.w = 0, .x = 1, .y = 0, .z = 0};
  return unit({dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1), dice.within(0.1, 1)});
}
Mat3 a_stiffness(Dice& dice) {
  if (dice.chance(0.3)) return a_number(dice) * Mat3::Identity();
  if (dice.chance(0.4)) return a_vector(dice).asDiagonal();
  Mat3 stiffness;
  stiffness << a_vector(dice), a_vector(dice), a_vector(dice);
  return stiffness;
}

DeviceState a_state(Dice& dice) {
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

ForceCommand a_force(Dice& dice) {
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

/// Spoils one number of it, as a broken engine or device does.
void spoil(Dice& dice, DeviceState& state) {
  constexpr std::array kBad = {kNan, kInf, -kInf, 2 * limits::kMaxValue};
  const double bad = kBad[dice.bits() % kBad.size()];
  const std::array<double*, 4> places = {&state.position.y(), &state.velocity.z(), &state.energy,
                                         &state.permitted_force};
  *places[dice.bits() % places.size()] = bad;
  if (dice.chance(0.2)) state.mode = static_cast<Mode>(dice.bits() % 256);
  if (dice.chance(0.2)) state.device = static_cast<std::uint32_t>(dice.bits());
  if (dice.chance(0.2)) state.force_age = -state.force_age;
}
void spoil(Dice& dice, ForceCommand& command) {
  constexpr std::array kBad = {kNan, kInf, -kInf, -2 * limits::kMaxValue};
  command.force.x() = kBad[dice.bits() % kBad.size()];
  if (dice.chance(0.2)) command.sequence = 0;
  if (dice.chance(0.2)) command.valid_for = -command.valid_for;
  if (dice.chance(0.2)) command.channel = static_cast<std::uint32_t>(dice.bits());
  if (command.model && dice.chance(0.5)) command.model->stiffness(1, 2) = kNan;
}

std::optional<OutgoingEcho> an_echo(Dice& dice) {
  if (dice.chance(0.1)) return {};
  return OutgoingEcho{.sent = PeerTime(a_time(dice)),
                      .received = LocalTime(a_time(dice)),
                      .packet_number = a_count(dice),
                      .received_mask = static_cast<std::uint32_t>(a_count(dice))};
}

/// States as a session puts them into columns; `many`: as long as can be, else one, two or all devices.
std::vector<DeviceState> states_of_a_step(Dice& dice, double spoilt) {
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

/// A datagram of a few states or forces; `spoilt`: with the share of impossible ones. By hand and by protobuf.
struct Written {
  Bytes by_hand;
  Bytes by_protobuf;
};
Written a_datagram(Dice& dice, double spoilt) {
  const auto echo = an_echo(dice);
  const LocalTime sent(a_time(dice));
  std::vector<std::variant<DeviceState, ForceCommand>> frames;
  const std::vector<DeviceState> together =
      dice.chance(0.2) ? states_of_a_step(dice, 0.1 * spoilt) : std::vector<DeviceState>();
  for (std::uint64_t left = dice.chance(0.8) ? 1 : dice.bits() % 9; left > 0; --left) {
    if (dice.chance(0.5)) {
      frames.emplace_back(a_state(dice));
    } else {
      frames.emplace_back(a_force(dice));
    }
    std::visit([&](auto& frame) { dice.chance(spoilt) ? spoil(dice, frame) : void(); }, frames.back());
  }
  std::vector<const DeviceState*> columns;
  for (const DeviceState& state : together) columns.push_back(&state);
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  const auto write = [&](auto add) {
    writer.begin(buffer, {.connection_id = 7}, sent, echo);
    if (!columns.empty()) add(std::span<const DeviceState* const>(columns));
    for (const auto& frame : frames) std::visit(add, frame);
    return Bytes(buffer.begin() + kHeaderSize, buffer.begin() + static_cast<std::ptrdiff_t>(writer.size()));
  };
  return {write([&](const auto& frame) { writer.add(frame); }),
          write([&](const auto& frame) { writer.add_by_protobuf(frame); })};
}

/// All of a state, bit for bit.
Bytes told_of(const DeviceState& state) {
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  writer.begin(buffer, {}, LocalTime{}, {});
  writer.add_by_protobuf(state);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(writer.size())};
}

/// `read` and `read_by_protobuf` of the same bytes. Each reader has been used for other bytes before.
class BothReaders {
 public:
  ::testing::AssertionResult agree(const Bytes& body) {
    const std::string one = told(reader_.read(body));
    const std::string other = told(reference_.read_by_protobuf(body));
    if (one == other) return ::testing::AssertionSuccess();
    std::string hex;
    for (const std::byte byte : body) {
      constexpr const char* kDigits = "0123456789abcdef";
      hex += {kDigits[std::to_integer<unsigned>(byte) >> 4U], kDigits[std::to_integer<unsigned>(byte) & 15U], ' '};
    }
    return ::testing::AssertionFailure() << "of " << hex;
  }

 private:
  DataReader reader_;
  DataReader reference_;
};

TEST(HandCodec, WritesTheBytesOfProtobuf) {
  Dice dice(1);
  for (int i = 0; i < kDatagrams; ++i) {
    const Written written = a_datagram(dice, 0.1);
    ASSERT_EQ(written.by_hand, written.by_protobuf) << "datagram " << i;
    if (i % 10 != 0) continue;
    v1::Datagram parsed;
    ASSERT_TRUE(parsed.ParseFromArray(written.by_hand.data(), static_cast<int>(written.by_hand.size()))) << i;
    const std::string again = parsed.SerializeAsString();  // the head, too
    ASSERT_EQ(again.size(), written.by_hand.size()) << i;
    ASSERT_TRUE(std::equal(again.begin(), again.end(), reinterpret_cast<const char*>(written.by_hand.data()))) << i;
  }
}

TEST(HandCodec, ReadsTheValuesOfProtobuf) {
  Dice dice(2);
  BothReaders readers;
  for (int i = 0; i < kDatagrams; ++i) ASSERT_TRUE(readers.agree(a_datagram(dice, 0.1).by_hand)) << "datagram " << i;
}

/// What a network, an old or a new peer, or an attacker may make of a datagram.
void distort(Dice& dice, Bytes& body) {
  const auto somewhere = [&] { return body.begin() + static_cast<std::ptrdiff_t>(dice.bits() % (body.size() + 1)); };
  switch (body.empty() ? 1 : dice.bits() % 7) {
    case 0:  // damage
      body[dice.bits() % body.size()] = static_cast<std::byte>(dice.bits());
      break;
    case 1:  // a byte more
      body.insert(somewhere(), static_cast<std::byte>(dice.bits()));
      break;
    case 2:  // one less
      body.erase(body.begin() + static_cast<std::ptrdiff_t>(dice.bits() % body.size()));
      break;
    case 3:  // cut
      body.resize(dice.bits() % body.size());
      break;
    case 4: {  // some of it twice
      const Bytes copy(body.begin(), somewhere());
      body.insert(body.end(), copy.begin(), copy.end());
      break;
    }
    case 5: {  // a number in a longer form than it needs
      auto& byte = body[dice.bits() % body.size()];
      if ((byte & std::byte{0x80}) != std::byte{0}) break;
      byte |= std::byte{0x80};
      body.insert(body.begin() + (&byte - body.data()) + 1, std::byte{0});
      break;
    }
    default:  // one bit: another field, another wire type, another length
      body[dice.bits() % body.size()] ^= static_cast<std::byte>(1U << (dice.bits() % 8));
  }
}

TEST(HandCodec, ReadsOfDistortedBytesWhatProtobufDoes) {
  Dice dice(3);
  BothReaders readers;
  for (int i = 0; i < kDatagrams; ++i) {
    Bytes body = a_datagram(dice, 0.05).by_hand;
    for (std::uint64_t left = 1 + dice.bits() % 3; left > 0; --left) distort(dice, body);
    ASSERT_TRUE(readers.agree(body)) << "datagram " << i;
  }
}

TEST(HandCodec, ReadsByHandWhateverItWrites) {
  Dice dice(4);
  DataContent content;
  const auto is_by_hand = [&](const Bytes& datagram) { return wire::read_by_hand(body(datagram), content); };
  for (int i = 0; i < 1000; ++i) {
    DeviceState state = a_state(dice);
    state.joints.reset();
    state.stiffness_wanted.reset();
    ASSERT_TRUE(is_by_hand(examples::data(1, {}, state))) << i;
    ForceCommand command = a_force(dice);
    if (command.model) command.model->contact.reset();
    ASSERT_TRUE(is_by_hand(examples::data(1, {}, command))) << i;
  }
  EXPECT_TRUE(is_by_hand(examples::data(1, {}, examples::state())));
  EXPECT_TRUE(is_by_hand(examples::data(1, {}, examples::force())));
}

/// One number in a longer form than it needs, and so on: what WIRE.md allows and our own writers never do.
TEST(HandCodec, LeavesToProtobufWhatNoWriterOfOursDoes) {
  const auto frame = [](const RawProtobuf& state) { return datagram_with(RawProtobuf().message(1, state)); };
  const RawProtobuf usual = RawProtobuf().varint(1, 5).varint(11, 2);
  const std::vector<std::pair<std::string, Bytes>> cases = {
      {"fields in another order", frame(RawProtobuf().varint(11, 2).varint(1, 5))},
      {"a field twice: the last one counts", frame(RawProtobuf().varint(1, 5).varint(1, 6).varint(11, 2))},
      {"a vector twice: merged", frame(RawProtobuf()
                                           .message(3, RawProtobuf().fixed64(1, 1))
                                           .message(3, RawProtobuf().fixed64(2, 1))
                                           .varint(11, 2))},
      {"an unknown field", frame(RawProtobuf().varint(1, 5).varint(11, 2).varint(999, 1))},
      {"a number as another wire type", frame(RawProtobuf().fixed64(1, 5).varint(11, 2))},
      {"a speed of turning without an orientation", frame(RawProtobuf().varint(11, 2).message(16, RawProtobuf()))},
      {"a mode that is none", frame(RawProtobuf().varint(1, 5).varint(11, 7))},
      {"a mode beyond a byte, whose last byte is one", frame(RawProtobuf().varint(1, 5).varint(11, 258))},
      {"a device beyond 32 bits, whose last 32 are one", frame(RawProtobuf().varint(11, 2).varint(12, 1ULL << 32U))},
      {"a frame of two kinds: the last one counts",
       datagram_with(RawProtobuf().message(1, usual).message(2, RawProtobuf().varint(1, 1).varint(5, 1000)))},
      {"an empty frame", datagram_with(RawProtobuf())},
      {"a request", examples::data(1, {}, examples::state_deadband())},
      {"a model of rotation without a torque", datagram_with(raw_force([](RawProtobuf& force) {
         force.message(14, RawProtobuf().message(1, RawProtobuf().fixed64(1, 0x3FF0000000000000)).packed(2, {1.0}));
       }))},
  };
  BothReaders readers;
  for (const auto& [what, bytes] : cases) {
    const Bytes whole = what == "a request" ? Bytes(bytes.begin() + kHeaderSize, bytes.end()) : bytes;
    DataContent content;
    EXPECT_FALSE(wire::read_by_hand(whole, content)) << what;
    EXPECT_TRUE(readers.agree(whole)) << what;
  }
  DataContent content;
  EXPECT_TRUE(wire::read_by_hand(frame(usual), content)) << "the others fail for their own reason";
  // The tick, 05, as 85 00: the lengths of state, frame and all grow by one.
  Bytes longer = frame(usual);
  const auto tick = std::find(longer.begin() + 9, longer.end(), std::byte{5});
  ASSERT_NE(tick, longer.end());
  *tick |= std::byte{0x80};
  longer.insert(tick + 1, std::byte{0});
  longer[10] = static_cast<std::byte>(std::to_integer<int>(longer[10]) + 1);
  longer[12] = static_cast<std::byte>(std::to_integer<int>(longer[12]) + 1);
  EXPECT_FALSE(wire::read_by_hand(longer, content)) << "a number in a longer form than it needs";
  EXPECT_TRUE(readers.agree(longer));
  DataReader reader;
  ASSERT_NE(reader.read(longer), nullptr);
  EXPECT_EQ(std::get<DeviceState>(reader.read(longer)->frames.at(0)).tick, 5U);
}

TEST(HandCodec, SixteenDevicesThatMoveOnAllAxesFitOneSealedDatagram) {
  Dice dice(5);
  std::vector<DeviceState> states(limits::kMaxDevices, examples::state());
  for (std::uint32_t device = 0; device < states.size(); ++device) {
    DeviceState& state = states[device];
    state.device = device;
    state.tick = 100'000'000;  // a day at 1 kHz
    state.position = {dice.within(-0.1, 0.1), dice.within(-0.1, 0.1), dice.within(-0.1, 0.1)};
    state.velocity = {dice.within(-1, 1), dice.within(-1, 1), dice.within(-1, 1)};
    state.force_applied = {dice.within(-8, 8), dice.within(-8, 8), dice.within(-8, 8)};
    state.force_sequence = state.tick;
    state.force_age = std::chrono::milliseconds(20);
  }
  std::vector<const DeviceState*> each;
  for (const DeviceState& state : states) each.push_back(&state);
  const OutgoingEcho echo{PeerTime(std::chrono::hours(24)), LocalTime(std::chrono::hours(24)), 100'000'000, ~0U};
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  const auto room = std::span(buffer).first(kMaxDatagram - 16);  // a seal's tag
  writer.begin(room, {.packet_number = 100'000'000}, LocalTime(std::chrono::hours(24)), echo);
  EXPECT_EQ(writer.add(std::span<const DeviceState* const>(each)), each.size());
  const auto bytes = writer.size();
  std::cout << "16 states in columns: " << bytes + 16 << " bytes sealed\n";
  std::size_t plain = 0;
  for (std::size_t i = 0; i < states.size(); ++plain) {
    writer.begin(room, {.packet_number = 100'000'000}, LocalTime(std::chrono::hours(24)), echo);
    while (i < states.size() && writer.add(states[i])) ++i;
  }
  EXPECT_EQ(plain, 3U) << "else columns save nothing";
}

TEST(HandCodec, ColumnsKeepAllButThePrecisionThatTheyNameAndThePosition) {
  Dice dice(6);
  DataReader reader;
  for (int i = 0; i < 1000; ++i) {
    std::vector<DeviceState> states = states_of_a_step(dice, 0);
    const Bytes datagram = examples::data_in_columns(1, states);
    const DataContent* content = read(reader, datagram);
    ASSERT_NE(content, nullptr);
    ASSERT_GT(content->frames.size(), 0U);
    for (std::size_t k = 0; k < content->frames.size(); ++k) {
      round_to_columns(states[k]);
      EXPECT_TRUE(told_of(std::get<DeviceState>(content->frames[k])) == told_of(states[k])) << i << " " << k;
    }
    DataContent by_hand;
    EXPECT_TRUE(wire::read_by_hand(body(datagram), by_hand));
  }
}

TEST(HandCodec, AStateWithAPartThatColumnsCannotSayStaysWhole) {
  const std::vector<std::function<void(DeviceState&)>> parts = {
      [](DeviceState& state) { state.force_wanted = Vec3::Zero(); },
      [](DeviceState& state) { state.stiffness_wanted = Mat3::Zero(); },
      [](DeviceState& state) { state.turning = Turning{}; },
      [](DeviceState& state) { state.torque_applied = Vec3::Zero(); },
      [](DeviceState& state) { state.grip = Grip{}; },
      [](DeviceState& state) { state.grip_applied = 0; },
      [](DeviceState& state) { state.hand_force = Vec3::Zero(); },
      [](DeviceState& state) { state.joints = Joints{}; },
  };
  DeviceState plain = examples::state();
  plain.buttons = 1;
  EXPECT_TRUE(fits_columns(plain));
  for (std::size_t i = 0; i < parts.size(); ++i) {
    DeviceState state = plain;
    parts[i](state);
    EXPECT_FALSE(fits_columns(state)) << i;
  }
}

/// One of a step's states that cannot be takes the others of its frame with it, and nothing else.
TEST(HandCodec, AColumnOfAnotherLengthOrAValueOutOfBoundsDropsTheFrame) {
  const auto columns = [](const std::function<void(v1::DeviceStates&)>& change) {
    const Bytes datagram = examples::data_in_columns(1, examples::states_in_columns());
    v1::Datagram parsed;
    EXPECT_TRUE(parsed.ParseFromArray(body(datagram).data(), static_cast<int>(body(datagram).size())));
    change(*parsed.mutable_frames(0)->mutable_states());
    parsed.add_frames()->mutable_state()->set_mode(v1::MODE_IDLE);
    const std::string bytes = parsed.SerializeAsString();
    const auto* const begin = reinterpret_cast<const std::byte*>(bytes.data());
    return Bytes(begin, begin + bytes.size());
  };
  const std::vector<std::pair<std::string, std::function<void(v1::DeviceStates&)>>> bad = {
      {"no device", [](v1::DeviceStates& s) { s.set_devices(0); }},
      {"a third device", [](v1::DeviceStates& s) { s.set_devices(7); }},
      {"device 16", [](v1::DeviceStates& s) { s.set_devices(1U << 16U | 1U); }},
      {"a position more", [](v1::DeviceStates& s) { s.add_position_m(0); }},
      {"no velocity", [](v1::DeviceStates& s) { s.clear_velocity_mps(); }},
      {"a force less", [](v1::DeviceStates& s) { s.mutable_force_applied_n()->RemoveLast(); }},
      {"no energy", [](v1::DeviceStates& s) { s.clear_energy_j(); }},
      {"no bound", [](v1::DeviceStates& s) { s.clear_permitted_force_n(); }},
      {"no mode", [](v1::DeviceStates& s) { s.clear_mode(); }},
      {"a reason less", [](v1::DeviceStates& s) { s.mutable_reasons()->RemoveLast(); }},
      {"a sequence more", [](v1::DeviceStates& s) { s.add_force_sequence(1); }},
      {"an age less", [](v1::DeviceStates& s) { s.mutable_force_age_ns()->RemoveLast(); }},
      {"a channel more", [](v1::DeviceStates& s) { s.add_channel(0); }},
      {"buttons of one", [](v1::DeviceStates& s) { s.mutable_buttons()->RemoveLast(); }},
      {"NaN", [](v1::DeviceStates& s) { s.set_velocity_mps(4, std::numeric_limits<float>::quiet_NaN()); }},
      {"a mode that is none", [](v1::DeviceStates& s) { s.set_mode(1, static_cast<v1::Mode>(7)); }},
      {"channel 8", [](v1::DeviceStates& s) { s.set_channel(1, 8); }},
      {"an age of more than 2^60", [](v1::DeviceStates& s) { s.set_force_age_ns(0, (1ULL << 60U) + 1); }},
  };
  BothReaders readers;
  DataReader reader;
  for (const auto& [what, change] : bad) {
    const Bytes bytes = columns(change);
    EXPECT_TRUE(readers.agree(bytes)) << what;
    const DataContent* content = reader.read(bytes);
    ASSERT_NE(content, nullptr) << what;
    EXPECT_EQ(content->invalid, 1U) << what;
    EXPECT_EQ(content->frames.size(), 1U) << what << ": the frame behind it";
  }
  const Bytes good = columns([](v1::DeviceStates&) {});
  ASSERT_NE(reader.read(good), nullptr);
  EXPECT_EQ(reader.read(good)->frames.size(), 3U);
}

TEST(HandCodec, ADatagramHasAtMostAsManyFramesAsProtobufTakes) {
  RawProtobuf datagram;
  BothReaders readers;
  DataContent content;
  for (int frames = 1; frames <= limits::kMaxFrames + 1; ++frames) {
    datagram.message(3, RawProtobuf().message(1, RawProtobuf().varint(11, 2)));
    EXPECT_EQ(wire::read_by_hand(datagram.bytes(), content), frames <= limits::kMaxFrames) << frames;
    EXPECT_TRUE(readers.agree(datagram.bytes())) << frames;
  }
}

TEST(HandCodec, NoFrameTakesMoreThanItSays) {
  const double number = 1.0 / 3;
  const Vec3 vector(number, number, number);
  const Mat3 matrix = Mat3::Constant(number);
  const std::uint64_t most = ~std::uint64_t{0};
  DeviceState state{.tick = most, .sampled = PeerTime(Duration(-1)), .position = vector, .velocity = vector};
  state.force_applied = vector;
  state.energy = state.permitted_force = number;
  state.reasons = state.buttons = state.device = state.channel = static_cast<std::uint32_t>(most);
  state.force_sequence = most;
  state.force_age = Duration(-1);
  state.mode = static_cast<Mode>(255);
  state.force_wanted = state.torque_applied = state.hand_force = vector;
  state.turning = Turning{{number, number, number, number}, vector};
  state.grip = Grip{number, number};
  state.grip_applied = number;
  ForceCommand command{.sequence = most, .based_on_tick = most, .force = vector};
  command.model = LocalModel{.at = vector, .stiffness = matrix, .valid_radius = number};
  command.valid_for = limits::kMaxValidFor;
  command.device = command.channel = static_cast<std::uint32_t>(most);
  command.topology_changed = true;
  command.error = command.grip_force = number;
  command.torque = RemoteTorque{vector, RotationModel{{number, number, number, number}, matrix}};
  std::array<std::uint8_t, 2 * wire::kMostFrame> place{};
  EXPECT_LE(wire::write_frame(place.data(), state), wire::kMostFrame);
  EXPECT_LE(wire::write_frame(place.data(), command), wire::kMostFrame);
  EXPECT_GT(wire::write_frame(place.data(), state), 300U) << "this is all that a state holds";
  EXPECT_GT(wire::write_frame(place.data(), command), 300U);
  const OutgoingEcho echo{PeerTime(Duration(-1)), LocalTime(Duration(-1)), most, static_cast<std::uint32_t>(most)};
  EXPECT_LE(wire::write_head(place.data(), LocalTime(Duration(-1)), echo), wire::kMostHead);
}

TEST(HandCodec, FillsADatagramToTheSameLastByteAsProtobuf) {
  Dice dice(5);
  for (int i = 0; i < 200; ++i) {
    const DeviceState state = a_state(dice);
    for (const std::size_t room : {kMaxDatagram, kMaxDatagram - 16, kMaxDatagram - dice.bits() % 600}) {
      std::array<std::byte, kMaxDatagram> one{};
      std::array<std::byte, kMaxDatagram> other{};
      DataWriter by_hand;
      DataWriter by_protobuf;
      by_hand.begin(std::span(one).first(room), {}, LocalTime{}, {});
      by_protobuf.begin(std::span(other).first(room), {}, LocalTime{}, {});
      while (by_hand.add(state)) ASSERT_TRUE(by_protobuf.add_by_protobuf(state));
      ASSERT_FALSE(by_protobuf.add_by_protobuf(state));
      ASSERT_EQ(by_hand.size(), by_protobuf.size());
      ASSERT_EQ(one, other);
    }
  }
}

}  // namespace
}  // namespace tendon::hand_codec_test
