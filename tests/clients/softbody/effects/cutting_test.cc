// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/cutting.h"

#include <gtest/gtest.h>

#include <cmath>
#include <future>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/quasi_static.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::cutting_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

/// A cut through the whole width of the block at x, from the top down.
Cut across(double x, double depth) {
  return {Vec3(x, -0.06, 0.05 - depth), Vec3(0, 0.12, 0), Vec3(0, 0, depth + 0.01)};
}

/// A cut in the center of the top, half as wide as the block.
Cut narrow(double depth) { return {Vec3(0, -0.025, 0.05 - depth), Vec3(0, 0.05, 0), Vec3(0, 0, depth)}; }

/// Horizontal, through the whole block at height z.
Cut below(double z) { return {Vec3(-0.06, -0.06, z), Vec3(0.12, 0, 0), Vec3(0, 0.12, 0)}; }

Solid after(const Solid& solid, const Division& division) {
  return {division.mesh, solid.element(), solid.material(), solid.law(), division.fixed};
}

/// Cut while it is pressed at `where`, by default at the center of its top.
template <class PressedModel, class... Options>
struct Cuttable {
  Cuttable(Element element, int n, Law law, const Options&... options, const Vec2& where = Vec2::Zero())
      : solid(pressed_block(element, n, 0.45, law)),
        top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        model(solid, top, options...),
        middle(where),
        patch(*top.patch(middle)) {}
  void cut(const Cut& next, const EffectsConfig& effects = {}) {
    made.push_back(next);
    const Division division = divide(solid.mesh(), solid.fixed(), made);
    solid = after(solid, division);
    top = TouchSurface(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    patch = *top.patch(middle);
    model.cut(division, effects);
  }
  Reaction press(double depth) { return model.press(patch, Prescribed::kDepth, depth); }

  Solid solid;
  TouchSurface top;
  PressedModel model;
  Vec2 middle;
  Patch patch;
  std::vector<Cut> made;
};
using CutLinear = Cuttable<LinearModel>;
using CutNewton = Cuttable<QuasiStaticModel, QuasiStaticModel::Config>;

template <class PressedModel, class... Options>
Reaction cut_from_the_start(Element element, int n, Law law, const std::vector<Cut>& cuts, double depth,
                            const Options&... options) {
  const Solid whole = pressed_block(element, n, 0.45, law);
  const Solid solid = after(whole, divide(whole.mesh(), whole.fixed(), cuts));
  const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  return PressedModel(solid, top, options...).press(*top.patch(Vec2::Zero()), Prescribed::kDepth, depth);
}

TEST(Divide, OpensTheFacesBetweenAndPartsTheNodesOnThemButThoseAtTheTip) {
  for (const Shape shape : {Shape::kHex8, Shape::kHex20, Shape::kHex27, Shape::kTet4}) {
    const Mesh mesh = block(shape, Vec3(0.1, 0.1, 0.05), {4, 4, 2});
    const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
    const std::vector<Cut> half{across(0, 0.025)};
    const Division division = divide(mesh, fixed, half);
    std::size_t parted = 0;
    for (const Vec3& node : mesh.nodes) parted += std::abs(node.x()) < 1e-9 && node.z() > 0.025 + 1e-9 ? 1 : 0;
    ASSERT_GT(parted, 0U);
    EXPECT_EQ(division.mesh.nodes.size(), mesh.nodes.size() + parted);
    EXPECT_EQ(division.lost, 0);
    EXPECT_EQ(division.opened, shape == Shape::kTet4 ? 8 : 4);
    for (std::size_t i = 0; i < division.mesh.nodes.size(); ++i) {
      EXPECT_EQ(division.mesh.nodes[i], mesh.nodes[at(division.node_before[i])]);
      EXPECT_EQ(division.fixed[3 * i], fixed[3 * at(division.node_before[i])]);
    }
    EXPECT_NEAR(check(division.mesh, "cut"), 5e-4, 1e-15);
    EXPECT_EQ(surface(division.mesh).size(), surface(mesh).size());  // the faces of a closed cut cannot be touched
  }
}

TEST(Divide, CutsOneAfterTheOtherPartWhatAllAtOncePart) {
  // The first cut opens two faces inside the body, whose nodes are all at the cut's tip and therefore not split.
  const Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.05), {4, 4, 4});
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  const Cut little{Vec3(0, -0.02, 0.014), Vec3(0, 0.04, 0), Vec3(0, 0, 0.01)};
  const std::vector<Cut> all{little, across(0, 0.025)};
  const Division first = divide(mesh, fixed, std::span(all).first(1));
  EXPECT_EQ(first.opened, 2);
  EXPECT_EQ(first.mesh.nodes.size(), mesh.nodes.size());
  const Division then = divide(first.mesh, first.fixed, all);
  const Division at_once = divide(mesh, fixed, all);
  EXPECT_EQ(then.opened, 10);
  EXPECT_EQ(then.mesh.nodes.size(), at_once.mesh.nodes.size());
  EXPECT_EQ(then.mesh.elements, at_once.mesh.elements);
  EXPECT_GT(then.mesh.nodes.size(), divide(mesh, fixed, std::span(all).last(1)).mesh.nodes.size());
}

