// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/self_test.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::self_test_test {
namespace {

constexpr double kK = 1000;  // N/m
constexpr double kB = 4;     // N·s/m

/// A spring and a damper behind x = 0. The damper never pulls.
Touch wall(const DeviceState& hand) {
  const double x = hand.position.x();
  Touch touch;
  touch.stiffness = Mat3::Zero();
  if (x <= 0) return touch;
  touch.force.x() = std::min(-kK * x - kB * hand.velocity.x(), 0.0);
  touch.stiffness = Mat3(Vec3(kK, 0, 0).asDiagonal());
  return touch;
}

int count(const SelfTest& result, SelfTest::Verdict verdict, const std::string& claim = "") {
  int found = 0;
  for (const auto& finding : result.findings)
    if (finding.verdict == verdict && finding.what.find(claim) != std::string::npos) ++found;
  return found;
}
constexpr auto kPassed = SelfTest::Verdict::kPassed;
constexpr auto kFailed = SelfTest::Verdict::kFailed;
constexpr auto kNotJudged = SelfTest::Verdict::kNotJudged;

TEST(SelfTest, TellsEachFindingAsSoonAsItIsOne) {
  std::string told;
  std::string told_json;
  int answers = 0;
  std::vector<int> answers_before;
  const SelfTest result = self_test(
      [&](const DeviceState& hand) {
        ++answers;
        return wall(hand);
      },
      {},
      [&](const SelfTest::Finding& finding) {
        told += finding.text();
        told_json += finding.json();
        answers_before.push_back(answers);
      });
  EXPECT_EQ(told, result.text());
  EXPECT_EQ(told_json, result.json());
  ASSERT_EQ(answers_before.size(), result.findings.size());
  EXPECT_LT(answers_before.front(), answers / 5);
}

TEST(SelfTest, IsPassedByAKelvinVoigtWallInEveryClaim) {
  const SelfTest result = self_test(wall);
  EXPECT_TRUE(result.passed()) << result.text();
  EXPECT_EQ(count(result, kPassed), 14 + 4 + 7) << result.text();
  EXPECT_EQ(count(result, kNotJudged), 0) << result.text();
}

TEST(SelfTest, MeasuresWhatAPressCosts) {
  // A spring returns all energy: 0.5·k·(10 mm)² = 50 mJ.
  const SelfTest result =
      self_test([](const DeviceState& hand) -> Touch { return Vec3(-kK * std::max(hand.position.x(), 0.0), 0, 0); });
  const auto& press = result.findings.front();
  EXPECT_NE(press.what.find("press and release"), std::string::npos);
  EXPECT_NEAR(press.bound, 0.01 * 0.5 * kK * 0.01 * 0.01, 2e-6);
  EXPECT_LT(press.value, 1e-6);
  EXPECT_EQ(count(result, kNotJudged, "stiffness"), 4) << "it provides no stiffness";
  EXPECT_TRUE(result.passed()) << result.text();
}

TEST(SelfTest, OfAnElasticBodyWantsBackWhatAWayHasCost) {
  SelfTestScript script;
  script.elastic = true;
  const SelfTest spring = self_test(
      [](const DeviceState& hand) -> Touch { return Vec3(-kK * std::max(hand.position.x(), 0.0), 0, 0); }, script);
  EXPECT_TRUE(spring.passed()) << spring.text();
  EXPECT_EQ(count(spring, kPassed, "returns the stored energy"), 14) << spring.text();
  const SelfTest damped = self_test(wall, script);
  EXPECT_EQ(count(damped, kFailed, "generates"), 0) << damped.text();
  EXPECT_EQ(count(damped, kFailed, "returns the stored energy"), 14) << damped.text();
  EXPECT_FALSE(damped.passed());
  const auto& press = damped.findings.at(1);
  EXPECT_EQ(press.what, "returns the stored energy: press and release, 0.025 m/s");
  EXPECT_GT(press.value, press.bound);
  // This engine jumps to another equilibrium at the end of the slide. Only the check of the lateral motion fails.
  const SelfTest snaps = self_test(
      [snapped = false](const DeviceState& hand) mutable -> Touch {
        const double depth = std::max(hand.position.x(), 0.0);
        if (depth == 0) snapped = false;
        if (hand.position.y() > 0.005) snapped = true;
        return Vec3(snapped ? -kK / 2 * depth : -kK * depth, 0, 0);
      },
      script);
  EXPECT_GT(count(snaps, kFailed, "returns the stored energy: press, slide, release"), 0) << snaps.text();
  EXPECT_EQ(count(snaps, kFailed, "returns the stored energy: press and release"), 0) << snaps.text();
}

TEST(SelfTest, AllowsForWhatFewStatesASecondMakeOfAForceThatBends) {
  // This engine is conservative, even if the hand moves up to 2 mm between two states at 50 Hz.
  SelfTestScript script;
  script.rate_hz = 50;
  script.work_tolerance = 1e-5;
  const SelfTest result = self_test(
      [](const DeviceState& hand) -> Touch {
        const Vec3 out = hand.position - Vec3(0.03, 0.004, 0.002);
        const double depth = std::max(0.035 - out.norm(), 0.0);
        return Vec3(1e7 * depth * depth * depth * out.normalized());
      },
      script);
  EXPECT_EQ(count(result, kFailed, "generates"), 0) << result.text();
}

TEST(SelfTest, IsFailedByAForceThatPushesOnWithTheHand) {
  const SelfTest result = self_test([](const DeviceState& hand) {
    Touch touch = wall(hand);
    if (hand.position.x() > 0) touch.force.x() = -kK * hand.position.x() + kB * hand.velocity.x();
    return touch;
  });
  EXPECT_FALSE(result.passed());
  EXPECT_EQ(count(result, kPassed, "press and release"), 0) << result.text();
}

TEST(SelfTest, IsFailedByAForceThatIsLate) {
  // A delay of 10 states reverses the hysteresis of the wall, so it generates energy.
  const SelfTest result = self_test([late = std::vector<Vec3>(10, Vec3::Zero())](const DeviceState& hand) mutable {
    late.insert(late.begin(), Vec3(-kK * std::max(hand.position.x(), 0.0), 0, 0));
    const Touch touch = late.back();
    late.pop_back();
    return touch;
  });
  EXPECT_FALSE(result.passed());
  EXPECT_GT(count(result, kFailed, "press and release, 0.1 m/s"), 0) << result.text();
}

TEST(SelfTest, IsFailedByAForceWithACurlInWhicheverPlane) {
  SelfTestScript script;
  script.start = Vec3::Zero();  // this bilateral spring stores no energy there
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1, 1}) {
      const SelfTest result = self_test(
          [&](const DeviceState& hand) {
            Touch touch = Vec3(-kK * hand.position);
            touch.force += sign * 100 * Vec3::Unit(axis).cross(hand.position);
            return touch;
          },
          script);
      EXPECT_GT(count(result, kFailed, "generates"), 0) << axis << result.text();
      EXPECT_GT(count(result, kPassed, "press and release"), 0) << "there it cannot be seen";
    }
  }
}

