// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "clients/cpp/field/field.h"
#include "core/field/material.h"
#include "protocol/secrets/blake2b.h"
#include "tests/server/clients/field_server.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::field_refusals_test {
namespace {

using std::chrono::hours;
using std::chrono::milliseconds;
using std::chrono::seconds;

const std::string kStill = "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 0\nfrequency_hz = 0\n[field]\n";
const std::string kTwoChannels = "allow = [\"liver\"]\n[[channel]]\nname = \"liver\"\n[[channel]]\nname = \"peg\"\n";
const ClientKey kLiver{.name = "liver", .role = Role::kController, .key = Ratchet(1).next()};
const ClientKey kSpy{.name = "spy", .role = Role::kController, .key = Ratchet(2).next()};

FieldShape ball() { return shape_of(sphere_at(Vec3(0.03, 0, 0), 0.02), Vec3(0.006, -0.024, -0.024), 3, 2e-3); }

class FieldRefusals : public FieldServer {
 protected:
  FieldRefusals() { start({scene_of(kStill)}); }

  /// An engine that has uploaded the ball.
  Engine with_ball(const FieldEngine::Config& config = {}) {
    Engine one = engine("127.0.0.1:4000", config);
    EXPECT_TRUE(upload(one, ball()));
    return one;
  }
  static std::string of_ball(const Engine& one, const std::string& rest) {
    return "field " + short_name(one->uploads.back().field()) + ": " + rest;
  }
  void expect_refused(std::uint32_t id, const Engine& one, Code code, const std::string& detail) {
    const FieldEngine::Answer answer = answer_to(id, one);
    EXPECT_EQ(answer.code, code);
    EXPECT_EQ(answer.detail, detail);
  }
};

TEST_F(FieldRefusals, AnObserverUploadsNothing) {
  FieldEngine::Config config;
  config.hello.role = Role::kObserver;
  const Engine one = engine("127.0.0.1:4000", config);
  one->upload(ball());
  run(milliseconds(200), {&one});
  EXPECT_EQ(one->welcome->features, std::vector<std::string>({"channels", "fields"}));
  ASSERT_FALSE(one->answers.empty());
  EXPECT_EQ(one->answers.begin()->second.code, Code::kDenied);
  EXPECT_EQ(one->answers.begin()->second.detail, "only a controller may upload or use a field");
  EXPECT_TRUE(one->statuses.empty());
  const std::uint64_t denied = assembly_->network().stats().denied;
  const BrickBytes bytes{};
  one->session()->send(FieldBrick{.hash = crypto::blake2b_128(bytes), .weights = bytes});
  run(milliseconds(10), {&one});
  EXPECT_EQ(assembly_->network().stats().denied, denied + 1);
}

TEST_F(FieldRefusals, ASessionWithoutTheFeatureUploadsNothing) {
  FieldEngine::Config config;
  config.hello.features = {"channels"};
  const Engine one = engine("127.0.0.1:4000", config);
  run(milliseconds(20), {&one});
  for (const Request& request :
       {Request(OfferField{.size = 100, .part = std::vector<std::byte>(100)}),
        Request(UseField{.generation = 1, .materials = {{.stiffness = 1}}}), Request(DropField{})}) {
    expect_refused(one->ask(request), one, Code::kUnsupported, "the session does not have the feature fields");
  }
  run(milliseconds(20), {&one});
  EXPECT_FALSE(one->state->field);
}

TEST_F(FieldRefusals, AGuessedHashDoesNotTellWhatAnotherKeyHasSent) {
  start({scene_of(kStill + "[[channel]]\nname = \"liver\"\n[[channel]]\nname = \"peg\"\n")}, {kLiver, kSpy});
  const Engine liver = with_ball(with_key(kLiver));
  FieldEngine::Config config = with_key(kSpy);
  config.hello.claims = {{.device = "left", .channel = "peg", .role = Role::kController}};
  const Engine spy = engine("127.0.0.1:4001", config);
  run(milliseconds(20), {&spy});
  const FieldSender sender({}, ball().lattice, ball().bricks);
  const auto manifest = sender.manifest();
  const std::uint32_t offer = spy->ask(OfferField{.field = sender.field(),
                                                  .size = static_cast<std::uint32_t>(manifest.size()),
                                                  .part = {manifest.begin(), manifest.end()}});
  EXPECT_EQ(answer_to(offer, spy).code, Code::kOk);
  run(milliseconds(100), {&spy, &liver});
  ASSERT_FALSE(spy->statuses.empty());
  for (const FieldStatus& status : spy->statuses) {
    for (std::size_t i = 0; i < ball().bricks.size(); ++i) EXPECT_TRUE(misses(status, i)) << i;
    EXPECT_FALSE(misses(status, kManifestBit));
  }
}

TEST_F(FieldRefusals, TenThousandOffersTakeNoMoreThanThree) {
  const Engine one = engine("127.0.0.1:4000");
  run(milliseconds(20), {&one});
  std::uint32_t asked = 0;
  while (asked < 10'000) {
    OfferField offer{.size = 1000, .part = std::vector<std::byte>(10)};
    offer.field[0] = static_cast<std::byte>(asked % 256);
    offer.field[1] = static_cast<std::byte>(asked / 256);
    asked += one->ask(offer) != 0 ? 1 : 0;
    if (one->session()->next_tick() <= now_ || asked % 16 == 0) run(milliseconds(1), {&one});
  }
  run(milliseconds(100), {&one});
  std::size_t taken = 0;
  for (const auto& [id, answer] : one->answers) {
    taken += answer.code == Code::kOk ? 1 : 0;
    if (answer.code == Code::kOk) continue;
    EXPECT_EQ(answer.code, Code::kBusy);
    EXPECT_NE(answer.detail.find("offers = 4: expected at most 3"), std::string::npos) << answer.detail;
  }
  EXPECT_EQ(one->answers.size(), asked);
  EXPECT_EQ(taken, 3U);
}

TEST_F(FieldRefusals, EachBoundOfAMaterialIsNamed) {
  const Engine one = with_ball();
  std::uint32_t generation = 0;
  const auto refused = [&](const FieldMaterial& material, const std::string& why) {
    expect_refused(one->use(newest(one), ++generation, {material}), one, Code::kInvalid, of_ball(one, why));
  };
  refused({.stiffness = 1501}, "materials[0].stiffness = 1501: expected above 0, and at most 1500 N/m with the branch");
  refused({.stiffness = 1000, .branch_stiffness = 600, .relaxation = 0.2},
          "materials[0].stiffness = 1600: expected above 0, and at most 1500 N/m with the branch");
  refused({.stiffness = 100, .branch_stiffness = 100, .relaxation = 0}, "materials[0].tau = 0: expected 0.01 … 10 s");
  const std::uint32_t id = one->ask(UseField{.generation = ++generation,
                                             .field = newest(one),
                                             .materials = {{.stiffness = 100}},
                                             .fixtures = {{.stiffness = 2000}}});
  expect_refused(id, one, Code::kInvalid,
                 of_ball(one, "fixture.stiffness = 2000: expected above 0, and at most 1500 N/m"));
  run(milliseconds(10), {&one});
  EXPECT_FALSE(one->state->field);
}

TEST_F(FieldRefusals, ACurveAsSteepAsAllowedIsNotRefusedForItsRounding) {
  const Engine one = with_ball();
  constexpr double kMost = 1500;
  std::uint32_t generation = 0;
  int rounded = 0;
  const auto code = [&](const Field& field) {
    return answer_to(one->use(newest(one), ++generation, field.materials, 0, field.tables), one).code;
  };
  Dice dice(2);
  for (std::size_t run = 0; run < 60; ++run) {
    const std::size_t count = 2 + dice.bits() % 15;
    const double step = dice.decades(-3.5, -2.5);
    std::vector<double> depths;
    std::vector<double> forces;
    for (std::size_t i = 0; i < count; ++i) {
      depths.push_back(step * static_cast<double>(i + 1));
      const double slope = i == run % count ? kMost : dice.within(300, 1200);
      forces.push_back((i == 0 ? 0 : forces.back()) + slope * step);
    }
    Field field;
    field.set_curve(0, depths, forces);
    const field::Material law{
        .stiffness = field.materials[0].stiffness,
        .table = field::DepthTable::of(field.tables[0].step, std::span(field.tables[0].force).first(count))};
    rounded += thrown_by([&] { law.expect_valid(kMost); }).empty() ? 0 : 1;
    EXPECT_EQ(code(field), Code::kOk) << "run " << run;
    const std::size_t steepest = run % count;
    field.tables[0].force[steepest] += 1e-6 * forces[steepest];
    EXPECT_EQ(code(field), Code::kInvalid) << "run " << run << ": more than rounding";
  }
  EXPECT_GT(rounded, 15);
  const auto two = [](double stiffness, double branch) {
    return std::vector<FieldMaterial>{{.stiffness = stiffness, .branch_stiffness = branch, .relaxation = 0.2}};
  };
  for (const double branch : {0.1, 700.3}) {
    const double above = (kMost - branch) * (1 + 1e-12);
    ASSERT_GT(above + branch, kMost);
    EXPECT_EQ(answer_to(one->use(newest(one), ++generation, two(above, branch)), one).code, Code::kOk);
    EXPECT_EQ(answer_to(one->use(newest(one), ++generation, two(above * (1 + 1e-7), branch)), one).code,
              Code::kInvalid);
  }
}

TEST_F(FieldRefusals, ATableIsRefusedWithItsMaterialAndItsKnot) {
  const Engine one = with_ball();
  std::uint32_t generation = 0;
  const auto use = [&](std::vector<FieldDepthTable> tables) {
    return one->use(newest(one), ++generation, {{.stiffness = 100}, {.stiffness = 200}}, 0, std::move(tables));
  };
  const auto refused = [&](std::vector<FieldDepthTable> tables, const std::string& why) {
    expect_refused(use(std::move(tables)), one, Code::kInvalid, of_ball(one, why));
  };
  const FieldDepthTable good{.material = 1, .step = 1e-3, .size = 2, .force = {0.5, 1.8}};
  refused({{.material = 1, .step = 1e-3, .size = 3, .force = {0.5, 1.8, 3.2}}},
          "materials[1].table knot 3 = 3.2: expected 1.62 … 3.1 N");
  refused({{.material = 0, .step = 1e-3, .size = 2, .force = {0, -0.1}}},
          "materials[0].table knot 2 = -0.1: expected -0.09 … 1.4 N");
  refused({{.material = 2, .step = 1e-3, .size = 1}}, "tables[0].material = 2: expected below 2");
  refused({good, good}, "tables[1].material = 1: expected a material without another table");
  run(milliseconds(10), {&one});
  EXPECT_FALSE(one->state->field);
  EXPECT_EQ(answer_to(use({good}), one).code, Code::kOk);
  for (const FieldDepthTable& wrong : {FieldDepthTable{.step = 0, .size = 1}, FieldDepthTable{.step = 1e-3, .size = 0},
                                       FieldDepthTable{.step = 1e-3, .size = 1, .force = {std::nan("")}},
                                       FieldDepthTable{.material = 8, .step = 1e-3, .size = 1}}) {
    const std::uint32_t id = use({wrong});
    if (id != 0) {
      EXPECT_NE(answer_to(id, one).code, Code::kOk) << "out of the bounds of the wire";
    }
  }
}

TEST_F(FieldRefusals, WhatTheWireDoesNotAllowNeverArrives) {
  const Engine one = with_ball();
  for (const FieldMaterial& material : {FieldMaterial{.stiffness = std::nan("")}, FieldMaterial{.stiffness = -1},
                                        FieldMaterial{.stiffness = 100, .friction = 2.1},
                                        FieldMaterial{.stiffness = 100, .branch_stiffness = 1, .relaxation = 11}}) {
    const std::uint32_t id = one->use(newest(one), 1, {material});
    if (id != 0) {
      EXPECT_NE(answer_to(id, one).code, Code::kOk);
    }
  }
  run(milliseconds(10), {&one});
  EXPECT_FALSE(one->state->field);
}

TEST_F(FieldRefusals, ABrickOfAnUnknownMaterialIsNamed) {
  FieldShape shape = ball();
  shape.bricks[2].material = 1;
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, shape));
  expect_refused(one->use(newest(one), 1), one, Code::kInvalid,
                 of_ball(one, "bricks[2].material = 1: expected below 1"));
  EXPECT_EQ(answer_to(one->use(newest(one), 1, {{.stiffness = 100}, {.stiffness = 200}}), one).code, Code::kOk);
}

