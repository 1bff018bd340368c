// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <variant>

#include "core/base/time.h"
#include "core/estimation/clock_offset_estimator.h"
#include "protocol/limits.h"
#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/secrets/seal.h"

namespace tendon {

/// Everything that is counted about one conversation. Bad input is counted here and nowhere else.
///
/// Each datagram received adds one to exactly one of `datagrams_received`, `duplicated`, `malformed`,
/// `forged`, `old_key`.
struct LinkStats {
  std::uint64_t datagrams_sent = 0;
  std::uint64_t datagrams_received = 0;  ///< accepted ones
  std::uint64_t lost = 0;                ///< peer packet numbers never seen (so far)
  std::uint64_t lost_outgoing = 0;       ///< ours that the peer had not seen, as far as its ack vectors reach
  std::uint64_t seen_outgoing = 0;       ///< … and those that it had
  std::uint64_t reordered = 0;           ///< accepted, but older than one seen before
  std::uint64_t duplicated = 0;          ///< seen before, older than the window, or of the handshake: dropped
  std::uint64_t malformed = 0;           ///< not a datagram of this conversation: dropped
  std::uint64_t forged = 0;              ///< suite 1: did not open; forged, or damaged under way: dropped
  std::uint64_t old_key = 0;             ///< suite 1: of a key that is over, or far ahead: dropped
  std::uint64_t invalid = 0;             ///< well-formed, with a value out of bounds (NaN, Inf …): frame dropped
  std::uint64_t stale = 0;               ///< state, force or report not newer than the newest one: frame dropped
  Duration round_trip{};                 ///< newest sample, (T4 − T1) − (T3 − T2); 0 = none yet
  Duration smoothed_round_trip{};        ///< RFC 6298 SRTT
  Duration round_trip_variation{};       ///< RFC 6298 RTTVAR
};

/// One open conversation between a client and a server, seen from either end: bytes and instants in,
/// bytes and events out (sans-I/O, pull). It has no socket, clock, thread or randomness of its own.
///
/// * State, force and the reports are unreliable and newest-wins, those of each device and channel by
///   themselves: `send` replaces what has not left yet, and a received one older than the newest is dropped and
///   counted.
/// * Requests are reliable and in order: resent until answered. Between requests, states and forces no
///   order is promised.
/// * Every datagram carries tx_time and an Echo, so each gives a round trip and an ack vector.
/// * Silence is filled with keep-alives and, when too long, ends the conversation.
///
/// Nothing queues without a bound: there is room for one state and one report of each device, one force and one report
/// of each channel, one report of the link and limits::kRequestWindow requests each way; an event that was not taken
/// out is replaced by a newer one of its kind.
///
/// SESSION.md describes the behaviour over time, WIRE.md the bytes.
///
/// Use: `receive` what arrives and `tick` when `next_tick()` is due; then pull `next_event` and
/// `next_datagram` until they are empty. `now` never goes back.
///
/// Thread-safe: no. Realtime-safe: no.
class Session {
 public:
  struct Config {
    std::uint32_t connection_id = 0;
    /// Longest silence we leave: five are lost before a server comes to its 250 ms safe stop.
    Duration keep_alive = std::chrono::milliseconds(50);
    /// Silence of the peer after which it is gone: longer than a Wi-Fi roam, shorter than patience.
    Duration timeout = std::chrono::seconds(2);
    /// A request is sent again after max(this, SRTT + 4 RTTVAR). Below it a peer that is merely scheduled
    /// late (tens of ms on a virtual machine) would be asked twice.
    Duration min_resend = std::chrono::milliseconds(20);

    // In suite 1:
    Rekey rekey{};
    /// After this age a session ends, kExpired: a new handshake, and no key is older than a day.
    Duration life = std::chrono::hours(24);
    /// … or when so many datagrams have left: a packet number is never used twice.
    std::uint64_t max_datagrams = limits::kMaxPacketNumber;
  };

  /// Either end of a conversation. `opened` is the instant of the handshake's end. The first datagram is
  /// due at once, so that the peer knows us to be there and both have a round trip.
  /// Throws std::invalid_argument when a duration of `config` is not positive.
  Session(const Config& config, LocalTime opened);
  /// … sealed, in suite 1.
  Session(const Config& config, const SessionKeys& keys, LocalTime opened);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // What can be told to the owner.
  struct StateArrived {
    DeviceState state;
  };
  struct ForceArrived {
    ForceCommand command;
  };
  struct ReportArrived {
    LinkReport report;
  };
  struct DeviceReportArrived {
    DeviceReport report;
  };
  struct PeerReportArrived {
    PeerReport report;
  };
  struct RequestArrived {
    std::uint32_t id;
    Request request;
  };
  struct RequestAnswered {
    std::uint32_t id;
    Code code;
    std::string detail;
    Duration wait{};                            ///< with kBusy of a TakeLease; 0 = nobody knows
    std::optional<DeviceDescription> device{};  ///< with kOk of a Describe
  };
  struct Closed {
    Code code;  ///< as the peer said Bye: kOk, kShutdown …; kTimedOut: it fell silent; kExpired: too old
    std::string reason;
  };
  using Event = std::variant<StateArrived, ForceArrived, ReportArrived, DeviceReportArrived, PeerReportArrived,
                             RequestArrived, RequestAnswered, Closed>;

  // In.
  /// Takes any bytes. A datagram that is not a good one of this conversation is counted and dropped. True when
  /// it was good and the newest so far: where it came from is where the peer is now. That is proved in
  /// suite 1 only.
  bool receive(LocalTime now, std::span<const std::byte> datagram);
  void send(const DeviceState& state);
  void send(const ForceCommand& command);
  void send(const LinkReport& report);
  void send(const DeviceReport& report);
  void send(const PeerReport& report);
  /// Queues a reliable request and returns its id; empty when limits::kRequestWindow are open, that is
  /// sent and their RequestAnswered not yet taken out.
  std::optional<std::uint32_t> request(const Request& request);
  /// Answers a `RequestArrived`. Every request must be answered; an id that waits for none is ignored.
  void answer(std::uint32_t id, Code code, std::string detail, Duration wait = {});
  /// … a Describe.
  void answer(std::uint32_t id, DeviceDescription device);
  /// Says Bye (limits::kByes times, as `next_datagram` is pulled) and closes. Whatever was not sent yet is
  /// dropped. No Closed comes: the owner knows.
  void close(Code code, std::string reason);
  /// Notices the silence of the peer, and our age.
  void tick(LocalTime now);

  // Out.
  /// Writes the next datagram to send into `buffer` and returns its size; 0 = nothing to send now.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// The next thing to tell; Closed is the last.
  std::optional<Event> next_event();
  /// When `tick` and `next_datagram` are due next; not in the future when something waits to be sent.
  LocalTime next_tick() const noexcept;

  bool open() const noexcept;
  std::uint32_t connection_id() const noexcept;
  const LinkStats& stats() const noexcept;
  /// The newest echo with its four time stamps; empty before the first.
  const std::optional<ClockExchange>& newest_exchange() const noexcept;
  /// The peer's clock, as the echoes tell of it up to the newest `now`, with the bound on its error; empty before the
  /// first.
  std::optional<ClockOffsetEstimator::Estimate> peer_clock() const noexcept;

 private:
  struct State;
  Session(const Config& config, const SessionKeys* keys, LocalTime opened);
  std::unique_ptr<State> state_;
};

}  // namespace tendon
