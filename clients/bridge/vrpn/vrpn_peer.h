// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "clients/bridge/bridge_loop.h"
#include "clients/bridge/stream_freshness.h"
#include "clients/bridge/vrpn/vrpn_force.h"
#include "clients/bridge/vrpn/vrpn_message.h"
#include "clients/bridge/vrpn/vrpn_station.h"

namespace tendon::bridge::vrpn {

using bridge::Moment;

/// The connection to one VRPN program (VRPN.md) as a state machine: bytes and times in; bytes, messages and the
/// program's requests out. This class does not use sockets or clocks.
///
///     Peer peer(stations, number, now);
///     peer.take_stream(now, bytes); peer.take_datagram(now, bytes);      for everything received, then
///     peer.end_of_batch(now);
///     peer.report(now, i, state, round_trip);                            for each new state of station i
///     write peer.stream(), peer.sent(n); send each of peer.datagrams()   to peer.udp_port()
///
/// * **Bounded.** The connection ends (`end()`) after a message longer than kLongestPayload, a cookie of another
///   major version, or more than kMaxUnread unread bytes. Other invalid input is counted.
/// * **Newest wins.** Above kMaxPerSecond messages per second, only the newest message of each batch is handled. The
///   others are skipped and counted, except descriptions.
/// * **Reports.** The pose is sent for every state; velocity, force and channels for every tenth; buttons when they
///   change. Reports are sent over UDP once the program has described a port, if possible in one datagram per state.
///   Buttons and texts are always sent over TCP.
///
/// Thread-safe: no. Realtime-safe: no.
class Peer {
 public:
  static constexpr std::size_t kMaxUnread = 64 * 1024;
  static constexpr int kMaxPerSecond = 4000;
  static constexpr int kBurst = 256;
  static constexpr int kRareReports = 10;         ///< divider of velocity, force and channel reports
  static constexpr int kForceError = 2;           ///< of vrpn_ForceDevice
  static constexpr std::size_t kMaxWarnings = 8;  ///< unknown names and types reported to one program

  struct Counts {
    std::uint64_t messages = 0;      ///< received, without descriptions
    std::uint64_t skipped = 0;       ///< messages that were skipped because of the rate limit
    std::uint64_t nonsense = 0;      ///< unknown messages or invalid values
    std::uint64_t not_rendered = 0;  ///< meshes, effects and other unsupported requests
    std::uint64_t reports = 0;       ///< poses sent
  };

  Peer(std::span<const Station> stations, const Moment& now);  ///< `stations` must outlive this object

  void take_stream(const Moment& now, Bytes bytes);
  void take_datagram(const Moment& now, Bytes datagram);
  void end_of_batch(const Moment& now);
  void report(const Moment& now, std::size_t station, const DeviceState& state, Duration round_trip);
  /// Sends a text that is shown to the user of the program.
  void tell(const Moment& now, std::size_t station, Severity severity, std::string_view text);
  /// Announces the UDP port of this server. `host` is required by VRPN but not used otherwise.
  void describe_port(const Moment& now, std::string_view host, std::uint16_t port);

  Bytes stream() const { return std::span(out_).subspan(sent_); }
  void sent(std::size_t bytes);
  std::vector<Buffer>& datagrams() { return datagrams_; }
  std::optional<std::uint16_t> udp_port() const { return udp_port_; }  ///< at its TCP address; empty: none

  /// The requests of the program for a station, and whether they have changed since the last call.
  Drawing& drawing(std::size_t station) { return wishes_[station].drawing; }
  const StreamFreshness& freshness(std::size_t station) const { return wishes_[station].freshness; }
  bool take_change(std::size_t station) { return std::exchange(wishes_[station].changed, false); }

  bool is_above_its_share() const { return allowance_ < 1; }  ///< above its message rate; reading may be delayed
  bool open() const { return open_; }                         ///< a valid cookie was received
  const std::string& end() const { return end_; }  ///< reason for the end of the connection; empty while it is open
  std::optional<std::string> next_sentence();
  const Counts& counts() const { return counts_; }

 private:
  static constexpr std::int32_t kNobody = -1;
  struct Name {
    std::optional<Type> type;
    std::string text;
  };
  struct Wish {
    Drawing drawing;
    StreamFreshness freshness;
    bool changed = false;
  };
  struct Told {
    bool any = false;
    double next_tick = 0;
    double period_ticks = 1;
    std::uint64_t reports = 0;
    int buttons = 0;  ///< number of buttons known to the program
    std::uint32_t held = 0;
    bool stopped = false;
  };

  void take(const Moment& now, const Message& message);
  void take_system(const Message& message);
  void understand(const Moment& now, std::size_t station, Type type, Bytes payload);
  void not_rendered(const Moment& now, std::size_t station, const std::string& what);
  void describe_all(const Moment& now);
  void say(std::string sentence);
  /// Completes the payload in `payload_` and sends it.
  void send(const Moment& now, std::int32_t sender, std::int32_t type, bool soon);
  void send(const Moment& now, std::size_t station, Type type, bool soon) {
    send(now, static_cast<std::int32_t>(station), static_cast<std::int32_t>(type), soon);
  }

  std::span<const Station> stations_;
  std::vector<Wish> wishes_;
  std::vector<Told> told_;

  bool open_ = false;
  std::string end_;
  Buffer in_;
  Buffer out_;
  std::size_t sent_ = 0;
  std::vector<Buffer> datagrams_;
  Buffer payload_;
  std::uint32_t sequence_ = 0;
  std::optional<std::uint16_t> udp_port_;

  std::vector<std::int32_t> senders_;  ///< number used by the program → station, or kNobody
  std::vector<Name> types_;            ///< number used by the program → type

  double allowance_ = kBurst;
  LocalTime allowed_{};
  struct Held {
    Message message;
    Buffer payload;
  };
  std::optional<Held> held_;  ///< newest message above the rate limit

  std::set<std::string, std::less<>> warned_;
  std::deque<std::string> sentences_;
  Counts counts_;
};

}  // namespace tendon::bridge::vrpn
