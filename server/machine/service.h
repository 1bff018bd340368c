// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"

/// Sends status messages to the service manager that has started this process (systemd, see sd_notify(3)). If there is
/// no service manager, these functions have no effect.
namespace tendon::service {

void ready();
void stopping();

/// Returns half of WatchdogSec=, or nothing if the watchdog is not enabled for this process. `alive` must be called at
/// this period.
std::optional<Duration> watch_period();
void alive();

}  // namespace tendon::service
