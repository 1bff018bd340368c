// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/plasticity.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <stdexcept>
#include <utility>

#include "clients/softbody/models/linear.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::plasticity_test {
namespace {

using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

constexpr Law kLaws[] = {Law::kLinear, Law::kCorotational};
constexpr Yield kSoft{.stress = 200, .hardening = 3e3};  // Pa; Young's modulus is 10 kPa

/// 20 × 20 × 40 mm along z, held at the bottom and free to widen. The nodes of its top move together.
struct Bar {
  explicit Bar(Law law, Element element = Element::kHex8Sri)
      : solid(solid_of(law, element)),
        top(solid.mesh(), Vec3::UnitZ(), 0.01),
        model(solid, top, {.max_iterations = 60, .tolerance = 1e-11}, {}, kSoft) {
    for (std::size_t i = 0; i < solid.mesh().nodes.size(); ++i) {
      if (solid.mesh().nodes[i].z() > kLength - 1e-9) patch.nodes.push_back(static_cast<int>(i));
    }
    patch.weights = VectorXd::Constant(4, 0.25);
    patch.slopes = Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, 4);
  }
  static Solid solid_of(Law law, Element element) {
    Mesh mesh = block(Shape::kHex8, Vec3(0.02, 0.02, kLength), {1, 1, 2});
    Fixed fixed(3 * mesh.nodes.size());
    for (std::size_t i = 0; i < mesh.nodes.size(); ++i) {
      fixed[3 * i] = mesh.nodes[i].x() < -0.01 + 1e-9;
      fixed[3 * i + 1] = mesh.nodes[i].y() < -0.01 + 1e-9;
      fixed[3 * i + 2] = mesh.nodes[i].z() < 1e-9;
    }
    return {std::move(mesh), element, {.young = kYoung, .poisson = 0.3}, law, fixed};
  }
  double stress_at(double strain) {  // Pa, tension positive
    return -model.press(patch, Prescribed::kDepth, -strain * kLength).force / kArea;
  }
  double strain_without_force() { return -model.press(patch, Prescribed::kForce, 0).depth / kLength; }

  static constexpr double kYoung = 1e4;
  static constexpr double kLength = 0.04;
  static constexpr double kArea = 4e-4;
  Solid solid;
  TouchSurface top;
  PlasticModel model;
  Patch patch;
};

/// Kinematic hardening in one dimension.
struct PaperBar {
  double plastic = 0;
  double lost = 0;  // J/m³
  double stress_at(double strain) {
    const double trial = Bar::kYoung * (strain - plastic) - kSoft.hardening * plastic;
    const double over = std::abs(trial) - kSoft.stress;
    if (over > 0) {
      const double more = over / (Bar::kYoung + kSoft.hardening);
      plastic += std::copysign(more, trial);
      lost += kSoft.stress * more;
    }
    return Bar::kYoung * (strain - plastic);
  }
  double stored(double strain) const {
    return 0.5 * Bar::kYoung * (strain - plastic) * (strain - plastic) + 0.5 * kSoft.hardening * plastic * plastic;
  }
};

constexpr double kFirst = kSoft.stress / Bar::kYoung;  // yield strain

TEST(Plasticity, ABarFollowsTheBilinearCurveDrawnBackPressedAndDrawnAgain) {
  for (const Law law : kLaws) {
    for (const Element element : {Element::kHex8, Element::kHex8Sri}) {
      Bar bar(law, element);
      PaperBar paper;
      for (const double strain : {0.5, 1.0, 1.5, 3.0, 4.0, 3.0, 2.1, 1.0, -1.0, -3.0, -2.0, 0.0, 2.0, 5.0}) {
        EXPECT_NEAR(bar.stress_at(strain * kFirst), paper.stress_at(strain * kFirst), 1e-7 * kSoft.stress)
            << strain << ' ' << static_cast<int>(law);
      }
      Bar fresh(law, element);
      const double at_2 = fresh.stress_at(2 * kFirst);
      const double at_3 = fresh.stress_at(3 * kFirst);
      const double back = fresh.stress_at(2.5 * kFirst);
      EXPECT_NEAR((at_3 - at_2) / kFirst, 1e4 * 3e3 / 1.3e4, 1e-2);
      EXPECT_NEAR((at_3 - back) / (0.5 * kFirst), 1e4, 1e-1);
    }
  }
}

TEST(Plasticity, UnloadedItKeepsTheStrainLessWhatTheStressGivesBack) {
  for (const Law law : kLaws) {
    Bar bar(law);
    EXPECT_NEAR(bar.strain_without_force(), 0, 1e-12);
    const double stress = bar.stress_at(4 * kFirst);
    EXPECT_NEAR(stress, kSoft.stress + 1e4 * 3e3 / 1.3e4 * 3 * kFirst, 1e-6 * stress);
    const double kept = 4 * kFirst - stress / Bar::kYoung;
    EXPECT_NEAR(bar.strain_without_force() / kept, 1, 1e-7);
    EXPECT_NEAR(bar.strain_without_force() / kept, 1, 1e-7);
    EXPECT_NEAR(bar.model.solid().plastic_strain(0, 0)(2, 2) / kept, 1, 1e-7);
    EXPECT_NEAR(bar.model.solid().plastic_strain(0, 0).trace(), 0, 1e-15);  // plastic flow preserves volume
  }
}