TEST_F(FieldRefusals, OnlyACompleteFieldIsUsedAndGenerationsIncrease) {
  const Engine one = with_ball();
  FieldName other = newest(one);
  other[0] ^= std::byte{1};
  expect_refused(one->use(other, 1), one, Code::kInvalid,
                 "field " + short_name(other) + ": expected a field that was offered");
  const std::uint32_t offer = one->ask(OfferField{.field = other, .size = 1000, .part = std::vector<std::byte>(10)});
  EXPECT_EQ(answer_to(offer, one).code, Code::kOk);
  expect_refused(
      one->use(other, 1), one, Code::kInvalid,
      "field " + short_name(other) + ": expected a field whose bricks have all arrived, found one that is incomplete");
  EXPECT_EQ(answer_to(one->use(newest(one), 5), one).code, Code::kOk);
  expect_refused(one->use(newest(one), 5), one, Code::kInvalid, of_ball(one, "generation = 5: expected above 5"));
  EXPECT_EQ(answer_to(one->use(newest(one), 6), one).code, Code::kOk);
}

TEST_F(FieldRefusals, AChannelMustAllowFieldsAndBeHeld) {
  start({scene_of(kStill + kTwoChannels)});
  const Engine peg = with_ball(claiming("peg"));
  expect_refused(peg->use(newest(peg), 1, {{.stiffness = 100}}, 1), peg, Code::kDenied,
                 "the channel \"peg\" may not use fields: expected it in allow of [field] of the scene");
  expect_refused(peg->use(newest(peg), 1, {{.stiffness = 100}}, 0), peg, Code::kDenied,
                 "only a controller of the channel may use a field");
  EXPECT_EQ(answer_to(peg->ask(GiveLease{.channel = 1}), peg).code, Code::kOk);
  const std::uint64_t denied = assembly_->network().stats().denied;
  peg->move({.channel = 0});
  run(milliseconds(10), {&peg});
  EXPECT_EQ(assembly_->network().stats().denied, denied + 1);
}