TEST(Divide, APieceThatNothingHoldsIsGone) {
  const Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.05), {4, 4, 2});
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  const std::vector<Cut> under{below(0.025)};
  const Division division = divide(mesh, fixed, under);
  EXPECT_EQ(division.lost, 16);
  EXPECT_NEAR(check(division.mesh, "cut"), 2.5e-4, 1e-15);
  const TouchSurface top(division.mesh, Vec3::UnitZ(), 0.02);
  EXPECT_EQ(top.nodes().size(), 25U);
  for (const int node : top.nodes()) EXPECT_NEAR(top.height(node), 0.025, 1e-12);
  // Held by the two nodes of one edge, it could still rotate.
  Fixed hinge = fix_where(mesh, [](const Vec3& node) { return node.z() > 0.05 - 1e-9 && node.x() < -0.05 + 1e-9; });
  for (std::size_t i = 0; i < fixed.size(); ++i) hinge[i] = hinge[i] || fixed[i];
  EXPECT_EQ(divide(mesh, hinge, under).lost, 16);
}

TEST(CutUnderLoad, AHalfThatIsCutOffGivesWayAsOneThatWasAlwaysAlone) {
  // The expected answer is that of a smaller block, without any cutting code.
  const Vec2 where(-0.025, 0);
  for (const Element element : {Element::kHex8Sri, Element::kHex27}) {
    CutLinear body(element, 4, Law::kLinear, where);
    const double whole = body.press(1e-3).force;
    body.cut(across(0, 0.06));
    const std::vector<double> xs{-0.05, -0.025, 0};
    const std::vector<double> ys{-0.05, -0.025, 0, 0.025, 0.05};
    const std::vector<double> zs{0, 0.025, 0.05};
    Mesh half = block(info(element).shape, xs, ys, zs);
    const Fixed fixed = fix_where(half, [](const Vec3& node) { return node.z() < 1e-9; });
    const Solid alone(std::move(half), element, body.solid.material(), Law::kLinear, fixed);
    const TouchSurface top(alone.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    const double expected = LinearModel(alone, top).press(*top.patch(where), Prescribed::kDepth, 1e-3).force;
    EXPECT_NEAR(body.press(1e-3).force / expected, 1, 1e-9);
    EXPECT_LT(expected, 0.99 * whole);
  }
}

TEST(CutUnderLoad, WhatIsLeftBelowALostPieceGivesWayAsOneThatWasAlwaysAlone) {
  CutLinear body(Element::kHex8Sri, 4, Law::kLinear);
  body.press(1e-3);
  body.cut(below(0.025));
  Mesh low = block(Shape::kHex8, Vec3(0.1, 0.1, 0.025), {4, 4, 1});
  const Fixed fixed = fix_where(low, [](const Vec3& node) { return node.z() < 1e-9; });
  const Solid alone(std::move(low), Element::kHex8Sri, body.solid.material(), Law::kLinear, fixed);
  const TouchSurface top(alone.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  const double expected = LinearModel(alone, top).press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 1e-3).force;
  EXPECT_NEAR(body.press(1e-3).force / expected, 1, 1e-9);
  CutNewton large(Element::kHex8Sri, 4, Law::kNeoHookean, {});
  large.press(3e-3);
  large.cut(below(0.025));
  EXPECT_NEAR(large.press(1e-6).force / expected * 1e3, 1, 1e-3);
}

TEST(CutUnderLoad, ACutLinearBodyAnswersAsOneBuiltWithItsCuts) {
  // Small cuts in the finer mesh update the factorization; the others need a new one.
  for (const auto& [element, n] : {std::pair(Element::kTet4, 4), std::pair(Element::kHex8Sri, 8),
                                   std::pair(Element::kHex8Sri, 4), std::pair(Element::kHex27, 4)}) {
    CutLinear body(element, n, Law::kLinear);
    double before = body.press(2e-3).stiffness;
    const Cut first = n == 8 ? narrow(0.0125) : across(0, 0.025);
    const Cut second = n == 8 ? narrow(0.025) : across(0.025, 0.025);
    for (const Cut& next : {first, second, across(0, 0.05), across(-0.025, 0.025)}) {
      body.cut(next);
      const Reaction found = body.press(2e-3);
      const Reaction expected = cut_from_the_start<LinearModel>(element, n, Law::kLinear, body.made, 2e-3);
      EXPECT_NEAR(found.force / expected.force, 1, 1e-9);
      EXPECT_NEAR(found.stiffness / expected.stiffness, 1, 1e-9);
      EXPECT_LT((found.slope - expected.slope).norm(), 1e-9);
      EXPECT_LT(found.stiffness, before * (1 - 1e-6));
      before = found.stiffness;
      // The supports carry the tool's load, and no other force acts.
      VectorXd u = VectorXd::Zero(body.solid.size());
      body.solid.add_free(found.force * body.model.displacements(body.patch), u);
      const VectorXd forces = body.solid.forces(u).force;
      const VectorXd load = found.force * patch_load(body.solid, Vec3::UnitZ(), body.patch);
      EXPECT_LT((body.solid.to_free(forces) - body.solid.to_free(load)).norm(), 1e-9 * found.force);
      const Vec3 sum = forces.reshaped(3, forces.size() / 3).rowwise().sum();
      EXPECT_LT(sum.norm(), 1e-9 * found.force);
    }
  }
}

TEST(CutUnderLoad, TheCutItselfPutsInNoEnergyAndTheBodyThenGivesWay) {
  for (const Element element : {Element::kTet4, Element::kHex8Sri}) {
    for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
      CutNewton body(element, 4, law, {});
      Reaction before = body.press(4e-3);
      double energy = body.solid.energy(body.model.displacements());
      for (const Cut& next : {across(0, 0.025), across(0.025, 0.05), across(0, 0.05)}) {
        body.cut(next);
        EXPECT_NEAR(body.solid.energy(body.model.displacements()) / energy, 1, 1e-12);
        const Reaction found = body.press(4e-3);
        EXPECT_LT(found.force, before.force);
        EXPECT_GT(found.force, 0.1 * before.force);
        EXPECT_LT(found.stiffness, before.stiffness);
        EXPECT_LE(found.error, 1e-5 * found.force);
        EXPECT_LE(body.solid.energy(body.model.displacements()), energy);
        energy = body.solid.energy(body.model.displacements());
        before = found;
        const Reaction expected =
            cut_from_the_start<QuasiStaticModel>(element, 4, law, body.made, 4e-3, QuasiStaticModel::Config{});
        EXPECT_NEAR(found.force / expected.force, 1, 1e-5);
        const VectorXd forces = body.solid.forces(body.model.displacements()).force;
        const Vec3 sum = forces.reshaped(3, forces.size() / 3).rowwise().sum();
        EXPECT_LT(sum.norm(), 1e-9 * found.force);
      }
    }
  }
}

