// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/effects/self_collision.h"

#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <stdexcept>
#include <utility>
#include <vector>

#include "clients/softbody/effects/cutting.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::softbody::self_collision_test {
namespace {

using testing::pressed_body;

constexpr double kYoung = 1e4;       // Pa
constexpr double kBed = 1e4 / 1e-4;  // Pa/m: 0.1 mm at a pressure of Young's modulus
constexpr Law kLaws[] = {Law::kCorotational, Law::kStVenantKirchhoff, Law::kNeoHookean};

/// C-shaped, 40 × 20 × 41 mm, with a slot 1 mm high, open to +x. The lower jaw is fixed.
struct Jaws {
  static constexpr double kFloor = 0.020;  // m, of the slot
  static constexpr double kRoof = 0.021;

  explicit Jaws(Law law, std::optional<double> bed = kBed, Element element = Element::kHex8Sri,
                const EffectsConfig& effects = {})
      : solid(solid_of(law, element)),
        top(solid.mesh(), Vec3::UnitZ(), 0.008),
        model(solid, top, {.max_iterations = 60, .self_collision = bed}, effects),
        patch(*top.patch(Vec2(0.01, 0))) {}
  static Solid solid_of(Law law, Element element) {
    constexpr double kXs[] = {-0.02, -0.015, -0.01, -0.005, 0, 0.005, 0.01, 0.015, 0.02};
    constexpr double kYs[] = {-0.01, 0, 0.01};
    constexpr double kZs[] = {0, 0.005, 0.01, 0.015, kFloor, kRoof, 0.026, 0.031, 0.036, 0.041};
    Mesh mesh = block(info(element).shape, kXs, kYs, kZs);
    const Mesh full = mesh;
    mesh.elements.clear();
    std::vector<bool> used(mesh.nodes.size());
    for (int e = 0; e < full.element_count(); ++e) {
      const auto nodes = full.element(e);
      Vec3 middle = Vec3::Zero();
      for (const int node : nodes) middle += full.nodes[at(node)] / static_cast<double>(nodes.size());
      if (middle.x() > 0 && middle.z() > kFloor && middle.z() < kRoof) continue;
      mesh.elements.insert(mesh.elements.end(), nodes.begin(), nodes.end());
      for (const int node : nodes) used[at(node)] = true;
    }
    Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
    for (std::size_t i = 0; i < fixed.size(); ++i) fixed[i] = fixed[i] || !used[i / 3];
    return {std::move(mesh), element, {.young = kYoung, .poisson = 0.3}, law, fixed};
  }
  Reaction press(double depth) { return model.press(patch, Prescribed::kDepth, depth); }

  /// Largest penetration of the slot's roof below its floor, the line through its nodes with the same y at rest, m.
  double overlap() const {
    double deepest = -std::numeric_limits<double>::infinity();
    const auto now = [&](int node) {
      return Vec3(solid.mesh().nodes[at(node)] + model.displacements().segment<3>(3 * node));
    };
    const auto of_slot = [&](double z, double y) {
      std::vector<Vec3> row;
      for (int i = 0; i < static_cast<int>(solid.mesh().nodes.size()); ++i) {
        const Vec3& node = solid.mesh().nodes[at(i)];
        if (node.x() > 1e-9 && std::abs(node.z() - z) < 1e-9 && std::abs(node.y() - y) < 1e-9) {
          row.push_back(now(i));
        }
      }
      std::ranges::sort(row, {}, [](const Vec3& node) { return node.x(); });
      return row;
    };
    for (const double y : {-0.01, 0.0, 0.01}) {
      const std::vector<Vec3> floor = of_slot(kFloor, y);
      for (const Vec3& roof : of_slot(kRoof, y)) {
        for (std::size_t i = 1; i < floor.size(); ++i) {
          const double share = (roof.x() - floor[i - 1].x()) / (floor[i].x() - floor[i - 1].x());
          if (share < 0 || share > 1) continue;
          deepest = std::max(deepest, (1 - share) * floor[i - 1].z() + share * floor[i].z() - roof.z());
        }
      }
    }
    return deepest;
  }

