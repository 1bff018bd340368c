// SPDX-License-Identifier: Apache-2.0
#include "core/stability/coulomb_boundary.h"

#include <algorithm>
#include <limits>
#include <numbers>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

double abbott_okamura_stiffness(const SampledSpring& spring) {
  check_without_damper(spring);
  expect(spring.delay_samples == 0, "delay_samples", spring.delay_samples,
         "0, because this law does not support a delay");
  const double held = 2 * spring.viscous / seconds(spring.period);
  return spring.encoder_step == 0 ? held : std::min(held, 2 * spring.coulomb / spring.encoder_step);
}

std::string_view to_string(DiolaitiRegion region) noexcept {
  switch (region) {
    case DiolaitiRegion::kPassive:
      return "passive";
    case DiolaitiRegion::kLimitCycle:
      return "limit cycle";
    case DiolaitiRegion::kLocallyStable:
      return "locally stable";
    case DiolaitiRegion::kLocalLimitCycle:
      return "local limit cycle";
  }
  return "?";
}

Diolaiti diolaiti(const SampledSpring& spring) {
  check_without_damper(spring);
  const double k = spring.stiffness;
  const double leak = k * mean_age(spring) - spring.viscous;  // N·s/m, negative damping of the hold less friction
  Diolaiti result;
  result.beta = k == 0 ? kInfinity : spring.viscous / (k * seconds(spring.period));
  result.sigma = k * spring.encoder_step == 0 ? kInfinity : spring.coulomb / (k * spring.encoder_step);
  result.tau = spring.delay_samples;
  result.speed_limit = leak > 0 ? 4 / std::numbers::pi * spring.coulomb / leak : kInfinity;
  const bool comes_to_rest = result.sigma >= 0.5;
  if (leak > 0) {
    result.region = comes_to_rest ? DiolaitiRegion::kLocallyStable : DiolaitiRegion::kLocalLimitCycle;
  } else {
    result.region = comes_to_rest ? DiolaitiRegion::kPassive : DiolaitiRegion::kLimitCycle;
  }
  return result;
}

}  // namespace tendon
