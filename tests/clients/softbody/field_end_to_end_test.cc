// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdint>
#include <iostream>
#include <string>

#include "clients/softbody/placed_body.h"
#include "core/base/bytes.h"
#include "core/field/brick_field.h"
#include "tests/clients/softbody/scene_text.h"
#include "tests/support/refusal.h"
#include "tests/tools/worlds/pressed_wall.h"

namespace tendon::softbody::field_end_to_end_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using testing::kGood;
using testing::with;

Scene scene_with(const std::string& field, const std::string& text = kGood) {
  return parse_scene(text + field, "s.toml", ".");
}
std::string refusal(const std::string& field, const std::string& text = kGood) {
  return thrown_by<SceneError>([&] { scene_with(field, text); });
}

TEST(SoftbodyField, ItsKeysArriveAndHaveDefaults) {
  EXPECT_FALSE(scene_with("").field);
  const Scene::Upload few = *scene_with("[field]\nstiffness_n_per_m = 420\n").field;
  EXPECT_EQ(few.stiffness, 420);
  EXPECT_EQ(few.spacing, 2e-3);
  EXPECT_EQ(few.friction, 0);
  EXPECT_FALSE(few.relaxation || few.branch_stiffness);
  const Scene::Upload all = *scene_with(
                                 "[field]\nstiffness_n_per_m = 420\nspacing_mm = 4\nfriction = 0.3\nrelax_s = 0.5\n"
                                 "branch_n_per_m = 80\n")
                                 .field;
  EXPECT_EQ(all.spacing, 4e-3);
  EXPECT_EQ(all.friction, 0.3);
  EXPECT_EQ(all.relaxation, 0.5);
  EXPECT_EQ(all.branch_stiffness, 80);
}

TEST(SoftbodyField, WhatCannotBeAFieldIsRefusedWithItsKey) {
  EXPECT_NE(refusal("[field]\n").find("field.stiffness_n_per_m: missing"), std::string::npos);
  EXPECT_NE(refusal("[field]\nstiffness_n_per_m = 0\n").find("field.stiffness_n_per_m"), std::string::npos);
  const std::string field = "[field]\nstiffness_n_per_m = 420\n";
  EXPECT_NE(refusal(field + "spacing_mm = 9\n").find("field.spacing_mm"), std::string::npos);
  EXPECT_NE(refusal(field + "friction = 3\n").find("field.friction"), std::string::npos);
  EXPECT_NE(refusal(field + "branch_n_per_m = 9\n").find("field.branch_n_per_m: expected relax_s"), std::string::npos);
  EXPECT_NE(refusal(field + "spacing = 2\n").find("unknown key"), std::string::npos);
  EXPECT_NE(refusal(field, with("[touch]\n", "[touch]\nside = \"bilateral\"\n")).find("field: expected a unilateral"),
            std::string::npos);
  EXPECT_NE(refusal(field, with("[touch]\n", "[touch]\ntool_offset_mm = [0, 1, 0]\n")).find("without tool_offset_mm"),
            std::string::npos);
  const std::string cut =
      testing::listing("linear", R"(["contact", "cutting"])", std::string(testing::kCut) + "above_n = 1\n");
  EXPECT_NE(refusal(field, cut).find("field: expected a body without cutting"), std::string::npos);
}

/// m, negative inside the field
double distance(const Field& field, const Vec3& x) {
  field::BrickField bricks;
  bricks.reset(field.lattice);
  for (const FieldSender::Brick& brick : field.bricks) {
    field::BrickField::Place place{};
    std::ranges::transform(brick.place, place.begin(), [](auto along) { return static_cast<std::uint16_t>(along); });
    field::BrickField::Weights weights{};
    for (std::size_t i = 0; i < weights.size(); ++i) {
      weights[i] = static_cast<std::int16_t>(get_little_endian<std::uint16_t>(&brick.bytes[2 * i]));
    }
    bricks.put(place, weights, brick.material);
  }
  bricks.finish();
  return bricks.at(x).distance;
}

