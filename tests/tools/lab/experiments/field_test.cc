// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

namespace tendon::lab::field_test {
namespace {

const FieldRow& row_of(const std::vector<FieldRow>& rows, FieldMethod method, const std::string& network) {
  return *std::ranges::find_if(rows,
                               [&](const FieldRow& row) { return row.method == method && row.network == network; });
}

TEST(FieldExperiment, AFieldFeelsTheSameAtEveryRoundTripAndAForceDoesNot) {
  for (const char* const scene : {"sphere", "slot"}) {
    const auto rows = field_rows({.hands = 1, .seed = 21, .scenes = {scene}, .round_trips_ms = {0, 600}});
    const FieldRun& near = row_of(rows, FieldMethod::kField, "0 ms").mean;
    const FieldRun& far = row_of(rows, FieldMethod::kField, "600 ms").mean;
    EXPECT_EQ(near.error, far.error) << scene;
    EXPECT_LT(far.error, 0.05) << scene;
    EXPECT_LT(far.jump, 1.5 * far.true_jump) << scene;
    EXPECT_GT(row_of(rows, FieldMethod::kHeld, "600 ms").mean.error, 1) << scene;
    EXPECT_GT(row_of(rows, FieldMethod::kPlane, "600 ms").mean.error, 0.9) << scene;
    for (const FieldRow& row : rows) EXPECT_GE(row.mean.least_energy, -1e-9) << scene << ", " << to_string(row.method);
  }
}

TEST(FieldExperiment, TrueForcesTeachTheHardeningAtEveryRoundTrip) {
  const auto rows = field_rows({.hands = 1, .seed = 21, .scenes = {"liver"}, .round_trips_ms = {0, 600}});
  for (const char* const network : {"0 ms", "600 ms"}) {
    EXPECT_GT(row_of(rows, FieldMethod::kField, network).mean.late_error, 0.1) << network;
    EXPECT_LT(row_of(rows, FieldMethod::kLearned, network).mean.late_error, 0.02) << network;
  }
}

TEST(FieldExperiment, ADescribedHardeningIsFeltAtOnceAtEveryRoundTrip) {
  const auto rows = field_rows({.hands = 1, .seed = 21, .scenes = {"liver-table"}, .round_trips_ms = {0, 600}});
  for (const char* const network : {"0 ms", "600 ms"}) {
    for (const FieldMethod method : {FieldMethod::kField, FieldMethod::kLearned}) {
      EXPECT_LT(row_of(rows, method, network).mean.error, 0.03) << network << ", " << to_string(method);
    }
  }
  for (const FieldRow& row : rows) EXPECT_GE(row.mean.least_energy, -1e-9) << to_string(row.method);
}

TEST(FieldExperiment, AMovingObjectNeedsATankAndPosesAheadOfTime) {
  const auto rows = field_rows({.hands = 1, .seed = 21, .scenes = {"moving"}, .round_trips_ms = {200}});
  const auto error = [&](bool ahead, bool tank) {
    return std::ranges::find_if(rows,
                                [&](const FieldRow& row) {
                                  return row.method == FieldMethod::kField && row.ahead == ahead &&
                                         (row.push.push_j > 0) == tank;
                                })
        ->mean.error;
  };
  EXPECT_LT(error(true, true), 0.2);
  EXPECT_GT(error(false, true), 0.35);
  EXPECT_GT(error(true, false), 0.5);
  for (const FieldRow& row : rows) EXPECT_GE(row.mean.least_energy, -1e-9);
}

TEST(FieldExperiment, ANetworkThatVariesIsNotFelt) {
  const auto rows = field_rows({.hands = 1, .seed = 21, .scenes = {"sphere"}, .networks = {"wifi-bad"}});
  EXPECT_LT(row_of(rows, FieldMethod::kField, "wifi-bad").mean.error, 0.01);
  EXPECT_GT(row_of(rows, FieldMethod::kHeld, "wifi-bad").mean.error, 0.2);
}

TEST(FieldExperiment, WrongUsageIsRefused) {
  EXPECT_THROW(field_rows({.hands = 0}), std::invalid_argument);
  EXPECT_THROW(field_rows({.round_trips_ms = {-1}}), std::invalid_argument);
  EXPECT_THROW(field_rows({.networks = {"wifi-worse"}}), std::invalid_argument);
  std::ostringstream out;
  EXPECT_THROW(field_experiment({.far = true}, out), std::invalid_argument);
  try {
    field_rows({.scenes = {"cup"}});
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_EQ(
        std::string(error.what()),
        "scene \"cup\" is unknown, expected one of wall, sphere, bowl, slot, liver, liver-table, edge, corner, moving");
  }
}

FieldScene scene_of(const std::vector<field::Primitive>& primitives, double friction) {
  FieldScene scene{.name = "test", .truth = {.stiffness = 1000, .friction = friction}};
  scene.exact.primitives = primitives;
  return scene;
}

TEST(TrueContact, AStickingPointIsLeftBehindAndASlidingOneOnTheCone) {
  const FieldScene scene = scene_of({{.shape = field::Plane{}}}, 0.3);
  TrueContact contact(scene);
  EXPECT_EQ(contact.force({}, {0, 0, 0.001}, 1e-3, 4), Vec3::Zero());
  EXPECT_NEAR(contact.gap(), 0.001, 1e-15);
  contact.force({}, {0, 0, -0.002}, 1e-3, 4);
  EXPECT_LT((contact.force({}, {0.0005, 0, -0.002}, 1e-3, 4) - Vec3(-0.5, 0, 2)).norm(), 1e-9);
  EXPECT_NEAR(contact.gap(), -0.002, 1e-12);
  EXPECT_LT((contact.force({}, {0.003, 0, -0.002}, 1e-3, 4) - Vec3(-0.6, 0, 2)).norm(), 1e-9);
  EXPECT_LT((contact.force({.position = {0, 0, -0.001}}, {0.003, 0, -0.002}, 1e-3, 4) - Vec3(-0.3, 0, 1)).norm(), 1e-9);
}

TEST(TrueContact, InAnEdgeBothSurfacesRub) {
  const FieldScene scene = scene_of({{.shape = field::Plane{}}, {.shape = field::Plane{.normal = Vec3::UnitX()}}}, 0.2);
  TrueContact contact(scene);
  contact.force({}, {0.001, 0, 0.001}, 1e-3, 20);
  contact.force({}, {-0.001, 0, -0.002}, 1e-3, 20);
  const Vec3 force = contact.force({}, {-0.001, 0.01, -0.002}, 1e-3, 20);
  EXPECT_LT((force - Vec3(1, -0.2 * (1 + 2), 2)).norm(), 1e-6);
}

TEST(TrueContact, ADentRelaxesAndThePushReturnsBehindIt) {
  FieldScene scene = scene_of({{.shape = field::Plane{}}}, 0);
  scene.truth = {.stiffness = 150, .hardening = 3e4, .branch = 200, .tau = 0.1};
  TrueContact contact(scene);
  contact.force({}, {0, 0, 0.001}, 1e-3, 4);
  EXPECT_NEAR(contact.force({}, {0, 0, -0.002}, 0, 4).z(), 0.3 + 0.12 + 0.4, 1e-9);
  EXPECT_NEAR(contact.force({}, {0, 0, -0.002}, 10, 4).z(), 0.3 + 0.12, 1e-9);
  EXPECT_EQ(contact.force({}, {0, 0, -0.001}, 0, 4).z(), 0);  // above the dent of 2 mm, whose rest is at 1.07 mm
  EXPECT_NEAR(scene.truth.force(scene.truth.rest(0.002) + 1e-9, 0.002), 0, 1e-5);
}

TEST(TrueForces, AHandAtRestIsInEquilibrium) {
  FieldScene scene = scene_of({{.shape = field::Plane{}}}, 0);
  scene.target = [](double, const FieldHand&) { return Vec3(0, 0, -0.01); };
  const auto forces = true_forces(scene, {}, 2000);
  EXPECT_NEAR(forces.back().z(), 0.01 / (1 / 300.0 + 1 / 1000.0), 0.03);  // within the Coulomb friction
}

}  // namespace
}  // namespace tendon::lab::field_test
