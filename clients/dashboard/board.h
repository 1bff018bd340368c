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

/// State of the connection to the server.
enum class Contact : std::uint8_t {
  kGreeting,    ///< an attempt is under way
  kOpen,        ///< states come in
  kUnanswered,  ///< nobody answers; it keeps trying
  kRefused,     ///< the server said no; it keeps trying
  kLost,        ///< a session has ended; it tries again
};

/// What the buttons of the page order.
enum class Order : std::uint8_t { kArm, kDisarm, kEngage, kDisengage };

/// The result of the newest press of a button.
struct Press {
  enum class State : std::uint8_t { kUnderWay, kDone, kFailed };
  std::uint32_t device = 0;
  Order order = Order::kDisarm;
  State state = State::kUnderWay;
  std::string words;  ///< for people
};

/// All that is known of a server at this instant, as values. The Observer writes them, Feed tells them to the page, and
/// /metrics exports them. Counters never shrink while this object lives, even when the server restarts.
///
/// Thread-safe: no. Realtime-safe: no.
class Board {
 public:
  /// The most states of a device that wait for the page; when there are more, the oldest are dropped and counted. Half
  /// a second at 1 kHz; the page takes them sixty times a second.
  static constexpr std::size_t kMaxWaiting = 500;
  static constexpr std::size_t kReasons = 32;
  /// Half a second of both ends of a coupling, for the page; when there are more, the oldest are dropped.
  static constexpr std::size_t kMaxPortsWaiting = 25;

  /// The engine at one channel of a device, as the server last reported it.
  struct Engine {
    PeerReport newest;
    // Sums over all reports.
    std::uint64_t forces = 0;
    std::uint64_t late_server = 0;
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    RefusedForces refused{};
    /// Reports on the device since the last report on this engine. Reports on an engine end when it leaves.
    std::uint64_t silent_for = 0;
  };

  /// Both ends of a device's coupling at one time.
  struct Ports {
    PeerTime at;  ///< the device's newest sample when `own` came: a port's own time is of no clock
    PortFrame own;
    std::optional<PortFrame> peer;  ///< the newest that had come; empty: none, or the device is alone or has lost it
  };

  struct Device {
    std::optional<DeviceDescription> about;
    std::optional<HandleDescription> handle;  ///< of this session's server; empty: it has not told
    std::optional<DeviceState> newest;
    std::vector<DeviceState> waiting;  ///< not yet told to the page, in order
    std::uint64_t dropped = 0;         ///< states dropped because nobody took them
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
    std::optional<Ports> ports;               ///< the newest; empty: the device has no coupling
    std::vector<Ports> ports_waiting;         ///< not yet told to the page, in order; at most kMaxPortsWaiting
  };

  void tell(Contact contact, std::string words);
  void tell(Press press);
  /// A session has begun: what the handles are has to be told anew, because this may be another server.
  void welcomed(const Welcome& welcome);
  void described(const DeviceDescription& about);
  void described(const HandleDescription& handle);
  /// The number of devices is known: any beyond it belonged to another server.
  void counted(std::uint32_t devices);
  void observe(const DeviceState& state);
  void observe(const DeviceReport& report);
  void observe(const PeerReport& report);
  void observe(const PortFrame& port);
  void observe(const LinkStats& link) { link_ = link; }
  /// How far the server's clock is ahead of ours; empty: not known yet in this session.
  void observe_clock(std::optional<Duration> server_ahead) { server_ahead_ = server_ahead; }

  Contact contact() const noexcept { return contact_; }
  const std::string& words() const noexcept { return words_; }  ///< about the contact, for people
  const std::optional<Press>& press() const noexcept { return press_; }
  const std::optional<Welcome>& welcome() const noexcept { return welcome_; }
  const LinkStats& link() const noexcept { return link_; }
  std::optional<Duration> server_ahead() const noexcept { return server_ahead_; }
  std::uint64_t sessions() const noexcept { return sessions_; }
  const std::map<std::uint32_t, Device>& devices() const noexcept { return devices_; }  ///< by number

  /// Grows when the contact, a press, the devices or what they are has changed.
  std::uint64_t version() const noexcept { return version_; }
  /// Takes out the waiting states of a device; empty for a device that does not exist.
  std::vector<DeviceState> take_states(std::uint32_t device);
  /// The same of both ends of its coupling.
  std::vector<Ports> take_ports(std::uint32_t device);

 private:
  Contact contact_ = Contact::kGreeting;
  std::string words_ = "looking for the server";
  std::optional<Press> press_;
  std::optional<Welcome> welcome_;
  LinkStats link_;
  std::optional<Duration> server_ahead_;
  std::uint64_t sessions_ = 0;
  std::uint64_t version_ = 1;
  std::map<std::uint32_t, Device> devices_;
};

/// Whether the device leads or follows; empty: not known yet.
std::optional<PortRole> role_of(const Board::Ports& ports);

/// J of the leader that both ends of a coupling may still give out: both accounts, and what one has paid and the other
/// has not heard of yet. One joule of the follower is s_f/s_x of the leader's. Empty: the scales are not known, no end
/// has a purse, or the two ends have not heard of each other yet.
std::optional<double> pair_account(const Board::Ports& ports);

}  // namespace tendon::dash
