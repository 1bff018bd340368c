// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/teleoperation/coupling.h"
#include "protocol/messages.h"

namespace tendon {

/// Device and channel are not set.
Couple couple_of(const Coupling::Config& config);

/// Returns the first difference between the configurations of both ends, for example "method: position-force in
/// your scene, position-position in the scene of the other server", or an empty string. The relative tolerance for
/// numbers is 1e-9.
std::string first_difference(const Couple& theirs, const Couple& mine);

}  // namespace tendon
