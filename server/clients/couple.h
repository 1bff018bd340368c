// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "core/teleoperation/coupling.h"
#include "protocol/messages.h"

namespace tendon {

Couple couple_of(const Coupling::Config& config);  ///< device and channel are not set

/// Returns the first difference between the configurations of both ends, for example "method: position-force in your
/// scene, position-position in the scene of the other server", or an empty string. Tolerance: 1e-9, relative.
std::string first_difference(const Couple& theirs, const Couple& mine);

}  // namespace tendon
