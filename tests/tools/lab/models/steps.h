// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/patch.h"

namespace tendon::softbody::compared {

/// Throws std::invalid_argument without inertia or with viscosity.
void check_only_with_inertia(const EffectsConfig& config);

/// Nodes (m) at rest under the gravity in `loads`, whose other effects are ignored.
VectorXd shape_at_rest(const Elastic& elastic, const TouchSurface& surface, EffectsConfig loads);

}  // namespace tendon::softbody::compared
