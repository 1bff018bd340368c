// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "core/base/time.h"

namespace tendon {

/// Determines why forces are late: because of our own threads, the network, or the physics engine. All times are
/// measured with our clock. The clock of the engine is only used for the differences between its time stamps.
///
/// The delay between a sample and the arrival of the force that answers it has three parts:
///
///     received − sampled  =  (state sent − sampled)  +  round trip  +  (remaining time)
///                            ours                       network        engine: waiting for its period, and computing
///
/// The round trip is measured with the datagram that contains the force. A force is late if the previous force is no
/// longer valid. The cause is determined by the first of these rules that applies:
/// 1. If no state of the device was received for kPause and for half of the missing time, the cause is the server: the
///    loop of the device or the network thread was blocked. This rule is the first because the datagrams that wait in
///    the socket in the meantime would look like a slow network or an engine that does not respond.
/// 2. If forces were refused since the last valid force, the cause is the engine.
/// 3. If the time stamps of two consecutive datagrams differ by more than kStandsStill, the program of the engine was
///    blocked, because a peer sends a datagram every 50 ms (SESSION.md). The cause is the engine if this explains half
///    of the missing time. The round trip is then not reliable, because datagrams waited in the socket of the program.
/// 4. The part with the largest increase over its usual duration is the cause if the increase is at least half of the
///    missing time. The usual duration is the median over the forces that were not late.
/// 5. Otherwise, the delay of this force is not unusual, so a previous force is missing. The cause is the network if
///    datagrams were lost in the meantime. Otherwise, the engine has not sent a force.
///
/// If the force is still missing when a report is created, the cause is the server if rule 1 applies, and otherwise the
/// engine as long as other datagrams from it arrive. After 250 ms without any datagram, a remote engine that is blocked
/// cannot be distinguished from a broken network, so the cause is unknown. An engine on this machine is the cause.
/// Thread-safe: no. Realtime-safe: yes, except report().
class Lateness {
 public:
  static constexpr Duration kPause = std::chrono::milliseconds(10);         ///< ten steps at 1 kHz
  static constexpr Duration kStandsStill = std::chrono::milliseconds(100);  ///< two keep-alive periods
  static constexpr Duration kSilent = std::chrono::milliseconds(250);       ///< five keep-alive periods

  enum class Part : std::uint8_t { kNone, kOurs, kNetwork, kEngine, kUnknown };
  enum class Cause : std::uint8_t {
    kNone,
    kStateWaited,    ///< ours: a state was sent late
    kServerStood,    ///< ours: the device loop or the network thread was blocked
    kRoundTrip,      ///< network: longer than usual
    kLost,           ///< network: datagrams were lost
    kUnheard,        ///< remote engine: no datagrams
    kEngineTook,     ///< engine: longer than usual
    kEngineMissing,  ///< engine: no valid force
    kEngineStood,    ///< engine: was blocked
    kEngineSilent,   ///< engine on this machine: no datagrams
    kNotFinite,      ///< engine: see RefusedForces (messages.h)
    kOutOfBounds,
    kUnknownTick,
    kOldSequence,
  };
  static Part part(Cause cause) noexcept;

  struct RoundTrip {
    LocalTime sampled;
    LocalTime sent;
    LocalTime received;
    Duration round_trip;  ///< measured by the same datagram; includes the time until it was read
    Duration valid_for;   ///< requested by the engine, starting at `received`
    bool lost = false;    ///< datagrams were lost since the previous force
  };

  struct Report {
    std::uint64_t forces = 0;
    std::uint64_t refused = 0;
    Cause refused_for = Cause::kNone;  ///< the cause of the newest one
    std::uint64_t late_ours = 0;
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    std::uint64_t cut = 0;  ///< forces that were limited to the maximum of the device
    Duration worst{};       ///< the longest time without a valid force
    Cause cause = Cause::kNone;
    Duration ours{};
    Duration network{};
    Duration engine{};
    Duration stood_still{};  ///< the longest pause of the engine or of our threads
    Duration usual_ours{};
    Duration usual_network{};
    Duration usual_engine{};
    std::uint64_t late() const noexcept { return late_ours + late_network + late_engine + late_unknown; }
    /// Adds the counters. The other values are copied from the report with the longer `worst`.
    void add(const Report& other);
    /// For the operator, for example "forces were late 3 times, by up to 85 ms: the network (round trip 131 ms, usually
    /// 41 ms)". Empty if there are no problems. At most 128 bytes.
    std::string text;
    std::string advice;  ///< for the developer of the engine: `text` and the number of limited forces
  };

  /// An engine becomes the holder of the channel. Its first force cannot be late. `same_machine`: loopback address.
  void begin(LocalTime now, bool same_machine) noexcept;
  void end() noexcept { attending_ = false; }

  /// Must be called for each authentic datagram that is newer than all previous ones. `sent` is the time stamp of the
  /// engine, if available. `lost` is the total number of lost datagrams.
  void heard(LocalTime now, std::optional<PeerTime> sent, std::uint64_t lost) noexcept;
  void took_state(LocalTime now) noexcept;
  void observe(const RoundTrip& trip) noexcept;
  void cut() noexcept { ++report_.cut; }
  void refused(Cause cause, std::uint64_t count) noexcept;  ///< `cause` must be one of the last four values

  Report report(LocalTime now);

 private:
  struct Parts {
    Duration ours{};
    Duration network{};
    Duration engine{};
  };
  Duration paused(LocalTime now) const noexcept;
  bool is_our_pause(LocalTime now, Duration late_by) const noexcept;
  Cause cause_of(const RoundTrip& trip, const Parts& parts, Duration late_by) const noexcept;
  void blame(Duration late_by, Cause cause, const Parts& parts) noexcept;

  bool attending_ = false;
  bool same_machine_ = false;
  bool usual_known_ = false;
  LocalTime heard_{};
  std::optional<PeerTime> sent_;
  std::uint64_t lost_ = 0;
  LocalTime valid_until_{};
  Parts usual_;
  std::optional<LocalTime> took_state_;
  // Since the newest force:
  Duration stood_still_{};
  Duration paused_{};
  Cause refused_for_ = Cause::kNone;
  Report report_;
};

}  // namespace tendon
