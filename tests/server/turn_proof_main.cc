// SPDX-License-Identifier: Apache-2.0
// This program is used by turn_proof_test.cc. A state is sent from its mailbox to an engine and the force is sent back,
// through the network loops of the server and a client. They are busy-polling, unencrypted and without sockets. It
// prints the clock readings, link polls and datagrams of the longer run. Callgrind counts within `exchange_in_turn` and
// writes a file each time the function returns.
#include <algorithm>
#include <array>
#include <cstdlib>
#include <iostream>
#include <memory>
#include <vector>

#include "clients/cpp/force_client.h"
#include "protocol/busy_link.h"
#include "server/network_loop.h"

using namespace tendon;

namespace {

struct Clock {
  LocalTime now{std::chrono::seconds(1)};
  std::uint64_t readings = 0;
  LocalTime read() noexcept {
    ++readings;
    return now += std::chrono::nanoseconds(100);
  }
};

/// One direction of the wire and the datagram that is in flight. There can be only one after the handshake.
struct Half {
  struct Datagram {
    std::array<std::byte, kMaxDatagram> bytes;
    std::size_t size = 0;
  };
  std::array<Datagram, 8> ring;
  std::size_t put = 0;
  std::size_t taken = 0;
};

class MemoryLink final : public Link {
 public:
  MemoryLink(Half& in, Half& out, Clock& clock, const Address& peer) : in_(in), out_(out), clock_(clock), peer_(peer) {}
  void send(const Address& to, std::span<const std::byte> datagram) override {
    if (to != peer_ || out_.put - out_.taken == out_.ring.size()) std::abort();
    Half::Datagram& free = out_.ring[out_.put++ % out_.ring.size()];
    std::copy(datagram.begin(), datagram.end(), free.bytes.begin());
    free.size = datagram.size();
    ++sent;
  }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    ++looks;
    if (in_.taken == in_.put) return 0;
    const Half::Datagram& next = in_.ring[in_.taken++ % in_.ring.size()];
    std::copy_n(next.bytes.begin(), std::min(next.size, buffer.size()), buffer.begin());
    from = peer_;
    return next.size;
  }
  LocalTime present(LocalTime now) const override { return std::max(now, clock_.read()); }

  std::uint64_t looks = 0;
  std::uint64_t sent = 0;

 private:
  Half& in_;
  Half& out_;
  Clock& clock_;
  Address peer_;
};

class Pair {
 public:
  Pair() {
    for (int i = 0; i < 20; ++i) exchange();
    if (client_.phase() != ForceClient::Phase::kOpen) std::abort();
  }

  /// Puts a state into its mailbox like a haptic step, and takes the force from the other one.
  void exchange() {
    clock_.now += std::chrono::microseconds(990);
    DeviceState& state = mail_->state.back();
    state.tick = ++tick_;
    state.sampled = PeerTime(clock_.now.time_since_epoch());
    state.position = Vec3(0.0123, -0.0456, 0.0789);
    state.velocity = Vec3(0.1, -0.2, 0.3);
    state.force_applied = Vec3(-1.5, 2.5, 0.25);
    state.energy = 0.0123;
    state.permitted_force = 3.4;
    state.force_sequence = tick_;
    state.force_age = std::chrono::milliseconds(7);
    state.mode = Mode::kActive;
    mail_->state.put();
    // At each end, there is no datagram in the first poll, but there is one in the second poll.
    LocalTime at_client = clock_.now;
    LocalTime at_server = clock_.now;
    client_busy_.look(at_client);
    network_.turn(clock_.read());
    server_busy_.look(at_server);
    if (client_busy_.look(at_client) || client_.phase() != ForceClient::Phase::kOpen) client_.turn(at_client);
    if (server_busy_.look(at_server)) network_.turn(at_server);
    while (mail_->datagrams.front() != nullptr) mail_->datagrams.pop();
    const RemoteForce* const force = mail_->forces[0].take();
    forces += force != nullptr && force->answers_tick == tick_ ? 1 : 0;
  }

  std::uint64_t readings() const noexcept { return clock_.readings; }
  std::uint64_t looks() const noexcept { return server_link_.looks + client_link_.looks; }
  std::uint64_t sent() const noexcept { return server_link_.sent + client_link_.sent; }
  std::uint64_t forces = 0;  ///< number of forces that answered the state of the turn

 private:
  static NetworkLoop::Config server_config(Mailboxes& mail) {
    NetworkLoop::Config config;
    config.devices = {
        {.about = {.name = "proof", .model = "proof", .max_force = 200, .loop_hz = 1000, .channels = {{}}},
         .mail = &mail}};
    return config;
  }
  static ForceClient::Config client_config() {
    ForceClient::Config config;
    config.name = "wall";
    config.seed = 7;
    return config;
  }

  const Address server_ = parse_address("127.0.0.1:47100");
  const Address client_address_ = parse_address("127.0.0.1:50000");
  Clock clock_;
  Half to_server_, to_client_;
  MemoryLink server_link_{to_server_, to_client_, clock_, client_address_};
  MemoryLink client_link_{to_client_, to_server_, clock_, server_};
  BusyLink server_busy_{server_link_};
  BusyLink client_busy_{client_link_};
  std::unique_ptr<Mailboxes> mail_ = std::make_unique<Mailboxes>();
  NetworkLoop network_{server_config(*mail_), server_busy_, clock_.now};
  ForceClient client_{
      client_busy_, server_, client_config(),
      [](const DeviceState& hand) -> Touch { return Vec3(-2000 * std::max(0.0, hand.position.x()), 0, 0); },
      clock_.now};
  std::uint64_t tick_ = 0;
};

}  // namespace

/// This function is neither inlined nor mangled, so callgrind can find it.
extern "C" [[gnu::noinline]] void exchange_in_turn(Pair& pair, std::uint64_t times) {
  for (std::uint64_t i = 0; i < times; ++i) pair.exchange();
}

int main() {
  Pair pair;
  exchange_in_turn(pair, 100);
  const std::uint64_t readings = pair.readings();
  const std::uint64_t looks = pair.looks();
  const std::uint64_t sent = pair.sent();
  const std::uint64_t forces = pair.forces;
  exchange_in_turn(pair, 600);
  std::cout << pair.readings() - readings << ' ' << pair.looks() - looks << ' ' << pair.sent() - sent << ' '
            << pair.forces - forces << '\n';
}