TEST(Plasticity, TheHandsWorkIsWhatIsStoredAndWhatIsLostOnPaper) {
  for (const Law law : kLaws) {
    Bar bar(law);
    PaperBar paper;
    double work = 0;
    double strain = 0;
    double stress = 0;
    constexpr double kVolume = Bar::kArea * Bar::kLength;
    for (const double turn : {4.0, -2.0, 3.0, 0.0}) {
      const double step = (turn * kFirst - strain) / 50;
      for (int i = 0; i < 50; ++i) {
        strain += step;
        const double now = bar.stress_at(strain);
        paper.stress_at(strain);
        work += 0.5 * (stress + now) * step * kVolume;
        stress = now;
      }
      const double stored = bar.model.solid().energy(bar.model.displacements());
      EXPECT_NEAR(stored / (paper.stored(strain) * kVolume), 1, 1e-6);
      EXPECT_NEAR(work / (stored + paper.lost * kVolume), 1, 2e-3);
    }
    EXPECT_GT(paper.lost, 3 * paper.stored(strain));
  }
}

TEST(Plasticity, BelowTheYieldTheAnswersAreThoseOfTheElasticBody) {
  const Yield far{.stress = 1e5, .hardening = 1e3};
  for (const Law law : kLaws) {
    const Solid solid = pressed_block(Element::kHex8Sri, 4, 0.45, law);
    const TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
    const Patch patch = *top.patch(Vec2::Zero());
    QuasiStaticModel elastic(solid, top, {});
    PlasticModel plastic(solid, top, {}, {}, far);
    EXPECT_TRUE(plastic.still());
    for (const double depth : {1e-3, 4e-3, 2e-3, 6e-3, 0.0}) {
      const Reaction a = elastic.press(patch, Prescribed::kDepth, depth);
      const Reaction b = plastic.press(patch, Prescribed::kDepth, depth);
      EXPECT_EQ(a.force, b.force);
      EXPECT_EQ(a.stiffness, b.stiffness);
      EXPECT_EQ(a.depth, b.depth);
      EXPECT_EQ(elastic.displacements(), plastic.displacements());
      if (law == Law::kLinear && depth > 0) {
        EXPECT_NEAR(b.force / LinearModel(solid, top).press(patch, Prescribed::kDepth, depth).force, 1, 1e-10);
      }
    }
    EXPECT_TRUE(plastic.still());
  }
}

struct Crumpled {
  explicit Crumpled(Law law, std::uint64_t seed) : solid(pressed_block(Element::kHex8Sri, 2, 0.4, law), kSoft) {
    Dice dice(seed);
    const auto shape = [&] {
      VectorXd moved(solid.size());
      for (double& each : moved) each = dice.within(-0.002, 0.002);
      return moved;
    };
    for (int i = 0; i < 3; ++i) solid.advance(shape());
    u = shape();
    aside = shape() / 0.002;
  }
  PlasticSolid solid;
  VectorXd u;
  VectorXd aside;
};

TEST(Plasticity, ForcesAreTheSlopeOfAStepsEnergyAndStiffnessThatOfTheForces) {
  constexpr double kStep = 1e-8;
  for (const Law law : kLaws) {
    for (std::uint64_t seed = 1; seed <= 4; ++seed) {
      const Crumpled body(law, seed);
      const VectorXd d = body.solid.to_free(body.aside);
      VectorXd beside = VectorXd::Zero(body.solid.size());
      body.solid.add_free(d, beside);
      const Solid::Forces high = body.solid.forces(body.u + kStep * beside);
      const Solid::Forces low = body.solid.forces(body.u - kStep * beside);
      const Solid::Forces here = body.solid.forces(body.u);
      EXPECT_NEAR((high.energy - low.energy) / (2 * kStep) / here.force.dot(beside), 1, 1e-5);
      const SymmetricMatrix k = body.solid.exact_stiffness(body.u);
      const VectorXd change = body.solid.to_free(high.force - low.force) / (2 * kStep);
      EXPECT_LT((k.times(d) - change).norm(), 2e-5 * change.norm()) << static_cast<int>(law);
      const PlasticSolid fresh(pressed_block(Element::kHex8Sri, 2, 0.4, law), {.stress = 1e9, .hardening = 1});
      EXPECT_GT((fresh.forces(body.u).force - here.force).norm(), 0.1 * here.force.norm());
    }
  }
}

