// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/patch.h"

namespace tendon::softbody::compared {

// Functions for models with explicit time steps.

/// Throws std::invalid_argument if inertia is missing or if viscosity is set.
void check_only_with_inertia(const EffectsConfig& config);

/// Returns the displacements of all nodes (m) at rest under the gravity in `loads`. Inertia, damping and viscosity in
/// `loads` are ignored.
VectorXd shape_at_rest(const Elastic& elastic, const TouchSurface& surface, EffectsConfig loads);

}  // namespace tendon::softbody::compared
