// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/steps.h"

#include <stdexcept>

#include "clients/softbody/models/quasi_static.h"

namespace tendon::softbody::compared {

void check_only_with_inertia(const EffectsConfig& config) {
  check(config);
  if (!config.inertia) throw std::invalid_argument("this model uses time steps and requires inertia");
  if (config.viscosity) throw std::invalid_argument("this model does not simulate viscosity");
}

VectorXd shape_at_rest(const Elastic& elastic, const TouchSurface& surface, EffectsConfig loads) {
  loads.inertia = false;
  loads.damping.reset();
  loads.viscosity.reset();
  return QuasiStaticModel(elastic, surface, {}, loads).displacements();
}

}  // namespace tendon::softbody::compared
