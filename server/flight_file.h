// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "server/mailboxes.h"
#include "server/recorder.h"

namespace tendon {

/// Writes the steps that led to a fault as a recording of its own, and thaws the flight recorder.
///
/// `flight` must be frozen. Log thread only.
void write_flight(decltype(Mailboxes::flight)& flight, const Recorder::Config& config, ByteSink& sink);

}  // namespace tendon
