// SPDX-License-Identifier: Apache-2.0
#include "protocol/handshake.h"

#include <cstring>
#include <utility>

#include "tests/fuzz/target.h"

// Unauthenticated clients and servers exchange arbitrary bytes. No reply may be longer than its request, no client may
// be accepted without the key, only a genuine Answer may complete an encrypted handshake, and both ends of a handshake
// must agree on suite and keys.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Ratchet random(1);
  LocalTime now{std::chrono::seconds(1000)};
  const ClientKey key{.name = "a", .role = Role::kController, .key = random.next()};
  const Suites all = suites_of_this_machine();
  // The second server only supports the first suite. Both of them have the same cookie secret.
  ServerHandshake every({.keys = {key}, .suites = all});
  ServerHandshake strict({.keys = {key}, .suites = {all.front()}});
  const auto client_of = [&](const Suites& suites) {
    ClientHandshake::Config config;
    config.hello = {.role = Role::kController, .name = "a", .features = {}};
    if (!suites.empty()) config.secret = {.key = key.key, .ephemeral = random.next()};
    if (!suites.empty()) config.suites = suites;
    return ClientHandshake(config, now);
  };
  // Copied, because half of the cost of a run is the elliptic curve. They have no key, only suite 1, or all suites.
  static const std::array<ClientHandshake, 3> fresh = {client_of({}), client_of({Suite::kNoise}), client_of(all)};
  std::array<ClientHandshake, 3> clients = fresh;
  const Address here = parse_address("127.0.0.1:4000");
  const Address there = parse_address("192.0.2.1:4000");
  std::array<std::byte, kMaxDatagram> buffer;
  std::array<std::byte, kMaxDatagram> answer;
  const auto change = [&](std::size_t length) {  // returns true if it changed a byte
    bool changed = false;
    for (std::uint8_t changes = input.byte() % 4; changes > 0; --changes) {
      const std::size_t at = (std::size_t{input.byte()} << 8U | input.byte()) % length;
      const auto to = static_cast<std::byte>(input.byte());
      changed |= std::exchange(buffer[at], to) != to;
    }
    return changed;
  };

  while (!input.empty()) {
    const std::uint8_t choice = input.byte();
    const bool sealed = choice % 2 == 1;
    const std::size_t which = sealed ? (choice & 4U ? 2 : 1) : 0;
    ClientHandshake& client = clients[which];
    ServerHandshake& door = choice & 8U ? strict : every;
    const Address& from = choice & 2U ? here : there;
    now += std::chrono::milliseconds(input.byte());
    client.tick(now);
    const std::size_t said = client.next_datagram(now, buffer);
    if (said == 0) continue;
    const bool untouched = !change(said);
    const auto reply = door.receive(now, from, std::span(buffer).first(said), answer);
    fuzz::require(reply.size <= said);
    std::size_t length = reply.size;
    std::optional<SessionKeys> its;
    if (reply.client) {
      // In suite 1, only a client that knows the key can get here, and every byte except the cookie is authenticated.
      if (reply.client->key != nullptr) fuzz::require(reply.client->hello.name == "a");
      Welcome welcome;
      welcome.version = 1;
      welcome.loop_hz = 1000;
      welcome.timeout = std::chrono::seconds(1);
      fuzz::require(reply.client->suite.has_value() || (&door == &strict && which == 1));
      const ServerHandshake::Answered answered = reply.client->suite ? door.welcome(*reply.client, 1, welcome, answer)
                                                                     : door.refuse(*reply.client, {}, answer);
      its = answered.keys;
      length = answered.size;
      fuzz::require(length < said);
    }
    if (length == 0) continue;
    std::memcpy(buffer.data(), answer.data(), length);
    const bool true_answer = !change(length) && untouched;
    const bool was_open = client.outcome().has_value();
    client.receive(now, std::span(buffer).first(length));
    // Only the connection id is not authenticated.
    if (sealed && !was_open && client.outcome() && !true_answer) {
      fuzz::require(std::equal(buffer.begin() + kHeaderSize, buffer.begin() + static_cast<long>(length),
                               answer.begin() + kHeaderSize));
    }
    if (sealed && !was_open && client.outcome()) {
      const auto* accepted = std::get_if<ClientHandshake::Accepted>(&*client.outcome());
      fuzz::require((accepted != nullptr) == its.has_value());
      if (accepted != nullptr) {
        fuzz::require(accepted->keys->suite == its->suite);
        fuzz::require(accepted->keys->send.bytes() == its->receive.bytes());
        fuzz::require(accepted->keys->receive.bytes() == its->send.bytes());
      }
    }
    if (client.outcome()) client = fresh[which];
  }
  return 0;
}
