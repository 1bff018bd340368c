// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/teleoperation/coupling.h"
#include "protocol/messages.h"

namespace tendon {

/// What this end of a coupling tells the other about itself. Device and channel are left for the caller.
Couple couple_of(const Coupling::Config& config);

/// The first thing in which two ends do not fit together, for people: "method: yours position-force, mine
/// position-position". Numbers fit when they differ by less than 1e-9 of the larger. Empty: they fit.
std::string first_difference(const Couple& theirs, const Couple& mine);

}  // namespace tendon
