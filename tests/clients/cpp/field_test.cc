// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "clients/cpp/force_client.h"
#include "tests/clients/cpp/a_and_z.h"
#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::field_client_test {
namespace {

using a_and_z::kFineWeather;
using a_and_z::Weather;
using a_and_z::World;
using std::chrono::milliseconds;
using std::chrono::seconds;

Field ball(double radius = 0.02) {
  const auto distance = [radius](const Vec3& x) { return x.norm() - radius; };
  return Field::from(distance, Vec3::Constant(-0.03), Vec3::Constant(0.03), {.spacing = 2e-3});
}

Touch truth_of(const DeviceState& hand) {
  Touch touch = Touch::truth(a_and_z::answer(hand));
  touch.stiffness = Mat3::Identity();
  return touch;
}

class FieldClient : public ::testing::Test {
 protected:
  explicit FieldClient(Weather weather = kFineWeather) : world_(1, weather) {
    world_.z->bricks.emplace(BrickStore::Config{});
    world_.z->fields.emplace(FieldReceiver::Config{}, *world_.z->bricks);
    world_.connect({.rate_hz = 100, .fields = true}, truth_of);
  }
  template <class Wanted>
  std::vector<Wanted> requests() const {
    std::vector<Wanted> found;
    for (const Request& request : world_.z->requests) {
      if (const auto* one = std::get_if<Wanted>(&request)) found.push_back(*one);
    }
    return found;
  }
  ForceClient& client() { return *world_.a; }