TEST(SelfTest, IsFailedByAStiffnessThatIsWrong) {
  for (const double factor : {0.9, 1.1, -1.0, 0.0}) {
    const SelfTest result = self_test([&](const DeviceState& hand) {
      Touch touch = wall(hand);
      *touch.stiffness *= factor;
      return touch;
    });
    EXPECT_EQ(count(result, kFailed, "stiffness"), 3) << "at one of the four depths nothing is touched";
    EXPECT_FALSE(result.passed());
  }
  EXPECT_EQ(count(self_test([](const DeviceState& hand) {
                    Touch touch = wall(hand);
                    touch.stiffness = Mat3(touch.stiffness->norm() * Vec3::UnitY().asDiagonal().toDenseMatrix());
                    return touch;
                  }),
                  kFailed, "stiffness"),
            3);
}

TEST(SelfTest, DoesNotJudgeAStiffnessWhereASurfaceIsWithinAStep) {
  SelfTestScript script;
  script.start = Vec3(-0.01, 0, 0);  // the wall's edge is in the middle of the path
  script.depth = 0.02;
  const SelfTest result = self_test(wall, script);
  EXPECT_EQ(count(result, kNotJudged, "stiffness"), 1) << result.text();
  EXPECT_TRUE(result.passed()) << result.text();
}

/// The rest position creeps towards the hand. This is passive, but the force is not a function of the position.
struct Creeping {
  Vec3 rest = Vec3::Zero();
  Vec3 saved = Vec3::Zero();
  Touch answer(const DeviceState& hand) {
    if (hand.position.norm() < 1) rest += 0.001 * (hand.position - rest);
    Touch touch = Vec3(-kK * (hand.position - rest));
    touch.stiffness = Mat3(kK * 0.999 * Mat3::Identity());
    return touch;
  }
};

