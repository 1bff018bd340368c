// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/fem/solid.h"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <stdexcept>

#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::solid_test {
namespace {

constexpr double kPi = std::numbers::pi;

Mesh crooked_block(Shape shape) {
  Mesh mesh = block(shape, Vec3(0.1, 0.08, 0.05), {3, 3, 2});
  for (Vec3& node : mesh.nodes) {
    const double inside =
        std::cos(10 * kPi * node.x()) * std::cos(12.5 * kPi * node.y()) * std::sin(20 * kPi * node.z());
    node += 0.003 * inside * Vec3(1, -0.6, 0.8);
  }
  return mesh;
}

/// The free displacements, given the prescribed ones in `u` and the loads on the free nodes.
VectorXd at_rest(const Solid& solid, VectorXd u, const VectorXd& loads) {
  const Factor factor = factor_of(solid.exact_stiffness(u));
  solid.add_free(factor.solve(solid.to_free(loads - solid.forces(u).force)), u);
  return u;
}

TEST(Reference, PatchTestAConstantStrainOnTheSurfaceIsConstantInside) {
  Mat3 strain;
  strain << 1, 0.4, -0.3, 0.2, -0.8, 0.5, 0.6, 0.1, 0.7;
  for (const ElementInfo& each : elements()) {
    const Mesh mesh = crooked_block(each.shape);
    Fixed fixed(3 * mesh.nodes.size(), false);
    for (const Facet& facet : surface(mesh)) {
      for (const int node : nodes_on(mesh, facet)) {
        for (std::size_t c = 0; c < 3; ++c) fixed[3 * static_cast<std::size_t>(node) + c] = true;
      }
    }
    const Solid solid(mesh, each.element, {.young = 1e4, .poisson = 0.45}, Law::kLinear, fixed);
    ASSERT_GT(solid.free_count(), 0);
    VectorXd exact(solid.size());
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      exact.segment<3>(3 * static_cast<Eigen::Index>(i)) = strain * mesh.nodes[i];
    }
    VectorXd given = exact;
    solid.add_free(-solid.to_free(exact), given);
    const VectorXd u = at_rest(solid, given, VectorXd::Zero(solid.size()));
    EXPECT_LT((u - exact).cwiseAbs().maxCoeff() / exact.cwiseAbs().maxCoeff(), 1e-12) << each.name;
  }
}

TEST(Reference, ABarIsStretchedByStressOverYoung) {
  for (const ElementInfo& each : elements()) {
    const Mesh mesh = crooked_block(each.shape);
    // Rollers on three sides. The side at x = 50 mm is pulled by 1 %.
    Fixed fixed(3 * mesh.nodes.size(), false);
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      fixed[3 * i] = std::abs(mesh.nodes[i].x()) > 0.05 - 1e-9;
      fixed[3 * i + 1] = mesh.nodes[i].y() < -0.04 + 1e-9;
      fixed[3 * i + 2] = mesh.nodes[i].z() < 1e-9;
    }
    const Solid solid(mesh, each.element, {.young = 1e4, .poisson = 0.3}, Law::kLinear, fixed);
    VectorXd u = VectorXd::Zero(solid.size());
    double drawn = 0;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      if (mesh.nodes[i].x() > 0.05 - 1e-9) u[3 * static_cast<Eigen::Index>(i)] = 1e-3;
    }
    u = at_rest(solid, u, VectorXd::Zero(solid.size()));
    const VectorXd force = solid.forces(u).force;
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      if (mesh.nodes[i].x() > 0.05 - 1e-9) drawn += force[3 * static_cast<Eigen::Index>(i)];
    }
    EXPECT_NEAR(drawn, 1e4 * 0.01 * 0.08 * 0.05, 1e-12) << each.name;
  }
}

