// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/protocol/wire/raw_protobuf.h"

namespace tendon::session_test {

using examples::Bytes;
using std::chrono::milliseconds;
using std::chrono::seconds;

inline constexpr LocalTime kOpened{seconds(100)};

inline Session::Config config() {
  Session::Config config;
  config.connection_id = examples::kConnection;
  return config;
}

inline std::vector<Bytes> pull(Session& session, LocalTime now) {
  std::vector<Bytes> out;
  std::array<std::byte, kMaxDatagram> buffer;
  while (const std::size_t size = session.next_datagram(now, buffer)) {
    out.emplace_back(buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(size));
  }
  return out;
}

inline std::vector<Session::Event> events(Session& session) {
  std::vector<Session::Event> out;
  while (const auto* event = session.next_event()) out.push_back(*event);
  return out;
}

template <class Event>
Event only(Session& session) {
  const std::vector<Session::Event> all = events(session);
  EXPECT_EQ(all.size(), 1U);
  return std::get<Event>(all.at(0));
}

inline void deliver(Session& to, LocalTime now, const std::vector<Bytes>& datagrams) {
  for (const Bytes& datagram : datagrams) to.receive(now, datagram);
}

inline ForceCommand force(std::uint64_t sequence) {
  ForceCommand command = examples::force();
  command.sequence = sequence;
  return command;
}
inline DeviceState state(std::uint64_t tick) {
  DeviceState state = examples::state();
  state.tick = tick;
  return state;
}

inline Bytes raw(std::uint64_t packet_number, const RawProtobuf& body) {
  Bytes bytes = examples::data(packet_number, {});
  bytes.resize(kHeaderSize);
  bytes.insert(bytes.end(), body.bytes().begin(), body.bytes().end());
  return bytes;
}

/// A and Z use the same clock. The datagrams must be passed on by the test.
class TwoEnds : public ::testing::Test {
 protected:
  LocalTime now_ = kOpened;
  Session a_{config(), kOpened};
  Session z_{config(), kOpened};
};

}  // namespace tendon::session_test
