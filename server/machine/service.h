// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"

/// Sends status messages to systemd, see sd_notify(3). Without a service manager, these functions have no effect.
namespace tendon::service {

void ready();
void stopping();

/// Returns half of WatchdogSec=, the period for calling `alive`, or nothing if this process has no watchdog.
std::optional<Duration> watch_period();
void alive();

}  // namespace tendon::service