TEST(Plasticity, ADentTurnsWithABodyThatTurns) {
  const Crumpled body(Law::kCorotational, 7);
  const Mat3 turn = Eigen::AngleAxisd(1.1, Vec3(1, 2, -1).normalized()).toRotationMatrix();
  VectorXd turned(body.u.size());
  for (int i = 0; i < turned.size(); i += 3) {
    const Vec3 node = body.solid.mesh().nodes[at(i / 3)];
    turned.segment<3>(i) = turn * (node + body.u.segment<3>(i)) - node;
  }
  const Solid::Forces upright = body.solid.forces(body.u);
  const Solid::Forces lying = body.solid.forces(turned);
  EXPECT_NEAR(lying.energy / upright.energy, 1, 1e-10);
  for (int i = 0; i < turned.size(); i += 3) {
    EXPECT_LT((lying.force.segment<3>(i) - turn * upright.force.segment<3>(i)).norm(), 1e-9 * upright.force.norm());
  }
}

/// B1, by default yielding under a press of a few mm.
BodyConfig soft_body(ModelKind model, const Yield& yield = {.stress = 300, .hardening = 2e3}) {
  BodyConfig config = pressed_body(model, Element::kHex8Sri, 4);
  set_plasticity(config.model, yield);
  return config;
}

TEST(Plasticity, ADentedBodyIsMetLowerAndKeepsItsDentUntouched) {
  for (const ModelKind model : {ModelKind::kLinear, ModelKind::kCorotational}) {
    Body body(soft_body(model));
    Body elastic(pressed_body(model, Element::kHex8Sri, 4));
    const double pressed = body.touch(Vec3(0, 0, 0.042)).force.z();
    EXPECT_LT(pressed, 0.8 * elastic.touch(Vec3(0, 0, 0.042)).force.z());
    const Feel above = body.touch(Vec3(0, 0, 0.0501));
    EXPECT_FALSE(above.touching);
    const double dent = above.gap - 1e-4;
    EXPECT_GT(dent, 1e-3);
    EXPECT_LT(dent, 8e-3);
    EXPECT_FALSE(body.touch(Vec3(0, 0, 0.05 - 0.95 * dent)).touching);
    EXPECT_TRUE(body.touch(Vec3(0, 0, 0.05 - 1.05 * dent)).touching);
    // Elastic up to the deepest press, where the force is the same as before.
    EXPECT_NEAR(body.touch(Vec3(0, 0, 0.042)).force.z() / pressed, 1, 0.02);
    EXPECT_GT(body.size().bytes, elastic.size().bytes);
  }
}

TEST(Plasticity, OnEveryClosedWayTheHandGivesMoreThanItGets) {
  Dice dice(5);
  for (const ModelKind model : {ModelKind::kLinear, ModelKind::kCorotational}) {
    Body body(soft_body(model));
    double depth = 0;
    double force = 0;
    double given = 0;  // total work of the hand, J
    double largest = 0;
    for (int way = 0; way < 8; ++way) {
      const double before = given;
      for (const double turn : {dice.within(0.003, 0.008), dice.within(0, 0.004), dice.within(0.003, 0.008), 0.0}) {
        const double from = depth;
        for (int i = 1; i <= 10; ++i) {
          const double next = from + (turn - from) * i / 10;
          const Reaction reaction = body.press(Prescribed::kLeastDepth, next);
          EXPECT_LE(reaction.error, 1e-4 * reaction.force + 1e-7);
          given += 0.5 * (force + reaction.force) * (next - depth);
          force = reaction.force;
          depth = next;
        }
      }
      EXPECT_GE(given - before, -1e-3 * largest) << way;
      largest = std::max(largest, given - before);
    }
    EXPECT_GT(given, 2e-4);
  }
}

TEST(Plasticity, UnderItsOwnWeightABodyYieldsBeforeItIsTouched) {
  BodyConfig config = soft_body(ModelKind::kCorotational, Yield{.stress = 20, .hardening = 2e3});
  config.effects.density = 1000;
  config.effects.gravity = Vec3(0, 0, -9.81);
  Body body(config);
  set_plasticity(config.model, {});
  EXPECT_GT(body.press(Prescribed::kForce, 0).depth, 1.1 * Body(config).press(Prescribed::kForce, 0).depth);
}

TEST(Plasticity, NonsenseIsRefusedByName) {
  const auto refusal = [](const BodyConfig& config) { return thrown_by([&] { Body{config}; }); };
  BodyConfig config = soft_body(ModelKind::kLinear);
  EXPECT_EQ(refusal(config), "");
  EXPECT_EQ(refusal(soft_body(ModelKind::kLinear, Yield{.stress = -1, .hardening = 1})),
            "plasticity.yield = -1: expected a finite number above 0");
  EXPECT_EQ(refusal(soft_body(ModelKind::kLinear, Yield{.stress = 1, .hardening = std::nan("")})),
            "plasticity.hardening = nan: expected a finite number above 0");
  config.stiffening = StiffnessOverTime{.at = {0}, .factor = {2}};
  EXPECT_EQ(refusal(config), "plasticity cannot be simulated together with stiffening");
  const Solid solid = pressed_block(Element::kHex8Sri, 2, 0.45, Law::kNeoHookean);
  EXPECT_THROW(PlasticSolid(solid, kSoft), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::plasticity_test
