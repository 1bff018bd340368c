// SPDX-License-Identifier: Apache-2.0
// The energy that a static field gives out on a closed path of the hand, by interpolation and by method: a torus with
// int16 weights at 2 mm, K 1000 N/m, 1 to 3 mm deep, loops of about 80 mm in steps of about 10 µm.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iostream>
#include <numbers>
#include <vector>

#include "core/field/field.h"
#include "core/field/proxy.h"
#include "tests/core/field/shapes.h"
#include "tests/support/dice.h"

namespace tendon::field::leak_test {
namespace {

constexpr double kStiffness = 1000;
constexpr double kSpacing = 2e-3;
constexpr int kSteps = 10'000;

/// Trilinear interpolation with rounded values, for comparison.
struct Trilinear {
  double spacing() const noexcept { return kSpacing; }
  SurfacePoint at(const Vec3& x) const noexcept {
    const Vec3 s = x / kSpacing;
    const Vec3 low = s.array().floor();
    const Vec3 t = s - low;
    SurfacePoint point;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec3 one(corner % 2, corner / 2 % 2, corner / 4);
      const double value = std::round(torus(kSpacing * (low + one)) / 1e-6) * 1e-6;
      Vec3 weight;
      Vec3 slope;
      for (int a = 0; a < 3; ++a) {
        weight[a] = one[a] > 0 ? t[a] : 1 - t[a];
        slope[a] = one[a] > 0 ? 1 : -1;
      }
      point.distance += value * weight[0] * weight[1] * weight[2];
      point.gradient +=
          value / kSpacing *
          Vec3(slope[0] * weight[1] * weight[2], weight[0] * slope[1] * weight[2], weight[0] * weight[1] * slope[2]);
    }
    return point;
  }
};

/// Moves x to the true depth.
Vec3 put(Vec3 x, double depth) {
  for (int i = 0; i < 20; ++i) {
    Vec3 gradient;
    for (int a = 0; a < 3; ++a) {
      const Vec3 h = 1e-7 * Vec3::Unit(a);
      gradient[a] = (torus(x + h) - torus(x - h)) / 2e-7;
    }
    x -= gradient.normalized() * (torus(x) + depth);
  }
  return x;
}

/// A loop below the surface.
std::vector<Vec3> loop(Dice& dice) {
  for (;;) {
    const double around = dice.within(0, 2 * std::numbers::pi);
    const Vec3 centre(0.025 * std::cos(around), 0.025 * std::sin(around), 0.012);
    std::array<Vec3, 6> wave;
    for (std::size_t i = 0; i < 6; ++i)
      wave[i] = dice.within(3e-3, 9e-3) / static_cast<double>(i / 2 + 1) * dice.direction();
    const double swell = dice.within(0.2e-3, 1e-3);
    std::vector<Vec3> path(kSteps + 1);
    double longest = 0;
    for (std::size_t i = 0; i < path.size(); ++i) {
      const double t = 2 * std::numbers::pi * static_cast<double>(i) / kSteps;
      Vec3 x = centre;
      for (std::size_t a = 0; a < 3; ++a) {
        const double angle = static_cast<double>(a + 1) * t;
        x += wave[2 * a] * std::cos(angle) + wave[2 * a + 1] * std::sin(angle);
      }
      path[i] = put(x, 2e-3 + swell * std::sin(2 * t));
      if (i > 0) longest = std::max(longest, (path[i] - path[i - 1]).norm());
    }
    if (longest < 5e-5) return path;
  }
}

struct Leak {
  double gradient = 0;    ///< J, maximum work of the force −K φ ∇φ on the hand
  double projection = 0;  ///< J, maximum work of a spring to the projection of the position
  double proxy = 0;       ///< J, mean work of the spring to the proxy
  double proxy_most = -1;
};

/// Returns the work of a force on the hand along a loop, by the trapezoidal rule.
template <class Force>
double work(const std::vector<Vec3>& path, Force&& force) {
  double sum = 0;
  Vec3 before = force(path[0]);
  for (std::size_t i = 1; i < path.size(); ++i) {
    const Vec3 now = force(path[i]);
    sum += 0.5 * (before + now).dot(path[i] - path[i - 1]);
    before = now;
  }
  return sum;
}

template <class Surface>
Leak leak(const Surface& surface, int loops) {
  Dice dice(1);
  Leak result;
  for (int l = 0; l < loops; ++l) {
    const std::vector<Vec3> path = loop(dice);
    result.gradient = std::max(result.gradient, work(path, [&](const Vec3& x) {
                                 const SurfacePoint point = surface.at(x);
                                 return Vec3(-kStiffness * point.distance * point.gradient);
                               }));
    result.projection = std::max(result.projection, work(path, [&](const Vec3& x) {
                                   const SurfacePoint point = surface.at(x);
                                   const double squared = point.gradient.squaredNorm();
                                   return Vec3(-kStiffness * point.distance / squared * point.gradient);
                                 }));
    Proxy proxy{.position = put(path[0], 0)};
    const auto spring = [&](const Vec3& x) {
      proxy = moved(surface, proxy, x, 0);
      return Vec3(kStiffness * (proxy.position - x));
    };
    for (const Vec3& x : path) spring(x);  // settles
    const double stored = 0.5 / kStiffness * spring(path[0]).squaredNorm();
    double given = work(path, spring);
    given += 0.5 / kStiffness * spring(path[0]).squaredNorm() - stored;
    result.proxy += given / loops;
    result.proxy_most = std::max(result.proxy_most, given);
  }
  return result;
}

void print(const char* what, const Leak& leak) {
  std::cout << what << ", worst of the loops, µJ: -K phi grad phi " << leak.gradient * 1e6 << ", projection "
            << leak.projection * 1e6 << "; proxy, mean " << leak.proxy * 1e6 << "\n";
}

TEST(FieldLeak, OnALoopAProxyOnlyLosesEnergyAndLittleOnASpline) {
  BrickField bricks;
  sample(torus, Vec3::Constant(-0.04), Vec3::Constant(0.04), kSpacing, bricks);
  constexpr int kLoops = 6;
  const Leak spline = leak(Field{.bricks = &bricks}, kLoops);
  const Leak linear = leak(Trilinear{}, kLoops);
  print("quadratic B-spline", spline);
  print("trilinear", linear);
  EXPECT_LT(spline.gradient, 0.1e-6);
  EXPECT_LT(spline.projection, 15e-6);
  EXPECT_LT(spline.proxy_most, 0.01e-6) << "a proxy only loses";
  EXPECT_GT(spline.proxy, -10e-6);
  EXPECT_LT(linear.proxy_most, 0.01e-6);
  EXPECT_LT(linear.proxy, -100e-6) << "the comparison is too weak";
}

}  // namespace
}  // namespace tendon::field::leak_test
