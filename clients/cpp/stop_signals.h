// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

namespace tendon {

/// While one lives, SIGINT and SIGTERM ask for a stop; a second one of the same kind ends the process as usual. One at a
/// time in a process, because the signal handlers are the process's. A signal that slips in just before a sleep does not
/// end it: sleep 100 ms at most.
///
/// Thread-safe: no. Realtime-safe: no.
class StopSignals {
 public:
  StopSignals();
  ~StopSignals();
  StopSignals(const StopSignals&) = delete;
  StopSignals& operator=(const StopSignals&) = delete;

  bool asked() const noexcept;

 private:
  struct sigaction old_int_ {};
  struct sigaction old_term_ {};
};

}  // namespace tendon
