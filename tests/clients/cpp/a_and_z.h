// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <random>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "clients/cpp/force_client.h"
#include "protocol/field/receiver.h"
#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/session.h"

// A ForceClient (A), a server of the protocol's parts (Z) and a network between them on virtual time. The network loses
// and delays datagrams according to a seed.

namespace tendon::a_and_z {

inline const Address a_address = parse_address("127.0.0.2:50000");
inline const Address z_address = parse_address("127.0.0.1:47100");

/// The jitter reorders datagrams. The delay must be positive.
struct Weather {
  double loss = 0.05;
  Duration delay = std::chrono::milliseconds(5);
  Duration jitter = std::chrono::milliseconds(2);  ///< uniform, added to delay
};
inline constexpr Weather kFineWeather{.loss = 0, .delay = std::chrono::milliseconds(5), .jitter = Duration::zero()};

/// The force depends on the state, so a test can find out which state an answer belongs to.
inline Vec3 answer(const DeviceState& hand) { return -100 * hand.position; }

class Network {
 public:
  Network(Weather weather, std::uint64_t seed) : weather_(weather), random_(seed) {}

  void set(Weather weather) { weather_ = weather; }
  void send(LocalTime now, const Address& from, const Address& to, std::span<const std::byte> bytes);
  /// Receives the next datagram for `to` that is due at `now`. Returns the size of the datagram, or 0 if there is none.
  std::size_t receive(LocalTime now, const Address& to, Address& from, std::span<std::byte> buffer);
  /// Drops the datagrams that have arrived while there was no open socket.
  void drop_arrived(LocalTime now);
  LocalTime next_arrival() const { return flying_.empty() ? LocalTime::max() : flying_.begin()->first; }

 private:
  struct Datagram {
    Address from;
    Address to;
    std::vector<std::byte> bytes;
  };
  double uniform() { return static_cast<double>(random_() >> 11U) * 0x1p-53; }

  Weather weather_;
  std::mt19937_64 random_;
  std::multimap<LocalTime, Datagram> flying_;
};

class Port : public Link {
 public:
  Port(Network& network, const LocalTime& now, Address self) : network_(network), now_(now), self_(self) {}
  void send(const Address& to, std::span<const std::byte> datagram) override {
    ++sent;
    network_.send(now_, self_, to, datagram);
  }
  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    return network_.receive(now_, self_, from, buffer);
  }

  int sent = 0;

 private:
  Network& network_;
  const LocalTime& now_;
  Address self_;
};

/// Only serves the client that has connected last. The simulated hand moves along a known path.
class Server {
 public:
  Server(Link& link, std::uint8_t secret) : link_(link), handshake_(handshake_config(secret)) {}

  LocalTime turn(LocalTime now);
  static Vec3 position(std::uint64_t tick) { return {1e-3 * static_cast<double>(tick), 0, -1}; }
  void say_bye(LocalTime now, Code code);
  const LinkStats& link_stats() const { return session_->stats(); }

  std::optional<Refused> refusal;  ///< if this is set, all clients are refused with it
  bool features = true;
  static constexpr int kLoopHz = 1000;
  int state_hz = kLoopHz;
  std::optional<Turning> turning;
  std::uint64_t press_every = 0;  ///< button 1 is pressed in one of this many states, or never if this is 0

  std::vector<Code> lease_answers;  ///< the answers to take_lease, followed by kOk
  int snatches = 0;                 ///< leases that are taken by another client immediately

  /// The fields of the client; empty if they are not supported.
  std::optional<BrickStore> bricks;
  std::optional<FieldReceiver> fields;
  std::vector<FieldReceiver::Refusal> refused_fields;
  std::vector<FieldPose> poses;

  std::vector<LocalTime> attempts;  ///< contains an entry for each Hello with a valid cookie
  std::vector<Hello> hellos;
  std::vector<std::pair<LocalTime, ForceCommand>> forces;
  std::vector<Request> requests;  ///< requests except those for descriptions
  std::optional<Code> closed;
  int welcomes = 0;
  std::uint64_t tick = 0;

 private:
  static ServerHandshake::Config handshake_config(std::uint8_t secret) {
    ServerHandshake::Config config;
    config.secret.fill(std::byte{secret});
    return config;
  }
  void hello(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void give_lease(std::uint32_t id, const TakeLease& wanted);
  void take_field(LocalTime now, const Session::Event& event);
  Code answer_to(LocalTime now, const Request& request);
  void flush(LocalTime now);

  Link& link_;
  ServerHandshake handshake_;
  std::optional<Session> session_;
  Address client_;
  std::optional<std::array<std::byte, 16>> attempt_;
  std::vector<std::byte> answer_;
  std::uint32_t connection_id_ = 0;
  LocalTime next_state_{};
};

/// Runs A, Z and the network in virtual time. The one with the earliest wake-up is always next.
class World {
 public:
  explicit World(std::uint64_t seed, Weather weather = {})
      : network_(weather, seed), a_port(network_, now, a_address), z_port(network_, now, z_address) {
    z.emplace(z_port, std::uint8_t{1});
  }

  LocalTime now = LocalTime(std::chrono::seconds(1000));

  template <typename Callback>
  void connect(ForceClient::Config config, Callback callback) {
    a.emplace(a_port, z_address, config, std::move(callback), now);
  }
  void run(Duration length);
  bool run_until(ForceClient::Phase phase, Duration limit);
  void restart_server() {
    kill_server();
    z.emplace(z_port, std::uint8_t{2});
  }
  void kill_server() { z.reset(); }
  Network& network() { return network_; }

 private:
  void turn();
  LocalTime next() const;
  /// Advances the time to the next wake-up. Throws std::logic_error if that is not later than now.
  void advance();

  Network network_;
  LocalTime a_next_{};
  LocalTime z_next_{};
  int turns_at_once_ = 0;

 public:
  Port a_port;
  Port z_port;
  std::optional<ForceClient> a;
  std::optional<Server> z;
};

}  // namespace tendon::a_and_z
