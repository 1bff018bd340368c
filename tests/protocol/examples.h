// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "protocol/codec.h"

// One example of everything that is said: the golden datagrams of WIRE.md are made of these.

namespace tendon::examples {

using Bytes = std::vector<std::byte>;

inline constexpr std::uint32_t kConnection = 0x11223344;

/// 16 bytes: first, first + 1, …
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

template <class Handshake>
Bytes encoded(const Handshake& message) {
  std::array<std::byte, kMaxDatagram> buffer;
  const std::size_t size = encode(message, buffer);
  return {buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size)};
}

/// In suite 0.
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

/// One complete datagram of each type and, in type Data, of each frame.
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
  };
}

}  // namespace tendon::examples
