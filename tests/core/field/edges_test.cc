// SPDX-License-Identifier: Apache-2.0
// Sharp edges and corners of a cube of 40 mm, from outside and from inside: the field of bricks against the exact box.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <iostream>
#include <numbers>

#include "core/field/field.h"
#include "core/field/proxy.h"
#include "tests/core/field/shapes.h"

namespace tendon::field::edges_test {
namespace {

constexpr double kStiffness = 1000;

struct Score {
  double error = 0;      ///< RMS error in % of the exact force
  double jump = 0;       ///< N in a step of 1 ms
  double true_jump = 0;  ///< N, of the exact box
};

/// The hand moves 2 mm below the faces of the cube, across edges and corners, at about 0.1 m/s.
Vec3 hand(double t, bool inside) {
  const double turn = 2 * std::numbers::pi * t;
  const Vec3 n = Vec3(std::cos(0.41 * turn), std::sin(0.41 * turn), 0.9 * std::sin(0.17 * turn + 0.3));
  return n * ((inside ? 0.022 : 0.018) / n.cwiseAbs().maxCoeff());
}

Score score(double spacing, bool inside, double friction) {
  const double side = inside ? -1 : 1;
  const auto cube = [side](const Vec3& x) { return side * box(x, Vec3::Constant(0.02)); };
  BrickField bricks;
  sample(cube, Vec3::Constant(-0.03), Vec3::Constant(0.03), spacing, bricks);
  const Field field{.bricks = &bricks};
  Field exact;
  exact.primitives = {{.shape = Box{.half = Vec3::Constant(0.02)}, .hollow = inside}};
  Proxy proxy{.position = hand(0, inside) * (inside ? 0.9 : 1.12)};
  Proxy truth = proxy;
  Score result;
  double wrong = 0;
  double all = 0;
  Vec3 before = Vec3::Zero();
  Vec3 true_before = Vec3::Zero();
  for (int k = 0; k < 20'000; ++k) {
    const Vec3 x = hand(1e-3 * k, inside);
    proxy = moved(field, proxy, x, friction);
    for (int i = 0; i < 10; ++i) truth = moved(exact, truth, x, friction);
    const Vec3 force = kStiffness * (proxy.position - x);
    const Vec3 wanted = kStiffness * (truth.position - x);
    if (k > 100) {
      wrong += (force - wanted).squaredNorm();
      all += wanted.squaredNorm();
      result.jump = std::max(result.jump, (force - before).norm());
      result.true_jump = std::max(result.true_jump, (wanted - true_before).norm());
    }
    before = force;
    true_before = wanted;
  }
  result.error = 100 * std::sqrt(wrong / all);
  return result;
}

TEST(FieldEdges, ACubeIsFeltRoundedByAFractionOfTheSpacing) {
  for (const bool inside : {false, true}) {
    for (const double friction : {0.0, 0.3}) {
      const Score coarse = score(2e-3, inside, friction);
      const Score fine = score(1e-3, inside, friction);
      for (const auto& [spacing, s] : {std::pair(2, coarse), std::pair(1, fine)}) {
        std::cout << (inside ? "inside " : "outside ") << spacing << " mm, friction " << friction << ": error "
                  << s.error << " %, largest jump " << s.jump << " N/ms, of the exact cube " << s.true_jump << "\n";
      }
      // Inside with friction, the exact cube sticks to one of two faces, and the rounded edge does not.
      const double more = inside && friction > 0 ? 10 : 0;
      EXPECT_LT(fine.error, 7 + more) << inside;
      EXPECT_LT(coarse.error, 11 + more) << inside;
      EXPECT_LT(fine.jump, fine.true_jump + 0.5) << inside;
    }
  }
}

}  // namespace
}  // namespace tendon::field::edges_test