  World world_;
};

class FieldClientWithLoss : public FieldClient {
 protected:
  FieldClientWithLoss() : FieldClient({.loss = 0.1, .delay = milliseconds(50), .jitter = milliseconds(5)}) {}
};

TEST_F(FieldClientWithLoss, AFieldIsUploadedAndUsedThoughDatagramsAreLost) {
  Field field = ball();
  field.materials = {{.stiffness = 700, .friction = 0.5}};
  field.primitives = {{.shape = field::Plane{.at = {0, 0, -0.02}}}};
  field.tables = {{.step = 1e-3, .size = 2, .force = {0, 0.25}}};
  const std::size_t bricks = field.bricks.size();
  EXPECT_GT(bricks, 20U);
  EXPECT_TRUE(client().use(field));
  world_.run(seconds(4));
  const auto& progress = client().field();
  EXPECT_TRUE(progress.current) << progress.refused;
  EXPECT_EQ(progress.generation, 1U);
  EXPECT_GE(progress.bricks_sent, bricks);
  EXPECT_LE(progress.bricks_sent, bricks * 3 / 2);
  EXPECT_EQ(world_.z->refused_fields.size(), 0U);
  const auto used = requests<UseField>();
  ASSERT_EQ(used.size(), 1U);
  EXPECT_EQ(used[0].materials.at(0).stiffness, 700);
  EXPECT_EQ(used[0].tables.at(0).force[1], 0.25);
  const auto manifest = world_.z->fields->ready(used[0].field);
  ASSERT_TRUE(manifest);
  EXPECT_EQ(manifest->primitives(), 1U);
  ASSERT_EQ(manifest->bricks(), bricks);
  for (std::size_t i = 0; i < bricks; ++i) {
    EXPECT_EQ(*world_.z->fields->brick(manifest->hash(i)), field.bricks[i].bytes) << i;
  }
}

TEST_F(FieldClient, ATruthIsOnlySentForAFieldInUseAndWithoutAModel) {
  world_.run(seconds(1));
  EXPECT_EQ(world_.z->forces.size(), 0U);
  client().use(ball());
  world_.run(seconds(1));
  ASSERT_GT(world_.z->forces.size(), 50U);
  for (const auto& [at, force] : world_.z->forces) {
    EXPECT_EQ(force.field, 1U);
    EXPECT_FALSE(force.model);
    EXPECT_EQ(force.force, -100 * a_and_z::Server::position(force.based_on_tick));
  }
}

TEST_F(FieldClient, APoseIsOnTheClockOfTheServerAndCounted) {
  EXPECT_FALSE(client().pose(world_.now, {}));
  client().use(ball());
  world_.run(seconds(1));
  const LocalTime at = world_.now + milliseconds(5);
  EXPECT_TRUE(client().pose(at, {.position = {0.1, 0, 0}, .velocity = {0, 1, 0}}));
  world_.run(milliseconds(20));
  EXPECT_TRUE(client().pose(at, {.position = {0.2, 0, 0}}));
  world_.run(milliseconds(20));
  const auto& poses = world_.z->poses;
  ASSERT_EQ(poses.size(), 2U);
  EXPECT_NEAR(static_cast<double>((poses[0].time.time_since_epoch() - at.time_since_epoch()).count()), 0, 1e5);
  EXPECT_EQ(poses[0].position, Vec3(0.1, 0, 0));
  EXPECT_EQ(poses[0].velocity, Vec3(0, 1, 0));
  EXPECT_EQ(poses[1].sequence, 2U);
}

TEST_F(FieldClient, APoseIsSentBeforeItsFieldIsInUse) {
  world_.run(seconds(1));
  EXPECT_EQ(client().field().generation, 0U);
  EXPECT_TRUE(client().pose(world_.now, {.position = {0.1, 0, 0}}));
  world_.run(milliseconds(20));
  ASSERT_EQ(world_.z->poses.size(), 1U);
  EXPECT_EQ(world_.z->poses[0].position, Vec3(0.1, 0, 0));
}

TEST_F(FieldClient, AnotherFieldReplacesTheFirstWhichIsDroppedAfterwards) {
  client().use(ball());
  world_.run(seconds(1));
  client().use(ball(0.021));
  EXPECT_FALSE(client().field().current);
  EXPECT_EQ(client().field().generation, 1U);
  world_.run(seconds(1));
  EXPECT_EQ(client().field().generation, 2U);
  const auto used = requests<UseField>();
  ASSERT_EQ(used.size(), 2U);
  const auto dropped = requests<DropField>();
  ASSERT_EQ(dropped.size(), 1U);
  EXPECT_EQ(dropped[0].field, used[0].field);
  EXPECT_EQ(world_.z->fields->offers(), 1U);
  client().stop_using();
  world_.run(seconds(1));
  EXPECT_EQ(client().field().generation, 0U);
  EXPECT_EQ(world_.z->fields->offers(), 0U);
}

TEST_F(FieldClient, ManyFieldsInTurnNeverTakeMoreThanThreeOffers) {
  for (int i = 0; i < 20; ++i) {
    client().use(ball(0.02 + 1e-4 * i));
    world_.run(milliseconds(30 * i));
  }
  world_.run(seconds(3));
  EXPECT_TRUE(client().field().current) << client().field().refused;
  EXPECT_EQ(world_.z->fields->offers(), 1U);
}

TEST_F(FieldClient, ANewSessionUsesTheFieldAgainAndSendsNoBricks) {
  client().use(ball());
  world_.run(seconds(1));
  const std::uint64_t sent = client().field().bricks_sent;
  world_.z->say_bye(world_.now, Code::kShutdown);
  world_.run(milliseconds(20));
  EXPECT_EQ(client().field().generation, 0U);
  world_.run(seconds(2));
  EXPECT_EQ(world_.z->welcomes, 2);
  EXPECT_TRUE(client().field().current);
  EXPECT_EQ(requests<UseField>().size(), 2U);
  EXPECT_EQ(client().field().bricks_sent, sent);
}

TEST_F(FieldClient, AFieldThatCannotWorkIsRefusedBeforeItIsSent) {
  const auto refusal = [this](auto change) {
    Field field = ball();
    change(field);
    return thrown_by([&] { client().use(field); });
  };
  const auto expect = [&](const std::string& begin, auto change) {
    const std::string said = refusal(change);
    EXPECT_TRUE(said.starts_with(begin)) << said;
  };
  expect("materials: expected", [](Field& f) { f.materials.clear(); });
  expect("materials: expected", [](Field& f) { f.materials.resize(9, {.stiffness = 1}); });
  expect("materials.friction: expected", [](Field& f) { f.materials[0].friction = 3; });
  expect("fixtures.stiffness_npm: expected", [](Field& f) { f.fixtures.emplace_back(); });
  expect("tables: expected", [](Field& f) { f.tables.resize(4, {.step = 1e-3, .size = 1}); });
  expect("tables.force_n: expected", [](Field& f) { f.tables = {{.step = 1e-3}}; });
  expect("tables[0].material = 1: expected below 1",
         [](Field& f) { f.tables = {{.material = 1, .step = 1e-3, .size = 1}}; });
  expect("bricks[4].material = 1: expected below 1", [](Field& f) { f.bricks[4].material = 1; });
  expect("primitives[0]: sphere.radius = 0", [](Field& f) { f.primitives = {{.shape = field::Sphere{}}}; });
  expect("bricks[0].place.x = 9: expected", [](Field& f) { f.bricks[0].place[0] = 9; });
  const auto flat = [](const Vec3& x) { return x.z(); };
  const auto from = [&](double spacing) {
    return thrown_by([&] { Field::from(flat, {-0.9, -0.9, -0.01}, {0.9, 0.9, 0.01}, {.spacing = spacing}); });
  };
  EXPECT_TRUE(from(2e-4).starts_with("spacing = 2e-04: expected")) << from(2e-4);
  EXPECT_TRUE(from(6e-3).starts_with("bricks = 1024: expected at most 1023")) << from(6e-3);
}

double force_at(const Field& field, double depth) {
  const FieldDepthTable& table = field.tables.at(0);
  const auto corrections = field::DepthTable::of(table.step, std::span(table.force).first(table.size));
  return field::Material{.stiffness = field.materials[0].stiffness, .table = corrections}.force(depth, 0);
}

TEST(FieldCurve, AMeasuredCurveIsMetBetweenItsPointsAndMayBeUsed) {
  Dice dice(1);
  for (int run = 0; run < 500; ++run) {
    const std::size_t count = 1 + dice.bits() % 40;
    const bool even = dice.chance(0.5);
    const double step = dice.decades(-3.5, -2.5);
    std::vector<double> depths;
    std::vector<double> forces;
    for (std::size_t i = 0; i < count; ++i) {
      depths.push_back((i == 0 ? 0 : depths.back()) + step * (even ? 1 : dice.within(0.5, 2)));
      forces.push_back((i == 0 ? 0 : forces.back()) + dice.decades(-2, 0.5));
    }
    Field field;
    field.set_curve(0, depths, forces);
    const FieldDepthTable& table = field.tables.at(0);
    const field::Material law{.stiffness = field.materials[0].stiffness,
                              .table = field::DepthTable::of(table.step, std::span(table.force).first(table.size))};
    EXPECT_NO_THROW(law.expect_valid(1e6));
    EXPECT_LE(table.size, 16U);
    for (std::size_t i = 0; even && count <= 16 && i < count; ++i) {
      EXPECT_NEAR(force_at(field, depths[i]), forces[i], 1e-9 * forces[i]) << "run " << run << ", point " << i;
    }
    EXPECT_NEAR(force_at(field, depths.back()), forces.back(), 1e-9 * forces.back()) << "run " << run;
  }
}

TEST(FieldCurve, ASecondCurveReplacesTheFirstAndAWrongOneIsRefused) {
  Field field;
  field.set_curve(0, std::vector{1e-3, 2e-3}, std::vector{1.0, 3.0});
  field.set_curve(0, std::vector{1e-3, 2e-3}, std::vector{0.5, 1.5});
  EXPECT_EQ(field.tables.size(), 1U);
  EXPECT_NEAR(force_at(field, 2e-3), 1.5, 1e-12);
  const auto said = [&](std::uint32_t material, std::vector<double> depths, std::vector<double> forces) {
    return thrown_by([&] { field.set_curve(material, depths, forces); });
  };
  EXPECT_EQ(said(0, {}, {}), "forces: expected as many as depths, which are 0, and at least 1");
  EXPECT_EQ(said(0, {1e-3, 1e-3}, {1, 2}), "depths[1] = 0.001: expected above 0.001 m");
  EXPECT_EQ(said(0, {1e-3, 2e-3}, {1, 1}), "forces[1] = 1: expected above 1 N");
  EXPECT_EQ(said(1, {1e-3}, {1}), "material = 1: expected below 1");
  EXPECT_EQ(said(0, {0.2}, {1}), "depths = 0.2: expected at most 0.1 m");
}

TEST(FieldClientWithoutFields, DoesNotUploadAnything) {
  World world(1, kFineWeather);
  world.connect({.rate_hz = 100}, truth_of);
  EXPECT_FALSE(world.a->use(ball()));
  world.run(seconds(1));
  EXPECT_EQ(world.z->requests.size(), 0U);
  EXPECT_EQ(std::ranges::count(world.z->hellos.front().features, "fields"), 0);

  World old(1, kFineWeather);
  old.z->features = false;
  old.connect({.rate_hz = 100, .fields = true}, truth_of);
  EXPECT_TRUE(old.a->use(ball()));
  old.run(seconds(1));
  EXPECT_EQ(old.z->requests.size(), 0U);
}

}  // namespace
}  // namespace tendon::field_client_test
