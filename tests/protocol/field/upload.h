// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "protocol/field/receiver.h"
#include "protocol/field/sender.h"
#include "protocol/reliable/requests.h"
#include "protocol/reliable/round_trip.h"
#include "tests/protocol/world.h"
#include "tests/support/dice.h"

namespace tendon {

inline FieldLattice lattice_of_1024() { return {.spacing = 1e-3, .scale = 1e-7, .bricks = {16, 8, 8}}; }

/// At most 1023 bricks of random weights.
inline std::vector<FieldSender::Brick> random_bricks(std::size_t count, std::uint64_t seed) {
  Dice dice(seed);
  std::vector<FieldSender::Brick> bricks(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto n = static_cast<std::int32_t>(i);
    bricks[i].place = {n % 16, n / 16 % 8, n / 128};
    bricks[i].material = static_cast<std::uint8_t>(i % 8);
    for (std::byte& byte : bricks[i].bytes) byte = static_cast<std::byte>(dice.bits());
  }
  return bricks;
}

/// Simulates an engine, a server, and the network between them. The requests are sent and resent as in Session, with one
/// message per datagram.
class Upload {
 public:
  Upload(BrickStore& store, BrickStore::Owner owner, std::span<const FieldSender::Brick> bricks, const Weather& weather,
         std::uint64_t seed, LocalTime start = LocalTime(std::chrono::seconds(100)))
      : now(start),
        sender({}, lattice_of_1024(), bricks),
        receiver({.owner = owner}, store),
        weather_(weather),
        dice_(seed) {
    for (int i = 0; i < 100; ++i) round_trip_.observe(delay() + delay());
  }

  /// Returns false if `done` is not true until then.
  template <class Done>
  bool run(Duration length, Done done) {
    for (const LocalTime end = now + length; now < end; now += std::chrono::milliseconds(1)) {
      turn();
      if (done()) return true;
    }
    return false;
  }
  bool run_until_known(Duration length = std::chrono::seconds(20)) {
    return run(length, [&] { return sender.complete(); });
  }

  LocalTime now;
  FieldSender sender;
  FieldReceiver receiver;
  std::optional<LocalTime> ready_at;  ///< the time at which all bricks are stored
  std::vector<std::string> refusals;

 private:
  using Ack = ControlAck;
  struct SentBrick {
    BrickHash hash;
    std::span<const std::byte> bytes;  // not copied
  };
  using ToServer = std::variant<Control, SentBrick>;
  using ToClient = std::variant<ControlAck, FieldStatus>;

  Duration delay() { return weather_.delay + from_seconds(dice_.uniform() * seconds(weather_.jitter)); }
  template <class Message>
  void send(std::multimap<LocalTime, Message>& to, const Message& message) {
    const int copies = dice_.chance(weather_.loss) ? 0 : dice_.chance(weather_.duplicate) ? 2 : 1;
    for (int i = 0; i < copies; ++i) to.emplace(now + delay(), message);
  }
  template <class Message>
  void receive(std::multimap<LocalTime, Message>& from) {
    while (!from.empty() && from.begin()->first <= now) {
      const auto first = from.extract(from.begin());
      std::visit([&](const auto& message) { take(message); }, first.mapped());
    }
  }
  void note(const std::optional<FieldReceiver::Refusal>& refusal) {
    if (refusal) refusals.push_back(refusal->detail);
  }
  void take(const Control& control) { answering_.take(control); }
  void take(const SentBrick& brick) {
    note(receiver.take(now, FieldBrick{.hash = brick.hash, .weights = brick.bytes}));
  }
  void take(const ControlAck& ack) { asked_.acknowledge(ack); }
  void take(const FieldStatus& status) { sender.take(now, status, round_trip_.smoothed()); }

  void turn() {
    receive(to_server_);
    while (const Control* const request = answering_.next()) {
      note(receiver.take(now, std::get<OfferField>(*request->request)));
      answering_.answer({.id = request->id, .code = Code::kOk, .detail = {}});
    }
    while (const auto status = receiver.next_status(now)) send(to_client_, ToClient(*status));
    if (!ready_at && receiver.ready(sender.field())) ready_at = now;
    while (const ControlAck* const ack = answering_.next_due()) {
      send(to_client_, ToClient(*ack));
      answering_.sent(ack->id);
    }
    receive(to_client_);
    while (asked_.next_answer()) {
    }
    for (auto part = sender.next_part(now); part && asked_.add(*part); part = sender.next_part(now)) {
      sender.part_sent();
    }
    while (const Control* const request = asked_.next_due(now)) {
      send(to_server_, ToServer(*request));
      asked_.sent(request->id, now, round_trip_.timeout(std::chrono::milliseconds(20)));
    }
    while (const auto brick = sender.next_brick(now))
      send(to_server_, ToServer(SentBrick{brick->hash, brick->weights}));
  }

  Weather weather_;
  Dice dice_;
  RoundTrip round_trip_;
  OutgoingRequests asked_;
  IncomingRequests answering_;
  std::multimap<LocalTime, ToServer> to_server_;
  std::multimap<LocalTime, ToClient> to_client_;
};

}  // namespace tendon
