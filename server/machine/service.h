// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"

/// Tells the service manager that started this process (systemd, sd_notify(3)) how the process does. Without a service
/// manager it does nothing.
namespace tendon::service {

/// It serves.
void ready();
/// It has begun to end.
void stopping();

/// How often to call `alive`: half of WatchdogSec=, the silence after which the manager ends a process. Empty when the
/// manager does not watch this one.
std::optional<Duration> watch_period();
void alive();

}  // namespace tendon::service