  Solid solid;
  TouchSurface top;
  QuasiStaticModel model;
  Patch patch;
};

TEST(SelfCollision, AJawGoesThroughTheOtherWithoutItAndIsHeldByItsBedWithIt) {
  for (const Law law : kLaws) {
    Jaws through(law, std::nullopt);
    Jaws held(law);
    Reaction without;
    Reaction with;
    for (const double depth : {0.0005, 0.001, 0.0015, 0.002}) {
      without = through.press(depth);
      with = held.press(depth);
      EXPECT_LE(with.error, 2e-3 * with.force) << depth;
    }
    EXPECT_GT(through.overlap(), 1e-3);
    // The pressure is of the order of the force over the patch area, about 1 kPa, which compresses the bed by 10 µm.
    EXPECT_LT(held.overlap(), 1e-4);
    EXPECT_GT(held.overlap(), 0);
    EXPECT_LT(held.model.self_collision()->overlap(held.model.displacements()), 1e-4);
    EXPECT_GT(with.force, 1.2 * without.force) << static_cast<int>(law);
  }
}

TEST(SelfCollision, WhereNothingTouchesEveryAnswerIsTheSameToTheLastBit) {
  for (const Law law : kLaws) {
    Jaws alone(law, std::nullopt);
    Jaws watched(law);
    for (const double depth : {0.0001, 0.0003, 0.0002, 0.0}) {
      const Reaction a = alone.press(depth);
      const Reaction b = watched.press(depth);
      testing::expect_same_bits(b, a, 0);
      EXPECT_EQ(alone.model.displacements(), watched.model.displacements());
      EXPECT_EQ(alone.model.iterations(), watched.model.iterations());
    }
    EXPECT_GT(watched.model.bytes(), alone.model.bytes());
  }
}

VectorXd bitten(const Solid& solid, std::uint64_t seed) {
  Dice dice(seed);
  VectorXd u = VectorXd::Zero(solid.size());
  for (int i = 0; i < u.size(); i += 3) {
    const Vec3& node = solid.mesh().nodes[at(i / 3)];
    if (node.z() < 1e-9) continue;
    u.segment<3>(i) = dice.within(0, 1e-4) * dice.direction();
    if (node.x() > 1e-9 && node.z() > Jaws::kRoof - 1e-9) u[i + 2] -= 0.0015;
  }
  return u;
}

TEST(SelfCollision, TheForcesOfTheTwoSidesAreEqualAndOppositeAndHaveNoMoment) {
  for (const Element element : {Element::kHex8Sri, Element::kTet4, Element::kHex20}) {
    const Solid solid = Jaws::solid_of(Law::kCorotational, element);
    const VectorXd u = bitten(solid, 3);
    const SelfCollision bed(solid, kBed, u);
    Elastic::Forces felt{0, VectorXd::Zero(solid.free_count())};
    bed.add_forces(u, felt);
    VectorXd all = VectorXd::Zero(solid.size());  // no held node is near the slot
    solid.add_free(felt.force, all);
    Vec3 force = Vec3::Zero();
    Vec3 moment = Vec3::Zero();
    double size = 0;
    for (int i = 0; i < all.size(); i += 3) {
      const Vec3 place = solid.mesh().nodes[at(i / 3)] + u.segment<3>(i);
      force += all.segment<3>(i);
      moment += place.cross(all.segment<3>(i));
      size += all.segment<3>(i).norm();
    }
    EXPECT_GT(size, 0.1);
    EXPECT_LT(force.norm(), 1e-12 * size);
    EXPECT_LT(moment.norm(), 1e-12 * size);
  }
}

TEST(SelfCollision, ForcesAreTheSlopeOfTheEnergyEvenAfterANewLookUp) {
  constexpr double kStep = 1e-9;
  for (std::uint64_t seed = 1; seed <= 5; ++seed) {
    const Solid solid = Jaws::solid_of(Law::kCorotational, Element::kHex8Sri);
    const VectorXd u = bitten(solid, seed);
    SelfCollision bed(solid, kBed, u);
    Dice dice(seed + 100);
    VectorXd aside = VectorXd::Zero(solid.size());
    for (double& each : aside) each = dice.within(-1, 1);
    const auto felt = [&](const VectorXd& there) {
      bed.look(there);
      Elastic::Forces sum{0, VectorXd::Zero(solid.free_count())};
      bed.add_forces(there, sum);
      return sum;
    };
    const double slope = (felt(u + kStep * aside).energy - felt(u - kStep * aside).energy) / (2 * kStep);
    EXPECT_NEAR(slope / felt(u).force.dot(solid.to_free(aside)), 1, 1e-4) << seed;
  }
}

TEST(SelfCollision, ASystemIsSolvedWithTheBedAsIfItWereInTheMatrix) {
  const Solid solid = Jaws::solid_of(Law::kCorotational, Element::kHex8Sri);
  const VectorXd u = bitten(solid, 8);
  const SelfCollision bed(solid, kBed, u);
  const SymmetricMatrix k = solid.exact_stiffness(VectorXd::Zero(solid.size()));
  const Factor factor = factor_of(k);
  const VectorXd b = VectorXd::LinSpaced(solid.free_count(), -1e-3, 2e-3);
  const VectorXd x = bed.solve(factor, b);
  // The contribution of the bed to K x, from its forces near u. They are linear while the same nodes penetrate.
  const auto forces = [&](const VectorXd& there) {
    Elastic::Forces sum{0, VectorXd::Zero(solid.free_count())};
    bed.add_forces(there, sum);
    return sum.force;
  };
  const double little = 1e-7 / x.norm();
  VectorXd there = u;
  solid.add_free(little * x, there);
  const VectorXd product = k.times(x) + (forces(there) - forces(u)) / little;
  EXPECT_LT((product - b).norm(), 1e-5 * b.norm());
  EXPECT_GT((k.times(x) - b).norm(), 0.1 * b.norm());
}

/// 20 × 20 × 40 mm, ν = 0, a uniform load on its top, a slit across its middle.
struct SlitBar {
  explicit SlitBar(std::optional<double> bed, bool slit)
      : solid(solid_of(slit)), top(solid.mesh(), Vec3::UnitZ(), 0.01), model(solid, top, {.self_collision = bed}) {
    std::vector<double> area(solid.mesh().nodes.size());
    for (std::size_t i = 0; i < area.size(); ++i) {
      const Vec3& node = solid.mesh().nodes[i];
      if (node.z() < 0.04 - 1e-9) continue;
      const auto share = [](double x) { return std::abs(x) > 0.01 - 1e-9 ? 0.125 : 0.25; };
      patch.nodes.push_back(static_cast<int>(i));
      area[i] = share(node.x()) * share(node.y());
    }
    patch.weights.resize(static_cast<Eigen::Index>(patch.nodes.size()));
    for (std::size_t i = 0; i < patch.nodes.size(); ++i) {
      patch.weights[static_cast<Eigen::Index>(i)] = area[at(patch.nodes[i])];
    }
    patch.slopes = Eigen::Matrix<double, 2, Eigen::Dynamic>::Zero(2, patch.weights.size());
  }
  static Solid solid_of(bool slit) {
    const Mesh mesh = block(Shape::kHex8, Vec3(0.02, 0.02, 0.04), {4, 4, 8});
    const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
    const Cut cut{Vec3(-0.005, -0.02, 0.02), Vec3(0.02, 0, 0), Vec3(0, 0.04, 0)};
    const Division division =
        slit ? divide(mesh, fixed, std::span(&cut, 1)) : Division{.mesh = mesh, .fixed = fixed, .node_before = {}};
    return {division.mesh, Element::kHex8, {.young = kYoung, .poisson = 0}, Law::kCorotational, division.fixed};
  }
  Solid solid;
  TouchSurface top;
  QuasiStaticModel model;
  Patch patch;
};

TEST(SelfCollision, ASlitPressedShutIsAsNoneAndADrawnOneGapes) {
  const double force = 0.1;     // N
  const double pressure = 250;  // Pa: 2.5 % strain
  const double bed = kYoung / 1e-6;
  const auto depth = [](SlitBar& bar, double newton) {
    bar.model.press(bar.patch, Prescribed::kForce, 0.2 * newton);
    return bar.model.press(bar.patch, Prescribed::kForce, newton).depth;
  };
  SlitBar whole(std::nullopt, false);
  SlitBar gaping(std::nullopt, true);
  SlitBar shut(bed, true);
  const double expected = 0.04 * pressure / kYoung;
  EXPECT_NEAR(depth(whole, force) / expected, 1, 1e-6);
  EXPECT_GT(depth(gaping, force), 1.1 * expected);
  EXPECT_NEAR(depth(shut, force) / expected, 1, 1e-4);
  EXPECT_NEAR(shut.model.self_collision()->overlap(shut.model.displacements()) / (pressure / bed), 1, 1e-2);
  const double drawn = depth(gaping, -force);
  EXPECT_LT(drawn, -1.1 * expected);
  EXPECT_NEAR(depth(shut, -force) / drawn, 1, 1e-6);
}

TEST(SelfCollision, OnAClosedWayTheHandGetsBackWhatItGave) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    Jaws jaws(law);
    std::vector<double> down;
    double most = 0;
    double work = 0;
    double before = 0;
    constexpr int kSteps = 10;
    constexpr double kStep = 0.002 / kSteps;
    for (int i = 1; i <= kSteps; ++i) {
      down.push_back(jaws.press(kStep * i).force);
      work += 0.5 * (before + down.back()) * kStep;
      before = down.back();
    }
    most = work;
    for (int i = kSteps - 1; i >= 0; --i) {
      const double up = jaws.press(kStep * i).force;
      if (i > 0) {
        EXPECT_NEAR(up, down[at(i - 1)], 6e-3 * down.back()) << i;
      }
      work -= 0.5 * (before + up) * kStep;
      before = up;
    }
    EXPECT_GT(most, 1e-5);
    EXPECT_NEAR(work / most, 0, 1e-3);
  }
}

