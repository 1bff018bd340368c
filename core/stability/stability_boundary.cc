// SPDX-License-Identifier: Apache-2.0
#include "core/stability/stability_boundary.h"

#include <cmath>
#include <stdexcept>

#include <Eigen/Core>
#include <Eigen/Eigenvalues>

#include "core/base/expect.h"

namespace tendon {
namespace {

void check_with_mass(const SampledSpring& spring) {
  check(spring);
  expect_above_zero(spring.mass, "mass");
}

}  // namespace

double spectral_radius(const SampledSpring& spring) {
  check_with_mass(spring);
  const double m = spring.mass;
  const double t = seconds(spring.period);
  const double u = spring.viscous * t / m;
  // Exact over one period: v decays with δ; a force moves x by T²/m · g(u) and v by T/m · h(u),
  // h = (1 − e^{−u})/u, g = (1 − h)/u. Series expansions avoid cancellation for small u.
  const double h = u < 1e-8 ? 1 - u / 2 : -std::expm1(-u) / u;
  const double g = u < 1e-3 ? 0.5 - u / 6 + u * u / 24 : (1 - h) / u;

  // The state consists of x, v, the previous x, and the forces in transit in the order from old to new.
  const Eigen::Index d = spring.delay_samples;
  const Eigen::Index n = 3 + d;
  Eigen::RowVectorXd computed = Eigen::RowVectorXd::Zero(n);
  computed(0) = -(spring.stiffness + spring.damping / t);
  computed(2) = spring.damping / t;
  Eigen::RowVectorXd held = computed;
  if (d > 0) held = Eigen::RowVectorXd::Unit(n, 3);

  Eigen::MatrixXd period = Eigen::MatrixXd::Zero(n, n);
  period(0, 0) = 1;
  period(0, 1) = t * h;
  period(1, 1) = std::exp(-u);
  period.row(0) += t * t / m * g * held;
  period.row(1) += t / m * h * held;
  period(2, 0) = 1;
  for (Eigen::Index i = 3; i + 1 < n; ++i) period(i, i + 1) = 1;
  if (d > 0) period.row(n - 1) = computed;

  const Eigen::EigenSolver<Eigen::MatrixXd> solver(period, false);
  if (solver.info() != Eigen::Success) throw std::runtime_error("spectral_radius: eigenvalues did not converge");
  return solver.eigenvalues().cwiseAbs().maxCoeff();
}

double largest_stable_stiffness(const SampledSpring& spring) {
  check_with_mass(spring);
  SampledSpring tried = spring;
  const auto is_stable = [&tried](double stiffness) {
    tried.stiffness = stiffness;
    return spectral_radius(tried) < 1;
  };
  // Even such a soft spring moves the slowest eigenvalue by about 1e-6 away from 1, which is far more than rounding.
  double stable = 1e-6 * (spring.viscous + std::abs(spring.damping)) / seconds(spring.period);
  if (stable == 0 || !is_stable(stable)) return 0;
  double unstable = stable;
  do {
    stable = unstable;
    unstable *= 2;
  } while (is_stable(unstable));
  while (unstable - stable > 1e-9 * stable) {
    const double middle = (stable + unstable) / 2;
    (is_stable(middle) ? stable : unstable) = middle;
  }
  return stable;
}

double jury_stiffness(const SampledSpring& spring) {
  check_with_mass(spring);
  check_without_damper(spring);
  expect(spring.delay_samples == 0, "delay_samples", spring.delay_samples,
         "0, because this form does not support a delay");
  const double b = spring.viscous;
  const double t = seconds(spring.period);
  const double u = b * t / spring.mass;
  if (u < 1e-4) return 2 * b / t * (1 + u / 6);  // the next term is smaller than 1e-9
  const double lost = -std::expm1(-u);
  return b / t * lost / (lost / u - std::exp(-u));
}

LinearLaw gil_stiffness(const SampledSpring& spring) {
  check_with_mass(spring);
  const double age = mean_age(spring);
  return {.stiffness = (spring.viscous + spring.damping) / age,
          .damper_share = std::abs(spring.damping) * age / spring.mass};
}

}  // namespace tendon
