// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/exact_math.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <span>

namespace tendon::injector::exact {
namespace {

constexpr double kHalfLogTwoPi = 0.91893853320467274178;  // ln √(2π)
constexpr double kInverseSqrtTwoPi = 0.39894228040143267794;

constexpr double polynomial(double x, std::span<const double> coefficients) noexcept {
  double sum = 0;
  for (std::size_t i = coefficients.size(); i-- > 0;) sum = sum * x + coefficients[i];
  return sum;
}

// AS 241, PPND16.
constexpr double kA[] = {3.3871328727963666080e0,  1.3314166789178437745e+2, 1.9715909503065514427e+3,
                         1.3731693765509461125e+4, 4.5921953931549871457e+4, 6.7265770927008700853e+4,
                         3.3430575583588128105e+4, 2.5090809287301226727e+3};
constexpr double kB[] = {1.0,
                         4.2313330701600911252e+1,
                         6.8718700749205790830e+2,
                         5.3941960214247511077e+3,
                         2.1213794301586595867e+4,
                         3.9307895800092710610e+4,
                         2.8729085735721942674e+4,
                         5.2264952788528545610e+3};
constexpr double kC[] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                         3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                         2.27238449892691845833e-2, 7.74545014278341407640e-4};
constexpr double kD[] = {1.0,
                         2.05319162663775882187e0,
                         1.67638483018380384940e0,
                         6.89767334985100004550e-1,
                         1.48103976427480074590e-1,
                         1.51986665636164571966e-2,
                         5.47593808499534494600e-4,
                         1.05075007164441684324e-9};
constexpr double kE[] = {6.65790464350110377720e0,  5.46378491116411436990e0,  1.78482653991729133580e0,
                         2.96560571828504891230e-1, 2.65321895265761230930e-2, 1.24266094738807843860e-3,
                         2.71155556874348757815e-5, 2.01033439929228813265e-7};
constexpr double kF[] = {1.0,
                         5.99832206555887937690e-1,
                         1.36929880922735805310e-1,
                         1.48753612908506148525e-2,
                         7.86869131145613259100e-4,
                         1.84631831751005468180e-5,
                         1.42151175831644588870e-7,
                         2.04426310338993978564e-15};

/// ln Γ(x) for x > 0: Stirling's series for x ≥ 10, and the recurrence Γ(x) = Γ(x + 1)/x below.
double log_gamma(double x) noexcept {
  double product = 1;
  for (; x < 10; x += 1) product *= x;
  constexpr double kStirling[] = {1.0 / 12,   -1.0 / 360,      1.0 / 1260, -1.0 / 1680,
                                  1.0 / 1188, -691.0 / 360360, 1.0 / 156};
  return (x - 0.5) * log(x) - x + kHalfLogTwoPi + polynomial(1 / (x * x), kStirling) / x - log(product);
}

/// P(a, x) and Q(a, x) = 1 − P, the regularized incomplete gamma functions; computes the smaller one where possible:
/// the series of P below x = a + 1, the continued fraction of Q above it (Lentz's method).
struct Shares {
  double below;
  double above;
};
Shares gamma_shares(double a, double x, double log_gamma_a) noexcept {
  const double front = exp(std::max(-700.0, a * log(x) - x - log_gamma_a));
  if (x < a + 1) {
    double term = 1 / a;
    double sum = term;
    for (double n = 1; term > sum * 1e-17; ++n) {
      term *= x / (a + n);
      sum += term;
    }
    const double below = std::min(1.0, front * sum);
    return {below, 1 - below};
  }
  double b = x + 1 - a;
  double c = 1e300;
  double d = 1 / b;
  double fraction = d;
  for (double i = 1; i < 100'000; ++i) {
    const double an = -i * (i - a);
    b += 2;
    d = 1 / (an * d + b);
    c = b + an / c;
    const double factor = c * d;
    fraction *= factor;
    if (std::abs(factor - 1) < 1e-16) break;
  }
  const double above = std::min(1.0, front * fraction);
  return {1 - above, above};
}

}  // namespace

double normal_quantile(double p) noexcept {
  const double q = p - 0.5;
  if (q >= -0.425 && q <= 0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(r, kA) / polynomial(r, kB);
  }
  const double r = std::sqrt(-log(q < 0 ? p : 1 - p));
  const double z =
      r <= 5 ? polynomial(r - 1.6, kC) / polynomial(r - 1.6, kD) : polynomial(r - 5, kE) / polynomial(r - 5, kF);
  return q < 0 ? -z : z;
}

double normal_tail(double z) noexcept {
  const double density = kInverseSqrtTwoPi * exp(-0.5 * z * z);
  if (z < 2.5) {  // Φ(z) = ½ + φ(z)(z + z³/3 + z⁵/(3·5) + …)
    double term = z;
    double sum = z;
    for (double n = 3; term > 1e-18; n += 2) {
      term *= z * z / n;
      sum += term;
    }
    return 0.5 - density * sum;
  }
  double fraction = z;  // Laplace: φ(z)/(z + 1/(z + 2/(z + 3/(z + …)))), evaluated backward
  for (double n = 200; n > 0; --n) fraction = z + n / fraction;
  return density / fraction;
}

double gamma_quantile(double shape, double p, double q) noexcept {
  const double log_gamma_shape = log_gamma(shape);
  // Initial value: near zero the leading term P = x^a/Γ(a + 1); elsewhere Wilson and Hilferty (1931), where the cube
  // root is approximately normal.
  double y = (log(p) + log_gamma_shape + log(shape)) / shape;  // y = ln x
  if (y < -690) return 0;
  const double ninth = 1 / (9 * shape);
  const double root = 1 - ninth + (p < q ? normal_quantile(p) : -normal_quantile(q)) * std::sqrt(ninth);
  if (shape > 0.5 && root > 0.1) y = log(shape * root * root * root);
  y = std::min(y, log(shape + 40 * (1 + std::sqrt(shape))));
  // Newton's method on the logarithm of the smaller probability. Both logarithms are concave, which limits overshoot.
  for (int i = 0; i < 60; ++i) {
    const double x = exp(y);
    const Shares shares = gamma_shares(shape, x, log_gamma_shape);
    const double slope = exp(std::max(-700.0, shape * y - x - log_gamma_shape));  // dP/dy
    const double share = p < q ? shares.below : shares.above;
    const double step = share / slope * (p < q ? log(p / share) : log(share / q));
    y += std::clamp(step, -2.0, 2.0);
    if (std::abs(step) < 1e-6) break;  // the next step is about 1e-12
  }
  return y < -690 ? 0 : exp(y);
}

}  // namespace tendon::injector::exact
