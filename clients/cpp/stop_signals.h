// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <csignal>

namespace tendon {

/// Catches SIGINT and SIGTERM during its lifetime. The first signal sets `asked`; a second one of the same kind
/// terminates the process. Only one instance per process, because signal handlers are global. A signal that arrives
/// immediately before a sleep does not interrupt it, so sleep for at most 100 ms. Thread-safe: no. Realtime-safe: no.
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
