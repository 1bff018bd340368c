// SPDX-License-Identifier: Apache-2.0
#include <deque>
#include <vector>

#include "protocol/secrets/suites.h"
#include "protocol/session.h"
#include "tests/fuzz/target.h"

// Two sessions use a network that loses, repeats, reorders, damages or delays datagrams. Received data must be the same
// as the data that was sent by the peer, requests must arrive once and in order, and a session must only end because of
// a timeout, a Bye or its age.

using namespace tendon;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  fuzz::Input input(data, size);
  LocalTime now{std::chrono::seconds(100)};
  const std::uint8_t first = input.byte();
  const bool sealed = first % 4 != 0;
  const Suite suite = (first & 4U) != 0 ? suites_of_this_machine().front() : Suite::kNoise;
  Session::Config config{.connection_id = 7};
  config.rekey = {.datagrams = 5, .age = std::chrono::seconds(1), .overlap = std::chrono::milliseconds(500)};
  Ratchet random(1);
  const SessionKeys keys{.send = random.next(), .receive = random.next(), .suite = suite};
  const SessionKeys turned{.send = keys.receive, .receive = keys.send, .suite = suite};
  std::array<Session, 2> ends = {sealed ? Session(config, keys, now) : Session(config, now),
                                 sealed ? Session(config, turned, now) : Session(config, now)};
  using Datagram = std::vector<std::byte>;
  std::array<std::deque<Datagram>, 2> flying;
  std::uint64_t sequence = 0;
  std::uint64_t heard = 0;
  std::uint32_t requests = 0;
  std::array<std::byte, kMaxDatagram> buffer;

  while (!input.empty()) {
    const std::uint8_t choice = input.byte();
    const std::size_t who = choice & 1U;
    Session& end = ends[who];
    std::deque<Datagram>& to_it = flying[who];
    switch (choice >> 1U & 7U) {
      case 0: {
        ForceCommand force;
        force.sequence = ++sequence;
        force.valid_for = std::chrono::milliseconds(20);
        ends[0].send(force);
        break;
      }
      case 1:
        ends[0].request(Rearm{});
        break;
      case 2:
        now += std::chrono::milliseconds(input.byte());
        end.tick(now);
        break;
      case 3:
        if (to_it.size() > 1) std::swap(to_it.front(), to_it[input.byte() % to_it.size()]);
        break;
      case 4:
        if (!to_it.empty()) to_it.push_back(to_it.front());
        break;
      case 5:
        if (!to_it.empty()) to_it.pop_front();
        break;
      case 6:
        if (sealed && !to_it.empty()) {
          Datagram bad = to_it.front();
          const std::size_t at = (std::size_t{input.byte()} << 8U | input.byte()) % bad.size();
          bad[at] ^= static_cast<std::byte>(input.byte() | 1U);
          const std::uint64_t before = end.stats().datagrams_received;
          fuzz::require(!end.receive(now, bad));
          fuzz::require(end.stats().datagrams_received == before);
        }
        break;
      default:
        if (!to_it.empty()) {
          end.receive(now, to_it.front());
          to_it.pop_front();
        }
        break;
    }
    for (std::size_t i = 0; i < 2; ++i) {
      while (const auto event = ends[i].next_event()) {
        if (const auto* force = std::get_if<Session::ForceArrived>(&*event)) {
          fuzz::require(i == 1 && force->command.sequence > heard && force->command.sequence <= sequence);
          heard = force->command.sequence;
        } else if (const auto* request = std::get_if<Session::RequestArrived>(&*event)) {
          fuzz::require(i == 1 && request->id == ++requests);
          ends[1].answer(request->id, Code::kOk, {});
        } else if (const auto* closed = std::get_if<Session::Closed>(&*event)) {
          fuzz::require(closed->code == Code::kTimedOut);
        }
      }
      while (const std::size_t written = ends[i].next_datagram(now, buffer)) {
        if (flying[1 - i].size() < 64)
          flying[1 - i].emplace_back(buffer.begin(), buffer.begin() + static_cast<long>(written));
      }
    }
  }
  return 0;
}
