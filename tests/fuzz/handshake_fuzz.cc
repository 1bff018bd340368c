// SPDX-License-Identifier: Apache-2.0
#include "protocol/handshake.h"

#include <cstring>
#include <utility>

#include "tests/fuzz/target.h"

// Strangers at the door and strangers who answer: no reply is longer than what asked, nobody gets in without the key,
// and no answer that we did not write ends a handshake of suite 1.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  Ratchet random(1);
  LocalTime now{std::chrono::seconds(1000)};
  const ClientKey key{.name = "a", .role = Role::kController, .key = random.next()};
  Doorman door({.keys = {key}});
  const auto client_of = [&](bool sealed) {
    ClientHandshake::Config config;
    config.hello = {.role = Role::kController, .name = "a", .features = {}};
    if (sealed) config.secret = {.key = key.key, .ephemeral = random.next()};
    return ClientHandshake(config, now);
  };
  // Made once and copied: half of what a run costs is the curve.
  static const std::array<ClientHandshake, 2> fresh = {client_of(false), client_of(true)};
  std::array<ClientHandshake, 2> clients = fresh;
  const Address here = parse_address("127.0.0.1:4000");
  const Address there = parse_address("192.0.2.1:4000");
  std::array<std::byte, kMaxDatagram> buffer;
  std::array<std::byte, kMaxDatagram> answer;
  const auto change = [&](std::size_t length) {  // true when something is other than it was
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
    ClientHandshake& client = clients[sealed ? 1 : 0];
    const Address& from = choice & 2U ? here : there;
    now += std::chrono::milliseconds(input.byte());
    client.tick(now);
    const std::size_t said = client.next_datagram(now, buffer);
    if (said == 0) continue;
    const bool untouched = !change(said);
    const auto reply = door.receive(now, from, std::span(buffer).first(said), answer);
    fuzz::require(reply.size <= said);
    std::size_t length = reply.size;
    if (reply.guest) {
      // In suite 1 only what the holder of the key wrote gets here; its cookie apart, every byte counts.
      if (reply.guest->key != nullptr) fuzz::require(reply.guest->hello.name == "a");
      Welcome welcome;
      welcome.version = 1;
      welcome.loop_hz = 1000;
      welcome.timeout = std::chrono::seconds(1);
      length = door.welcome(*reply.guest, 1, welcome, answer).size;
      fuzz::require(length < said);
    }
    if (length == 0) continue;
    std::memcpy(buffer.data(), answer.data(), length);
    const bool true_answer = !change(length) && untouched;
    const bool was_open = client.outcome().has_value();
    client.receive(now, std::span(buffer).first(length));
    // The connection id is the one thing that is not authentic by itself.
    if (sealed && !was_open && client.outcome() && !true_answer) {
      fuzz::require(std::equal(buffer.begin() + kHeaderSize, buffer.begin() + static_cast<long>(length),
                               answer.begin() + kHeaderSize));
    }
    if (client.outcome()) client = fresh[sealed ? 1 : 0];
  }
  return 0;
}
