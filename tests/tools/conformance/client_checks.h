// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// Is the server of `guest`, a client that talks to `wire`, and judges it: Report(Side::kClient). A controller is
/// expected to compute one force from each state that it is shown.
void judge_client(Wire& wire, Guest& guest, const Options& options, Report& report);

}  // namespace tendon::conformance