TEST(CutUnderLoad, ABodyThatSagsSagsMoreWhenItIsCut) {
  const EffectsConfig weight{.density = 1000, .gravity = Vec3(3, 0, -9.81)};
  for (const ModelKind model : {ModelKind::kLinear, ModelKind::kNeoHookean}) {
    BodyConfig config = pressed_body(model, Element::kHex8Sri, 4);
    config.effects = weight;
    config.cuts = {{across(0.025, 0.05), PlannedCut::When::kTime, 1}};
    Body body(config);
    Body cut(config);
    cut.tick(2);
    body.press(Prescribed::kForce, 0.1);
    body.tick(1);
    const double depth = body.press(Prescribed::kForce, 0.1).depth;
    EXPECT_NEAR(depth / cut.press(Prescribed::kForce, 0.1).depth, 1, 1e-6);
    config.cuts.clear();
    EXPECT_GT(depth, 1.001 * Body(config).press(Prescribed::kForce, 0.1).depth);
  }
}

TEST(Factor, OfTwoThreadsAtOnceIsRightWhereThatIsSaid) {
  if (!factors_may_work_at_once()) GTEST_SKIP() << "this OpenBLAS only supports one thread";
  const auto off_at_most = [](int cells) {
    const Solid solid = pressed_block(Element::kHex8Sri, cells, 0.45);
    const SymmetricMatrix matrix = solid.exact_stiffness(VectorXd::Zero(solid.size()));
    const MatrixXd load = MatrixXd::Ones(matrix.size, 4);
    double off = 0;
    for (int i = 0; i < 20; ++i) {
      Factor factor(matrix);
      if (!factor.factorize(matrix)) return 1.0;
      const MatrixXd solution = factor.solve(load);
      for (Eigen::Index j = 0; j < load.cols(); ++j) {
        off = std::max(off, (matrix.times(solution.col(j)) - load.col(j)).lpNorm<Eigen::Infinity>());
      }
    }
    return off;
  };
  auto other = std::async(std::launch::async, off_at_most, 10);
  EXPECT_LT(off_at_most(12), 1e-6);
  EXPECT_LT(other.get(), 1e-6);
}

