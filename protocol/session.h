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

/// Statistics of one conversation. Bad input is counted only here.
///
/// Each received datagram adds one to exactly one of `datagrams_received`, `duplicated`, `malformed`, `forged` and
/// `old_key`.
struct LinkStats {
  std::uint64_t datagrams_sent = 0;
  std::uint64_t datagrams_received = 0;  ///< accepted datagrams
  std::uint64_t lost = 0;                ///< packet numbers of the peer that have not been seen so far
  std::uint64_t lost_outgoing = 0;       ///< own datagrams that the peer's ack vectors report as missing
  std::uint64_t seen_outgoing = 0;       ///< own datagrams that the peer's ack vectors report as received
  std::uint64_t reordered = 0;           ///< accepted, but older than an earlier one
  std::uint64_t duplicated = 0;          ///< seen before, too old to tell, or a late handshake datagram: dropped
  std::uint64_t malformed = 0;           ///< not a datagram of this conversation: dropped
  std::uint64_t forged = 0;         ///< sealed suites: authentication failed (forged, or damaged in transit): dropped
  std::uint64_t old_key = 0;        ///< sealed suites: sealed with a key that has expired or is not known yet: dropped
  std::uint64_t invalid = 0;        ///< well-formed, but a value is out of bounds (NaN, Inf …): frame dropped
  std::uint64_t stale = 0;          ///< state, force or report that is not newer than the newest one: frame dropped
  RefusedForces refused_forces{};   ///< those of `invalid` and `stale` that are caused by an engine
  Duration round_trip{};            ///< newest sample, (T4 − T1) − (T3 − T2); 0 = none yet
  Duration smoothed_round_trip{};   ///< RFC 6298 SRTT
  Duration round_trip_variation{};  ///< RFC 6298 RTTVAR
};

/// One open conversation between a client and a server; both peers use this class. Its inputs are bytes and times, its
/// outputs bytes and events, which the owner pulls. It has no socket, clock, thread or source of randomness.
///
/// * States, forces, ports and reports are unreliable, and the newest wins, separately for each device and channel:
///   `send` replaces a value that has not been sent yet, and a received value older than the newest one is dropped and
///   counted.
/// * Requests are reliable and in order: each one is resent until it is answered. The order of requests relative to
///   states and forces is not guaranteed.
/// * Every datagram carries its sending time and an Echo, so each received datagram yields a round trip and an ack
///   vector.
/// * Keep-alives are sent when there is nothing else to send. The conversation ends if the peer is silent for too long.
///
/// All queues are bounded. There is room for one state and one report of each device, for one force, one port and one
/// report of each channel, for one report of the link, and for limits::kRequestWindow requests in each direction. A
/// newer event replaces one of the same kind that was not taken in time.
///
/// SESSION.md describes the behavior over time, WIRE.md the bytes.
///
/// Call `receive` with each datagram and `tick` when `next_tick()` is due, then call `next_event` and `next_datagram`
/// until they return nothing. `now` must never decrease.
///
/// Thread-safe: no. Realtime-safe: no.
class Session {
 public:
  struct Config {
    std::uint32_t connection_id = 0;
    /// A keep-alive is sent after this time without another datagram. Five in a row must be lost before a server
    /// reaches its safe stop after 250 ms.
    Duration keep_alive = std::chrono::milliseconds(50);
    /// The session ends after this much silence of the peer. It is longer than a Wi-Fi roam and shorter than people
    /// wait.
    Duration timeout = std::chrono::seconds(2);
    /// A request is resent after max(this, SRTT + 4 RTTVAR). With a shorter time, requests would be sent twice whenever
    /// the peer is scheduled late, which takes tens of ms on a virtual machine.
    Duration min_resend = std::chrono::milliseconds(20);
    /// Send states in columns if these can represent them. Only to a client that was granted kFeatureStateColumns.
    bool states_in_columns = false;

