// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/models/exact_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>

namespace tendon::injector::exact::exact_math_test {
namespace {

TEST(ExactMath, NormalTailAgreesWithErfcAndIsTheInverseOfTheQuantile) {
  for (double z = 0; z < 37; z += 0.013) {
    EXPECT_NEAR(normal_tail(z) / (0.5 * std::erfc(z / std::sqrt(2.0))), 1, 1e-12) << z;
  }
  for (double p = 0.499; p > 1e-15; p *= 0.9) EXPECT_NEAR(normal_tail(-normal_quantile(p)) / p, 1, 2e-14) << p;
  EXPECT_EQ(normal_quantile(0.5), 0);
  EXPECT_EQ(normal_quantile(0.75), -normal_quantile(0.25));
}

/// 1 − F of a gamma distribution with integer shape k: e⁻ˣ Σ xⁱ/i!, i < k.
double erlang_tail(int k, double x) {
  double term = std::exp(-x);
  double sum = term;
  for (int i = 1; i < k; ++i) sum += term *= x / i;
  return sum;
}

TEST(ExactMath, GammaQuantileInvertsTheClosedFormsOfWholeAndHalfShapes) {
  for (double q = 0.999; q > 1e-12; q *= 0.7) {
    EXPECT_NEAR(gamma_quantile(1, 1 - q, q) / -std::log(q), 1, 1e-9) << q;
    for (const int k : {2, 4, 25, 400}) {
      EXPECT_NEAR(erlang_tail(k, gamma_quantile(k, 1 - q, q)) / q, 1, 1e-7) << k << " " << q;
    }
    // Shape ½ is half of the square of a standard normal variate.
    EXPECT_NEAR(std::erfc(std::sqrt(gamma_quantile(0.5, 1 - q, q))) / q, 1, 1e-7) << q;
  }
  for (double p = 0.5; p > 1e-12; p *= 0.7) {
    EXPECT_NEAR(gamma_quantile(1, p, 1 - p) / -std::log1p(-p), 1, 1e-9) << p;
    EXPECT_NEAR(std::erf(std::sqrt(gamma_quantile(0.5, p, 1 - p))) / p, 1, 1e-9) << p;
  }
  // If the shape is much smaller than 1, almost all values are near zero.
  EXPECT_EQ(gamma_quantile(0.01, 1e-12, 1 - 1e-12), 0);
}

TEST(ExactMath, GivesTheSameBitsEverywhere) {
  std::uint64_t sum = 0;
  const auto feed = [&sum](double x) {
    std::uint64_t bits = 0;
    std::memcpy(&bits, &x, sizeof bits);
    sum = sum * 0x100000001b3 ^ bits;
  };
  for (double p = 0.5; p > 1e-12; p *= 0.71) {
    feed(log(p));
    feed(exp(-p * 30));
    feed(normal_quantile(p));
    feed(normal_tail(p * 16));
    feed(gamma_quantile(0.3, p, 1 - p));
    feed(gamma_quantile(17, 1 - p, p));
  }
  EXPECT_EQ(sum, 5764668087681210650U);
}

}  // namespace
}  // namespace tendon::injector::exact::exact_math_test
