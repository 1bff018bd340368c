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

/// Statistics of a conversation. Counts a datagram once: received, duplicated, malformed, forged or old_key.
struct LinkStats {
  std::uint64_t datagrams_sent = 0;
  std::uint64_t datagrams_received = 0;
  std::uint64_t lost = 0;           ///< packet numbers of the peer not yet seen
  std::uint64_t lost_outgoing = 0;  ///< missing in the peer's ack vectors
  std::uint64_t seen_outgoing = 0;  ///< received, in the peer's ack vectors
  std::uint64_t reordered = 0;      ///< accepted, but not the newest
  std::uint64_t duplicated = 0;     ///< also too old, or a late handshake datagram
  std::uint64_t malformed = 0;      ///< not a datagram of this conversation
  std::uint64_t forged = 0;         ///< not authentic, or damaged in transit
  std::uint64_t old_key = 0;        ///< key expired or not yet known
  std::uint64_t invalid = 0;        ///< frames with a value out of bounds (NaN, Inf …)
  std::uint64_t stale = 0;          ///< frames not newer than the newest one
  RefusedForces refused_forces{};   ///< of `invalid` and `stale`, those caused by an engine
  Duration round_trip{};            ///< newest sample, (T4 − T1) − (T3 − T2); 0: none
  Duration smoothed_round_trip{};   ///< RFC 6298 SRTT
  Duration round_trip_variation{};  ///< RFC 6298 RTTVAR
};

/// A conversation between a client and a server, used by both. It has no sockets, clocks, threads or random numbers.
/// Its inputs are bytes and times, and its owner pulls bytes and events.
///
/// All queues are bounded: one state and one report per device, one force, port, pose and report per channel, one link
/// report, one brick, eight FieldStatus, and limits::kRequestWindow requests in each direction. If an event was not pulled in time, a newer one of
/// the same stream replaces it.
///
/// Call `receive` with each datagram and `tick` when `next_tick()` is due. Then pull `next_event` and `next_datagram`
/// until both are empty. `now` must never decrease. See SESSION.md for the behavior and WIRE.md for the bytes.
/// Thread-safe: no. Realtime-safe: no.
class Session {
 public:
  struct Config {
    std::uint32_t connection_id = 0;
    /// The longest silence of this peer. A server's safe stop (250 ms) is only reached if five keep-alives are lost.
    Duration keep_alive = std::chrono::milliseconds(50);
    /// The longest silence of the other peer. This is longer than a Wi-Fi roam, but shorter than a person would wait.
    Duration timeout = std::chrono::seconds(2);
    /// Requests are resent after max(this, SRTT + 4 RTTVAR). Scheduling delays of tens of ms, which are usual on
    /// virtual machines, would otherwise cause duplicates.
    Duration min_resend = std::chrono::milliseconds(20);
    bool states_in_columns = false;  ///< requires kFeatureStateColumns

    // Only used in suites 1 and 2:
    Rekey rekey{};
    /// The maximum age, after which a session is closed with kExpired and the client repeats the handshake.
    Duration life = std::chrono::hours(24);
    std::uint64_t max_datagrams = limits::kMaxPacketNumber;  ///< sent, because packet numbers must not be reused
    std::uint64_t max_forged = limits::kMaxForged;           ///< each one is a guess at a tag
  };

  /// Opens a conversation of suite 0 after the handshake has completed at `opened`. The first datagram is due at once,
  /// so that both peers can measure a round trip. Throws std::invalid_argument if a duration of `config` is not
  /// positive, or if `rekey.datagrams` exceeds limits::kMaxDatagramsOfKey.
  Session(const Config& config, LocalTime opened);
  /// Opens a conversation of suite 1 or 2.
  Session(const Config& config, const SessionKeys& keys, LocalTime opened);
  ~Session();
  Session(Session&&) noexcept;
  Session& operator=(Session&&) noexcept;

  // States and forces are stored as events, to avoid copying them.
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
  struct BrickArrived {
    FieldBrick brick;
  };
  struct FieldStatusArrived {
    FieldStatus status;
  };
  struct FieldPoseArrived {
    FieldPose pose;
  };
  struct RequestArrived {
    std::uint32_t id;
    Request request;
  };
  struct RequestAnswered {
    std::uint32_t id;
    Code code;
    std::string detail;
    Duration wait{};                            ///< for kBusy to a TakeLease; 0: unknown
    std::optional<DeviceDescription> device{};  ///< for kOk to a Describe
    std::optional<HandleDescription> handle{};  ///< for kOk to a Describe with `handle`
  };
  struct Closed {
    Code code;  ///< of the peer's Bye, or kTimedOut or kExpired
    std::string reason;
  };
  using Event =
      std::variant<StateArrived, ForceArrived, ReportArrived, DeviceReportArrived, PeerReportArrived, PortArrived,
                   BrickArrived, FieldStatusArrived, FieldPoseArrived, RequestArrived, RequestAnswered, Closed>;

  // Input.
  /// Handles a datagram. Malformed or foreign datagrams are counted and dropped. Returns true if this is the newest
  /// datagram so far, whose source is then the current address of the peer. Only suites 1 and 2 authenticate it.
  /// `reached` is used instead of `now` to measure the round trip and the clock of the peer (Link::reached).
  bool receive(LocalTime now, std::span<const std::byte> datagram, LocalTime reached);
  bool receive(LocalTime now, std::span<const std::byte> datagram) { return receive(now, datagram, now); }
  void send(const DeviceState& state);
  void send(const ForceCommand& command);
  void send(const LinkReport& report);
  void send(const DeviceReport& report);
  void send(const PeerReport& report);
  void send(const PortFrame& port);
  void send(const FieldStatus& status);
  void send(const FieldPose& pose);
  /// Copies the brick. Returns false if the previous one was not written to a datagram yet.
  bool send(const FieldBrick& brick);
  /// Queues a reliable request and returns its id, or nullopt if limits::kRequestWindow requests are pending. A request
  /// remains pending until its RequestAnswered has been pulled.
  std::optional<std::uint32_t> request(const Request& request);
  /// Answers a request. Every request must be answered. Unknown ids are ignored.
  void answer(std::uint32_t id, Code code, std::string detail, Duration wait = {});
  /// Answer a Describe with kOk.
  void answer(std::uint32_t id, DeviceDescription device);
  void answer(std::uint32_t id, HandleDescription handle);
  /// Closes the session without a Closed event. Only kByes copies of a Bye remain in `next_datagram`.
  void close(Code code, std::string reason);
  /// Closes the session if the peer was silent for too long or the session is too old.
  void tick(LocalTime now);

  // Output.
  /// Writes the next datagram and returns its size, or 0 if there is no data to send.
  std::size_t next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  /// Returns the next event, or null; Closed is the last one. Valid until the next call of this function or `receive`.
  const Event* next_event();
  LocalTime next_tick() const noexcept;  ///< when to call `tick` and `next_datagram`; at once if data must be sent

  bool open() const noexcept;
  std::uint32_t connection_id() const noexcept;
  Suite suite() const noexcept;
  const LinkStats& stats() const noexcept;
  /// Returns the exchange of the last accepted datagram, or nothing if it did not contain a valid echo.
  const std::optional<ClockExchange>& exchange() const noexcept;
  /// The offset of the peer's clock at the newest `now`, with an error bound. Empty before the first echo.
  std::optional<ClockOffsetEstimator::Estimate> peer_clock() const noexcept;

 private:
  struct State;
  Session(const Config& config, const SessionKeys* keys, LocalTime opened);
  std::unique_ptr<State> state_;
};

}  // namespace tendon