TEST(SelfCollision, StiffnessIsTheSlopeOfTheForceAlsoWithTheJawsShut) {
  constexpr double kStep = 5e-6;
  for (const Law law : kLaws) {
    Jaws jaws(law);
    for (const double depth : {0.0007, 0.0014}) jaws.press(depth);
    const double low = jaws.press(0.0018 - kStep).force;
    const Reaction here = jaws.press(0.0018);
    const double high = jaws.press(0.0018 + kStep).force;
    EXPECT_GT(jaws.overlap(), 0);
    EXPECT_NEAR((high - low) / (2 * kStep) / here.stiffness, 1, 2e-2) << static_cast<int>(law);
  }
}

TEST(SelfCollision, AHeavyJawFallsOnTheOtherAndStaysThere) {
  const EffectsConfig heavy{
      .density = 1200, .step = 0.01, .gravity = Vec3(0, 0, -9.81), .inertia = true, .damping = 20};
  EffectsConfig at_rest = heavy;
  at_rest.inertia = false;
  at_rest.damping.reset();
  EXPECT_GT(Jaws(Law::kCorotational, std::nullopt, Element::kHex8Sri, at_rest).overlap(), 5e-4);
  Jaws resting(Law::kCorotational, kBed, Element::kHex8Sri, at_rest);
  EXPECT_GT(resting.overlap(), 0);
  EXPECT_LT(resting.overlap(), 1e-4);
  Jaws falling(Law::kCorotational, kBed, Element::kHex8Sri, heavy);
  falling.model.set_displacements(VectorXd::Zero(falling.solid.size()));  // the jaw begins at its undeformed position
  double deepest = 0;
  for (int i = 0; i < 40; ++i) {
    falling.model.press({}, Prescribed::kForce, 0);
    deepest = std::max(deepest, falling.overlap());
  }
  EXPECT_LT(deepest, 5e-4);
  EXPECT_LT((falling.model.displacements() - resting.model.displacements()).cwiseAbs().maxCoeff(), 5e-5);
}

