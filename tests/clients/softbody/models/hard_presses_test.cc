// SPDX-License-Identifier: Apache-2.0
// Presses that are difficult for such solvers. touch/rigid_contact_test.cc has those with rigid tools.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/fem/region.h"
#include "clients/softbody/near/near_model.h"
#include "clients/softbody/touch/contact.h"
#include "tests/clients/softbody/pressed_block.h"
#include "tests/clients/softbody/touch/ways.h"

namespace tendon::softbody::hard_presses_test {
namespace {

constexpr double kPatch = testing::kB1PatchRadius;

struct Side {
  Side(Solid of, const Vec3& towards_tool, const Vec3& first, double tolerance = 1e-9)
      : solid(std::move(of)),
        surface(solid.mesh(), towards_tool, kPatch),
        whole(solid, surface, {.tolerance = tolerance}),
        near(solid, surface, *surface.patch(surface.across(first)), {.newton = {.tolerance = tolerance}}) {}

  Solid solid;
  TouchSurface surface;
  QuasiStaticModel whole;
  NearModel near;
};

TEST(HardPress, InACornerAndAtTheRimStiffnessIsTheSlopeAndNearIsWhole) {
  struct Place {
    Vec3 towards_tool;
    Vec3 tool;
  };
  for (const Place& place :
       {Place{Vec3::UnitZ(), Vec3(0.042, 0.041, 0.047)}, Place{Vec3::UnitX(), Vec3(0.047, 0.003, 0.004)}})
    for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
      Side side(testing::pressed_block(Element::kHex8Sri, 8, 0.45, law), place.towards_tool, place.tool);
      PatchContact contact(side.whole, side.surface, 0, PatchContact::Side::kUnilateral, nullptr);
      const Feel feel = contact.at(place.tool);
      EXPECT_GT(feel.force.dot(place.towards_tool), 0.1);
      EXPECT_LT(feel.error, 1e-6 * feel.force.norm());
      const Mat3 expected = testing::force_slope(place.tool, 2e-6, [&](const Vec3& at) { return contact.at(at); });
      EXPECT_LT((feel.stiffness - expected).norm(), 0.01 * expected.norm()) << place.tool.transpose();
      PatchContact by_near(side.near, side.surface, 0, PatchContact::Side::kUnilateral, nullptr);
      const Feel near = by_near.at(place.tool);
      EXPECT_LT((near.force - feel.force).norm(), 0.02 * feel.force.norm()) << place.tool.transpose();
      EXPECT_GE(near.error, (near.force - feel.force).norm());
    }
}

TEST(HardPress, EightMillimetresDeepIsTheSameAtOnceAndInSteps) {
  for (const int n : {8, 12}) {
    Side side(testing::pressed_block(Element::kHex8Sri, n, 0.45, Law::kCorotational), Vec3::UnitZ(), Vec3::Zero());
    const Patch patch = *side.surface.patch(Vec2::Zero());
    const Reaction at_once = side.whole.press(patch, Prescribed::kDepth, 0.008);
    EXPECT_LT(at_once.stiffness, 0.7 * at_once.force / 0.008);  // softening: close to the patch's limit load
    EXPECT_LT(at_once.error, 1e-6 * at_once.force);
    QuasiStaticModel slow(side.solid, side.surface, {.tolerance = 1e-9});
    for (double depth = 0.0005; depth < 0.0096; depth += 0.0005) slow.press(patch, Prescribed::kDepth, depth);
    const Reaction from_above = slow.press(patch, Prescribed::kDepth, 0.008);
    EXPECT_NEAR(from_above.force, at_once.force, 1e-6 * at_once.force) << n;
    EXPECT_NEAR(from_above.stiffness, at_once.stiffness, 0.01 * at_once.stiffness) << n;
    const Reaction near = side.near.press(patch, Prescribed::kDepth, 0.008);
    EXPECT_LT(std::abs(near.force - at_once.force), near.error) << n;
    EXPECT_NEAR(near.force, at_once.force, 0.01 * at_once.force) << n;
  }
}

Solid block_of_two(int n, Law law, const Material& inner, const Material& outer) {
  Mesh mesh = block(Shape::kHex8, Vec3(0.1, 0.1, 0.05), {n, n, n / 2});
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  const std::vector<Region> regions{
      {.where = Region::Ball{.middle = Vec3(0, 0, 0.05), .radius = 0.03}, .material = inner}};
  std::vector<Material> of_elements = materials_of(mesh, outer, regions);
  return {std::move(mesh), Element::kHex8Sri, outer, law, fixed, std::move(of_elements)};
}

/// Newton's method solves the whole body. The error that the near model reports must cover its approximate far field.
TEST(HardPress, AMillionTimesStifferFarFieldIsCoveredByTheErrorSaid) {
  const Material tissue{.young = 1e4, .poisson = 0.45};
  for (const double ratio : {1e6, 1e-6}) {
    for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
      Side side(block_of_two(8, law, tissue, {.young = ratio * tissue.young, .poisson = 0.45}), Vec3::UnitZ(),
                Vec3::Zero());
      for (const double depth : {1e-3, 3e-3}) {
        const Patch patch = *side.surface.patch(Vec2::Zero());
        const Reaction whole = side.whole.press(patch, Prescribed::kDepth, depth);
        const Reaction near = side.near.press(patch, Prescribed::kDepth, depth);
        // Rounding errors of the stiff part affect the soft part.
        EXPECT_LT(whole.error, 1e-3 * whole.force) << ratio << ' ' << depth;
        EXPECT_LE(std::abs(near.force - whole.force), near.error) << ratio << ' ' << depth;
        // The first answer is exact with a rigid far field. One softer than the near field moves and rotates as much.
        const double share = ratio > 1 ? 1e-5 : 0.05;
        EXPECT_LT(std::abs(near.force - whole.force), share * whole.force) << ratio << ' ' << depth;
        EXPECT_LT(near.error, 0.2 * near.force) << ratio << ' ' << depth;
      }
    }
  }
}

TEST(HardPress, NearlyIncompressibleAtOnceIsTheSameAsInSteps) {
  for (const Law law : {Law::kCorotational, Law::kNeoHookean}) {
    for (const int n : {8, 12}) {
      Side side(testing::pressed_block(Element::kHex8Sri, n, 0.499, law), Vec3::UnitZ(), Vec3::Zero());
      const Patch patch = *side.surface.patch(Vec2::Zero());
      const Reaction at_once = side.whole.press(patch, Prescribed::kDepth, 0.005);
      EXPECT_EQ(side.solid.inverted(side.whole.displacements()), 0) << n;
      QuasiStaticModel slow(side.solid, side.surface, {.tolerance = 1e-9});
      Reaction in_steps;
      for (double depth = 0.0005; depth < 0.00501; depth += 0.0005) {
        in_steps = slow.press(patch, Prescribed::kDepth, depth);
      }
      EXPECT_LT(in_steps.error, 1e-6 * in_steps.force) << n;
      EXPECT_LE(std::abs(at_once.force - in_steps.force), at_once.error + in_steps.error) << n;
      EXPECT_LT(at_once.error, 2e-3 * at_once.force) << n;  // the iteration limit ends the solver
      const Reaction near = side.near.press(patch, Prescribed::kDepth, 0.005);
      EXPECT_LE(std::abs(near.force - in_steps.force), near.error) << n;
      EXPECT_NEAR(near.force, in_steps.force, 0.01 * in_steps.force) << n;
    }
  }
}

}  // namespace
}  // namespace tendon::softbody::hard_presses_test
