// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <bit>

#include "protocol/handshake.h"
#include "protocol/limits.h"
#include "protocol/session.h"
#include "tests/protocol/examples.h"
#include "tests/support/property_cases.h"

// Hostile bytes must never crash a receiver or yield a value out of bounds, and they must always be counted.

namespace tendon::hostile_test {
namespace {

using examples::Bytes;

bool bounded(const Vec3& v) { return v.allFinite() && v.cwiseAbs().maxCoeff() <= limits::kMaxValue; }

/// A session that receives invalid bytes. All of the results are checked.
class Target {
 public:
  Target() : session_({.connection_id = examples::kConnection}, LocalTime{}) {
    // The session has outstanding packets and requests, so that the echoes and answers of the examples match.
    std::array<std::byte, kMaxDatagram> buffer;
    for (int i = 0; i < 10; ++i) session_.request(Rearm{});
    for (std::uint64_t i = 1; i <= 4; ++i) {
      session_.send(examples::state());
      session_.next_datagram(LocalTime{}, buffer);
    }
  }

  bool take(const Bytes& datagram) {
    const auto total = [this] {
      const LinkStats& s = session_.stats();
      return s.datagrams_received + s.duplicated + s.malformed;
    };
    const std::uint64_t before = total();
    session_.receive(LocalTime{std::chrono::seconds(1)}, datagram);
    const bool counted = total() == before + 1;
    while (const auto event = session_.next_event()) look(*event);
    std::array<std::byte, kMaxDatagram> buffer;
    for (int i = 0; i < 4; ++i) session_.next_datagram(LocalTime{std::chrono::seconds(1)}, buffer);
    return counted;
  }

  bool open() const { return session_.open(); }
  const LinkStats& stats() const { return session_.stats(); }

 private:
  static void look(const Session::Event& event) {
    if (const auto* arrived = std::get_if<Session::StateArrived>(&event)) {
      const DeviceState& s = arrived->state;
      EXPECT_TRUE(bounded(s.position) && bounded(s.velocity) && bounded(s.force_applied));
      EXPECT_TRUE(std::isfinite(s.energy) && s.permitted_force >= 0);
      EXPECT_TRUE(s.mode >= Mode::kIdle && s.mode <= Mode::kFault);
      EXPECT_GE(s.force_age, Duration{});
    } else if (const auto* commanded = std::get_if<Session::ForceArrived>(&event)) {
      const ForceCommand& f = commanded->command;
      EXPECT_TRUE(bounded(f.force));
      EXPECT_TRUE(!f.model || (bounded(f.model->at) && f.model->stiffness.allFinite() && f.model->valid_radius >= 0));
      if (f.model && f.model->contact && f.model->contact->table) {
        EXPECT_LE(f.model->contact->table->size, ForceTable::kMaxEntries);
      }
      EXPECT_TRUE(f.valid_for > Duration{} && f.valid_for <= limits::kMaxValidFor);
    } else if (const auto* closed = std::get_if<Session::Closed>(&event)) {
      EXPECT_LE(closed->reason.size(), limits::kMaxDetail);
    } else if (const auto* answered = std::get_if<Session::RequestAnswered>(&event)) {
      EXPECT_LE(answered->detail.size(), limits::kMaxDetail);
    }
  }

  Session session_;
};

bool take_everywhere(const Bytes& datagram) {
  std::array<std::byte, kMaxDatagram> buffer;
  ClientHandshake client({.hello = examples::hello(), .random = examples::random()}, LocalTime{});
  client.receive(LocalTime{}, datagram);
  client.next_datagram(LocalTime{}, buffer);
  ServerHandshake door({});
  const auto reply = door.receive(LocalTime{}, parse_address("127.0.0.1:4000"), datagram, buffer);
  EXPECT_LE(reply.size, datagram.size());
  EXPECT_EQ(door.stats().malformed == 1, reply.size == 0 && !reply.client);
  return Target().take(datagram);
}

TEST(HostileBytes, EveryTruncationOfEveryDatagramIsCounted) {
  for (const auto& [name, bytes] : examples::datagrams()) {
    for (std::size_t size = 0; size < bytes.size(); ++size) {
      EXPECT_TRUE(take_everywhere(Bytes(bytes.begin(), bytes.begin() + static_cast<std::ptrdiff_t>(size))))
          << name << " cut to " << size;
    }
  }
}

TEST(HostileBytes, EveryCorruptionOfOneByteIsCounted) {
  // The short run changes only one bit or all bits.
  const bool every_value = property_cases() >= 10'000;
  for (const auto& [name, bytes] : examples::datagrams()) {
    const bool padded = bytes.size() == kMaxDatagram;
    for (std::size_t at = 0; at < (padded ? 100 : bytes.size()); ++at) {
      for (unsigned flip = 1; flip < 256; ++flip) {
        if (!every_value && !std::has_single_bit(flip) && flip != 0xFF) continue;
        Bytes bad = bytes;
        bad[at] ^= static_cast<std::byte>(flip);
        EXPECT_TRUE(Target().take(bad)) << name << " byte " << at << " xor " << flip;
        if (flip == 1 || flip == 0x80 || flip == 0xFF) take_everywhere(bad);
      }
    }
  }
}

TEST(HostileBytes, ADatagramTooLongIsMalformed) {
  for (const auto& [name, bytes] : examples::datagrams()) {
    for (const std::size_t size : {kMaxDatagram + 1, std::size_t{2000}, std::size_t{65507}}) {
      Bytes longer = bytes;
      longer.resize(size);
      Target target;
      EXPECT_TRUE(target.take(longer));
      EXPECT_EQ(target.stats().malformed, 1U) << name;
      EXPECT_TRUE(target.open());
    }
  }
}

}  // namespace
}  // namespace tendon::hostile_test
