// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/teleoperation/coupling.h"
#include "protocol/messages.h"

namespace tendon {

/// Returns the description of this end of a coupling. The device and the channel are not set.
Couple couple_of(const Coupling::Config& config);

/// Returns a description of the first difference between the configurations of both ends, for example "method: yours
/// position-force, mine position-position". The tolerance for numbers is 1e-9, relative to the larger one. Returns an
/// empty string if the configurations are compatible.
std::string first_difference(const Couple& theirs, const Couple& mine);

}  // namespace tendon
