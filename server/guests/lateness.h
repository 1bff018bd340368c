// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"

namespace tendon {

/// Why forces are missing, late or refused: our own threads, the network, or the physics engine. Needs no clock but ours.
///
/// The way of a force, from the sample it answers to its arrival, has three parts that add up:
///
///     received − sampled  =  (state sent − sampled)  +  round trip  +  (the rest)
///                            server                     network        engine: waiting for its period, and computing
///
/// The round trip is that of the datagram which brought the force: its echo tells how long the peer had held ours. A
/// force is late when the one before had outlived its validity. The part that exceeds its usual length (the median of
/// the forces that were in time) by most is to blame. When no part exceeds it by even half the missing time, this force
/// was quick and an earlier one is missing: the network's fault where datagrams were lost meanwhile, else the engine
/// sent none.
///
/// A force that is still missing is the engine's fault while the engine is heard, and also when it is silent on this
/// machine, where no network can be cut: a client that computes in its only thread sends nothing meanwhile. Silence of
/// another machine for 250 ms is put down to the network, until the next force tells better. Where forces came and were
/// refused, that is the cause.
///
/// Thread-safe: no. Realtime-safe: yes, except for report().
class Lateness {
 public:
  enum class Part : std::uint8_t { kNone, kOurs, kNetwork, kEngine };
  enum class Cause : std::uint8_t {
    kNone,
    kStateWaited,    ///< ours
    kRoundTrip,      ///< the network: was longer than usual
    kLost,           ///< the network: datagrams were lost
    kUnheard,        ///< the network: nothing comes from the engine's machine
    kEngineTook,     ///< the engine: longer than usual
    kEngineMissing,  ///< the engine: is heard, and nothing is lost, yet it sends no force
    kEngineSilent,   ///< the engine: is on this machine, and nothing comes from it
    kEngineRefused,  ///< the engine: its forces come and are refused
  };
  /// Why a force is refused.
  enum class Refused : std::uint8_t {
    kValue,  ///< not finite, or out of the wire's bounds (WIRE.md)
    kTick,   ///< it answers a tick that never was, or one older than SampledSteps remembers
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
    std::uint64_t late_ours = 0;  ///< by the part to blame
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    Duration worst{};            ///< how long the device was without a valid force, at most
    Cause cause = Cause::kNone;  ///< of the worst of them
    Duration ours{};             ///< its parts, and what is usual
    Duration network{};
    Duration engine{};
    Duration usual_ours{};
    Duration usual_network{};
    Duration usual_engine{};
    std::uint64_t refused_values = 0;  ///< forces, by Refused
    std::uint64_t refused_ticks = 0;
    std::uint64_t cut = 0;  ///< forces above the device's bound, which it cuts
    std::uint64_t late() const noexcept { return late_ours + late_network + late_engine; }
    /// Of both together: the counts are added, the rest is that of the worse.
    void add(const Report& other);
    /// For the operator: "forces were late 3 times, by up to 85 ms: the network (round trip 131 ms, usually 41 ms)".
    /// Empty when all is well.
    std::string text;
    /// For the engine's author: `text`, and how many forces the device cuts.
    std::string advice;
  };

  /// An engine has come: nobody is late before its first force.
  void begin(LocalTime now) noexcept;
  /// It has gone, and nobody is late.
  void end() noexcept { attending_ = false; }

  /// Any authentic datagram of the engine.
  void heard(LocalTime now) noexcept { heard_ = now; }
  void observe(const Way& way) noexcept;
  /// Forces of the engine came and were not handed on.
  void refuse(Refused why, std::uint64_t forces = 1) noexcept;
  /// The newest force is above the device's bound.
  void cut() noexcept { ++report_.cut; }

  /// Since the last call. A force that is still missing counts as late too. `same_machine`: the engine's address is one
  /// of this machine.
  Report report(LocalTime now, bool same_machine);

 private:
  struct Parts {
    Duration ours{};
    Duration network{};
    Duration engine{};
  };
  void blame(Duration late_by, Cause cause, const Parts& parts) noexcept;

  bool attending_ = false;
  bool usual_known_ = false;
  LocalTime heard_{};
  LocalTime valid_until_{};
  Parts usual_;
  Report report_;
};

}  // namespace tendon
