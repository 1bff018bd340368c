// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "tests/tools/conformance/opening.h"
#include "tests/tools/conformance/report.h"
#include "tests/tools/conformance/wire.h"

namespace tendon::conformance {

/// Acts as the server of `guest` and judges it with Report(Side::kClient). A controller must compute one force from
/// each state that it receives.
void judge_client(Wire& wire, Guest& guest, const Options& options, Report& report);

}  // namespace tendon::conformance
