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
  std::uint64_t lost_outgoing = 0;       ///< ours that the peer's ack vectors report as missing
  std::uint64_t seen_outgoing = 0;       ///< ours that the peer's ack vectors report as received
  std::uint64_t reordered = 0;           ///< accepted, but older than one seen before
  std::uint64_t duplicated = 0;          ///< seen before, too old to tell, or a late handshake datagram: dropped
  std::uint64_t malformed = 0;           ///< not a datagram of this conversation: dropped
  std::uint64_t forged = 0;              ///< sealed suites: not authentic (forged, or damaged on the way): dropped
  std::uint64_t old_key = 0;             ///< sealed suites: sealed with a key no longer or not yet held: dropped
  std::uint64_t invalid = 0;             ///< well-formed, with a value out of bounds (NaN, Inf …): frame dropped
  std::uint64_t stale = 0;               ///< state, force or report not newer than the newest one: frame dropped
  RefusedForces refused_forces{};        ///< of `invalid` and `stale`, those that are an engine's mistake
  Duration round_trip{};                 ///< newest sample, (T4 − T1) − (T3 − T2); 0 = none yet
  Duration smoothed_round_trip{};        ///< RFC 6298 SRTT
  Duration round_trip_variation{};       ///< RFC 6298 RTTVAR
};

/// One open conversation between a client and a server; both ends use this class. Bytes and instants go in, bytes and
/// events come out (sans-I/O, pull). It has no socket, clock, thread or randomness of its own.
///
/// * States, forces, ports and reports are unreliable, and the newest wins, separately for each device and channel: `send`
///   replaces a value that has not left yet; a received value older than the newest is dropped and counted.
/// * Requests are reliable and in order: each is resent until it is answered. No order is promised between requests,
///   states and forces.
/// * Every datagram carries its sending time and an Echo, so each one received gives a round trip and an ack vector.
/// * Our own silence is filled with keep-alives; too long a silence of the peer ends the conversation.
///
/// No queue is unbounded: there is room for one state and one report of each device, one force, one port and one
/// report of each channel, one report of the link and limits::kRequestWindow requests each way. A newer event replaces one of its kind
/// that was not taken out in time.
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
    /// A keep-alive is sent after this much silence of ours. Five in a row must be lost before a server reaches its
    /// 250 ms safe stop.
    Duration keep_alive = std::chrono::milliseconds(50);
    /// The session ends after this much silence of the peer: longer than a Wi-Fi roam takes, shorter than a person
    /// waits.
    Duration timeout = std::chrono::seconds(2);
    /// A request is sent again after max(this, SRTT + 4 RTTVAR). A shorter wait would ask twice whenever the peer is
    /// scheduled late, which takes tens of ms on a virtual machine.
    Duration min_resend = std::chrono::milliseconds(20);

    // In suites 1 and 2:
    Rekey rekey{};
    /// A session of this age ends with kExpired. The client then shakes hands again, so no key is older than a day.
    Duration life = std::chrono::hours(24);
    /// It also ends after this many datagrams of ours, so that no packet number is used twice.
    std::uint64_t max_datagrams = limits::kMaxPacketNumber;
    /// And after this many datagrams that did not open, so that nobody can go on guessing tags.
    std::uint64_t max_forged = limits::kMaxForged;
  };

  /// Either end of a conversation of suite 0. `opened` is the instant at which the handshake ended. The first datagram
  /// is due at once: it tells the peer that we are there, and gives both ends a round trip.
  /// Throws std::invalid_argument when a duration of `config` is not positive, or a key is to seal more than
  /// limits::kMaxDatagramsOfKey.
  Session(const Config& config, LocalTime opened);
  /// The same in suite 1 or 2: datagrams are sealed with `keys`.
  Session(const Config& config, const SessionKeys& keys, LocalTime opened);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // Events for the owner. A state or a force waits as the event that tells it, so that telling copies nothing.
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
  struct PortArrived {
    PortFrame port;
  };
  struct RequestArrived {
    std::uint32_t id;
    Request request;
  };
  struct RequestAnswered {
    std::uint32_t id;
    Code code;
    std::string detail;
    Duration wait{};                            ///< after a TakeLease answered kBusy; 0 = not known
    std::optional<DeviceDescription> device{};  ///< after a Describe answered kOk
    std::optional<HandleDescription> handle{};  ///< … that asked for the handle
  };
  struct Closed {
    Code code;  ///< the code of the peer's Bye; kTimedOut: it fell silent; kExpired: the session is too old
    std::string reason;
  };
  using Event = std::variant<StateArrived, ForceArrived, ReportArrived, DeviceReportArrived, PeerReportArrived,
                             PortArrived, RequestArrived, RequestAnswered, Closed>;

  // In.
  /// Takes any bytes. A datagram that does not belong to this conversation, or is malformed, is counted and dropped.
  /// True when the datagram was accepted and is the newest so far: its source is then the peer's present address. Only
  /// suites 1 and 2 prove that.
  bool receive(LocalTime now, std::span<const std::byte> datagram);
  void send(const DeviceState& state);
  void send(const ForceCommand& command);
  void send(const LinkReport& report);
  void send(const DeviceReport& report);
  void send(const PeerReport& report);
  void send(const PortFrame& port);
  /// Queues a reliable request and returns its id; empty when limits::kRequestWindow are open. A request is open until
  /// its RequestAnswered has been taken out.
  std::optional<std::uint32_t> request(const Request& request);
  /// Answers a `RequestArrived`. Every request must be answered. An id that is not waiting for an answer is ignored.
  void answer(std::uint32_t id, Code code, std::string detail, Duration wait = {});
  /// Answers a Describe with kOk.
  void answer(std::uint32_t id, DeviceDescription device);
  void answer(std::uint32_t id, HandleDescription handle);
  /// Says Bye (limits::kByes times, as `next_datagram` is pulled) and closes. Anything not sent yet is dropped. No
  /// Closed event follows, because the owner knows.
  void close(Code code, std::string reason);
  /// Ends the session when the peer has been silent for too long, or the session is too old.
  void tick(LocalTime now);

  // Out.
  /// Writes the next datagram to send into `buffer` and returns its size; 0 = nothing to send now.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// The next event, null when there is none; Closed is the last one. It stays until the next call of this function or
  /// of `receive`.
  const Event* next_event();
  /// When to call `tick` and `next_datagram` next; not in the future when something waits to be sent.
  LocalTime next_tick() const noexcept;

  bool open() const noexcept;
  std::uint32_t connection_id() const noexcept;
  Suite suite() const noexcept;
  const LinkStats& stats() const noexcept;
  /// The four time stamps of the newest echo; empty before the first.
  const std::optional<ClockExchange>& newest_exchange() const noexcept;
  /// The peer's clock, estimated from all echoes up to the newest `now`, with a bound on the error; empty before the
  /// first echo.
  std::optional<ClockOffsetEstimator::Estimate> peer_clock() const noexcept;

 private:
  struct State;
  Session(const Config& config, const SessionKeys* keys, LocalTime opened);
  std::unique_ptr<State> state_;
};

}  // namespace tendon