TEST_F(FieldRefusals, WhoHasGivenTheLeaseUsesNoField) {
  const Engine one = with_ball();
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  run(milliseconds(10), {&one});
  EXPECT_TRUE(last_.field);
  EXPECT_EQ(answer_to(one->ask(GiveLease{}), one).code, Code::kOk);
  run(milliseconds(10), {&one});
  EXPECT_FALSE(last_.field);
  expect_refused(one->use(newest(one), 2), one, Code::kDenied, "only the holder of the channel may use a field");
}

TEST_F(FieldRefusals, AWildPoseDoesNotMoveTheObject) {
  const Engine one = with_ball();
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  const PeerTime at(now_.time_since_epoch());
  const double nan = std::nan("");
  run(milliseconds(10), {&one});
  notices();
  for (const FieldPose& wild :
       {FieldPose{.time = at, .position = Vec3(nan, 0, 0)}, FieldPose{.time = at, .position = Vec3(11, 0, 0)},
        FieldPose{.time = at, .velocity = Vec3(1e9, 0, 0)}, FieldPose{.time = at, .angular_velocity = Vec3(0, 101, 0)},
        FieldPose{.time = at, .orientation = Quat{.w = 0, .x = 0, .y = 0, .z = 0}}}) {
    one->move(wild);
    run(milliseconds(10), {&one});
  }
  EXPECT_EQ(last_.field->depth, 0);
  EXPECT_EQ(last_.field->proxy, last_.hand.position);
  EXPECT_TRUE(said("expected at most 10 m, 10 m/s and 100 rad/s"));
  EXPECT_GE(least_energy_, -1e-9);
}

