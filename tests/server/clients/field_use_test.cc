// SPDX-License-Identifier: Apache-2.0
#include <cmath>
#include <string>
#include <vector>

#include "core/field/renderer.h"
#include "tests/server/clients/field_server.h"

namespace tendon::field_use_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

/// The hand rests for 3 s, and then presses 8 mm into the wall at x = 4 mm.
const std::string kPress =
    "[device.hand.motion]\nkind = \"minimum-jerk\"\npoints_mm = [[0, 0, 0], [0, 0, 0], [12, 0, 0], [0, 0, 0]]\n"
    "durations_ms = [3000, 400, 400]\n[field]\n";
const std::string kStir = "[device.hand.motion]\nkind = \"sine\"\namplitude_mm = 12\nfrequency_hz = 1\n[field]\n";

/// A plane at x = 4 mm, and the solid behind it, in bricks of 2 mm.
FieldShape wall() {
  return shape_of([](const Vec3& x) { return 0.004 - x.x(); }, Vec3(-0.024, -0.024, -0.024), 3, 2e-3);
}
FieldShape ball(double x = 0.028) {
  return shape_of(sphere_at(Vec3(x, 0, 0), 0.02), Vec3(-0.01, -0.032, -0.032), 4, 2e-3);
}

using FieldUse = FieldServer;

struct Pressed {
  bool used = false;
  std::vector<Vec3> wanted;  ///< from 3 s on
  std::vector<Vec3> hand;
  double worst_difference = 0;  ///< N, to a renderer that has the field from the start
};

TEST_F(FieldUse, AWallUploadedOver200MsRendersAsWithoutDelay) {
  const FieldShape shape = wall();
  const auto press = [&](Duration way) {
    Pressed pressed;
    now_ = LocalTime(seconds(1000));
    start({scene_of(kPress)});
    way_ = way;
    const LocalTime begin = now_;
    field::BrickField bricks = shape.built();
    const field::Field direct{.bricks = &bricks, .materials = {{.stiffness = 500}}};
    field::Renderer renderer({});
    bool renders = false;
    watch_ = [&](const StepRecord& record) {
      if (record.field && !renders) renderer.use(&direct, record.hand.at);
      renders = record.field.has_value();
      if (renders) {
        const auto rendered = renderer.render(record.hand, record.energy, record.tick);
        pressed.worst_difference = std::max(pressed.worst_difference, (rendered.force - record.wanted).norm());
      }
      if (now_ - begin < seconds(3)) return;
      pressed.wanted.push_back(record.wanted);
      pressed.hand.push_back(record.hand.position);
    };
    const Engine one = engine("127.0.0.1:4000");
    EXPECT_TRUE(upload(one, shape));
    EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
    run(begin + milliseconds(3900) - now_, {&one});
    EXPECT_TRUE(one->state && one->state->field);
    pressed.used = one->state && one->state->field && one->state->field->generation == 1;
    EXPECT_GE(least_energy_, -1e-9);
    watch_ = {};
    return pressed;
  };
  const Pressed near = press({});
  const Pressed far = press(milliseconds(100));
  EXPECT_TRUE(near.used && far.used);
  EXPECT_EQ(near.worst_difference, 0);
  EXPECT_EQ(far.worst_difference, 0);
  ASSERT_EQ(near.wanted.size(), far.wanted.size());
  double force = 0;
  double error = 0;
  for (std::size_t i = 0; i < near.wanted.size(); ++i) {
    EXPECT_EQ(near.wanted[i], far.wanted[i]) << i;
    const double expected = -500 * std::max(near.hand[i].x() - 0.004, 0.0);
    force = std::max(force, std::abs(expected));
    error = std::max(error, std::abs(near.wanted[i].x() - expected));
  }
  EXPECT_GT(force, 0.5);
  EXPECT_LT(error, 0.02 * force);
}

TEST_F(FieldUse, AnUploadSurvivesLossReorderingAndDuplicates) {
  start({scene_of(kStir)});
  way_ = milliseconds(40);
  jitter_ms_ = 30;
  loss_ = 0.05;
  duplicates_ = 0.05;
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  double deepest = 0;
  run(seconds(2), {&one}, [&] {
    if (one->state && one->state->field) deepest = std::max(deepest, one->state->field->depth);
  });
  EXPECT_GT(deepest, 1e-3);
  EXPECT_GE(least_energy_, -1e-9);
  EXPECT_EQ(assembly_->network().stats().denied, 0U);
}