TEST(SoftbodyField, ItIsTheSurfaceInTheFrameOfTheDevice) {
  // The block fills x = 10 … 60 mm, |y| < 50 mm and |z| < 50 mm.
  for (const char* element : {"hex8-sri", "tet4", "hex20"}) {
    for (const double radius : {0.0, 0.01}) {
      const std::string tool = "tool_radius_mm = " + std::to_string(1e3 * radius) + "\npatch_radius_mm";
      std::string text = with("patch_radius_mm", tool);
      text.replace(text.find("hex8-sri"), 8, element);
      const Scene scene = scene_with("[field]\nstiffness_n_per_m = 420\nspacing_mm = 4\n", text);
      const Field field = PlacedBody(scene).field(*scene.field);
      EXPECT_EQ(field.materials.at(0).stiffness, 420);
      for (const double depth : {-0.003, 0.003}) {
        EXPECT_NEAR(distance(field, Vec3(0.01 - radius + depth, 0.005, 0.003)), -depth, 2e-4) << element;
        EXPECT_NEAR(distance(field, Vec3(0.06 + radius - depth, 0.005, 0.003)), -depth, 2e-4) << element;
        EXPECT_NEAR(distance(field, Vec3(0.03, 0.05 + radius - depth, 0.003)), -depth, 2e-4) << element;
        EXPECT_NEAR(distance(field, Vec3(0.03, 0.005, -0.05 - radius + depth)), -depth, 2e-4) << element;
      }
    }
  }
}

TEST(SoftbodyField, ASpacingWithTooManyBricksIsRefusedWithItsKey) {
  const Scene scene = scene_with("[field]\nstiffness_n_per_m = 420\nspacing_mm = 0.5\n");
  const PlacedBody body(scene);
  EXPECT_EQ(thrown_by([&] { body.field(*scene.field); }),
            "[field] with spacing_mm = 0.5: bricks = 1024: expected at most 1023");
}

struct Pressed {
  double error = 0;  ///< root mean square of the applied force minus the force of the body at this position, N
  double rms = 0;    ///< root mean square of the force of the body, N
  std::uint64_t steps = 0;
  std::uint64_t truths = 0;
};

/// The hand presses with a period of 2 s. The result is for the last 4 s of 10 s.
Pressed press(Duration one_way, bool truths, double stiffness) {
  using namespace simulation;
  const Scene scene = scene_with("[field]\nspacing_mm = 4\nstiffness_n_per_m = " + std::to_string(stiffness) + "\n");
  PlacedBody body(scene);
  PlacedBody exact(scene);
  SimulatedDevice::Config moved = moved_falcon(Vec3(0.02, 0, 0), milliseconds(500), {});
  moved.hand->motion =
      ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.02, .frequency = 0.5, .centre = Vec3(0.005, 0, 0)});
  moved.encoder_step.reset();
  SimulatedDevice device(moved);
  World::Config config = world_config(device.info());
  config.loop.control.hold.field.emplace();
  config.mail.flight = 1;
  const auto profile = injector::parse_profile("delay=" + std::to_string(one_way / milliseconds(1)) + "ms");
  config.weather = {profile, profile};
  World world(config, device);
  std::size_t handle = 0;
  Pressed run;
  ForceClient::Config client = at_100_hz();
  client.fields = true;
  handle = world.add_controller(client, [&](const DeviceState& hand) {
    Touch touch = body.answer(hand);
    touch.is_truth = world.client(handle).field().generation > 0;
    run.truths += touch.is_truth ? 1 : 0;
    touch.unknown = touch.is_truth && !truths;
    return touch;
  });
  world.client(handle).use(body.field(*scene.field));
  world.run_for(seconds(6));
  EXPECT_TRUE(world.client(handle).field().current) << world.client(handle).field().refused;
  world.watch_steps([&](const StepRecord& step) {
    if (!step.field) return;
    const Vec3 wanted = exact.touch(step.hand.position).force;
    run.error += (step.applied - wanted).squaredNorm();
    run.rms += wanted.squaredNorm();
    ++run.steps;
  });
  world.run_for(seconds(4));
  run.error = std::sqrt(run.error / static_cast<double>(run.steps));
  run.rms = std::sqrt(run.rms / static_cast<double>(run.steps));
  return run;
}

TEST(SoftbodyField, TruthsReduceTheErrorOfTheServerForEveryDelay) {
  for (const Duration one_way : {milliseconds(0), milliseconds(100)}) {
    const Pressed plain = press(one_way, false, 250);
    const Pressed taught = press(one_way, true, 250);
    std::cout << "one way " << one_way / milliseconds(1) << " ms: error " << plain.error << " N, with truths "
              << taught.error << " N of " << taught.rms << " N\n";
    EXPECT_EQ(taught.steps, 4000U) << "the server renders the field";
    EXPECT_GT(taught.truths, 600U);
    EXPECT_GT(taught.rms, 0.5);
    EXPECT_GT(plain.error, 0.3 * plain.rms);
    EXPECT_LT(taught.error, 0.02 * taught.rms);
  }
}

}  // namespace
}  // namespace tendon::softbody::field_end_to_end_test