/// The ball comes within 10 mm of the hand at 0.1 m/s, and may be extrapolated by 50 ms.
TEST_F(FieldRefusals, APoseAnHourAheadMovesTheObjectByAtMost50Ms) {
  const Engine one = with_ball();
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  one->move({.time = PeerTime((now_ + hours(1)).time_since_epoch()), .velocity = Vec3(0.1, 0, 0)});
  run(milliseconds(300), {&one});
  EXPECT_EQ(last_.field->depth, 0) << "the ball is 5 mm nearer, which is 5 mm away";
  one->move({.time = PeerTime((now_ + hours(1)).time_since_epoch()), .velocity = Vec3(0.3, 0, 0)});
  run(milliseconds(300), {&one});
  EXPECT_GT(last_.field->proxy.x(), -0.02);
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldRefusals, MoreThan250PosesPerSecondAreNotUsed) {
  const Engine one = with_ball();
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  notices();
  run(seconds(1), {&one}, [&] { one->move({.time = PeerTime(now_.time_since_epoch())}); });
  EXPECT_TRUE(said("refused from \"engine\": expected at most 250 poses per second"));
  notices();
  int number = 0;
  run(seconds(1), {&one}, [&] {
    if (++number % 4 == 0) one->move({.time = PeerTime(now_.time_since_epoch())});
  });
  EXPECT_FALSE(said("poses per second"));
}

}  // namespace
}  // namespace tendon::field_refusals_test
