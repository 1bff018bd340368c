// SPDX-License-Identifier: Apache-2.0
// In most tests the second thread's work is done at a given answer, so that they do not depend on time.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <memory>
#include <thread>
#include <utility>
#include <vector>

#include "clients/softbody/body.h"
#include "clients/softbody/near/near_model.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::near_oracle_test {
namespace {

using testing::AskedAndExact;
using testing::Elsewhere;
using testing::expect_right;
using testing::expect_same_bits;
using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

struct NearBeside : AskedAndExact {
  NearBeside(int n, Law law, double tolerance = 5e-3, double poisson = 0.45)
      : AskedAndExact(pressed_block(Element::kHex8Sri, n, poisson, law)),
        model(solid, top, *top.patch(Vec2::Zero()), {.newton = {.max_iterations = 100, .tolerance = tolerance}}) {
    model.make_fields_by(thread.background());
  }
  Reaction press(const Vec2& place, double depth) {
    return model.press(*top.patch_with_curvatures(place), Prescribed::kDepth, depth);
  }
  Elsewhere thread;
  NearModel model;
};

constexpr Law kLaws[] = {Law::kNeoHookean, Law::kCorotational};

TEST(NearOracle, AboutTheShapeThereAnswersAreRightToATenthOfAPercent) {
  for (const Law law : kLaws) {
    NearBeside near(12, law, 1e-6);
    double depth = 0;
    for (; depth < 4e-3; depth += 5e-4) {
      near.press(Vec2::Zero(), depth + 5e-4);
      near.thread.work();
    }
    const int made = near.model.size().made;
    EXPECT_GE(made, 2);
    EXPECT_LE(made, 4);
    for (const double way : {0.0, 1e-3, 2e-3, 3e-3, 4e-3}) {
      const Vec2 place(way, 0);
      expect_right(near.press(place, depth), near.truth(place, depth), 2e-3, static_cast<int>(law), way);
    }
  }
}

TEST(NearOracle, NoAnswerMakesAPieceAndOneFieldAtATimeIsAskedFor) {
  NearBeside near(8, Law::kCorotational);
  const int pieces = near.model.size().pieces;
  for (int i = 1; i <= 100; ++i) {
    near.press(Vec2(1e-4 * i, 0), std::min(4e-3, 1e-4 * i));
    EXPECT_LE(near.thread.given.size(), 1U) << i;
    if (i % 5 == 0) near.thread.work();
  }
  EXPECT_EQ(near.model.size().pieces, pieces);
  EXPECT_EQ(near.model.size().linear, 0);
  EXPECT_GE(near.model.size().made, 3);
  near.thread.work();
  near.press(Vec2(0.01, 0), 4e-3);
  near.thread.work();
  for (int i = 0; i < 20; ++i) near.press(Vec2(0.01, 0), 4e-3);
  EXPECT_TRUE(near.thread.given.empty());
}

TEST(NearOracle, OnItsWayAsideNoForceJumpsAndErrorsAreSaid) {
  for (const Law law : kLaws) {
    for (const int slow : {1, 4, 15}) {  // answers until a field is finished
      NearBeside near(8, law);
      double last = 0;
      for (int i = 1; i <= 80; ++i) {
        const Vec2 place(2.5e-4 * std::max(0, i - 20), 0);
        const double depth = std::min(4e-3, 2e-4 * i);
        const double truth = near.truth(place, depth);
        const Reaction found = near.press(place, depth);
        expect_right(found, truth, 0.02, static_cast<int>(law), slow, i);
        if (i > 21) {
          EXPECT_NEAR(found.force, last, 0.006 * truth) << static_cast<int>(law) << ' ' << slow << ' ' << i;
        }
        last = found.force;
        if (i % slow == 0) near.thread.work();
      }
      EXPECT_GE(near.model.size().made, 3);
      EXPECT_EQ(near.model.size().linear, 0);
    }
  }
}

TEST(NearOracle, WhileAHandIsStillItsForceIsTooThroughEachRefresh) {
  for (const Law law : kLaws) {
    NearBeside near(8, law);
    for (int i = 1; i <= 40; ++i) near.press(Vec2(2e-4 * i, 0), 1e-4 * i);
    const double force = near.press(Vec2(0.008, 0), 4e-3).force;
    for (int i = 0; i < 20; ++i) {
      if (i % 5 == 0) near.thread.work();
      EXPECT_NEAR(near.press(Vec2(0.008, 0), 4e-3).force, force, 1e-6 * force) << static_cast<int>(law) << ' ' << i;
    }
    EXPECT_GE(near.model.size().made, 2);
  }
}

/// Within the initial field and to a depth of a/4, the error is at most 2 %.
TEST(NearOracle, AThreadThatHasStoppedLeavesTheFieldAndTheLinearBody) {
  for (const int n : {8, 12}) {
    for (const Law law : kLaws) {
      NearBeside near(n, law);
      for (const double depth : {1e-3, 3e-3, 5e-3}) {
        for (const Vec2& place : {Vec2(0, 0), Vec2(0.006, -0.004)}) {
          expect_right(near.press(place, depth), near.truth(place, depth), 0.02, n, static_cast<int>(law), depth);
        }
      }
      EXPECT_EQ(near.model.size().linear, 0);
      double last = near.press(Vec2(0.008, 0), 5e-3).force;
      for (int i = 1; i < 30; ++i) {
        const Vec2 place(0.008 + 5e-4 * i, 0);
        const double truth = near.truth(place, 5e-3);
        const Reaction found = near.press(place, 5e-3);
        EXPECT_GE(found.error, std::abs(found.force - truth)) << n << ' ' << static_cast<int>(law) << ' ' << i;
        EXPECT_NEAR(found.force, last, 0.02 * truth) << "no jump where the field ends " << i;
        last = found.force;
      }
      EXPECT_GE(near.model.size().linear, 25);
      EXPECT_EQ(near.model.size().made, 1);
      EXPECT_LE(near.thread.given.size(), 1U);
    }
  }
}

/// The second thread never works.
struct NoField : AskedAndExact {
  NoField(int n, Law law, double poisson)
      : AskedAndExact(pressed_block(Element::kHex8Sri, n, poisson, law)),
        model(solid, top, {.newton = {.max_iterations = 100, .tolerance = 1e-6}}, [](auto) {}) {}
  Reaction press(const Vec2& place, double depth) { return model.press(*top.patch(place), Prescribed::kDepth, depth); }
  NearModel model;
};

/// For comparison, the linear body has an error of 8 % at 3 mm and 15 % at a/4 (corotational).
TEST(NearOracle, WithoutAFieldAnswersAreNearTheLawsToAQuarterOfTheRadius) {
  for (const Law law : kLaws) {
    NoField near(8, law, 0.45);
    for (const Vec2& place : {Vec2(0, 0), Vec2(0.004, 0.011), Vec2(-0.03, 0.02)}) {
      for (const auto& [depth, share] : {std::pair(1e-3, 1e-3), std::pair(3e-3, 2e-3), std::pair(5e-3, 1e-2)}) {
        const Reaction truth = near.exact.press(*near.top.patch(place), Prescribed::kDepth, depth);
        const Reaction found = near.press(place, depth);
        EXPECT_NEAR(found.force, truth.force, share * truth.force) << static_cast<int>(law) << ' ' << depth;
        EXPECT_NEAR(found.stiffness, truth.stiffness, 0.1 * truth.stiffness) << static_cast<int>(law) << ' ' << depth;
        EXPECT_LT((found.slope - truth.slope).norm(), 3e-3) << static_cast<int>(law) << ' ' << depth;
        EXPECT_NEAR(found.depth, depth, 1e-12);
        EXPECT_GE(found.error, std::abs(found.force - truth.force)) << static_cast<int>(law) << ' ' << depth;
        EXPECT_LT(found.error, 0.3 * truth.force) << static_cast<int>(law) << ' ' << depth;
      }
    }
  }
}

/// In a nearly incompressible body the Newton step is useless from a depth of a/15 on.
TEST(NearOracle, WithoutAFieldAStepThatLeadsNowhereIsLeftOutLittleByLittle) {
  for (const Law law : kLaws) {
    NoField near(8, law, 0.499);
    const double linear = near.press(Vec2::Zero(), 1e-6).stiffness;
    double last = 0;
    for (int i = 1; i <= 100; ++i) {
      const double depth = 5e-5 * i;
      const double truth = near.truth(Vec2::Zero(), depth);
      const Reaction found = near.press(Vec2::Zero(), depth);
      EXPECT_GE(found.error, std::abs(found.force - truth)) << static_cast<int>(law) << ' ' << depth;
      EXPECT_NEAR(found.force, linear * depth, 0.06 * linear * depth) << static_cast<int>(law) << ' ' << depth;
      EXPECT_NEAR(found.force - last, 5e-5 * linear, 0.5 * 5e-5 * linear) << "no jump " << static_cast<int>(law) << i;
      last = found.force;
    }
    EXPECT_NEAR(last, linear * 5e-3, 1e-4 * last) << "the linear body";
  }
}

TEST(NearOracle, AHandThatJumpsFarIsAnsweredByTheLinearBodyAndSoonByAField) {
  for (const Law law : kLaws) {
    NearBeside near(12, law);
    near.press(Vec2(-0.025, -0.025), 3e-3);
    const auto patch = near.top.patch_with_curvatures(Vec2(0.025, -0.025));
    const double truth = near.truth(Vec2(0.025, -0.025), 3e-3);
    near.thread.work();
    const Reaction at_once = near.model.press(*patch, Prescribed::kDepth, 3e-3);
    EXPECT_GT(at_once.force, 0.5 * truth);
    EXPECT_GE(at_once.error, std::abs(at_once.force - truth));
    EXPECT_GE(near.model.size().linear, 1);
    EXPECT_EQ(at_once.way, SolverPath::kLinear);
    near.thread.work();  // too late: for the previous position
    near.model.press(*patch, Prescribed::kDepth, 3e-3);
    near.thread.work();
    EXPECT_NEAR(near.model.press(*patch, Prescribed::kDepth, 3e-3).force, at_once.force, 1e-3 * truth) << "no jump";
    EXPECT_GE(near.model.size().made, 2);
    EXPECT_EQ(near.press(Vec2(0.025, -0.025), 3e-3).way, SolverPath::kNear);
    double depth = 3e-3;
    for (int i = 0; i < 60; ++i) depth = near.press(Vec2(0.025, -0.025 + 1e-4 * i), 3e-3).depth;
    EXPECT_NEAR(near.press(Vec2(0.025, -0.019), depth).force, near.truth(Vec2(0.025, -0.019), depth), 5e-3 * truth);
  }
}

TEST(NearOracle, AFieldThatTheHandHasLeftIsThrownAway) {
  NearBeside near(8, Law::kNeoHookean);
  near.press(Vec2(-0.005, 0), 3e-3);
  ASSERT_EQ(near.thread.given.size(), 1U);
  near.press(Vec2(0.02, 0.01), 3e-3);
  const int made = near.model.size().made;
  near.thread.work();
  near.press(Vec2(0.02, 0.01), 3e-3);
  EXPECT_EQ(near.model.size().late, 1);
  EXPECT_EQ(near.model.size().made, made);
  ASSERT_EQ(near.thread.given.size(), 1U) << "asked anew at once";
  near.thread.work();
  near.press(Vec2(0.02, 0.01), 3e-3);
  EXPECT_EQ(near.model.size().made, made + 1);
}

TEST(NearOracle, AHandThatHoversAtTheEdgeOfAFieldStaysWithinTheErrorSaid) {
  for (const double middle : {0.0045, 0.009}) {  // the next field is requested here
    NearBeside near(8, Law::kCorotational);
    for (int i = 0; i < 100; ++i) {
      const Vec2 place(middle + (i % 2 == 0 ? -6e-4 : 6e-4), 0);
      expect_right(near.press(place, 3e-3), near.truth(place, 3e-3), 0.02, middle, i);
      if (i % 10 == 9) near.thread.work();
    }
    EXPECT_LE(near.model.size().made, 3);
  }
}

TEST(NearOracle, AToolThatIsLiftedMeanwhileComesBackToTheBodyAtRest) {
  NearBeside near(8, Law::kNeoHookean);
  near.press(Vec2::Zero(), 5e-3);
  ASSERT_EQ(near.thread.given.size(), 1U);
  const double least = near.model.press(*near.top.patch(Vec2::Zero()), Prescribed::kLeastDepth, 1e-5).force;
  near.thread.work();  // for a shape that no longer exists
  for (int i = 0; i < 10; ++i) {
    expect_right(near.press(Vec2::Zero(), 1e-4), near.truth(Vec2::Zero(), 1e-4), 0.02);
    near.thread.work();
  }
  EXPECT_NEAR(least, near.truth(Vec2::Zero(), 1e-5), 1e-4);
}

TEST(NearOracle, APoseThatIsNoPlaceLeavesTheStateBitByBit) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const bool beside : {false, true}) {
    const BodyConfig config = pressed_body(ModelKind::kNear, Element::kHex8Sri, 8);
    Body one(config);
    Body other(config);
    Elsewhere of_one;
    Elsewhere of_other;
    if (beside) {
      one.prepare_by(of_one.background());
      other.prepare_by(of_other.background());
    }
    for (int i = 0; i < 12; ++i) {
      const Vec3 tool(2e-3 * i, 0, 0.047);
      const Feel expected = one.touch(tool);
      other.touch(Vec3(nan, 0, 0.047));
      other.touch(Vec3(0, 0, nan));
      const Feel found = other.touch(tool);
      EXPECT_EQ(of_other.given.size(), of_one.given.size());
      if (i % 3 == 2) {
        of_one.work();
        other.touch(Vec3(0, nan, 0.047));
        of_other.work();
      }
      expect_same_bits(found, expected, i);
    }
    EXPECT_GE(one.near_field()->made, 3);
    EXPECT_EQ(one.near_field()->made, other.near_field()->made);
  }
}

