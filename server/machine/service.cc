// SPDX-License-Identifier: Apache-2.0
#include "server/machine/service.h"

#include <systemd/sd-daemon.h>

#include <chrono>
#include <cstdint>

namespace tendon::service {

void ready() { sd_notify(0, "READY=1"); }

void stopping() { sd_notify(0, "STOPPING=1"); }

std::optional<Duration> watch_period() {
  std::uint64_t microseconds = 0;
  if (sd_watchdog_enabled(0, &microseconds) <= 0) return {};
  return std::chrono::microseconds(microseconds / 2);
}

void alive() { sd_notify(0, "WATCHDOG=1"); }

}  // namespace tendon::service
