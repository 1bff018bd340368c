// SPDX-License-Identifier: Apache-2.0
#include "core/base/portable_math.h"

#include <array>
#include <bit>
#include <cstddef>
#include <limits>
#include <numbers>

namespace tendon::portable {
namespace {

// ln 2 in two parts: the first has 32 bits, so that k · kLn2High is exact for every exponent k.
constexpr double kLn2High = 0x1.62e42fee00000p-1;
constexpr double kLn2Low = 0x1.a39ef35793c76p-33;

// π/2 in three parts: the first two have 22 bits, so that k · part is exact for k below 2³¹.
constexpr double kHalfPiHigh = 0x1.921fb00000000p+0;
constexpr double kHalfPiMiddle = 0x1.5110b00000000p-22;
constexpr double kHalfPiLow = 0x1.18469898cc517p-44;

/// c₀ + c₁x + c₂x² + …
template <std::size_t N>
constexpr double polynomial(double x, const std::array<double, N>& coefficients) noexcept {
  double sum = 0;
  for (std::size_t i = N; i-- > 0;) sum = sum * x + coefficients[i];
  return sum;
}

/// 1/first! · −1/(first + 2)! …: the Taylor series of sine (if first is 3) and cosine (if it is 4) in x².
template <std::size_t N>
constexpr std::array<double, N> alternating(int first, double sign) {
  std::array<double, N> series{};
  double factorial = 1;
  for (int n = 2; n < first; ++n) factorial *= n;
  for (std::size_t i = 0; i < N; ++i) {
    const int n = first + 2 * static_cast<int>(i);
    factorial *= i == 0 ? n : static_cast<double>(n) * (n - 1);
    series[i] = sign / factorial;
    sign = -sign;
  }
  return series;
}
constexpr auto kSine = alternating<8>(3, -1);   // up to x¹⁷, with a remainder below 1e-19
constexpr auto kCosine = alternating<8>(4, 1);  // to x¹⁸

/// x = k ln 2 + rest, where |rest| is at most slightly above ½ ln 2.
struct Doublings {
  std::int64_t k;
  double rest;
};
Doublings doublings(double x) noexcept {
  // This k is on the critical path: adding a double without fractional bits rounds the product. The exact quotient,
  // which defines k, is computed off the critical path and replaces k in the rare case that the two round differently.
  constexpr double kWhole = 0x1.8p52;
  double whole = (x * (1 / std::numbers::ln2) + kWhole) - kWhole;
  auto k = static_cast<std::int64_t>(whole);
  if (const std::int64_t defined = round(x / std::numbers::ln2); defined != k) [[unlikely]] {
    k = defined;
    whole = static_cast<double>(k);
  }
  return {k, (x - whole * kLn2High) - whole * kLn2Low};
}

/// 1 + r/first (1 + r/(first + 1) (… (1 + r/last))), summed from the smallest term. Each sum is 1 + sum * r / n, where
/// `sum` is the previous one. Because each division depends on the previous one, this takes 100 ns. The function
/// therefore predicts the sums with r / n, whose divisions are independent, and checks each prediction off the critical
/// path. If a prediction differs in its last bit (in one of 15 series), the following sums use the definition. This
/// takes 5 ns if the loop is unrolled with constant n.
template <std::size_t kFirst, std::size_t kLast>
double taylor(double r) noexcept {
  std::array<double, kLast + 1> sums;  // [n]: the sum of the terms from n + 1 on
  sums[kLast] = 1;
#pragma GCC unroll 16
  for (std::size_t n = kLast; n >= kFirst; --n) sums[n - 1] = 1 + sums[n] * (r / static_cast<double>(n));
  std::size_t n = kLast;
#pragma GCC unroll 16
  for (; n >= kFirst; --n) {
    if (sums[n - 1] != 1 + sums[n] * r / static_cast<double>(n)) break;
  }
  double sum = sums[n];
  for (; n >= kFirst; --n) sum = 1 + sum * r / static_cast<double>(n);
  return sum;
}

double power_of_two(std::int64_t k) noexcept {
  return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52);
}

/// x = quarter · π/2 + rest, where |rest| is at most slightly above π/4.
struct Angle {
  double rest;
  std::int64_t quarter;
};
Angle reduced(double x) noexcept {
  if (!(std::abs(x) < 0x1p30)) x = std::fmod(x, 2 * std::numbers::pi);
  if (!std::isfinite(x)) return {x, 0};
  const std::int64_t quarter = round(x / (std::numbers::pi / 2));
  const auto k = static_cast<double>(quarter);
  return {((x - k * kHalfPiHigh) - k * kHalfPiMiddle) - k * kHalfPiLow, quarter};
}

double small_sine(double x) noexcept {
  const double square = x * x;
  return x + x * square * polynomial(square, kSine);
}

double small_cosine(double x) noexcept {
  const double square = x * x;
  return 1 - (square / 2 - square * square * polynomial(square, kCosine));
}

}  // namespace

