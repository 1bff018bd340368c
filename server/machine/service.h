// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/time.h"

/// Tells the service manager that has started this process how it is (systemd, sd_notify(3)). When none has, nothing
/// happens.
namespace tendon::service {

/// It serves.
void ready();
/// It has begun to end.
void stopping();

/// How often to call `alive`: half of the time (WatchdogSec=) after which the manager ends a process that it has not
/// heard of. Empty when it does not watch this one.
std::optional<Duration> watch_period();
void alive();

}  // namespace tendon::service
