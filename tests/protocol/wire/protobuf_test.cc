// SPDX-License-Identifier: Apache-2.0
// The Writer produces libprotobuf's bytes, and the DataReader reads the same values in any order of the fields. The
// fuzz target `payload` does this with random bytes.
#include <google/protobuf/message.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <iostream>
#include <string>
#include <variant>
#include <vector>

#include "protocol/limits.h"
#include "protocol/wire/any_order.h"
#include "protocol/wire/codec.h"
#include "protocol/wire/generated/schema.h"
#include "tendon.pb.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/by_protobuf.h"
#include "tests/protocol/wire/drawn.h"
#include "tests/protocol/wire/raw_protobuf.h"
#include "tests/protocol/wire/read_back.h"
#include "tests/protocol/wire/scrambled.h"
#include "tests/protocol/wire/told.h"
#include "tests/support/dice.h"

namespace tendon::protobuf_test {
namespace {

using examples::Bytes;
using namespace drawn;

constexpr int kDatagrams = 100'000;  ///< random datagrams per test

Bytes told_of(const DeviceState& state) { return examples::data(0, {}, state); }

/// Directly, through AnyOrder, and after libprotobuf has rewritten the bytes.
class Readers {
 public:
  ::testing::AssertionResult agree(const Bytes& body) {
    const auto anew = by_protobuf(body);
    const std::string expected = anew ? told(reference_.read(*anew)) : "malformed";
    const std::string usual = told(reader_.read(body));
    const std::string any = told(any_order_.read_in_any_order(body));
    if (usual == expected && any == expected) return ::testing::AssertionSuccess();
    return ::testing::AssertionFailure() << "of " << examples::hex(body, " ") << "\n"
                                         << expected << "\n"
                                         << usual << "\n"
                                         << any;
  }