TEST(Factor, SplitsAreSolvedAsByANewFactorOrRefused) {
  const Solid whole = pressed_block(Element::kHex8Sri, 8, 0.45);
  const auto stiffness = [](const Solid& solid) { return solid.exact_stiffness(VectorXd::Zero(solid.size())); };
  const SymmetricMatrix before = stiffness(whole);
  Factor kept = factor_of(before);
  std::vector<Cut> cuts{narrow(0.012)};
  const Division first = divide(whole.mesh(), whole.fixed(), cuts);
  const Solid once = after(whole, first);
  ASSERT_TRUE(kept.split(stiffness(once), twins(once, first)));
  cuts.push_back(narrow(0.025));
  const Division second = divide(once.mesh(), once.fixed(), cuts);
  const Solid twice = after(once, second);
  SymmetricMatrix matrix = stiffness(twice);
  ASSERT_TRUE(kept.split(matrix, twins(twice, second)));
  const Factor fresh = factor_of(matrix);
  MatrixXd right(twice.free_count(), 2);
  for (Eigen::Index i = 0; i < right.size(); ++i) right(i) = std::sin(1.0 + 7.0 * static_cast<double>(i));
  const MatrixXd expected = fresh.solve(right);
  EXPECT_LT((kept.solve(right) - expected).norm(), 1e-10 * expected.norm());

  SymmetricMatrix loose = before;
  loose.rows.push_back(loose.size);
  loose.values.push_back(0);
  loose.column_starts.push_back(static_cast<int>(loose.rows.size()));
  ++loose.size;
  Factor again = factor_of(before);
  EXPECT_FALSE(again.split(loose, {0}));
  EXPECT_FALSE(again.split(matrix, std::vector<int>(static_cast<std::size_t>(matrix.size), 0)));
  const MatrixXd back = again.solve(right.topRows(before.size));
  EXPECT_LT((before.times(back.col(0)) - right.col(0).head(before.size)).norm(), 1e-9);

  // The ordering of the grown pattern is reused and the splits are included.
  for (double& value : matrix.values) value *= 2;
  ASSERT_TRUE(kept.factorize(matrix));
  EXPECT_LT((kept.solve(right) - expected / 2).norm(), 1e-10 * expected.norm());
}

