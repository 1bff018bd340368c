// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"

namespace tendon {

/// Why forces come late: our own threads, the network, or the physics engine. Needs no clock but ours.
///
/// The way of a force, from the sample it answers to its arrival, has three parts that add up:
///
///     received − sampled  =  (state sent − sampled)  +  round trip  +  (what remains)
///                            ours                       network        engine: waiting for its period, and computing
///
/// the round trip being that of the datagram which brought the force: the echo in it tells how long the peer had held
/// ours. A force is late when the one before had outlived its validity. To blame is the part that exceeds its usual
/// length (the median of the forces that were in time, tracked step by step) by most. When none of them exceeds it by
/// even half the time that was missing, this force was quick, and one before it is missing: the network's fault where
/// datagrams were lost meanwhile, else the engine has sent none.
///
/// Thread-safe: no. Realtime-safe: yes, but for report().
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
    kEngineMissing,  ///< the engine: is heard, and nothing is lost, but sends no force
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
    std::uint64_t late() const noexcept { return late_ours + late_network + late_engine; }
    /// Of both together: the counts are added, the rest is that of the worse.
    void add(const Report& other);
    /// For the operator and for the engine's people: "forces were late 3 times, by up to 85 ms: the network (round trip
    /// 131 ms, usually 41 ms)". Empty when all is well.
    std::string text;
  };

  /// An engine has come: nobody is late before its first force.
  void begin(LocalTime now) noexcept;
  /// It has gone, and nobody is late.
  void end() noexcept { attending_ = false; }

  /// Any authentic datagram of the engine.
  void heard(LocalTime now) noexcept { heard_ = now; }
  void observe(const Way& way) noexcept;

  /// Since the last call. A force that is still missing counts as late too: the engine is to blame when it is heard but
  /// sends no force, the network when nothing is heard.
  Report report(LocalTime now);

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
