// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "protocol/messages.h"
#include "protocol/session.h"

namespace tendon::dash {

enum class Contact : std::uint8_t {
  kGreeting,    ///< connecting
  kOpen,        ///< a session is open
  kUnanswered,  ///< no answer; retrying
  kRefused,     ///< the server refused the connection; retrying
  kLost,        ///< the session ended; reconnecting
};

enum class Order : std::uint8_t { kArm, kDisarm, kEngage, kDisengage };  ///< commands of the buttons on the page

struct Press {
  enum class State : std::uint8_t { kUnderWay, kDone, kFailed };
  std::uint32_t device = 0;
  Order order = Order::kDisarm;
  State state = State::kUnderWay;
  std::string words;  ///< for the user
};

/// The known state of a server. The Observer updates it; Feed sends it to the page, and /metrics exports it. Counters
/// never decrease during the lifetime of this object, even if the server restarts. Thread-safe: no. Realtime-safe: no.
class Board {
 public:
  /// Limit of states waiting for the page, per device: half a second at 1 kHz. The page reads them 60 times per
  /// second. The oldest states are dropped and counted.
  static constexpr std::size_t kMaxWaiting = 500;
  static constexpr std::size_t kReasons = 32;
  static constexpr std::size_t kMaxPortsWaiting = 25;  ///< half a second of coupling states; the oldest are dropped

  /// The engine at one channel of a device, from the latest report.
  struct Engine {
    PeerReport newest;
    // Sums over all reports.
    std::uint64_t forces = 0;
    std::uint64_t late_server = 0;
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    RefusedForces refused{};
    std::uint64_t silent_for = 0;  ///< device reports since the engine's last one; no more come after it has left
  };

  /// The newest state of each end of a coupling.
  struct Ports {
    PeerTime at;  ///< newest sampling time of the device when `own` arrived, because the port's own time uses an
                  ///< unrelated clock
    PortFrame own;
    std::optional<PortFrame> peer;  ///< newest state of the peer, if any
  };

  struct Device {
    std::optional<DeviceDescription> about;
    std::optional<HandleDescription> handle;  ///< for this session; empty until it arrives
    std::optional<DeviceState> newest;
    std::vector<DeviceState> waiting;  ///< states waiting for the page, in order
    std::uint64_t dropped = 0;         ///< dropped states, if the page is slow
    std::uint64_t states = 0;
    std::array<std::uint64_t, kReasons> limited{};  ///< states with each bit of core/base/reason.h
    std::optional<DeviceReport> report;
    // Sums over all reports.
    LatenessHistogram lateness{};
    std::uint64_t steps = 0;
    std::uint64_t missed = 0;
    std::uint64_t overruns = 0;
    std::uint64_t unseen = 0;
    std::map<std::uint32_t, Engine> engines;  ///< by channel
    std::optional<Ports> ports;               ///< empty without a coupling
    std::vector<Ports> ports_waiting;         ///< waiting for the page, in order; at most kMaxPortsWaiting
  };

  void tell(Contact contact, std::string words);
  void tell(Press press);
  void welcomed(const Welcome& welcome);  ///< discards the handles: this may be a different server
  void described(const DeviceDescription& about);
  void described(const HandleDescription& handle);
  void counted(std::uint32_t devices);  ///< removes devices with larger indices, which belonged to another server
  void observe(const DeviceState& state);
  void observe(const DeviceReport& report);
  void observe(const PeerReport& report);
  void observe(const PortFrame& port);
  void observe(const LinkStats& link) { link_ = link; }
  /// Offset of the server's clock from the local clock. Empty if it is not known yet.
  void observe_clock(std::optional<Duration> server_ahead) { server_ahead_ = server_ahead; }

  Contact contact() const noexcept { return contact_; }
  const std::string& words() const noexcept { return words_; }  ///< state of the connection, for the user
  const std::optional<Press>& press() const noexcept { return press_; }
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  const LinkStats& link() const noexcept { return link_; }
  std::optional<Duration> server_ahead() const noexcept { return server_ahead_; }
  std::uint64_t sessions() const noexcept { return sessions_; }
  const std::map<std::uint32_t, Device>& devices() const noexcept { return devices_; }  ///< by index

  /// Incremented when the connection, a button press, the devices or their descriptions change.
  std::uint64_t version() const noexcept { return version_; }
  std::vector<DeviceState> take_states(std::uint32_t device);  ///< removes and returns the waiting states of a device
  std::vector<Ports> take_ports(std::uint32_t device);

 private:
  Contact contact_ = Contact::kGreeting;
  std::string words_ = "connecting to the server";
  std::optional<Press> press_;
  std::optional<Welcome> welcome_;
  LinkStats link_;
  std::optional<Duration> server_ahead_;
  std::uint64_t sessions_ = 0;
  std::uint64_t version_ = 1;
  std::map<std::uint32_t, Device> devices_;
};

std::optional<PortRole> role_of(const Board::Ports& ports);  ///< the role of the device, if it is known

/// Returns the energy that both ends of a coupling may still output, in J of the leader: both accounts plus payments
/// in transit. One joule of the follower is s_f/s_x joules of the leader. Returns nullopt if the scales are unknown,
/// if there is no account, or if one of the ends has not received the state of the other end.
std::optional<double> pair_account(const Board::Ports& ports);

}  // namespace tendon::dash