TEST(Cutting, IsMadeInItsOrderAtItsTimeOrForceAndSaidOnce) {
  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  config.cuts = {{across(0, 0.025), PlannedCut::When::kTime, 1},
                 {across(0, 0.05), PlannedCut::When::kForce, 0.5},
                 {across(0.025, 0.05), PlannedCut::When::kTime, 0.5}};
  Body body(config);
  EXPECT_TRUE(body.has_clock());
  const auto stiffness = [&](double depth) {
    const Feel feel = body.touch(Vec3(0, 0, 0.05 - depth));
    return std::pair(feel.force.z() / depth, feel.topology_changed);
  };
  const auto [whole, nothing_yet] = stiffness(2e-3);  // the force exceeds 0.5 N, but the previous cut has not been made
  EXPECT_FALSE(nothing_yet);
  body.tick(0.9);
  EXPECT_EQ(stiffness(2e-3).first, whole);
  body.tick(1);
  const auto [once, said_once] = stiffness(1e-4);
  EXPECT_LT(once, 0.999 * whole);
  EXPECT_TRUE(said_once);
  EXPECT_EQ(stiffness(1e-4), std::pair(once, false));
  body.tick(0);
  const auto [pressed, not_yet] = stiffness(2e-3);
  EXPECT_NEAR(pressed / once, 1, 1e-9);
  EXPECT_FALSE(not_yet);
  const auto [twice, said_twice] = stiffness(2e-3);
  EXPECT_LT(twice, 0.999 * once);
  EXPECT_TRUE(said_twice);
  body.tick(1);
  EXPECT_LT(stiffness(2e-3).first, 0.999 * twice);
  EXPECT_GT(Body(config).size().bytes, Body(pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4)).size().bytes);
}

TEST(PreparedCut, AnswersGoOnUncutAndFlaggedAndThenAreThoseOfTheCutBody) {
  for (const ModelInfo& model : models()) {
    // near_cut_test.cc tests the near model, whose answers differ until a near field of the cut body exists.
    if (!model.may.has(EffectKind::kCutting) || model.kind == ModelKind::kNear) continue;
    BodyConfig config = pressed_body(model.kind, Element::kHex8Sri, 4);
    if (Newton* newton = newton_of(config.model)) *newton = {.max_iterations = 100, .tolerance = 1e-9};
    config.friction = 0.3;
    Body whole(config);
    config.stiffening = StiffnessOverTime{.at = {0, 1}, .factor = {1, 1}};
    config.cuts = {{across(0.025, 0.025), PlannedCut::When::kTime, 1}, {narrow(0.0125), PlannedCut::When::kTime, 1}};
    Body at_once(config);
    Body body(config);
    testing::Elsewhere later;
    body.prepare_by(later.background());
    Vec3 tool(0, 0, 0.048);
    for (Body* each : {&whole, &at_once, &body}) each->touch(tool);
    body.tick(1);
    at_once.tick(1);
    ASSERT_EQ(later.given.size(), 1U) << model.name;
    for (int i = 0; i < 3; ++i) {
      tool.x() += 1e-4;
      body.tick(1);
      const Feel feel = body.touch(tool);
      at_once.touch(tool);
      EXPECT_EQ(feel.force, whole.touch(tool).force) << model.name;
      EXPECT_GE(feel.error, feel.force.norm());
      EXPECT_FALSE(feel.topology_changed);
    }
    ASSERT_EQ(later.given.size(), 1U) << "the second cut waits for the first";
    later.given[0]();
    body.tick(1);
    const Feel first = body.touch(tool);
    EXPECT_TRUE(first.topology_changed);
    EXPECT_LT(first.force.z(), 0.999 * whole.touch(tool).force.z()) << model.name;
    body.tick(1);
    ASSERT_EQ(later.given.size(), 2U);
    later.given[1]();
    const Feel both = body.touch(tool);
    const Feel expected = at_once.touch(tool);
    EXPECT_TRUE(both.topology_changed);
    EXPECT_LT(both.force.z(), first.force.z());
    // The friction spring keeps its state, so the drag agrees as well.
    EXPECT_LT((both.force - expected.force).norm(), 1e-5 * expected.force.norm()) << model.name;
    EXPECT_LT(both.error, 1e-3 * both.force.norm());
    EXPECT_FALSE(body.touch(tool).topology_changed);
  }
}

