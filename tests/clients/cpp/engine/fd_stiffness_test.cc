// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/fd_stiffness.h"

#include <gtest/gtest.h>

#include <limits>
#include <stdexcept>

namespace tendon::fd_stiffness_test {
namespace {

const Mat3 kSpring = (Mat3() << 500, 20, -30, 20, 800, 10, -30, 10, 300).finished();

TEST(FdStiffness, OfALinearForceIsItsMatrix) {
  const auto found = fd_stiffness([](const Vec3& x) { return Vec3(-kSpring * x); }, Vec3(0.01, 0.02, 0.03), 1e-4);
  ASSERT_TRUE(found);
  EXPECT_LT((found->stiffness - kSpring).norm(), 1e-7);
  EXPECT_LT(found->asymmetry, 1e-7);
  EXPECT_LT(found->kink, 1e-7);
}

TEST(FdStiffness, HasAnErrorOfSecondOrder) {
  // F = −c·x³ along x gives K = 3·c·x². Central differences add c·h².
  const double c = 1e6;
  const auto cubic = [&](const Vec3& x) { return Vec3(-c * x.x() * x.x() * x.x(), 0, 0); };
  for (const double h : {1e-3, 1e-4}) {
    const auto found = fd_stiffness(cubic, Vec3(0.02, 0, 0), h);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->stiffness(0, 0) - 3 * c * 0.02 * 0.02, c * h * h, 1e-3 * c * h * h);
  }
}

TEST(FdStiffness, SaysHowMuchOfTheForceIsNoSpring) {
  const Mat3 turning = (Mat3() << 0, 40, 0, -40, 0, 0, 0, 0, 0).finished();
  const auto found = fd_stiffness([&](const Vec3& x) { return Vec3(-(kSpring + turning) * x); }, Vec3::Zero(), 1e-4);
  ASSERT_TRUE(found);
  EXPECT_LT((found->stiffness - kSpring).norm(), 1e-7) << "the symmetric part";
  EXPECT_NEAR(found->asymmetry, 40, 1e-7);
}

TEST(FdStiffness, ShowsASurfaceThatIsWithinAStep) {
  const auto wall = [](const Vec3& x) { return Vec3(-2000 * std::max(x.x(), 0.0), 0, 0); };
  const auto at_its_edge = fd_stiffness(wall, Vec3::Zero(), 1e-4);
  ASSERT_TRUE(at_its_edge);
  EXPECT_NEAR(at_its_edge->stiffness(0, 0), 1000, 1e-7);
  EXPECT_NEAR(at_its_edge->kink, 1000, 1e-7);
  const auto inside = fd_stiffness(wall, Vec3(2e-4, 0, 0), 1e-4);
  ASSERT_TRUE(inside);
  EXPECT_NEAR(inside->kink, 0, 1e-7);
}

/// The rest position moves halfway to the hand at each call.
struct Creeping {
  Vec3 rest = Vec3::Zero();
  Vec3 saved = Vec3::Zero();
  Vec3 force(const Vec3& x) {
    rest += 0.5 * (x - rest);
    return -500 * (x - rest);
  }
};

TEST(FdStiffness, PutsAnEngineThatGoesOnBackEachTime) {
  Creeping engine{.rest = Vec3(0.01, 0, 0), .saved = {}};
  const SavedState state{[&] { engine.saved = engine.rest; }, [&] { engine.rest = engine.saved; }};
  const auto found = fd_stiffness([&](const Vec3& x) { return engine.force(x); }, Vec3(0.03, 0, 0), 1e-4, state);
  ASSERT_TRUE(found);
  EXPECT_LT((found->stiffness - 250 * Mat3::Identity()).norm(), 1e-7);
  EXPECT_EQ(engine.rest, Vec3(0.01, 0, 0));
}

TEST(FdStiffness, PutsTheEngineBackWhenItThrows) {
  Creeping engine{.rest = Vec3(0.01, 0, 0), .saved = {}};
  const SavedState state{[&] { engine.saved = engine.rest; }, [&] { engine.rest = engine.saved; }};
  const auto breaks = [&](const Vec3& x) -> Vec3 {
    engine.force(x);
    throw std::runtime_error("no solution");
  };
  EXPECT_THROW(fd_stiffness(breaks, Vec3(0.03, 0, 0), 1e-4, state), std::runtime_error);
  EXPECT_EQ(engine.rest, Vec3(0.01, 0, 0));
}

TEST(FdStiffness, IsNoneWhereAForceIsNotFinite) {
  const auto hole = [](const Vec3& x) {
    return x.y() < 0 ? Vec3(Vec3::Constant(std::numeric_limits<double>::quiet_NaN())) : Vec3(-x);
  };
  EXPECT_FALSE(fd_stiffness(hole, Vec3::Zero(), 1e-4));
}

TEST(FdStiffness, RefusesWhatIsNoStepAndHalfAState) {
  const auto spring = [](const Vec3& x) { return Vec3(-x); };
  for (const double step : {0.0, -1e-4, std::numeric_limits<double>::quiet_NaN(), HUGE_VAL})
    EXPECT_THROW(fd_stiffness(spring, Vec3::Zero(), step), std::invalid_argument);
  EXPECT_THROW(fd_stiffness(spring, Vec3::Zero(), 1e-4, {.save = [] {}, .restore = {}}), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::fd_stiffness_test
