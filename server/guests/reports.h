// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "protocol/messages.h"
#include "server/guests/guest.h"

namespace tendon {

/// What a controller is told about its forces and its link since `since`; all but `number`.
LinkReport link_report(LocalTime now, LocalTime since, const Guest& guest, const LinkMeter::Report& link,
                       const Lateness::Report& forces);

/// What observers are told about the engine on one channel; all but `link.number`.
PeerReport peer_report(LocalTime now, LocalTime since, const Guest& engine, const Seat& seat,
                       const LinkMeter::Report& link, const Lateness::Report& forces);

/// Tells, once a second, each controller how its forces fare, and each observer that asked (kFeatureDiagnostics) how its
/// devices' loops and their engines do. Often enough to look at, and next to nothing beside 1000 states a second.
///
/// Thread-safe: no. Realtime-safe: no.
class Reports {
 public:
  /// `devices` and `guests` must outlive it.
  Reports(std::vector<ServedDevice>& devices, std::vector<Guest>& guests) : devices_(devices), guests_(guests) {}

  /// News since the last call, of all channels.
  struct News {
    std::uint64_t late_ours = 0;  ///< forces, by the part to blame: Lateness
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::vector<std::string> warnings;  ///< for the operator, channel by channel
  };
  /// Hands due reports to the guests' sessions.
  News turn(LocalTime now);

 private:
  void count_refused(Guest& guest);
  Lateness::Report report_on(LocalTime now, ServedDevice& device, std::size_t channel, News& news);
  void tell_of_devices();
  void tell_of_engine(LocalTime now, const Guest& engine, const LinkMeter::Report& link);
  template <class Report>
  void tell_observers(std::uint32_t device, const Report& report);

  std::vector<ServedDevice>& devices_;
  std::vector<Guest>& guests_;
  LocalTime reported_{};
};

}  // namespace tendon