TEST(PreparedCut, PutsInNoEnergy) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    const Solid whole = pressed_block(Element::kHex8Sri, 4, 0.45, law);
    const TouchSurface top(whole.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    QuasiStaticModel before(whole, top, {});
    const double force = before.press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 4e-3).force;
    const std::vector<Cut> cut{across(0, 0.025)};
    const Division division = divide(whole.mesh(), whole.fixed(), cut);
    const Solid parted = after(whole, division);
    const TouchSurface there(parted.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    QuasiStaticModel model(parted, there, {});
    const int factors = model.factors();
    model.go_on_from(before, division.node_before);
    EXPECT_NEAR(parted.energy(model.displacements()) / whole.energy(before.displacements()), 1, 1e-12);
    EXPECT_LT(model.press(*there.patch(Vec2::Zero()), Prescribed::kDepth, 4e-3).force, 0.99 * force);
    EXPECT_EQ(model.factors(), factors);  // the factorization of the cut body at rest is used
    EXPECT_LT(parted.energy(model.displacements()), whole.energy(before.displacements()));
  }
}

TEST(PreparedCut, MayBeDoneWhenTheBodyIsGone) {
  BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  config.cuts = {{across(0, 0.025), PlannedCut::When::kForce, 0.1}};
  std::vector<std::packaged_task<void()>> left;
  {
    Body body(config);
    body.prepare_by([&](std::packaged_task<void()> work) { left.push_back(std::move(work)); });
    body.touch(Vec3(0, 0, 0.048));
  }
  ASSERT_EQ(left.size(), 1U);
  left[0]();
}

TEST(Cutting, APlanThatGoesWrongIsRefusedBeforeAnythingIsTouched) {
  const auto refusal = [](const Cut& cut, double value = 1) {
    BodyConfig config = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
    config.cuts = {{across(0.025, 0.02), PlannedCut::When::kTime, 0}, {cut, PlannedCut::When::kForce, value}};
    return thrown_by([&] { Body body(config); });
  };
  EXPECT_EQ(refusal(across(0, 0.02)), "");
  EXPECT_EQ(refusal(across(0, 0.02), 0), "cutting: cut 2: expected a force above 0");
  EXPECT_EQ(refusal({Vec3::Zero(), Vec3::UnitX(), Vec3::UnitX()}), "cutting: cut 2 has no area");
  EXPECT_EQ(refusal({Vec3(1, 0, 0), Vec3::UnitX(), Vec3::UnitY()}),
            "cutting: cut 2 does not separate any elements of the body");
  EXPECT_EQ(refusal({Vec3(-0.06, -0.06, 0.001), Vec3(0.12, 0, 0), Vec3(0, 0.12, 0)}),
            "cutting: cut 2 does not separate any elements of the body");
  BodyConfig swinging = pressed_body(ModelKind::kLinear, Element::kHex8Sri, 4);
  swinging.cuts = {{across(0, 0.02), PlannedCut::When::kTime, 0}};
  swinging.effects = {.density = 1000, .step = 1e-3, .inertia = true};
  EXPECT_THROW(Body{swinging}, std::invalid_argument);
  swinging.effects = {};
  swinging.model = CondensedConfig{};
  EXPECT_THROW(Body{swinging}, std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::cutting_test
