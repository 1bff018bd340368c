// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/near/near_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "clients/softbody/models/quasi_static.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::near_body_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;

struct AtRest {
  AtRest(int n, double poisson, Law law)
      : solid(pressed_block(Element::kHex8Sri, n, poisson, law)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        factor(factor_of(solid.exact_stiffness(VectorXd::Zero(solid.size())))),
        load(patch_load(solid, Vec3::UnitZ(), *top.patch(Vec2::Zero()))) {}
  std::unique_ptr<NearBody> near(double radius, int modes = NearBody::Config{}.modes,
                                 const std::vector<int>& pressed = {}) const {
    return made({Vec3(0, 0, 0.05), radius, modes, pressed, solid.to_free(load)}, factor);
  }
  std::unique_ptr<NearBody> made(NearBody::Config config, const Factor& of) const {
    std::unique_ptr<NearBody> body;
    Pieces pieces = NearBody::make(solid, of, std::move(config), body);
    while (pieces.next()) continue;
    return body;
  }
  Solid solid;
  TouchSurface top;
  Factor factor;
  VectorXd load;
};

struct Pressed : AtRest {
  Pressed(Law law, double radius, int modes)
      : AtRest(8, 0.45, law), whole(solid, top, {.max_iterations = 100, .tolerance = 1e-10, .glides = false}) {
    force = whole.press(*top.patch(Vec2::Zero()), Prescribed::kDepth, kDepth).force;
    if (!whole.renew_factor()) throw std::runtime_error("not definite");
    body = made({.middle = Vec3(0, 0, 0.05),
                 .radius = radius,
                 .modes = modes,
                 .pressed = {},
                 .press = solid.to_free(load),
                 .about = whole.displacements(),
                 .about_depth = kDepth},
                whole.factor());
  }
  static constexpr double kDepth = 4e-3;
  QuasiStaticModel whole;
  double force;
  std::unique_ptr<NearBody> body;
};

VectorXd own_load(const NearBody& body, const VectorXd& load) {
  VectorXd own = VectorXd::Zero(body.size());
  for (int node = 0; 3 * node < load.size(); ++node) {
    if (body.own_node(node) >= 0) own.segment<3>(3 * body.own_node(node)) = load.segment<3>(3 * node);
  }
  return body.to_free(own);
}

TEST(NearBody, ForcesAreTheSlopeOfTheEnergyAndTheStiffnessThatOfTheForces) {
  constexpr Law kLaws[] = {Law::kNeoHookean, Law::kCorotational, Law::kStVenantKirchhoff};
  std::vector<std::unique_ptr<NearBody>> bodies;
  for (const Law law : kLaws) bodies.push_back(AtRest(8, 0.45, law).near(0.035));
  for (const Law law : kLaws) bodies.push_back(std::move(Pressed(law, 0.035, 60).body));
  for (const auto& body : bodies) {
    ASSERT_GT(body->modes(), 20);
    VectorXd u = body->beginning();
    VectorXd way = VectorXd::Zero(body->free_count());
    const int inner = body->free_count() - body->modes();
    for (int i = 0; i < body->free_count(); ++i) way[i] = (i < inner ? 1e-3 : 3e-3) * std::sin(3.0 * i);
    body->add_free(way, u);
    const SymmetricMatrix stiffness = body->exact_stiffness(u);
    const double h = 1e-7;
    for (int i = 0; i < body->free_count(); i += 7) {
      VectorXd low = u;
      VectorXd high = u;
      body->add_free(-h * VectorXd::Unit(body->free_count(), i), low);
      body->add_free(h * VectorXd::Unit(body->free_count(), i), high);
      const VectorXd force = body->to_free(body->forces(u).force);
      EXPECT_NEAR((body->energy(high) - body->energy(low)) / (2 * h), force[i], 1e-6 * force.lpNorm<Eigen::Infinity>());
      const VectorXd slope = body->to_free(body->forces(high).force - body->forces(low).force) / (2 * h);
      const VectorXd column = stiffness.times(VectorXd::Unit(body->free_count(), i));
      EXPECT_LT((slope - column).norm(), 1e-5 * column.norm()) << i;
    }
  }
}

// Regression: in a rotated frame, other elements at the same distance were evaluated for the error.
TEST(NearBody, WhatItLeavesOutDoesNotDependOnRounding) {
  const AtRest block(8, 0.45, Law::kNeoHookean);
  const Patch pressed = *block.top.patch(Vec2(0.004, 0.002));
  const auto left_out = [&](const Vec3& middle) {
    const auto body = block.made(
        {.middle = middle, .radius = 0.035, .pressed = pressed.nodes, .press = block.solid.to_free(block.load)},
        block.factor);
    QuasiStaticModel model(*body, block.top, {.max_iterations = 100, .tolerance = 1e-8, .glides = false});
    Patch own = pressed;
    for (int& node : own.nodes) node = body->own_node(node);
    model.press(own, Prescribed::kDepth, 4e-3);
    return body->left_out(model.displacements(), 4e-3);
  };
  const double expected = left_out(Vec3(0, 0, 0.05));
  for (const double by : {-1e-15, 1e-15}) {
    EXPECT_NEAR(left_out(Vec3(by, -by / 2, 0.05)), expected, 1e-6 * std::abs(expected)) << by;
  }
}

TEST(NearBody, WithItsExactInterfaceItIsTheWholeBodyAtFirstTouch) {
  const AtRest block(8, 0.45, Law::kNeoHookean);
  const double whole = block.solid.to_free(block.load).dot(block.factor.solve(block.solid.to_free(block.load)).col(0));
  const auto compliance = [&](int modes) {
    const auto body = block.near(0.045, modes);
    const VectorXd load = own_load(*body, block.load);
    return load.dot(factor_of(body->exact_stiffness(VectorXd::Zero(body->size()))).solve(load).col(0));
  };
  EXPECT_NEAR(compliance(100'000) / whole, 1, 1e-7);
  EXPECT_LT(compliance(60), whole);
  EXPECT_NEAR(compliance(60) / whole, 1, 5e-3);
  EXPECT_LT(compliance(10), compliance(60));
}

TEST(NearBody, AboutAPressedShapeItBeginsThereAtRestAsStiffAsTheWholeBody) {
  for (const Law law : {Law::kNeoHookean, Law::kCorotational}) {
    const Pressed exact(law, 0.045, 100'000);
    const NearBody& body = *exact.body;
    const VectorXd load = own_load(body, exact.load);
    const VectorXd left = body.to_free(body.forces(body.beginning()).force) - exact.force * load;
    EXPECT_LT(left.norm(), 1e-8 * exact.force);
    const Factor factor = factor_of(body.exact_stiffness(body.beginning()));
    const VectorXd whole_load = exact.solid.to_free(exact.load);
    const double whole = whole_load.dot(exact.whole.factor().solve(whole_load).col(0));
    EXPECT_NEAR(load.dot(factor.solve(load).col(0)) / whole, 1, 1e-7);
  }
}

TEST(NearBody, AboutAPressedShapeNothingIsLeftOutThereAndFarFromItMuch) {
  const Pressed pressed(Law::kNeoHookean, 0.045, 60);
  const NearBody& body = *pressed.body;
  EXPECT_LT(std::abs(body.left_out(body.beginning(), Pressed::kDepth)), 1e-12);
  QuasiStaticModel model(body, pressed.top, {.max_iterations = 100, .tolerance = 1e-9, .glides = false});
  Patch patch = *pressed.top.patch(Vec2::Zero());
  for (int& node : patch.nodes) node = body.own_node(node);
  double before = 0;
  for (const double depth : {3.5e-3, 2e-3, 1e-5}) {
    model.press(patch, Prescribed::kDepth, depth);
    const double left_out = std::abs(body.left_out(model.displacements(), depth));
    EXPECT_GT(left_out, before) << depth;
    before = left_out;
  }
}

TEST(NearBody, OfABodyThatEndsBeforeItsRadiusThereIsNone) {
  const AtRest block(4, 0.45, Law::kNeoHookean);
  EXPECT_EQ(block.near(0.2), nullptr);
  EXPECT_NE(block.near(0.055), nullptr);
}

TEST(NearBody, NoToolPressesOnTheInterfaceOrBeyond) {
  const AtRest block(8, 0.45, Law::kNeoHookean);
  const auto body = block.near(0.045);
  int near = 0;
  for (int node = 0; 3 * node < block.solid.size(); ++node) {
    if (body->own_node(node) < 0) continue;
    ++near;
    EXPECT_EQ(body->mesh().nodes[at(body->own_node(node))], block.solid.mesh().nodes[at(node)]);
    EXPECT_LT((block.solid.mesh().nodes[at(node)] - Vec3(0, 0, 0.05)).norm(), 0.055);
  }
  EXPECT_GT(near, 40);
  EXPECT_LT(near + body->interface() / 3, static_cast<int>(body->mesh().nodes.size()) + 1);
}

TEST(NearBody, AToolMayPressWhereItIsSaidToHoweverFar) {
  const AtRest block(8, 0.45, Law::kNeoHookean);
  const std::vector<int> pressed = block.top.nodes_of_patches(Vec2::Zero(), 0.015);
  const auto lacking = [&](const NearBody& body) {
    return std::ranges::count_if(pressed, [&](int node) { return body.own_node(node) < 0; });
  };
  EXPECT_GT(lacking(*block.near(0.03)), 0);
  EXPECT_EQ(lacking(*block.near(0.03, 60, pressed)), 0);
}

Pieces letters(std::string& to) {
  to += 'a';
  co_await kPieceDone;
  to += 'b';
  co_await kPieceDone;
  to += 'c';
}

Pieces failing() {
  co_await kPieceDone;
  throw std::runtime_error("no");
}

TEST(Pieces, AreDoneOneByOne) {
  std::string done;
  Pieces pieces = letters(done);
  EXPECT_EQ(done, "");
  EXPECT_TRUE(pieces.next());
  EXPECT_EQ(done, "a");
  EXPECT_TRUE(pieces.next());
  EXPECT_FALSE(pieces.next());
  EXPECT_EQ(done, "abc");
  EXPECT_FALSE(pieces.next());
  EXPECT_EQ(done, "abc");
}

TEST(Pieces, OneThatThrowsIsTheLast) {
  Pieces pieces = failing();
  EXPECT_TRUE(pieces.next());
  EXPECT_THROW(pieces.next(), std::runtime_error);
  EXPECT_FALSE(pieces.next());
}

}  // namespace
}  // namespace tendon::softbody::near_body_test