TEST_F(FieldUse, PrimitivesNeedNoBrick) {
  start({scene_of(kStir)});
  way_ = milliseconds(100);
  const Engine one = engine("127.0.0.1:4000");
  FieldShape shape;
  shape.primitives.push_back({.shape = field::Sphere{.centre = Vec3(0.028, 0, 0), .radius = 0.02}});
  ASSERT_TRUE(upload(one, shape));
  EXPECT_EQ(one->uploads.back().sent(), 0U);
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  double deepest = 0;
  run(seconds(1), {&one}, [&] { deepest = std::max(deepest, last_.field->depth); });
  EXPECT_GT(deepest, 1e-3);
}

TEST_F(FieldUse, ARestartedEngineSendsNothing) {
  start({scene_of(kStir)});
  Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_GE(one->uploads.back().sent(), ball().bricks.size());
  const Engine again = engine("127.0.0.1:4000");  // as after SIGKILL
  ASSERT_TRUE(upload(again, ball()));
  EXPECT_EQ(again->uploads.back().sent(), 0U);
  EXPECT_EQ(answer_to(again->use(newest(again), 1), again).code, Code::kOk);
  run(milliseconds(50), {&again});
  ASSERT_TRUE(again->state->field);
  EXPECT_EQ(again->state->field->generation, 1U);
}

TEST_F(FieldUse, ACutSendsItsBricksOnly) {
  start({scene_of(kStir)});
  const FieldShape whole = ball();
  FieldShape cut = whole;
  cut.bricks[3].bytes[100] ^= std::byte{1};
  cut.bricks[7].bytes[100] ^= std::byte{1};
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, whole));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  ASSERT_TRUE(upload(one, cut));
  EXPECT_EQ(one->uploads.back().sent(), 2U);
  EXPECT_EQ(answer_to(one->use(newest(one), 2), one).code, Code::kOk);
  run(milliseconds(50), {&one});
  EXPECT_EQ(one->state->field->generation, 2U);
}

const std::string kTwoChannels = "[[channel]]\nname = \"liver\"\n[[channel]]\nname = \"peg\"\n";
const ClientKey kLiver{.name = "liver", .role = Role::kController, .key = Ratchet(1).next()};
const ClientKey kPeg{.name = "peg", .role = Role::kController, .key = Ratchet(2).next()};

/// A field of 1000 different bricks.
FieldShape big(std::uint8_t first) {
  FieldShape shape{.lattice = {.bricks = {10, 10, 10}}, .bricks = std::vector<FieldSender::Brick>(1000)};
  for (std::size_t i = 0; i < 1000; ++i) {
    const auto n = static_cast<std::int32_t>(i);
    shape.bricks[i].place = {n % 10, n / 10 % 10, n / 100};
    shape.bricks[i].bytes[0] = static_cast<std::byte>(first);
    put_little_endian(static_cast<std::uint16_t>(i), &shape.bricks[i].bytes[2]);
  }
  return shape;
}

TEST_F(FieldUse, TwoEnginesShareBricksNotQuotas) {
  start({scene_of(kStir + "cache_mb = 4\n" + kTwoChannels)}, {kLiver, kPeg});
  FieldEngine::Config of_peg = with_key(kPeg);
  of_peg.hello.claims = {{.device = "left", .channel = "peg", .role = Role::kController}};
  const Engine liver = engine("127.0.0.1:4000", with_key(kLiver));
  const Engine peg = engine("127.0.0.1:4001", of_peg);
  const FieldShape shape = ball();
  ASSERT_TRUE(upload(liver, shape));
  ASSERT_TRUE(upload(peg, shape));
  EXPECT_GE(peg->uploads.back().sent(), shape.bricks.size()) << "a key does not learn what another one has sent";

  // Half of the cache is 1953 bricks.
  const auto offer = [this](const Engine& one, std::uint8_t first) {
    const FieldShape more = big(first);
    FieldSender sender({}, more.lattice, more.bricks);
    FieldEngine::Answer last;
    for (auto part = sender.next_part(now_); part; part = sender.next_part(now_)) {
      last = answer_to(one->ask(*part), one);
      if (last.code != Code::kOk) break;
      sender.part_sent();
    }
    return last;
  };
  EXPECT_EQ(offer(liver, 1).code, Code::kOk);
  const auto refused = offer(liver, 2);
  EXPECT_EQ(refused.code, Code::kBusy);
  EXPECT_NE(refused.detail.find("expected at most 1953 of all fields of a client"), std::string::npos)
      << refused.detail;
  EXPECT_EQ(offer(peg, 2).code, Code::kOk);

  EXPECT_EQ(answer_to(liver->use(newest(liver), 1), liver).code, Code::kOk);
  EXPECT_EQ(answer_to(peg->use(newest(peg), 7, {{.stiffness = 100}}, 1), peg).code, Code::kOk);
  run(seconds(1), {&liver, &peg});
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, LargeFieldsAreNotBuiltTooOften) {
  start({scene_of(kStir + kTwoChannels)});
  FieldEngine::Config both = claiming("liver");
  both.hello.claims.push_back({.device = "left", .channel = "peg", .role = Role::kController});
  const Engine one = engine("127.0.0.1:4000", both);
  for (std::uint8_t first = 1; first <= 3; ++first) ASSERT_TRUE(upload(one, big(first)));
  std::vector<std::uint32_t> asked;
  for (const std::uint32_t channel : {0U, 1U}) {
    for (std::uint32_t i = 0; i < 3; ++i) {
      asked.push_back(one->use(one->uploads[i].field(), i + 1, {{.stiffness = 100}}, channel));
    }
  }
  run(milliseconds(10), {&one});
  int busy = 0;
  for (const std::uint32_t id : asked) {
    const auto* const answer = one->answer(id);
    ASSERT_NE(answer, nullptr);
    if (answer->code == Code::kOk) continue;
    ++busy;
    EXPECT_EQ(answer->code, Code::kBusy);
    EXPECT_NE(answer->detail.find("expected at most 10000 new bricks per second"), std::string::npos);
  }
  EXPECT_GT(busy, 0);
  EXPECT_LT(busy, 4) << "there is a slot for each of three";
  run(milliseconds(300), {&one});
  EXPECT_EQ(answer_to(one->use(one->uploads[2].field(), 4, {{.stiffness = 100}}, 1), one).code, Code::kOk);
}

