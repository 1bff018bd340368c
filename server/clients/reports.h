// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "server/clients/served_client.h"

namespace tendon {

/// Creates the reports that are sent once per second (SESSION.md, "Report"): to controllers about their forces, to the
/// operator about late or refused forces, and to observers with kFeatureDiagnostics about each device loop and each
/// engine. Thread-safe: no. Realtime-safe: no.
class Reports {
 public:
  static constexpr Duration kPeriod = std::chrono::seconds(1);  ///< the cost is small compared to 1000 states

  struct Sums {
    std::uint64_t late_ours = 0;  ///< late or missing forces by cause
    std::uint64_t late_network = 0;
    std::uint64_t late_engine = 0;
    std::uint64_t late_unknown = 0;
    std::vector<std::string> warnings;
  };

  /// Adds reports to the sessions if the last ones are at least one period old.
  Sums turn(LocalTime now, std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients);

 private:
  LinkReport link_report(LocalTime now, const ServedClient& client, const LinkMeter::Report& link,
                         const Lateness::Report& forces) const;
  void publish_engine(LocalTime now, const ServedClient& engine, const LinkMeter::Report& link,
                      std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients) const;

  LocalTime reported_{};
};

}  // namespace tendon