TEST(NearOracle, TheErrorSaidCoversTheTrueOneOfDrawnAnswers) {
  struct Beside : AskedAndExact {
    using AskedAndExact::AskedAndExact;
    Elsewhere thread;
  };
  class Slow : public Model {
   public:
    Slow(std::unique_ptr<NearModel> model, Elsewhere& thread, int slow)
        : model_(std::move(model)), thread_(thread), slow_(slow) {
      model_->make_fields_by(thread.background());
    }
    Reaction press(const Patch& patch, Prescribed given, double value) override {
      const Reaction reaction = model_->press(patch, given, value);
      if (++answers_ % slow_ == 0) thread_.work();
      return reaction;
    }
    std::size_t bytes() const noexcept override { return 0; }

   private:
    std::unique_ptr<NearModel> model_;
    Elsewhere& thread_;
    int slow_;
    int answers_ = 0;
  };
  const testing::ErrorsSaid said = testing::errors_said(5e-3, [](int path, double tolerance) {
    auto block =
        std::make_unique<Beside>(pressed_block(Element::kHex8Sri, 8, path % 4 == 3 ? 0.499 : 0.45, kLaws[path % 2]));
    block->asked = std::make_unique<Slow>(
        std::make_unique<NearModel>(block->solid, block->top, *block->top.patch(Vec2::Zero()),
                                    NearModel::Config{.newton = {.max_iterations = 30, .tolerance = tolerance}}),
        block->thread, 1 + path % 3);
    return block;
  });
  testing::expect_covered(said);
}

