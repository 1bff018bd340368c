// SPDX-License-Identifier: Apache-2.0
// The tests decide when the second thread's work is done.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <future>
#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "clients/softbody/background.h"
#include "clients/softbody/body.h"
#include "clients/softbody/effects/cutting.h"
#include "clients/softbody/near/near_model.h"
#include "tests/clients/softbody/drawn_answers.h"
#include "tests/clients/softbody/pressed_block.h"

namespace tendon::softbody::near_cut_test {
namespace {

using testing::AskedAndExact;
using testing::Elsewhere;
using testing::kB1PatchRadius;
using testing::pressed_block;
using testing::pressed_body;

constexpr Law kLawsOfCut[] = {Law::kNeoHookean, Law::kCorotational};

/// A cut through the whole width of B1 at x, from the top down.
Cut slit(double x, double depth) { return {Vec3(x, -0.06, 0.05 - depth), Vec3(0, 0.12, 0), Vec3(0, 0, depth + 0.01)}; }

BodyConfig cut_body(Law law, const std::vector<Cut>& cuts) {
  BodyConfig config = pressed_body(ModelKind::kNear, Element::kHex8Sri, 8);
  config.model = NearConfig{.newton = {.tolerance = 5e-3}, .law = law};
  double at = 0;
  for (const Cut& cut : cuts) config.cuts.push_back({cut, PlannedCut::When::kTime, ++at});
  return config;
}

Solid with_cuts(const Solid& solid, const std::vector<Cut>& cuts) {
  Division division = divide(solid.mesh(), solid.fixed(), cuts);
  return {std::move(division.mesh), solid.element(), solid.material(), solid.law(), std::move(division.fixed)};
}

/// Newton's method on the whole body with these cuts, N along z.
struct Truth : AskedAndExact {
  Truth(Law law, const std::vector<Cut>& cuts)
      : AskedAndExact(with_cuts(pressed_block(Element::kHex8Sri, 8, 0.45, law), cuts)) {}
  double at(const Vec3& tool) {
    return exact.press(*top.patch(tool.head<2>()), Prescribed::kLeastDepth, 0.05 - tool.z()).force;
  }
};

void expect_covered(const Feel& feel, double truth, double within, const std::string& what) {
  EXPECT_GE(feel.error, std::abs(feel.force.z() - truth)) << what;
  EXPECT_NEAR(feel.force.z(), truth, within * truth) << what;
}

TEST(NearCut, AnswersGoOnAndAreThoseOfTheCutBodyToTheErrorSaid) {
  const std::vector<Cut> cuts{slit(0.0125, 0.025), slit(-0.0125, 0.0375)};
  for (const Law law : kLawsOfCut) {
    Body body(cut_body(law, cuts));
    Elsewhere thread;
    body.prepare_by(thread.background());
    Vec3 tool(0, 0, 0.05);
    const auto touch = [&] {
      tool.x() += 5e-5;
      return body.touch(tool);
    };
    for (int i = 0; i < 16; ++i) {
      tool.z() -= 2.5e-4;
      touch();
      thread.work();
    }
    Truth uncut(law, {});
    for (std::size_t made = 0; made < cuts.size(); ++made) {
      const std::string which = std::to_string(static_cast<int>(law)) + " cut " + std::to_string(made + 1);
      Truth truth(law, {cuts.begin(), cuts.begin() + static_cast<std::ptrdiff_t>(made) + 1});
      Truth before(law, {cuts.begin(), cuts.begin() + static_cast<std::ptrdiff_t>(made)});
      body.tick(static_cast<double>(made) + 1);
      double last = 0;
      for (int i = 0; i < 5; ++i) {
        const Feel feel = touch();
        EXPECT_FALSE(feel.topology_changed);
        EXPECT_NEAR(feel.force.z(), before.at(tool), 0.02 * before.at(tool)) << which;
        EXPECT_GE(feel.error, std::abs(feel.force.z() - truth.at(tool))) << which;
        last = feel.force.z();
      }
      thread.work();
      const int fields = body.near_field()->made;
      const Feel first = touch();
      EXPECT_TRUE(first.topology_changed) << which;
      EXPECT_LT(first.force.z(), 0.99 * last) << which;
      expect_covered(first, truth.at(tool), 0.08, which + ", at once");
      EXPECT_EQ(body.near_field()->made, fields) << "no field yet";
      for (int i = 0; i < 5; ++i) {
        const Feel feel = touch();
        EXPECT_FALSE(feel.topology_changed);
        expect_covered(feel, truth.at(tool), 0.08, which + ", linear");
      }
      thread.work();
      for (int i = 0; i < 60; ++i) {
        tool.x() += 5e-5;
        const Feel feel = touch();
        expect_covered(feel, truth.at(tool), i < 55 ? 0.08 : 0.02, which + ", near " + std::to_string(i));
        if (i % 10 == 9) thread.work();
      }
      EXPECT_GT(body.near_field()->made, fields) << which;
    }
  }
}

TEST(NearCut, WithoutAnotherThreadTheNextAnswerMakesTheFieldOfTheCutBody) {
  const std::vector<Cut> cuts{slit(-0.025, 0.0375)};
  for (const Law law : kLawsOfCut) {
    Body body(cut_body(law, cuts));
    const Vec3 tool(0.0055, 0, 0.047);
    const double whole = body.touch(tool).force.z();
    const int pieces = body.near_field()->pieces;
    body.touch(tool);
    EXPECT_EQ(body.near_field()->pieces, pieces + 1) << "a next field is begun, of the body before the cut";
    Truth truth(law, cuts);
    body.tick(1);
    const Feel feel = body.touch(tool);
    EXPECT_TRUE(feel.topology_changed);
    EXPECT_LT(feel.force.z(), 0.999 * whole);
    expect_covered(feel, truth.at(tool), 0.02, "cut");
    for (int i = 0; i < 40; ++i) {
      const Vec3 there = tool + Vec3(0, 5e-4 * i, 0);
      expect_covered(body.touch(there), truth.at(there), 0.02, std::to_string(i));
    }
  }
}

/// A refresh requested before the cut finishes at any time. The cut is next to the patch, so a field of the uncut body
/// could still contain the patch.
TEST(NearCut, AFieldOfTheBodyBeforeTheCutIsThrownAwayWheneverItIsDone) {
  const BodyConfig config = cut_body(Law::kNeoHookean, {slit(0.025, 0.0375)});
  const Vec3 tool(0.002, 0, 0.046);
  const auto asked = [&](Body& body, Elsewhere& thread) {
    body.prepare_by(thread.background());
    body.touch(tool);
    ASSERT_EQ(thread.given.size(), 1U) << "a refresh";
    body.tick(1);
    ASSERT_EQ(thread.given.size(), 2U) << "the cut";
  };
  Body never(config);
  Elsewhere of_never;
  asked(never, of_never);
  std::vector<Feel> expected{never.touch(tool)};
  of_never.given[1]();
  for (int i = 0; i < 3; ++i) expected.push_back(never.touch(tool));
  const int made = never.near_field()->made;
  for (const int when : {0, 1, 2}) {
    Body body(config);
    Elsewhere thread;
    asked(body, thread);
    if (when == 0) thread.given[0]();
    EXPECT_EQ(body.touch(tool).force, expected[0].force) << when;
    if (when != 1) thread.given[1]();
    if (when == 1) {
      thread.given[1]();
      thread.given[0]();
    }
    EXPECT_EQ(body.touch(tool).force, expected[1].force) << when;
    if (when == 2) thread.given[0]();
    for (std::size_t i = 2; i < expected.size(); ++i) {
      const Feel feel = body.touch(tool);
      EXPECT_EQ(feel.force, expected[i].force) << when;
      EXPECT_EQ(feel.error, expected[i].error) << when;
    }
    EXPECT_EQ(body.near_field()->made, made) << when;
    EXPECT_EQ(thread.given.size(), 3U) << "of the cut body, asked for once";
    thread.given[2]();
    EXPECT_EQ(body.near_field()->made, made);
    body.touch(tool);
    EXPECT_EQ(body.near_field()->made, made + 1) << "the field of the cut body is taken";
  }
}

TEST(NearCut, AModelThatIsCutInPlaceTakesNoFieldOfTheBodyBefore) {
  Solid solid = pressed_block(Element::kHex8Sri, 8, 0.45, Law::kNeoHookean);
  TouchSurface top(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  const QuasiStaticModel::Config newton{.max_iterations = 100, .tolerance = 1e-6};
  NearModel model(solid, top, *top.patch(Vec2::Zero()), {.newton = newton});
  Elsewhere thread;
  model.make_fields_by(thread.background());
  const auto press = [&] { return model.press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 4e-3); };
  press();
  ASSERT_EQ(thread.given.size(), 1U);
  const std::vector<Cut> cuts{slit(0.025, 0.0375)};
  const Division division = divide(solid.mesh(), solid.fixed(), cuts);
  solid = with_cuts(solid, cuts);
  top = TouchSurface(solid.mesh(), Vec3::UnitZ(), kB1PatchRadius);
  model.cut(division, {});
  const double truth = QuasiStaticModel(solid, top, {.max_iterations = 200, .tolerance = 1e-9})
                           .press(*top.patch(Vec2::Zero()), Prescribed::kDepth, 4e-3)
                           .force;
  const int made = model.size().made;
  thread.given[0]();
  const Reaction linear = press();
  EXPECT_EQ(model.size().made, made);
  EXPECT_GE(linear.error, std::abs(linear.force - truth));
  ASSERT_EQ(thread.given.size(), 2U) << "asked anew";
  thread.given[1]();
  EXPECT_GE(press().error, std::abs(linear.force - truth));
  EXPECT_EQ(model.size().made, made + 1);
}

TEST(NearCut, AThreadOfItsOwnCutsWhileAnswersGoOn) {
  if (!factors_may_work_at_once()) GTEST_SKIP() << "this OpenBLAS only supports one thread";
  const std::vector<Cut> cuts{slit(0.025, 0.0375)};
  Body body(cut_body(Law::kNeoHookean, cuts));
  BackgroundThread thread;
  body.prepare_by([&](std::packaged_task<void()> work) { thread.give(std::move(work)); });
  Truth truth(Law::kNeoHookean, cuts);
  const auto place = [](int i) { return Vec3(1e-4 * (i % 80 < 40 ? i % 80 : 80 - i % 80), 0, 0.046); };
  body.touch(place(0));  // starts a refresh before the cut is requested
  body.tick(1);
  int cut_at = 0;
  int made = 0;
  // The pause between answers gives the second thread time to work.
  for (int i = 1; i < 20'000 && (cut_at == 0 || body.near_field()->made == made); ++i) {
    const Feel feel = body.touch(place(i));
    EXPECT_GE(feel.error, std::abs(feel.force.z() - truth.at(place(i)))) << i;
    if (feel.topology_changed) {
      cut_at = i;
      made = body.near_field()->made;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  EXPECT_GT(cut_at, 0);
  EXPECT_GT(body.near_field()->made, made);
}

TEST(NearCut, ABodyThatIsAllNearIsCutAsTheWholeModel) {
  BodyConfig config = cut_body(Law::kNeoHookean, {slit(0, 0.0125)});
  config.shape = BlockShape{Vec3(0.04, 0.04, 0.02), {4, 4, 2}};
  config.cuts[0].cut = {Vec3(0, -0.03, 0.01), Vec3(0, 0.06, 0), Vec3(0, 0, 0.02)};
  const Newton exact{.max_iterations = 100, .tolerance = 1e-9};
  *newton_of(config.model) = exact;
  BodyConfig whole = config;
  whole.model = NeoHookeanConfig{.newton = exact};
  const Vec3 tool(0.001, 0, 0.018);
  for (const bool beside : {false, true}) {
    Body near(config);
    Body newton(whole);
    Elsewhere thread;
    if (beside) near.prepare_by(thread.background());
    ASSERT_EQ(near.near_field()->radius, 0);
    EXPECT_EQ(near.touch(tool).force, newton.touch(tool).force);
    near.tick(1);
    newton.tick(1);
    thread.work();
    const double truth = newton.touch(tool).force.z();
    const Feel first = near.touch(tool);
    EXPECT_GE(first.error + 1e-9 * truth, std::abs(first.force.z() - truth)) << beside;
    thread.work();
    for (int i = 0; i < 3; ++i) near.touch(tool + Vec3(0.003 * i, 0, 0));
    EXPECT_NEAR(near.touch(tool).force.z(), truth, 1e-6 * truth) << beside;
    EXPECT_TRUE(thread.given.empty()) << "nothing better can be asked for";
  }
}

TEST(NearCut, WhatWasLearnedOfTheUncutBodyAnswersNoCutOne) {
  BodyConfig config = cut_body(Law::kNeoHookean, {slit(0, 0.025)});
  config.shape = BlockShape{Vec3(0.1, 0.1, 0.05), {6, 6, 3}};
  NearConfig near{.newton = {.tolerance = 0.02}, .law = Law::kNeoHookean, .learn = true, .tabulate = true};
  config.model = near;
  config.reach = 0.005;
  near.learned = learn(config, {});
  config.model = near;
  const Solid solid = with_cuts(pressed_block(Element::kHex8Sri, 6, 0.45, Law::kNeoHookean), {config.cuts.front().cut});
  AskedAndExact truth(solid);
  const Vec3 tool(0.001, 0.001, 0.047);
  for (const bool beside : {false, true}) {
    Body body(config);
    Elsewhere thread;
    if (beside) body.prepare_by(thread.background());
    ASSERT_EQ(body.fallbacks().size(), 2U);
    const double whole = body.touch(tool).force.z();
    EXPECT_EQ(body.fallbacks()[0].answers, 1);
    body.tick(1);
    thread.work();
    for (int i = 0; i < 5; ++i) {
      const Feel feel = body.touch(tool);
      const double expected = truth.exact.press(*truth.top.patch(tool.head<2>()), Prescribed::kDepth, 3e-3).force;
      EXPECT_EQ(feel.topology_changed, i == 0);
      EXPECT_TRUE(body.fallbacks().empty());
      EXPECT_LT(feel.force.z(), 0.99 * whole);
      EXPECT_GE(feel.error, std::abs(feel.force.z() - expected)) << beside << ' ' << i;
      thread.work();
    }
  }
}

/// The body is cut once after some answers.
class CutMeanwhile : public Model {
 public:
  CutMeanwhile(const AskedAndExact& cut, Solid whole, const NearModel::Config& config, int slow, int at)
      : cut_(cut),
        whole_(std::move(whole)),
        top_(whole_.mesh(), Vec3::UnitZ(), kB1PatchRadius),
        before_(whole_, top_, *top_.patch(Vec2::Zero()), config),
        after_(std::make_unique<NearModel>(cut.solid, cut.top, config, thread_.background())),
        slow_(slow),
        at_(at) {
    before_.make_fields_by(thread_.background());
  }
  Reaction press(const Patch& patch, Prescribed given, double value) override {
    Reaction reaction;
    if (answers_ < at_) {
      reaction = before_.press(*top_.patch(top_.across(place_of(cut_.solid.mesh(), patch))), given, value);
      reaction.error = std::max(reaction.error, std::abs(reaction.force));
    } else {
      if (answers_ == at_) after_->go_on_from(before_, {});
      reaction = after_->press(patch, given, value);
    }
    if (++answers_ % slow_ == 0) thread_.work();
    return reaction;
  }
  std::size_t bytes() const noexcept override { return 0; }

 private:
  const AskedAndExact& cut_;
  Solid whole_;
  TouchSurface top_;
  Elsewhere thread_;
  NearModel before_;
  std::unique_ptr<NearModel> after_;
  int slow_;
  int at_;
  int answers_ = 0;
};

TEST(NearCut, TheErrorSaidCoversTheTrueOneOfDrawnAnswersAroundACut) {
  const testing::ErrorsSaid said = testing::errors_said(5e-3, [](int path, double tolerance) {
    const Solid whole = pressed_block(Element::kHex8Sri, 8, path % 4 == 3 ? 0.499 : 0.45, kLawsOfCut[path % 2]);
    const std::vector<Cut> cut{slit(0.0125 * (path % 5 - 2), 0.0125 * (1 + path % 3))};
    auto block = std::make_unique<AskedAndExact>(with_cuts(whole, cut));
    const NearModel::Config config{.newton = {.max_iterations = 30, .tolerance = tolerance}};
    block->asked =
        std::make_unique<CutMeanwhile>(*block, whole, config, path % 3 == 2 ? 1000 : 1 + path % 3, 1 + path % 5);
    return block;
  });
  testing::expect_covered(said);
  EXPECT_GE(said.covered, said.answers - 1);
}

}  // namespace
}  // namespace tendon::softbody::near_cut_test
