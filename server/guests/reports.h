// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "server/guests/guest.h"

namespace tendon {

/// Says once a second how things go (SESSION.md, "Report"): to each controller how its forces fare, to the operator
/// what was late or refused, and to observers that ask for diagnostics how each device's loop and each engine do.
///
/// Thread-safe: no. Realtime-safe: no.
class Reports {
 public:
  /// Often enough to look at, and nothing beside 1000 states.
  static constexpr Duration kPeriod = std::chrono::seconds(1);

  /// What one round of reports adds to the server's counts, and what the operator should read.
  struct Told {
    std::uint64_t late_ours = 0;  ///< forces that came too late, or are missing, by the part to blame
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    std::vector<std::string> warnings;
  };

  /// Gives the guests' sessions their reports when the last ones are a period old; otherwise does nothing.
  Told turn(LocalTime now, std::vector<ServedDevice>& devices, std::vector<Guest>& guests);

 private:
  LinkReport link_report(LocalTime now, const Guest& guest, const LinkMeter::Report& link,
                         const Lateness::Report& forces) const;
  void tell_of_engine(LocalTime now, const Guest& engine, const LinkMeter::Report& link,
                      std::vector<ServedDevice>& devices, std::vector<Guest>& guests) const;

  LocalTime reported_{};
};

}  // namespace tendon
