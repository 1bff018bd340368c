// SPDX-License-Identifier: Apache-2.0
#include "core/base/portable_math.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace tendon::portable::portable_math_test {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
const double kNan = std::numeric_limits<double>::quiet_NaN();

double ulps(double right) { return std::max(3e-16 * std::abs(right), 1.2e-16); }

TEST(PortableMath, RoundsEvenWhereAddingAHalfWouldNot) {
  EXPECT_EQ(round(0.49999999999999994), 0);
  EXPECT_EQ(round(0.5), 1);
  EXPECT_EQ(round(-0.5), -1);
  EXPECT_EQ(round(-2.4), -2);
  EXPECT_EQ(round(4503599627370497.0), 4503599627370497);
}

TEST(PortableMath, LogarithmAndExponentialAgreeWithLibmToTheLastBits) {
  for (double x = 1e-300; x < 1e300; x *= 1.37) {
    EXPECT_NEAR(log(x), std::log(x), 4e-16 * std::max(1.0, std::abs(std::log(x)))) << x;
  }
  for (double x = 0.9; x < 1.1; x += 0.0003) EXPECT_NEAR(log(x), std::log(x), 1e-16) << x;
  for (double x = -700; x < 700; x += 0.317) EXPECT_NEAR(exp(x) / std::exp(x), 1, 1e-15) << x;
  EXPECT_EQ(log(1), 0);
  EXPECT_EQ(exp(0), 1);
  EXPECT_EQ(exp(-kInfinity), 0);
  EXPECT_EQ(exp(kInfinity), kInfinity);
  EXPECT_TRUE(std::isnan(exp(kNan)));
}

TEST(PortableMath, Expm1AndTanhKeepTheirPrecisionNearZero) {
  for (double x = 1e-18; x < 60; x *= 1.07) {
    for (const double y : {x, -x}) {
      EXPECT_NEAR(expm1(y) / std::expm1(y), 1, 1e-15) << y;
      EXPECT_NEAR(tanh(y) / std::tanh(y), 1, 1e-15) << y;
      EXPECT_LE(std::abs(tanh(y)), 1) << y;
    }
  }
  EXPECT_EQ(expm1(0), 0);
  EXPECT_EQ(expm1(-kInfinity), -1);
  EXPECT_EQ(tanh(0), 0);
  EXPECT_EQ(tanh(kInfinity), 1);
  EXPECT_EQ(tanh(-kInfinity), -1);
  EXPECT_TRUE(std::isnan(expm1(kNan)));
  EXPECT_TRUE(std::isnan(tanh(kNan)));
}

/// Returns eˣ (or eˣ − 1). The operations are in the order of the definition, and each of them is rounded.
double defined(double x, bool less_one) {
  const std::int64_t k = round(x / std::numbers::ln2);
  const auto whole = static_cast<double>(k);
  const double r = (x - whole * 0x1.62e42fee00000p-1) - whole * 0x1.a39ef35793c76p-33;
  double sum = 1;
  for (double n = less_one ? 15 : 14; n > (less_one ? 1 : 0); --n) sum = 1 + sum * r / n;
  const double scale = std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
  return less_one ? scale * (r * sum) + (scale - 1) : sum * scale;
}

TEST(PortableMath, TheExponentialsAreTheirSeriesToTheLastBit) {
  const auto same = [](double x) {
    ASSERT_EQ(exp(x), defined(x, false)) << x;
    if (std::abs(x) >= 40) return;
    ASSERT_EQ(expm1(x), defined(x, true)) << x;
  };
  for (double x = -40; x < 40; x += 0.00137) same(x);
  for (double x = 1e-300; x < 1; x *= 1.01) {
    same(x);
    same(-x);
  }
  for (int k = -1000; k < 1000; ++k) {  // halfway between two adjacent powers of two
    double x = (k + 0.5) * std::numbers::ln2;
    for (int i = 0; i < 4; ++i) x = std::nextafter(x, -kInfinity);
    for (int i = 0; i < 9; ++i, x = std::nextafter(x, kInfinity)) same(x);
  }
}

TEST(PortableMath, SineAndCosineAgreeWithLibmUpToAYearOfSeconds) {
  for (double x = 1e-12; x < 1e9; x *= 1.0011) {
    for (const double y : {x, -x}) {
      EXPECT_NEAR(sin(y), std::sin(y), ulps(std::sin(y))) << y;
      EXPECT_NEAR(cos(y), std::cos(y), ulps(std::cos(y))) << y;
    }
  }
  for (int k = -100'000; k < 100'000; k += 7) {
    const double y = k * std::numbers::pi / 2;
    EXPECT_NEAR(sin(y), std::sin(y), 1.2e-16) << k;
    EXPECT_NEAR(cos(y), std::cos(y), 1.2e-16) << k;
  }
  EXPECT_EQ(sin(0), 0);
  EXPECT_EQ(cos(0), 1);
  EXPECT_LE(std::abs(sin(1e300)), 1);
  EXPECT_TRUE(std::isnan(sin(kInfinity)));
  EXPECT_TRUE(std::isnan(cos(kNan)));
}

TEST(PortableMath, HypotNeitherOverflowsNorLosesTheSmallSide) {
  EXPECT_EQ(hypot(3.0, 4.0), 5);
  EXPECT_EQ(hypot(0.0, -2.0), 2);
  EXPECT_EQ(hypot(0.0, 0.0), 0);
  EXPECT_EQ(hypot(3e-200, 4e-200), 5e-200);
  EXPECT_NEAR(hypot(3e200, 4e200) / 5e200, 1, 1e-15);
  EXPECT_NEAR(hypot(3e30F, 4e30F) / 5e30F, 1, 1e-6);
  EXPECT_EQ(hypot(kInfinity, 1.0), kInfinity);
  EXPECT_TRUE(std::isnan(hypot(kNan, 1.0)));
}

/// Another hash means that this machine does not reproduce the reference bits.
TEST(PortableMath, TheBitsAreThoseOfEveryOtherMachine) {
  std::uint64_t bits = 0;
  const auto feed = [&](double value) { bits = bits * 6364136223846793005U + std::bit_cast<std::uint64_t>(value); };
  for (int i = 1; i < 5'000; ++i) {
    const double x = i * 0.0137;
    feed(sin(x));
    feed(cos(-x * 1000));
    feed(exp(-x));
    feed(expm1(x / 10));
    feed(tanh(x / 10));
    feed(log(x));
    feed(hypot(x, 1 / x));
  }
  EXPECT_EQ(bits, 3218950563101596005U);
}

}  // namespace
}  // namespace tendon::portable::portable_math_test
