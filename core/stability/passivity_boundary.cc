// SPDX-License-Identifier: Apache-2.0
#include "core/stability/passivity_boundary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string>

#include "core/base/expect.h"

namespace tendon {
namespace {

constexpr double kPi = std::numbers::pi;

/// The b that the condition requires at the angle θ.
double demand(const SampledSpring& spring, double theta) {
  const double half = theta / 2;
  const double d = spring.delay_samples;
  // sin((2d+1)θ/2)/sin(θ/2), with its limit at θ = 0.
  const double kernel = half < 1e-9 ? 2 * d + 1 : std::sin((2 * d + 1) * half) / std::sin(half);
  return spring.stiffness * seconds(spring.period) / 2 * kernel - spring.damping * std::cos((d + 1) * theta);
}

/// Golden-section search. The function has one maximum between `low` and `high`.
double refined_maximum(const SampledSpring& spring, double low, double high) {
  constexpr double kGolden = 0.6180339887498949;
  for (int i = 0; i < 60; ++i) {
    const double left = high - kGolden * (high - low);
    const double right = low + kGolden * (high - low);
    (demand(spring, left) > demand(spring, right) ? high : low) =
        demand(spring, left) > demand(spring, right) ? right : left;
  }
  return demand(spring, (low + high) / 2);
}

}  // namespace

double passive_viscous_friction(const SampledSpring& spring) {
  check(spring);
  // The maximum is located with 32 points per half wave of the fastest term, and refined by a golden-section search.
  const int points = 32 * (spring.delay_samples + 1);
  int best = 0;
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 0; i <= points; ++i) {
    const double here = demand(spring, kPi * i / points);
    if (here > most) {
      most = here;
      best = i;
    }
  }
  const double low = kPi * std::max(best - 1, 0) / points;
  const double high = kPi * std::min(best + 1, points) / points;
  return std::max(most, refined_maximum(spring, low, high));
}

double passive_viscous_friction(const std::function<std::complex<double>(std::complex<double>)>& environment,
                                Duration period, int points) {
  expect_above_zero(seconds(period), "period");
  expect(points >= 2, "points", points, "2 or more");
  double most = -std::numeric_limits<double>::infinity();
  for (int i = 1; i <= points; ++i) {
    const double theta = kPi * i / points;
    const std::complex<double> z = std::polar(1.0, theta);
    const double sine = std::sin(theta / 2);
    // 1 − cos θ = 2 sin²(θ/2)
    const double here = seconds(period) / (4 * sine * sine) * ((1.0 - 1.0 / z) * environment(z)).real();
    expect(std::isfinite(here), "environment", here, "a finite value at θ = " + shortest(theta));
    most = std::max(most, here);
  }
  return most;
}

double largest_passive_stiffness(const SampledSpring& spring) {
  check(spring);
  if (spring.damping == 0) return spring.viscous / mean_age(spring);
  SampledSpring tried = spring;
  const auto demanded = [&tried](double stiffness) {
    tried.stiffness = stiffness;
    return passive_viscous_friction(tried);
  };
  if (demanded(0) > spring.viscous) return 0;
  // The required friction is convex in K, and K (T/2 + dT) − B for θ → 0.
  double passive = 0;
  double active = 2 * (spring.viscous + std::abs(spring.damping)) / mean_age(spring);
  for (int i = 0; i < 60; ++i) {
    const double middle = (passive + active) / 2;
    (demanded(middle) <= spring.viscous ? passive : active) = middle;
  }
  return passive;
}

double passive_viscous_friction_of_field(double steepest, Duration period, int delay_samples) {
  return steepest * mean_age({.stiffness = steepest, .period = period, .delay_samples = delay_samples});
}

double felt_stiffness(double coupling, double environment) {
  expect_above_zero(coupling, "coupling");
  expect(environment >= 0, "environment", environment, "a stiffness of 0 N/m or more");
  return std::isinf(environment) ? coupling : coupling * environment / (coupling + environment);
}

}  // namespace tendon