TEST(SelfCollision, TheSidesOfACutThatIsMadeUnderTheToolStayApart) {
  BodyConfig config = pressed_body(ModelKind::kCorotational, Element::kHex8Sri, 8);
  config.middle = Vec3(0.0125, 0, 0);
  config.cuts = {{{Vec3(0, -0.06, 0.025), Vec3(0, 0.12, 0), Vec3(0, 0, 0.03)}, PlannedCut::When::kForce, 0.5}};
  const auto felt = [](const BodyConfig& each) {
    Body body(each);
    Feel last;
    for (int i = 1; i <= 10; ++i) last = body.touch(Vec3(0.0125, 0, 0.05 - 0.001 * i));
    return last.force.z();
  };
  const double through = felt(config);
  set_self_collision(config.model, 1e-4);
  const double apart = felt(config);
  config.cuts.clear();
  const double whole = felt(config);
  EXPECT_GT(apart, 1.01 * through);  // the pressed flap leans on the other one
  EXPECT_LT(apart, whole);
}

TEST(SelfCollision, NonsenseIsRefusedByName) {
  const Solid solid = Jaws::solid_of(Law::kCorotational, Element::kHex8Sri);
  const VectorXd at_rest = VectorXd::Zero(solid.size());
  EXPECT_THROW(SelfCollision(solid, 0, at_rest), std::invalid_argument);
  EXPECT_THROW(SelfCollision(solid, std::nan(""), at_rest), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::softbody::self_collision_test