std::int64_t round(double x) noexcept {
  const auto whole = static_cast<std::int64_t>(x);
  const double rest = x - static_cast<double>(whole);
  return whole + (rest >= 0.5 ? 1 : rest <= -0.5 ? -1 : 0);
}

// ln(2ᵏm) = k ln 2 + 2 artanh(s), s = (m − 1)/(m + 1), m in √½…√2, so |s| ≤ 0.1716.
double log(double x) noexcept {
  const auto bits = std::bit_cast<std::uint64_t>(x);
  auto k = static_cast<std::int64_t>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0x000fffffffffffffU) | 0x3ff0000000000000U);
  if (m > std::numbers::sqrt2) {
    m /= 2;
    ++k;
  }
  constexpr std::array kArtanh = {1.0 / 3,  1.0 / 5,  1.0 / 7,  1.0 / 9,  1.0 / 11,
                                  1.0 / 13, 1.0 / 15, 1.0 / 17, 1.0 / 19, 1.0 / 21};
  const double s = (m - 1) / (m + 1);
  const double s2 = s * s;
  const double tail = 2 * s * s2 * polynomial(s2, kArtanh);
  const auto exponent = static_cast<double>(k);
  return exponent * kLn2High + (2 * s + (tail + exponent * kLn2Low));
}

// eˣ = 2ᵏ eʳ, |r| ≤ ½ ln 2.
double exp(double x) noexcept {
  if (!(x >= -700)) return x < -700 ? 0 : x;
  if (x > 709) return std::numeric_limits<double>::infinity();
  const auto [k, r] = doublings(x);
  return taylor<1, 14>(r) * power_of_two(k);
}

// eˣ − 1 = 2ᵏ (eʳ − 1) + (2ᵏ − 1), |r| ≤ ½ ln 2.
double expm1(double x) noexcept {
  if (!(std::abs(x) < 40)) return exp(x) - 1;  // 1 or eˣ is negligible
  const auto [k, r] = doublings(x);
  const double scale = power_of_two(k);
  return scale * (r * taylor<2, 15>(r)) + (scale - 1);
}

double tanh(double x) noexcept {
  if (std::abs(x) >= 20) return x > 0 ? 1 : -1;
  const double excess = expm1(2 * std::abs(x));  // NaN stays NaN
  const double size = excess / (excess + 2);
  return x < 0 ? -size : size;
}

double sin(double x) noexcept {
  const Angle angle = reduced(x);
  const double size = (angle.quarter & 1) == 0 ? small_sine(angle.rest) : small_cosine(angle.rest);
  return (angle.quarter & 2) == 0 ? size : -size;
}

double cos(double x) noexcept {
  const Angle angle = reduced(x);
  const double size = (angle.quarter & 1) == 0 ? small_cosine(angle.rest) : small_sine(angle.rest);
  return ((angle.quarter + 1) & 2) == 0 ? size : -size;
}

double atan2(double y, double x) noexcept {
  const double up = std::abs(y);
  const double along = std::abs(x);
  if (up == 0 && along == 0) return 0;
  // The angle to the nearer axis, with a tangent t in [0, 1]: atan(t) = atan(c) + atan((t − c)/(1 + t c)), c = i/4.
  constexpr std::array kAngle{0.0, 0.24497866312686414, 0.4636476090008061, 0.6435011087932844, 0.7853981633974483};
  const double t = up < along ? up / along : along / up;
  const auto i = static_cast<std::size_t>(round(t * 4));
  const double c = static_cast<double>(i) / 4;
  const double r = (t - c) / (1 + t * c);  // at most 1/8
  const double square = r * r;
  double series = 0;
  for (int n = 17; n >= 3; n -= 2) series = square * (1.0 / n - series);
  double angle = kAngle[i] + (r - r * series);
  if (up >= along) angle = std::numbers::pi / 2 - angle;
  if (x < 0) angle = std::numbers::pi - angle;
  return y < 0 ? -angle : angle;
}

}  // namespace tendon::portable