TEST(SelfTest, JudgesTheStiffnessOfAnEngineThatGoesOnOnlyWithSaveAndRestore) {
  Creeping engine;
  const Physics physics = [&](const DeviceState& hand) { return engine.answer(hand); };
  SelfTestScript script;
  script.work_tolerance = 1;  // energy that was stored before is released on the path
  const SelfTest without = self_test(physics, script);
  EXPECT_EQ(count(without, kNotJudged, "stiffness"), 4) << without.text();
  EXPECT_NE(without.text().find("provide save and restore"), std::string::npos) << without.text();
  engine = {};
  script.state = {[&] { engine.saved = engine.rest; }, [&] { engine.rest = engine.saved; }};
  const SelfTest with = self_test(physics, script);
  EXPECT_EQ(count(with, kPassed, "stiffness"), 4) << with.text();
}

TEST(SelfTest, IsFailedByAnEngineThatANanPoisons) {
  const SelfTest result = self_test([mean = Vec3(0, 0, 0)](const DeviceState& hand) mutable -> Touch {
    mean += 0.5 * (hand.position - mean);
    return Vec3(-kK * mean);
  });
  EXPECT_GE(count(result, kFailed, "after a hand at NaN"), 1) << result.text();
}

TEST(SelfTest, IsFailedByAnEngineThatThrowsOrDividesByTheTime) {
  const SelfTest throws = self_test([](const DeviceState& hand) {
    if (hand.position.norm() > 1) throw std::out_of_range("no cell there");
    return wall(hand);
  });
  EXPECT_GE(count(throws, kFailed, "1 km away"), 2) << throws.text();
  EXPECT_NE(throws.text().find("exception \"no cell there\""), std::string::npos);

  std::optional<PeerTime> last;
  const SelfTest divides = self_test([&](const DeviceState& hand) {
    Touch touch = wall(hand);
    if (last) touch.force.y() = hand.position.y() / seconds(hand.sampled - *last);
    last = hand.sampled;
    return touch;
  });
  EXPECT_EQ(count(divides, kFailed, "same state twice"), 1) << divides.text();
}

TEST(SelfTest, IsFailedByAnEngineThatIsNotTouched) {
  const SelfTest result = self_test([](const DeviceState&) { return Touch(); });
  EXPECT_EQ(count(result, kFailed, "is felt"), 1);
  EXPECT_FALSE(result.passed());
}

TEST(SelfTest, PressesWhereTheScriptSays) {
  SelfTestScript script;
  script.start = Vec3(0.1, 0.2, 0.3);
  script.into = Vec3(0, 0, -4);
  script.depth = 0.02;
  double deepest = 1;
  self_test(
      [&](const DeviceState& hand) -> Touch {
        const bool near = (hand.position - script.start).norm() < 0.05;
        if (near) deepest = std::min(deepest, hand.position.z());
        return Vec3(0, 0, 500 * std::max(0.295 - hand.position.z(), 0.0));
      },
      script);
  EXPECT_NEAR(deepest, 0.28, 1e-12);
}

TEST(SelfTest, SaysItAsTextAndAsJson) {
  SelfTest result;
  result.findings = {{kPassed, "is well", "all of it", 0.5, 1}, {kFailed, "is felt", "exception \"no\"\n", 0, 0}};
  EXPECT_EQ(result.text(), "passed   is well: all of it\nFAILED   is felt: exception \"no\"\n\n");
  EXPECT_EQ(
      result.json(),
      "{\"finding\":{\"verdict\":\"passed\",\"what\":\"is well\",\"why\":\"all of it\",\"value\":0.5,\"bound\":1.0}}\n"
      "{\"finding\":{\"verdict\":\"failed\",\"what\":\"is felt\",\"why\":\"exception \\\"no\\\"\\n\",\"value\":0.0,"
      "\"bound\":0.0}}\n");
}

TEST(SelfTest, RefusesAnImpossibleScript) {
  const auto refused = [](auto change) {
    SelfTestScript script;
    change(script);
    EXPECT_THROW(self_test(wall, script), std::invalid_argument);
  };
  refused([](SelfTestScript& s) { s.start.x() = std::numeric_limits<double>::quiet_NaN(); });
  refused([](SelfTestScript& s) { s.into = Vec3::Zero(); });
  refused([](SelfTestScript& s) { s.depth = 0; });
  refused([](SelfTestScript& s) { s.slide = -1; });
  refused([](SelfTestScript& s) { s.speed = HUGE_VAL; });
  refused([](SelfTestScript& s) { s.rate_hz = 0; });
  refused([](SelfTestScript& s) { s.work_tolerance = -1; });
  refused([](SelfTestScript& s) { s.stiffness_step = 0; });
  refused([](SelfTestScript& s) { s.stiffness_tolerance = -1; });
  refused([](SelfTestScript& s) { s.state.save = [] {}; });
}

}  // namespace
}  // namespace tendon::self_test_test
