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
#include "protocol/handshake.h"
#include "protocol/link.h"
#include "protocol/session.h"

// Two ends and what lies between them, on virtual time: A is the guest under test, Z a server written
// out by hand from the protocol's own parts, and the network loses and delays by one seed.

namespace tendon::a_and_z {

inline const Address a_address = parse_address("127.0.0.2:50000");
inline const Address z_address = parse_address("127.0.0.1:47100");

/// Loses, delays and (by its jitter) reorders. The delay must be above zero.
struct Weather {
  double loss = 0.05;
  Duration delay = std::chrono::milliseconds(5);
  Duration jitter = std::chrono::milliseconds(2);  ///< uniform, added to delay
};
inline constexpr Weather kFineWeather{.loss = 0, .delay = std::chrono::milliseconds(5), .jitter = Duration::zero()};

/// A force that identifies the state that it answers.
inline Vec3 answer(const DeviceState& hand) { return -100 * hand.position; }

class Network {
 public:
  Network(Weather weather, std::uint64_t seed) : weather_(weather), random_(seed) {}

  void set(Weather weather) { weather_ = weather; }
  void send(LocalTime now, const Address& from, const Address& to, std::span<const std::byte> bytes);
  /// The next datagram for `to` that is due at `now`; 0 when none.
  std::size_t receive(LocalTime now, const Address& to, Address& from, std::span<std::byte> buffer);
  /// What nobody has taken when it arrived is gone: there was no socket.
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

/// One end's view of the network. Its time is the world's.
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

  int sent = 0;  ///< datagrams

 private:
  Network& network_;
  const LocalTime& now_;
  Address self_;
};

/// Z: one guest at a time, the newest one; states of a hand that moves along a known path.
class Server {
 public:
  Server(Link& link, std::uint8_t secret) : link_(link), doorman_(doorman_config(secret)) {}

  LocalTime turn(LocalTime now);
  /// The position of the hand at a tick, m.
  static Vec3 position(std::uint64_t tick) { return {1e-3 * static_cast<double>(tick), 0, -1}; }
  void say_bye(LocalTime now, Code code);
  /// Of the open session.
  const LinkStats& link_stats() const { return session_->stats(); }

  std::optional<Refused> refusal;  ///< set: everybody is refused with it
  bool features = true;            ///< agree to whatever is offered, or to nothing
  static constexpr int kLoopHz = 1000;
  int state_hz = kLoopHz;
  std::optional<Turning> turning;  ///< of the handle, in each state
  std::uint64_t press_every = 0;   ///< ticks: button 1 is held in one state of so many, unless 0

  std::vector<Code> lease_answers;  ///< to take_lease, in this order; then kOk
  int snatches = 0;                 ///< so many leases are another one's as soon as they are given

  std::vector<LocalTime> attempts;  ///< when Hellos with a good cookie came, one per attempt
  std::vector<Hello> hellos;        ///< … and what they said
  std::vector<std::pair<LocalTime, ForceCommand>> forces;
  std::vector<Request> requests;  ///< but for descriptions: everybody asks for those
  std::optional<Code> closed;     ///< how the last session ended
  int welcomes = 0;
  std::uint64_t tick = 0;  ///< of the newest state sent

 private:
  static Doorman::Config doorman_config(std::uint8_t secret) {
    Doorman::Config config;
    config.secret.fill(std::byte{secret});
    return config;
  }
  void hello(LocalTime now, const Address& from, std::span<const std::byte> datagram);
  void give_lease(std::uint32_t id, const TakeLease& wanted);
  void flush(LocalTime now);

  Link& link_;
  Doorman doorman_;
  std::optional<Session> session_;
  Address guest_;
  std::optional<std::array<std::byte, 16>> attempt_;
  std::vector<std::byte> answer_;
  std::uint32_t connection_id_ = 0;
  LocalTime next_state_{};
};

/// A, Z and the network, turned in the order of their next wake-up.
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
  /// Lets time pass.
  void run(Duration length);
  /// Lets time pass until A is in `phase`; false when it is not within `limit`.
  bool run_until(ForceClient::Phase phase, Duration limit);
  /// Z dies without a word and comes back with another secret.
  void restart_server() {
    kill_server();
    z.emplace(z_port, std::uint8_t{2});
  }
  void kill_server() { z.reset(); }
  Network& network() { return network_; }

 private:
  void turn();
  LocalTime next() const;
  /// To the next wake-up. Throws std::logic_error when time stands still.
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
