// SPDX-License-Identifier: Apache-2.0
#include "core/stability/sampled_spring.h"

#include <cmath>
#include <string_view>

#include "core/base/expect.h"

namespace tendon {
namespace {

void expect_amount(std::string_view field, double value) {
  expect(value >= 0 && std::isfinite(value), field, value, "a finite number ≥ 0");
}

}  // namespace

void check(const SampledSpring& spring) {
  expect_amount("mass", spring.mass);
  expect_amount("viscous", spring.viscous);
  expect_amount("coulomb", spring.coulomb);
  expect_amount("stiffness", spring.stiffness);
  expect(std::isfinite(spring.damping), "damping", spring.damping, "a finite number");
  expect(spring.period > Duration::zero(), "period", seconds(spring.period), "more than 0 s");
  expect(spring.delay_samples >= 0 && spring.delay_samples <= kMaxDelaySamples, "delay_samples", spring.delay_samples,
         "0 to 200");
  expect_amount("encoder_step", spring.encoder_step);
}

void check_without_damper(const SampledSpring& spring) {
  check(spring);
  expect(spring.damping == 0, "damping", spring.damping, "0, because this law does not support a virtual damper");
}

double mean_age(const SampledSpring& spring) {
  check(spring);
  return (0.5 + spring.delay_samples) * seconds(spring.period);
}

}  // namespace tendon