 private:
  DataReader reader_;
  DataReader any_order_;
  DataReader reference_;
};

bool is_in_order(const Bytes& body) {
  wire::AnyOrder any_order;
  const auto written = any_order.in_order(wire::schema::kDatagram, body);
  return written && std::ranges::equal(*written, body);
}

TEST(Protobuf, WritesTheBytesOfProtobuf) {
  Dice dice(1);
  for (int i = 0; i < kDatagrams; ++i) {
    const Bytes written = a_datagram(dice, 0.1);
    ASSERT_EQ(by_protobuf(written), written) << "datagram " << i;
    ASSERT_TRUE(is_in_order(written)) << "datagram " << i;
  }
}

TEST(Protobuf, ReadsTheValuesOfProtobuf) {
  Dice dice(2);
  Readers readers;
  for (int i = 0; i < kDatagrams; ++i) ASSERT_TRUE(readers.agree(a_datagram(dice, 0.1))) << "datagram " << i;
}

TEST(Protobuf, ReadsOfScrambledFieldsTheValuesOfProtobuf) {
  Dice dice(7);
  Readers readers;
  DataReader plain;
  DataReader reader;
  int fitting = 0;
  for (int i = 0; i < kDatagrams / 5; ++i) {
    const Bytes body = a_datagram(dice, 0.1);
    v1::Datagram parsed;
    ASSERT_TRUE(parsed.ParseFromArray(body.data(), static_cast<int>(body.size())));
    const Bytes scrambled = bytes_of(Scrambled(dice)(parsed));
    if (scrambled.size() > kMaxDatagram) continue;
    ++fitting;
    ASSERT_TRUE(readers.agree(scrambled)) << "datagram " << i;
    if (parsed.frames_size() != 1) continue;
    ASSERT_EQ(told(reader.read(scrambled)), told(plain.read(body))) << examples::hex(scrambled, " ");
  }
  EXPECT_GT(fitting, kDatagrams / 10);
}

TEST(Protobuf, WhatIsMalformedForProtobufIsMalformedHere) {
  const auto groups = [](std::size_t deep) {  // number 10
    return bytes_of(std::string(deep, '\x53') + std::string(deep, '\x54'));
  };
  const std::vector<std::pair<std::string, Bytes>> cases = {
      {"nothing", {}},
      {"a tag of 0", bytes_of(std::string(1, '\0'))},
      {"a field of number 0", bytes_of(std::string("\x01 1234567"))},
      {"a tag of five bytes", bytes_of("\x80\x80\x80\x80\x7f\x01")},
      {"a tag of six bytes", bytes_of("\x80\x80\x80\x80\x80\x01\x01")},
      {"wire type 6", bytes_of("\x56\x01")},
      {"wire type 7", bytes_of("\x57\x01")},
      {"the end of no group", bytes_of("\x54")},
      {"a group that does not end", bytes_of("\x53")},
      {"a group that another one ends", bytes_of("\x53\x5c")},
      {"groups 100 deep", groups(100)},
      {"groups 101 deep", groups(101)},
      {"a number of ten bytes", bytes_of("\x50\xff\xff\xff\xff\xff\xff\xff\xff\xff\x7f")},
      {"a number of eleven bytes", bytes_of("\x50\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01")},
      {"a length of five bytes", bytes_of(std::string("\x52\x81\x80\x80\x80\x00 ", 7))},
      {"a length of six bytes", bytes_of(std::string("\x52\x81\x80\x80\x80\x80\x00 ", 8))},
      {"a length beyond the end", bytes_of("\x52\x02 ")},
      {"a text that is not UTF-8, of a message that is replaced",
       datagram_with(RawProtobuf().message(5, RawProtobuf().text(2, "\xff")).message(1, RawProtobuf().varint(11, 2)))},
      {"five bytes of doubles", datagram_with(RawProtobuf().message(1, RawProtobuf().text(23, "12345")))},
      {"a cut number in a list", datagram_with(RawProtobuf().message(7, RawProtobuf().text(9, "\x80")))},
  };
  Readers readers;
  for (const auto& [what, bytes] : cases) EXPECT_TRUE(readers.agree(bytes)) << what;
}

/// Changes a datagram as a network, an older or newer peer, or an attacker may.
void distort(Dice& dice, Bytes& body) {
  const auto somewhere = [&] { return body.begin() + static_cast<std::ptrdiff_t>(dice.bits() % (body.size() + 1)); };
  switch (body.empty() ? 1 : dice.bits() % 7) {
    case 0:  // a changed byte
      body[dice.bits() % body.size()] = static_cast<std::byte>(dice.bits());
      break;
    case 1:  // an added byte
      body.insert(somewhere(), static_cast<std::byte>(dice.bits()));
      break;
    case 2:  // a removed byte
      body.erase(body.begin() + static_cast<std::ptrdiff_t>(dice.bits() % body.size()));
      break;
    case 3:  // truncated
      body.resize(dice.bits() % body.size());
      break;
    case 4: {  // a repeated part
      const Bytes copy(body.begin(), somewhere());
      body.insert(body.end(), copy.begin(), copy.end());
      break;
    }
    case 5: {  // a number longer than necessary
      auto& byte = body[dice.bits() % body.size()];
      if ((byte & std::byte{0x80}) != std::byte{0}) break;
      byte |= std::byte{0x80};
      body.insert(body.begin() + (&byte - body.data()) + 1, std::byte{0});
      break;
    }
    default:  // one bit: other field, wire type or length
      body[dice.bits() % body.size()] ^= static_cast<std::byte>(1U << (dice.bits() % 8));
  }
}

TEST(Protobuf, ReadsOfDistortedBytesWhatProtobufDoes) {
  Dice dice(3);
  Readers readers;
  for (int i = 0; i < kDatagrams; ++i) {
    Bytes body = a_datagram(dice, 0.05);
    for (std::uint64_t left = 1 + dice.bits() % 3; left > 0; --left) distort(dice, body);
    body.resize(std::min(body.size(), kMaxDatagram));
    ASSERT_TRUE(readers.agree(body)) << "datagram " << i;
  }
}

/// Allowed by WIRE.md, such as overlong numbers.
TEST(Protobuf, WhatNoWriterOfOursDoesIsPutInOrder) {
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
      {"a mode beyond 32 bits, whose last 32 are one", frame(RawProtobuf().varint(11, (1ULL << 32U) + 2))},
      {"a device beyond 32 bits, whose last 32 are one", frame(RawProtobuf().varint(11, 2).varint(12, 1ULL << 32U))},
      {"a frame of two kinds: the last one counts",
       datagram_with(RawProtobuf().message(1, usual).message(2, RawProtobuf().varint(1, 1).varint(5, 1000)))},
  };
  Readers readers;
  for (const auto& [what, bytes] : cases) {
    EXPECT_FALSE(is_in_order(bytes)) << what;
    EXPECT_TRUE(readers.agree(bytes)) << what;
  }
  EXPECT_TRUE(is_in_order(frame(usual))) << "the others fail for their own reason";
  for (const RawProtobuf& odd :
       {RawProtobuf().varint(11, 7), RawProtobuf().varint(11, 258),
        RawProtobuf().varint(11, 2).message(16, RawProtobuf()), RawProtobuf().varint(11, 2).varint(26, 0),
        RawProtobuf().varint(11, 2).varint(26, 0).fixed64(27, 0x3FF0000000000000),
        RawProtobuf().varint(11, 2).varint(26, 1ULL << 32U).message(28, RawProtobuf())}) {
    EXPECT_TRUE(readers.agree(frame(odd)));
  }
  EXPECT_TRUE(readers.agree(datagram_with(raw_force([](RawProtobuf& force) {
    force.message(14, RawProtobuf().message(1, RawProtobuf().fixed64(1, 0x3FF0000000000000)).packed(2, {1.0}));
  }))))
      << "a model of rotation without a torque";
  // The tick 05 becomes 85 00. The lengths of state, frame and datagram grow by one.
  Bytes longer = frame(usual);
  const auto tick = std::find(longer.begin() + 9, longer.end(), std::byte{5});
  ASSERT_NE(tick, longer.end());
  *tick |= std::byte{0x80};
  longer.insert(tick + 1, std::byte{0});
  longer[10] = static_cast<std::byte>(std::to_integer<int>(longer[10]) + 1);
  longer[12] = static_cast<std::byte>(std::to_integer<int>(longer[12]) + 1);
  EXPECT_FALSE(is_in_order(longer)) << "a number in a longer form than it needs";
  EXPECT_TRUE(readers.agree(longer));
  DataReader reader;
  ASSERT_NE(reader.read(longer), nullptr);
  EXPECT_EQ(std::get<DeviceState>(reader.read(longer)->frames.at(0)).tick, 5U);
}

TEST(Protobuf, SixteenDevicesThatMoveOnAllAxesFitOneSealedDatagram) {
  Dice dice(5);
  std::vector<DeviceState> states(limits::kMaxDevices, examples::state());
  for (std::uint32_t device = 0; device < states.size(); ++device) {
    DeviceState& state = states[device];
    state.device = device;
    state.tick = 100'000'000;  // one day at 1 kHz
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
  const auto room = std::span(buffer).first(kMaxDatagram - 16);  // minus the tag of the seal
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

TEST(Protobuf, ColumnsKeepAllButThePrecisionThatTheyNameAndThePosition) {
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
    EXPECT_TRUE(is_in_order(Bytes(datagram.begin() + kHeaderSize, datagram.end())));
  }
}

TEST(Protobuf, AStateWithAPartThatColumnsCannotSayStaysWhole) {
  Dice dice(8);
  const auto& columns = *v1::DeviceStates::descriptor();
  for (int i = 0; i < 10'000; ++i) {
    const auto state = a<DeviceState>(dice, {.present = 0.1});
    v1::Datagram parsed;
    const Bytes written = told_of(state);
    ASSERT_TRUE(parsed.ParseFromArray(body(written).data(), static_cast<int>(body(written).size())));
    std::vector<const google::protobuf::FieldDescriptor*> fields;
    const auto& told = parsed.frames(0).state();
    told.GetReflection()->ListFields(told, &fields);
    const bool fits = std::ranges::all_of(fields, [&](const auto* field) {
      return field->name() == "device" || columns.FindFieldByName(field->name()) != nullptr;
    });
    ASSERT_EQ(fits_columns(state), fits) << i;
  }
}

/// If a state is invalid, all states of its frame are dropped. Nothing else is dropped.
TEST(Protobuf, AColumnOfAnotherLengthDropsTheFrame) {
  const auto columns = [](const std::function<void(v1::DeviceStates&)>& change) {
    const Bytes datagram = examples::data_in_columns(1, examples::states_in_columns());
    v1::Datagram parsed;
    EXPECT_TRUE(parsed.ParseFromArray(body(datagram).data(), static_cast<int>(body(datagram).size())));
    change(*parsed.mutable_frames(0)->mutable_states());
    parsed.add_frames()->mutable_state()->set_mode(v1::MODE_IDLE);
    return bytes_of(parsed.SerializeAsString());
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
  };
  Readers readers;
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

TEST(Protobuf, NoFrameTakesMoreThanItSays) {
  const std::uint64_t most = ~std::uint64_t{0};
  auto state = the_fullest<DeviceState>();
  state.force_age = Duration(-1);
  state.mode = static_cast<Mode>(255);
  auto command = the_fullest<ForceCommand>();
  state.device = state.channel = command.device = command.channel = command.way = static_cast<std::uint32_t>(most);
  const auto size = [](const auto& frame) {
    return examples::data(0, {}, frame).size() - examples::data(0, {}).size();
  };
  EXPECT_LE(size(state), 640U) << "kMostOfAStep of codec.cc";
  EXPECT_LE(size(command), 640U);
  EXPECT_GT(size(state), 500U) << "this is all that a state holds";
  EXPECT_GT(size(command), 500U);
  const OutgoingEcho echo{PeerTime(Duration(-1)), LocalTime(Duration(-1)), most, static_cast<std::uint32_t>(most)};
  std::array<std::byte, kMaxDatagram> buffer{};
  DataWriter writer;
  writer.begin(buffer, {}, LocalTime(Duration(-1)), echo);
  EXPECT_LE(writer.size() - kHeaderSize, 48U) << "kMostHead";
}

TEST(Protobuf, AFrameIsTakenIfItFitsToTheLastByte) {
  Dice dice(5);
  const std::size_t empty = examples::data(0, {}).size();
  for (int i = 0; i < 200; ++i) {
    const auto state = a<DeviceState>(dice);
    const std::size_t frame = examples::data(0, {}, state).size() - empty;
    for (const std::size_t room : {kMaxDatagram, empty + frame, empty + frame - 1, empty + 2 * frame}) {
      std::array<std::byte, kMaxDatagram> buffer{};
      DataWriter writer;
      writer.begin(std::span(buffer).first(std::min(room, kMaxDatagram)), {}, LocalTime{Duration{1'000'100'000}}, {});
      std::size_t frames = 0;
      while (writer.add(state)) ++frames;
      EXPECT_EQ(frames, (std::min(room, kMaxDatagram) - empty) / frame);
      EXPECT_EQ(writer.size(), empty + frames * frame);
    }
  }
}

}  // namespace
}  // namespace tendon::protobuf_test
