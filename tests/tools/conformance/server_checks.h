// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// Talks to the server as several clients, and judges it with Report(Side::kServer). The server must have no other
/// controller. A key must be a controller's.
void judge_server(Wire& wire, const Options& options, Report& report);

}  // namespace tendon::conformance