TEST_F(FieldUse, ADroppedFieldStopsAndItsForceFades) {
  start({scene_of(kStir)});
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  run(seconds(2), {&one});
  for (int i = 0; i < 1000 && last_.wanted.norm() < 0.5; ++i) run(milliseconds(1), {&one});
  const double before = last_.wanted.norm();
  EXPECT_GE(before, 0.5);
  const std::uint32_t id = one->ask(DropField{.field = newest(one)});
  double jump = 0;
  Vec3 wanted = last_.wanted;
  run(milliseconds(500), {&one},
      [&] { jump = std::max(jump, (last_.wanted - std::exchange(wanted, last_.wanted)).norm()); });
  EXPECT_EQ(one->answer(id)->code, Code::kOk);
  EXPECT_LT(jump, 0.25);
  EXPECT_FALSE(last_.field);
  EXPECT_EQ(last_.wanted.norm(), 0);
  EXPECT_FALSE(one->state->field);
  EXPECT_EQ(answer_to(one->ask(DropField{.field = newest(one)}), one).code, Code::kInvalid);
  EXPECT_EQ(answer_to(one->use(newest(one), 2), one).code, Code::kInvalid);
}

TEST_F(FieldUse, AnEngineThatDiesLeavesNoForce) {
  start({scene_of(kStir)});
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  run(milliseconds(500), {&one});
  EXPECT_TRUE(last_.field);
  run(milliseconds(2500), {});  // controller_timeout is 2 s
  EXPECT_FALSE(last_.field);
  EXPECT_EQ(last_.wanted.norm(), 0);
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, WhoTakesTheLeaseStopsTheField) {
  start({scene_of(kStir + "[[channel]]\nname = \"ball\"\nlease_ms = 100\n")});
  const Engine first = engine("127.0.0.1:4000", claiming("ball"));
  ASSERT_TRUE(upload(first, ball()));
  EXPECT_EQ(answer_to(first->use(newest(first), 9), first).code, Code::kOk);
  run(milliseconds(100), {&first});
  EXPECT_EQ(last_.field->generation, 9U);
  const Engine second = engine("127.0.0.1:4001", claiming("ball"));
  run(milliseconds(100), {&first, &second});
  ASSERT_EQ(answer_to(second->ask(TakeLease{}), second).code, Code::kOk);
  run(milliseconds(10), {&first, &second});
  EXPECT_FALSE(last_.field);
  first->move({.time = PeerTime(now_.time_since_epoch()), .position = Vec3(1, 0, 0)});
  ASSERT_TRUE(upload(second, ball()));
  EXPECT_EQ(answer_to(second->use(newest(second), 1), second).code, Code::kOk) << "with its own generations";
  double deepest = 0;
  run(seconds(1), {&first, &second}, [&] { deepest = std::max(deepest, last_.field ? last_.field->depth : 0); });
  EXPECT_GT(deepest, 1e-3) << "where the first engine has moved the ball does not matter";
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, AFieldStopsAlsoIfTheReleaseOfItsEngineIsLost) {
  start({scene_of(kStir)});
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  run(milliseconds(100), {&one});
  ASSERT_TRUE(last_.field);
  after_haptics_ = [&] {  // the release does not fit into the queue
    while (mail().orders.try_push({.kind = HapticOrder::Kind::kDisengage})) {
    }
  };
  EXPECT_EQ(answer_to(one->ask(GiveLease{}), one).code, Code::kOk);
  after_haptics_ = {};
  run(milliseconds(20), {&one});
  EXPECT_FALSE(last_.field);
}