/// Tip deflection of a 10 × 1 × 1 beam over Timoshenko's F·L³/(3EI) + F·L/(κGA). With ν = 0 a clamp does not restrain
/// lateral contraction, so the theory holds up to the clamp.
double cantilever(Element element, int along, int across) {
  Mesh mesh = block(info(element).shape, Vec3(10, 1, 1), {along, across, across});
  Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.x() < -5 + 1e-9; });
  const Solid solid(std::move(mesh), element, {.young = 1000, .poisson = 0}, Law::kLinear, std::move(fixed));
  VectorXd loads = VectorXd::Zero(solid.size());
  const auto& nodes = solid.mesh().nodes;
  double area = 0;
  for (const Facet& facet : surface(solid.mesh())) {
    const auto on = nodes_on(solid.mesh(), facet);
    bool far = true;
    for (const int node : on) far = far && nodes[static_cast<std::size_t>(node)].x() > 5 - 1e-9;
    if (!far) continue;
    // Consistent nodal loads: equal for the corners of a linear face; for a 9-node face 4/9 at the center, 1/9 on the
    // edges and 1/36 at the corners.
    const double share = 1.0 / (across * across) / (on.size() == 3 ? 2 : 1);
    for (std::size_t i = 0; i < on.size(); ++i) {
      double part = 1.0 / static_cast<double>(on.size());
      if (on.size() == 9) part = i < 4 ? 1 / 36.0 : i < 8 ? 1 / 9.0 : 4 / 9.0;
      loads[3 * on[i] + 2] += share * part;
    }
    area += share;
  }
  EXPECT_NEAR(area, 1, 1e-12);
  const VectorXd u = at_rest(solid, VectorXd::Zero(solid.size()), loads);
  const double inertia = 1 / 12.0;
  const double kappa = 10 / 12.0;  // Cowper 1966
  const double shear = 1000 / 2.0;
  return loads.dot(u) / (1000.0 / (3 * 1000 * inertia) + 10 / (kappa * shear));
}

TEST(Reference, ACantileverBendsAsTimoshenkoSays) {
  EXPECT_NEAR(cantilever(Element::kHex27, 10, 1), 1, 0.005);
  EXPECT_NEAR(cantilever(Element::kHex8Sri, 40, 4), 1, 0.04);
  EXPECT_LT(cantilever(Element::kTet4, 10, 1), 0.5);  // shear locking
}

TEST(Solid, ForcesAreTheSlopeOfTheEnergyAndTheStiffnessThatOfTheForces) {
  for (const Element element : {Element::kTet4, Element::kHex8Sri}) {
    for (const Law law : {Law::kLinear, Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean}) {
      const Solid solid = testing::pressed_block(element, 2, 0.45, law);
      VectorXd u(solid.size());
      VectorXd along(solid.free_count());
      for (int i = 0; i < u.size(); ++i) u[i] = 3e-3 * std::sin(1.7 * i);
      for (int i = 0; i < along.size(); ++i) along[i] = std::cos(2.3 * i);
      const double h = 1e-7;
      VectorXd plus = u;
      VectorXd minus = u;
      solid.add_free(h * along, plus);
      solid.add_free(-h * along, minus);
      const VectorXd force = solid.to_free(solid.forces(u).force);
      EXPECT_NEAR((solid.energy(plus) - solid.energy(minus)) / (2 * h), force.dot(along), 1e-6 * force.norm());
      const SymmetricMatrix k = solid.exact_stiffness(u);
      const VectorXd measured = solid.to_free(solid.forces(plus).force - solid.forces(minus).force) / (2 * h);
      EXPECT_LT((k.times(along) - measured).norm(), 1e-6 * measured.norm())
          << info(element).name << static_cast<int>(law);
    }
  }
}

TEST(Solid, WhatCannotBeIsRefused) {
  const Mesh mesh = block(Shape::kHex8, Vec3(1, 1, 1), {1, 1, 1});
  const Material soft{.young = 1, .poisson = 0.3};
  const Fixed nothing(3 * mesh.nodes.size(), false);
  const Fixed all(3 * mesh.nodes.size(), true);
  EXPECT_THROW(Solid(mesh, Element::kHex8, soft, Law::kLinear, nothing), std::invalid_argument);
  EXPECT_THROW(Solid(mesh, Element::kTet4, soft, Law::kLinear, all), std::invalid_argument);
  EXPECT_THROW(Solid(mesh, Element::kHex8, {.young = -1, .poisson = 0.3}, Law::kLinear, all), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::solid_test
