// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"

namespace tendon {

/// Why forces come late: our own threads, the network, or the physics engine. Its clock is ours; of the engine's clock
/// it uses only how far apart two of its time stamps are.
///
/// The way of a force, from the sample it answers to its arrival, has three parts that add up:
///
///     received − sampled  =  (state sent − sampled)  +  round trip  +  (what remains)
///                            ours                       network        engine: waiting for its period, and computing
///
/// The round trip is that of the datagram which brought the force: the echo in it tells how long the peer had held
/// ours. A force is late when the one before had outlived its validity. These are asked in this order:
///
/// 1. If no state of the device was taken for kPause and for half of the missing time, the server is to blame: the loop
///    of the device or the network thread has stopped. The datagrams that wait in the socket meanwhile look like a slow
///    network or a silent engine.
/// 2. If forces were refused since the last one, the engine is to blame.
/// 3. If two datagrams with successive numbers carry time stamps further apart than kStandsStill, the engine's program
///    has stopped, because a peer sends something every 50 ms (SESSION.md). The engine is to blame if this explains half
///    of the missing time. The round trip is no evidence then, because the datagrams that a program does not read wait
///    in its socket, and look like a slow network.
/// 4. Which part of the way exceeds its usual length (the median of the forces that were in time) by most? That part is
///    to blame, when it exceeds it by half the time that was missing.
/// 5. Otherwise this force was quick, and one before it is missing. The network is to blame when datagrams were lost
///    meanwhile, else the engine has sent none.
///
/// A force that is still missing is our fault when states are missing, too (1), else the engine's while the engine is
/// heard. After 250 ms of silence nobody can know whether a remote engine stands still or the network is down: the
/// cause is unknown until it is heard again. On this machine it is the engine.
///
/// Thread-safe: no. Realtime-safe: yes, except report().
class Lateness {
 public:
  /// Ten steps of a device at 1 kHz.
  static constexpr Duration kPause = std::chrono::milliseconds(10);
  /// Two keep-alives of a peer.
  static constexpr Duration kStandsStill = std::chrono::milliseconds(100);
  /// Five keep-alives.
  static constexpr Duration kSilent = std::chrono::milliseconds(250);

  enum class Part : std::uint8_t { kNone, kOurs, kNetwork, kEngine, kUnknown };
  enum class Cause : std::uint8_t {
    kNone,
    kStateWaited,    ///< ours
    kServerStood,    ///< ours: the device's loop or the network thread stood still
    kRoundTrip,      ///< the network: was longer than usual
    kLost,           ///< the network: datagrams were lost
    kUnheard,        ///< unknown: nothing is heard of the engine's machine
    kEngineTook,     ///< the engine: longer than usual
    kEngineMissing,  ///< the engine: is heard, and nothing is lost, but no force comes that can be used
    kEngineStood,    ///< the engine: its program stood still
    kEngineSilent,   ///< the engine: its program is on this machine, and nothing is heard of it
    kNotFinite,      ///< the engine: its forces are refused, see RefusedForces (messages.h)
    kOutOfBounds,    ///< …
    kUnknownTick,    ///< …
    kOldSequence,    ///< …
  };
  static Part part(Cause cause) noexcept;

  struct Way {
    LocalTime sampled;    ///< the state it answers
    LocalTime sent;       ///< when that state left for the engine
    LocalTime received;   ///< the force
    Duration round_trip;  ///< of the datagram that brought it
    Duration valid_for;   ///< as the engine says, from `received`
    bool lost = false;    ///< datagrams were lost since the force before, in either direction
  };

  /// What has happened since the last report.
  struct Report {
    std::uint64_t forces = 0;
    std::uint64_t refused = 0;         ///< forces that could not be used
    Cause refused_for = Cause::kNone;  ///< the newest of them
    std::uint64_t late_ours = 0;       ///< by the part to blame
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    std::uint64_t cut = 0;       ///< forces above the device's bound, which it cuts
    Duration worst{};            ///< how long the device was without a valid force, at most
    Cause cause = Cause::kNone;  ///< of the worst of them
    Duration ours{};             ///< its parts, and what is usual
    Duration network{};
    Duration engine{};
    Duration stood_still{};  ///< the engine's program or our threads, at most
    Duration usual_ours{};
    Duration usual_network{};
    Duration usual_engine{};
    std::uint64_t late() const noexcept { return late_ours + late_network + late_engine + late_unknown; }
    /// Of both together: the counts are added, the rest is that of the worse.
    void add(const Report& other);
    /// For the operator: "forces were late 3 times, by up to 85 ms: the network (round trip
    /// 131 ms, usually 41 ms)". Empty when all is well. At most 128 bytes.
    std::string text;
    /// For the engine's author: `text`, and how many forces the device cuts.
    std::string advice;
  };

  /// An engine has come: nobody is late before its first force. `same_machine`: it came from a loopback address.
  void begin(LocalTime now, bool same_machine) noexcept;
  /// It has gone, and nobody is late.
  void end() noexcept { attending_ = false; }

  /// A datagram of the engine that is authentic and the newest so far. `sent`: when, by the engine's clock, when known;
  /// `lost`: how many of the engine's datagrams have not come so far.
  void heard(LocalTime now, std::optional<PeerTime> sent, std::uint64_t lost) noexcept;
  /// The network thread has taken a newer state of the device.
  void took_state(LocalTime now) noexcept;
  void observe(const Way& way) noexcept;
  /// The newest force is above the device's bound.
  void cut() noexcept { ++report_.cut; }
  /// `count` forces came that cannot be used, for one of the last four causes.
  void refused(Cause cause, std::uint64_t count) noexcept;

  /// What happened since the last call. A force that is still missing counts as late, too.
  Report report(LocalTime now);

 private:
  struct Parts {
    Duration ours{};
    Duration network{};
    Duration engine{};
  };
  Duration paused(LocalTime now) const noexcept;
  bool is_our_pause(LocalTime now, Duration late_by) const noexcept;
  Cause cause_of(const Way& way, const Parts& parts, Duration late_by) const noexcept;
  void blame(Duration late_by, Cause cause, const Parts& parts) noexcept;

  bool attending_ = false;
  bool same_machine_ = false;
  bool usual_known_ = false;
  LocalTime heard_{};
  std::optional<PeerTime> sent_;  ///< its newest time stamp
  std::uint64_t lost_ = 0;        ///< of its datagrams
  LocalTime valid_until_{};
  Parts usual_;
  std::optional<LocalTime> took_state_;
  // Since the newest force:
  Duration stood_still_{};
  Duration paused_{};  ///< the longest time between two states
  Cause refused_for_ = Cause::kNone;
  Report report_;
};

}  // namespace tendon