TEST_F(FieldUse, ASwapInEveryStepIsPassive) {
  start({scene_of(kStir + "max_stiffness_n_per_m = 3000\n")});
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball(0.028)));
  ASSERT_TRUE(upload(one, ball(0.026)));
  std::uint32_t generation = 0;
  std::uint32_t newest_seen = 0;
  run(seconds(2), {&one}, [&] {
    const FieldName& field = one->uploads[generation % 2].field();
    if (one->use(field, generation + 1, {{.stiffness = generation % 3 == 0 ? 3000.0 : 300.0}}) != 0) ++generation;
    if (one->state->field) newest_seen = std::max(newest_seen, one->state->field->generation);
  });
  EXPECT_GT(generation, 900U);
  EXPECT_GT(newest_seen, generation - 10);
  for (const auto& [id, answer] : one->answers) EXPECT_EQ(answer.code, Code::kOk) << answer.detail;
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, APoseMovesTheObjectAlsoIfItArrivesBeforeItsField) {
  start({scene_of(kStir)});
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  const auto pose = [&](double x) {
    return FieldPose{.time = PeerTime(now_.time_since_epoch()), .position = Vec3(x, 0, 0)};
  };
  one->move(pose(0.1));
  run(milliseconds(20), {&one});
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  run(seconds(1), {&one});
  EXPECT_EQ(last_.wanted.norm(), 0) << "the ball is 100 mm away";
  one->move(pose(0));
  double most = 0;
  run(seconds(2), {&one}, [&] { most = std::max(most, last_.wanted.norm()); });
  EXPECT_GT(most, 0.3);
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, ATableAndTrueForcesCorrectTheNextSteps) {
  start({scene_of(kStir)});
  way_ = milliseconds(100);
  const Engine one = engine("127.0.0.1:4000");
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(answer_to(one->use(newest(one), 1), one).code, Code::kOk);
  const auto ratio = [&] {  // of the force to that of 500 N/m
    double sum = 0;
    double expected = 0;
    run(seconds(1), {&one}, [&] {
      if (!last_.field || last_.field->depth < 4e-4) return;
      sum += last_.wanted.norm();
      expected += 500 * last_.field->depth;
    });
    return sum / expected;
  };
  EXPECT_NEAR(ratio(), 1, 0.01);
  FieldDepthTable table{.step = 1e-3, .size = 16};
  for (std::size_t i = 0; i < table.size; ++i) table.force[i] = 0.3 * static_cast<double>(i + 1);
  EXPECT_EQ(answer_to(one->use(newest(one), 2, {{.stiffness = 500}}, 0, {table}), one).code, Code::kOk);
  run(milliseconds(300), {&one});
  EXPECT_NEAR(ratio(), 1.6, 0.01) << "the table adds 300 N/m";
  EXPECT_EQ(answer_to(one->use(newest(one), 3), one).code, Code::kOk);
  run(milliseconds(300), {&one});
  EXPECT_NEAR(ratio(), 1, 0.01);
  std::uint64_t told = 0;
  for (int i = 0; i < 600; ++i) {
    run(milliseconds(10), {&one});
    const auto& field = one->state->field;
    if (!field || field->depth < 3e-4 || one->state->tick == std::exchange(told, one->state->tick)) continue;
    one->tell((field->proxy - one->state->position) * 800, field->generation);
  }
  EXPECT_NEAR(ratio(), 1.6, 0.1) << "the object has 800 N/m";
  EXPECT_GE(least_energy_, -1e-9);
}

TEST_F(FieldUse, EachNetworkThreadHasItsOwnStore) {
  std::vector<Scene> scenes(32, device_named("d"));
  for (std::size_t i = 0; i < scenes.size(); ++i) scenes[i].name = "d-" + std::to_string(i);
  scenes[20] = scene_of(kStir, "ball");
  start(scenes, {}, 2);
  const Engine one = engine("127.0.0.1:4000", claiming("main", "ball"));
  ASSERT_TRUE(upload(one, ball()));
  EXPECT_EQ(one->welcome->features, (std::vector<std::string>{"channels", "fields"}));
  EXPECT_EQ(answer_to(one->ask(UseField{
                          .device = 4, .generation = 1, .field = newest(one), .materials = {{.stiffness = 500}}}),
                      one)
                .code,
            Code::kOk);
  run(milliseconds(50), {&one});
  EXPECT_TRUE(one->state->field);
  const Engine other = engine("127.0.0.1:4001", claiming("main", "d-3"));
  run(milliseconds(50), {&other});
  EXPECT_EQ(other->welcome->features, std::vector<std::string>{"channels"});
}

}  // namespace
}  // namespace tendon::field_use_test
