// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// Talks to the server behind `wire` as several clients, and judges it: Report(Side::kServer). The server must have no
/// other controller; with a key, that of a controller.
void judge_server(Wire& wire, const Options& options, Report& report);

}  // namespace tendon::conformance