TEST(NearOracle, AFarFieldThatTurnsIsRefusedAtRestAndRightAboutTheShapeThere) {
  Mesh mesh = block(info(Element::kHex8Sri).shape, Vec3(0.12, 0.024, 0.024), {20, 4, 4});
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.x() < -0.06 + 1e-9; });
  const Solid beam(std::move(mesh), Element::kHex8Sri, {.young = 1e4, .poisson = 0.3}, Law::kCorotational, fixed);
  const TouchSurface top(beam.mesh(), Vec3::UnitZ(), 0.01);
  const Patch end = *top.patch(Vec2(0.046, 0));
  const QuasiStaticModel::Config newton{.max_iterations = 200, .tolerance = 1e-6};
  QuasiStaticModel exact(beam, top, newton);
  NearModel at_rest(beam, top, end, {.newton = newton});
  NearModel refreshed(beam, top, end, {.newton = newton});
  ASSERT_GT(at_rest.size().radius, 0);
  Elsewhere thread;
  refreshed.make_fields_by(thread.background());
  double worst_at_rest = 0;
  for (double depth = 1.5e-3; depth < 0.07; depth += 1.5e-3) {
    const double truth = exact.press(end, Prescribed::kDepth, depth).force;
    const Reaction straight = at_rest.press(end, Prescribed::kDepth, depth);
    const Reaction bent = refreshed.press(end, Prescribed::kDepth, depth);
    thread.work();
    EXPECT_GE(straight.error, std::abs(straight.force - truth)) << depth;
    expect_right(bent, truth, 0.02, depth);
    worst_at_rest = std::max(worst_at_rest, std::abs(straight.force / truth - 1));
  }
  EXPECT_GT(beam.largest_turn(exact.displacements()), 1);  // rad
  EXPECT_GT(worst_at_rest, 0.1);
  const Reaction straight = at_rest.press(end, Prescribed::kDepth, 0.07);
  EXPECT_GT(straight.error, 0.1 * std::abs(straight.force)) << "refused";
}

TEST(NearOracle, WorkMayBeDoneWhenTheBodyIsGone) {
  Elsewhere thread;
  {
    Body body(pressed_body(ModelKind::kNear, Element::kHex8Sri, 8));
    body.prepare_by(thread.background());
    body.touch(Vec3(0, 0, 0.046));
  }
  ASSERT_EQ(thread.given.size(), 1U);
  thread.work();
}

}  // namespace
}  // namespace tendon::softbody::near_oracle_test