    // Only in suites 1 and 2:
    Rekey rekey{};
    /// A session ends with kExpired at this age. The client then repeats the handshake, so no key is older than a day.
    Duration life = std::chrono::hours(24);
    /// The session also ends after this many sent datagrams, so that no packet number is used twice.
    std::uint64_t max_datagrams = limits::kMaxPacketNumber;
    /// The session also ends after this many datagrams that fail authentication, which bounds the guesses at tags.
    std::uint64_t max_forged = limits::kMaxForged;
  };

  /// Opens a conversation of suite 0, for either peer. `opened` is the time at which the handshake ended. The first
  /// datagram is due at once: it confirms to the peer that we are connected and gives both peers a round trip. Throws
  /// std::invalid_argument if a duration of `config` is not positive, or if `rekey.datagrams` exceeds
  /// limits::kMaxDatagramsOfKey.
  Session(const Config& config, LocalTime opened);
  /// Opens a conversation of suite 1 or 2, whose datagrams are sealed with `keys`.
  Session(const Config& config, const SessionKeys& keys, LocalTime opened);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // Events for the owner. A state or a force is stored as the event that reports it, to avoid a copy.
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
    Duration wait{};                            ///< after a TakeLease answered kBusy; 0 = unknown
    std::optional<DeviceDescription> device{};  ///< after a Describe answered kOk
    std::optional<HandleDescription> handle{};  ///< after a Describe with `handle` answered kOk
  };
  struct Closed {
    Code code;  ///< code of the peer's Bye, kTimedOut after silence, or kExpired at the maximum age
    std::string reason;
  };
  using Event = std::variant<StateArrived, ForceArrived, ReportArrived, DeviceReportArrived, PeerReportArrived,
                             PortArrived, RequestArrived, RequestAnswered, Closed>;

  // Input.
  /// Handles a datagram from the network. It is counted and dropped if it is malformed or does not belong to this
  /// conversation. Returns true if the datagram was accepted and is the newest so far: its source is then the current
  /// address of the peer. Only suites 1 and 2 authenticate that address.
  bool receive(LocalTime now, std::span<const std::byte> datagram);
  void send(const DeviceState& state);
  void send(const ForceCommand& command);
  void send(const LinkReport& report);
  void send(const DeviceReport& report);
  void send(const PeerReport& report);
  void send(const PortFrame& port);
  /// Queues a reliable request and returns its id, or nullopt if limits::kRequestWindow requests are open. A request is
  /// open until its RequestAnswered event has been taken.
  std::optional<std::uint32_t> request(const Request& request);
  /// Answers a `RequestArrived`. Every request must be answered. An id that does not wait for an answer is ignored.
  void answer(std::uint32_t id, Code code, std::string detail, Duration wait = {});
  /// Answers a Describe with kOk.
  void answer(std::uint32_t id, DeviceDescription device);
  void answer(std::uint32_t id, HandleDescription handle);
  /// Closes the session and sends a Bye (limits::kByes times, as `next_datagram` is called). Anything not sent yet is
  /// dropped. There is no Closed event.
  void close(Code code, std::string reason);
  /// Ends the session if the peer has been silent for too long or the session has reached its maximum age.
  void tick(LocalTime now);

  // Output.
  /// Writes the next datagram into `buffer`. Returns its size, or 0 if there is nothing to send now.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// Returns the next event, or null if there is none; Closed is the last one. The event is valid until the next call
  /// of this function or of `receive`.
  const Event* next_event();
  /// When to call `tick` and `next_datagram` next. Not in the future if something is waiting to be sent.
  LocalTime next_tick() const noexcept;

  bool open() const noexcept;
  std::uint32_t connection_id() const noexcept;
  Suite suite() const noexcept;
  const LinkStats& stats() const noexcept;
  /// The four time stamps of the newest echo. Empty before the first echo.
  const std::optional<ClockExchange>& newest_exchange() const noexcept;
  /// The offset of the peer's clock with an error bound, estimated from all echoes up to the newest `now`. Empty before
  /// the first echo.
  std::optional<ClockOffsetEstimator::Estimate> peer_clock() const noexcept;

 private:
  struct State;
  Session(const Config& config, const SessionKeys* keys, LocalTime opened);
  std::unique_ptr<State> state_;
};

}  // namespace tendon
