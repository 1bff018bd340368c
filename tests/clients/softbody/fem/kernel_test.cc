// SPDX-License-Identifier: Apache-2.0
// Four elements computed together must give the results of each element alone.
#include "clients/softbody/fem/kernel.h"

#include <gtest/gtest.h>

#include <array>
#include <cstddef>
#include <stdexcept>

#include "clients/softbody/fem/laws.h"
#include "clients/softbody/fem/products.h"
#include "clients/softbody/fem/solid.h"
#include "tests/support/dice.h"

#pragma GCC diagnostic ignored "-Wpsabi"

namespace tendon::softbody::kernel_test {
namespace {

constexpr std::array kLaws{Law::kLinear, Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean};
constexpr double kMu = 3;
constexpr double kLambda = 27;

/// A near rotation, a stretch, a nearly flat and an inverted deformation gradient.
std::array<Mat3, kLanes> four(Dice& dice) {
  std::array<Mat3, kLanes> all;
  const std::array<double, kLanes> spread{0.2, 0.5, 0.3, 1.5};
  for (std::size_t k = 0; k < kLanes; ++k) {
    all[k] = Mat3::Identity();
    for (double& entry : all[k].reshaped()) entry += dice.within(-spread[k], spread[k]);
  }
  all[1] *= 3;
  all[2].col(1) *= dice.within(0, 0.1);
  return all;
}

template <Law kLaw>
void expect_each_as_alone(Dice& dice) {
  const std::array<Mat3, kLanes> f = four(dice);
  Lanes together[9];
  Lanes energies{};
  Lanes piola[9];
  for (int i = 0; i < 9; ++i) {
    for (std::size_t k = 0; k < kLanes; ++k) together[i][k] = f[k].data()[i];
  }
  kernel::respond<kLaw, Lanes>(together, kMu + Lanes{}, kLambda + Lanes{}, energies, piola);
  for (std::size_t k = 0; k < kLanes; ++k) {
    double energy = 0;
    Mat3 alone;
    kernel::respond<kLaw, double>(f[k].data(), kMu, kLambda, energy, alone.data());
    const Stress expected = stress(kLaw, f[k], kMu, kLambda);
    const double size = kLambda * (1 + f[k].squaredNorm() * f[k].squaredNorm());
    EXPECT_NEAR(energies[k], energy, 1e-13 * size);
    EXPECT_NEAR(energies[k], expected.energy, 1e-13 * size);
    for (int i = 0; i < 9; ++i) {
      EXPECT_NEAR(piola[i][k], alone.data()[i], 1e-13 * size);
      EXPECT_NEAR(piola[i][k], expected.piola.data()[i], 1e-13 * size) << static_cast<int>(kLaw) << ' ' << k;
    }
  }
}

TEST(Kernel, FourAtOnceAreEachWhatItIsAloneAlsoFlatAndInsideOut) {
  Dice dice(1);
  for (int i = 0; i < 100; ++i) {
    expect_each_as_alone<Law::kLinear>(dice);
    expect_each_as_alone<Law::kCorotational>(dice);
    expect_each_as_alone<Law::kStVenantKirchhoff>(dice);
    expect_each_as_alone<Law::kNeoHookean>(dice);
  }
}

TEST(Kernel, ForcesOfASolidAreTheSumOverThePointsOfItsElements) {
  Dice dice(2);
  for (const ElementInfo& each : elements()) {
    for (const Law law : kLaws) {
      // six hexahedra: the last group of four is not full
      Mesh mesh = block(each.shape, Vec3(0.1, 0.08, 0.05), {3, 1, 2});
      const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
      const Solid solid(std::move(mesh), each.element, {.young = 1e4, .poisson = 0.45}, law, fixed);
      VectorXd u(solid.size());
      for (double& one : u) one = dice.within(-4e-3, 4e-3);
      double energy = 0;
      VectorXd force = VectorXd::Zero(solid.size());
      for (int e = 0; e < solid.mesh().element_count(); ++e) {
        for (int q = 0; q < solid.points_per_element(); ++q) {
          const Solid::Point& point = solid.point(e, q);
          const Mat3 f = Mat3::Identity() + solid.displacements(u, e) * solid.gradient(e, q).transpose();
          const Stress here = stress(law, f, point.mu, point.lambda);
          energy += point.volume * here.energy;
          const Solid::Nodal nodal = point.volume * here.piola * solid.gradient(e, q);
          for (int i = 0; i < nodal.cols(); ++i) force.segment<3>(3 * solid.mesh().element(e)[at(i)]) += nodal.col(i);
        }
      }
      const Solid::Forces found = solid.forces(u);
      EXPECT_NEAR(found.energy / energy, 1, 1e-12) << each.name;
      EXPECT_LT((found.force - force).norm(), 1e-12 * force.norm()) << each.name << static_cast<int>(law);
    }
  }
}

TEST(Products, AreThoseOfAMatrixAndOfItsTranspose) {
  for (const Eigen::Index columns : {1, 3, 4, 9}) {
    const MatrixXd m = MatrixXd::Random(12, columns);
    const VectorXd x = VectorXd::Random(columns);
    const VectorXd y = VectorXd::Random(12);
    VectorXd found = VectorXd::Ones(5);
    times(m, x, found);
    EXPECT_LT((found - m * x).norm(), 1e-14);
    times_transposed(m, y, found);
    EXPECT_LT((found - m.transpose() * y).norm(), 1e-14);
  }
}

TEST(Products, RowsThatAreNoMultipleOfFourAreRefused) {
  VectorXd ignored;
  EXPECT_THROW(times(MatrixXd::Zero(5, 2), VectorXd::Zero(2), ignored), std::invalid_argument);
  EXPECT_THROW(times_transposed(MatrixXd::Zero(6, 2), VectorXd::Zero(6), ignored), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::kernel_test
