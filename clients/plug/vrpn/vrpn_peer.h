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

#include "clients/plug/vrpn/vrpn_force.h"
#include "clients/plug/vrpn/vrpn_message.h"
#include "clients/plug/vrpn/vrpn_station.h"

namespace tendon::plug::vrpn {

/// One instant: for intervals, and for the stamps of messages.
struct Moment {
  LocalTime at{};
  Duration since_1970{};
};

/// The conversation with one VRPN program (VRPN.md). Bytes and instants go in; bytes, sentences and what the
/// program has drawn come out. It has no socket and no clock.
///
///     Peer peer(stations, number, now);
///     peer.take_stream(now, bytes); peer.take_datagram(now, bytes);      all that has come, then
///     peer.end_of_batch(now);
///     peer.report(now, i, state, round_trip);                            for each new state of station i
///     write peer.stream(), peer.sent(n); send each of peer.datagrams()   to peer.udp_port()
///
/// * **Bounded.** A message that says it is longer than kLongestPayload, a cookie of another major version and more
///   than kMaxUnread bytes that the program does not read end it (`end()`). Everything else that makes no sense is
///   counted.
/// * **Newest wins.** Of more than kMaxPerSecond messages in a second all but the newest of each batch are skipped and
///   counted; descriptions never are.
/// * **Reports.** Pose at every state; velocity, force and channels at every tenth; a button when it changes. By UDP
///   once the program has described a port, and as one datagram a state where they fit; buttons and texts always by
///   TCP.
///
/// Thread-safe: no. Realtime-safe: no.
class Peer {
 public:
  static constexpr std::size_t kMaxUnread = 64 * 1024;
  static constexpr int kMaxPerSecond = 4000;
  static constexpr int kBurst = 256;              ///< messages that may come at once
  static constexpr int kRareReports = 10;         ///< one in so many has velocity, force and channels
  static constexpr int kForceError = 2;           ///< vrpn_ForceDevice's FD_FORCE_ERROR
  static constexpr std::size_t kMaxWarnings = 8;  ///< names and types that one program is told about

  struct Counts {
    std::uint64_t messages = 0;      ///< that came, but for descriptions
    std::uint64_t skipped = 0;       ///< of these, because there were too many
    std::uint64_t nonsense = 0;      ///< not understood, or with impossible values
    std::uint64_t not_rendered = 0;  ///< meshes, effects and what else no device here can do
    std::uint64_t reports = 0;       ///< poses sent
  };

  /// `stations` must outlive this object.
  Peer(std::span<const Station> stations, const Moment& now);

  void take_stream(const Moment& now, Bytes bytes);
  void take_datagram(const Moment& now, Bytes datagram);
  void end_of_batch(const Moment& now);
  void report(const Moment& now, std::size_t station, const DeviceState& state, Duration round_trip);
  /// A text that the program's user sees.
  void tell(const Moment& now, std::size_t station, Severity severity, std::string_view text);
  /// Says where we take datagrams. `host` is for VRPN's eyes only.
  void describe_port(const Moment& now, std::string_view host, std::uint16_t port);

  Bytes stream() const { return std::span(out_).subspan(sent_); }
  void sent(std::size_t bytes);
  std::vector<Buffer>& datagrams() { return datagrams_; }
  /// The program's port for datagrams, at the address that its TCP connection has; empty: it takes none.
  std::optional<std::uint16_t> udp_port() const { return udp_port_; }

  /// What the program has drawn around a station, and whether that has changed since the last call.
  Drawing& drawing(std::size_t station) { return wishes_[station].drawing; }
  const Freshness& freshness(std::size_t station) const { return wishes_[station].freshness; }
  bool take_change(std::size_t station) { return std::exchange(wishes_[station].changed, false); }

  /// Whether it has sent more than its share: who reads it may let it wait.
  bool is_above_its_share() const { return allowance_ < 1; }
  bool open() const { return open_; }  ///< its cookie has come, and is right
  /// Why the conversation is over; empty while it is not.
  const std::string& end() const { return end_; }
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
    Freshness freshness;
    bool changed = false;
  };
  struct Told {
    bool any = false;  ///< a state
    double next_tick = 0;
    double period_ticks = 1;
    std::uint64_t reports = 0;
    int buttons = 0;  ///< that it knows of
    std::uint32_t held = 0;
    bool stopped = false;
  };

  void take(const Moment& now, const Message& message);
  void take_system(const Message& message);
  void understand(const Moment& now, std::size_t station, Type type, Bytes payload);
  void not_rendered(const Moment& now, std::size_t station, const std::string& what);
  void describe_all(const Moment& now);
  void say(std::string sentence);
  /// Ends a payload that has been appended to `payload_` and sends it.
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

  std::vector<std::int32_t> senders_;  ///< the program's number → station, or kNobody
  std::vector<Name> types_;            ///< the program's number → type

  double allowance_ = kBurst;  ///< messages
  LocalTime allowed_{};
  struct Held {
    Message message;
    Buffer payload;
  };
  std::optional<Held> held_;  ///< the newest of those above the allowance

  std::set<std::string, std::less<>> warned_;
  std::deque<std::string> sentences_;
  Counts counts_;
};

}  // namespace tendon::plug::vrpn
