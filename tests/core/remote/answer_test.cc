// SPDX-License-Identifier: Apache-2.0
#include "core/remote/answer.h"

#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <cmath>
#include <limits>

#include "tests/support/dice.h"

namespace tendon::answer_test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kAnyStiffness = 1e9;

/// A tool 4 mm deep in a surface with normal +z: 2 N normal force, 0.4 N friction along x.
RemoteForce pressed() {
  RemoteForce answer{.force = {0.4, 0, 2}};
  answer.model = LocalModel{.at = {0.01, 0.02, -0.004}, .stiffness = Vec3(100, 100, 500).asDiagonal()};
  return answer;
}

Vec3 deeper_by(double depth) { return pressed().model->at - Vec3(0, 0, depth); }

ForceTable table(double first, double step, std::initializer_list<double> force) {
  ForceTable made{.first = first, .step = step, .size = static_cast<std::uint32_t>(force.size())};
  std::copy(force.begin(), force.end(), made.force.begin());
  return made;
}

/// The table contains the force for each depth from 1 mm above the surface to 7 mm below the surface, in steps of 1 mm.
RemoteForce with_table() {
  RemoteForce answer = pressed();
  answer.model->contact = Contact{
      .normal = Vec3::UnitZ(), .gap = -0.004, .table = table(-0.005, 0.001, {0, 0, 0.1, 0.4, 1, 2, 3.5, 5.5, 8})};
  return answer;
}

TEST(Answer, WithoutAModelItIsHeld) {
  const RemoteForce answer{.force = {1, 2, 3}};
  EXPECT_EQ(reconstruct(answer, Vec3(9, 9, 9)).force, Vec3(1, 2, 3));
  EXPECT_EQ(reconstruct(answer, Vec3(9, 9, 9)).stiffness, Mat3::Zero());
}

TEST(Answer, ASpringPushesBackWhereTheHandGoes) {
  const Prediction said = reconstruct(pressed(), deeper_by(0.001) + Vec3(0.002, 0, 0));
  EXPECT_NEAR((said.force - Vec3(0.4 - 0.2, 0, 2.5)).norm(), 0, 1e-12);
  EXPECT_EQ(said.stiffness, pressed().model->stiffness);
}

TEST(Answer, BeyondItsValidRadiusAStiffnessIsNotFollowed) {
  RemoteForce answer = pressed();
  answer.model->valid_radius = 0.001;
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.0009)).force.z(), 2.45, 1e-12);
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.003)).force.z(), 2.5, 1e-12);
  EXPECT_EQ(reconstruct(answer, deeper_by(0.003)).stiffness, Mat3::Zero());
  answer.model->valid_radius = 0;
  EXPECT_EQ(reconstruct(answer, deeper_by(0.003)).force, answer.force);
}

TEST(Answer, OfAnotherBodyTheForceIsAllThatIsBelieved) {
  RemoteForce answer = with_table();
  answer.topology_changed = true;
  const RemoteForce kept = believed(answer, kAnyStiffness);
  EXPECT_EQ(reconstruct(kept, deeper_by(0.002)).force, answer.force);
  EXPECT_EQ(reconstruct(kept, deeper_by(0.002)).stiffness, Mat3::Zero());
}

TEST(Answer, BelievedIsOnlyAConservativeBoundedStiffness) {
  Dice dice(9);
  for (int i = 0; i < 500; ++i) {
    RemoteForce answer = pressed();
    for (int c = 0; c < 3; ++c) answer.model->stiffness.col(c) = dice.decades(0, 4) * dice.direction();
    const Mat3 kept = believed(answer, 1000).model->stiffness;
    EXPECT_LT((kept - kept.transpose()).norm(), 1e-9);
    const Vec3 values = Eigen::SelfAdjointEigenSolver<Mat3>(kept).eigenvalues();
    EXPECT_GE(values.minCoeff(), -1e-9);
    EXPECT_LE(values.maxCoeff(), 1000 + 1e-9);
  }
  EXPECT_EQ(believed(pressed(), 1000).model->stiffness, pressed().model->stiffness);  // plausible models stay unchanged
}

TEST(Answer, ASurfaceDoesNotPullAndIsNotFeltBeyondItself) {
  RemoteForce answer = pressed();
  answer.model->contact = Contact{.normal = Vec3::UnitZ(), .gap = -0.004};
  EXPECT_EQ(reconstruct(answer, deeper_by(0)).force, answer.force);
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.001)).force.z(), 2.5, 1e-12);
  EXPECT_NEAR(reconstruct(answer, deeper_by(-0.0039)).force.z(), 2 - 500 * 0.0039, 1e-12);
  EXPECT_EQ(reconstruct(answer, deeper_by(-0.0041)).force, Vec3::Zero());
  EXPECT_EQ(reconstruct(answer, deeper_by(-0.0041)).stiffness, Mat3::Zero());
  answer.model->stiffness(2, 2) = 1000;  // this linear model reaches zero force at half the depth
  EXPECT_EQ(reconstruct(answer, deeper_by(-0.003)).force, Vec3::Zero());
  answer.model->stiffness(2, 2) = 100;  // this one still has a force at the surface
  EXPECT_EQ(reconstruct(answer, deeper_by(-0.0041)).force, Vec3::Zero());
}

TEST(Answer, WhatRubsAcrossFadesWithWhatItIsPressedBy) {
  RemoteForce answer = pressed();
  answer.model->contact = Contact{.normal = Vec3::UnitZ(), .gap = -0.004};
  EXPECT_NEAR(reconstruct(answer, deeper_by(-0.002)).force.x(), 0.2, 1e-12);
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.002)).force.x(), 0.4, 1e-12);
  EXPECT_NEAR(reconstruct(with_table(), deeper_by(-0.001)).force.x(), 0.2, 1e-12);
  EXPECT_EQ(reconstruct(with_table(), deeper_by(-0.0045)).force, Vec3::Zero());
}

TEST(Answer, WithoutARadiusAStickingForceStaysInTheConeOfItsAnswer) {
  RemoteForce answer = with_table();  // 0.4 N across at 2 N
  const auto across = [&](double depth, double x) {
    return reconstruct(answer, deeper_by(depth) + Vec3(x, 0, 0)).force.x();
  };
  EXPECT_NEAR(across(0, -0.01), 0.4, 1e-12);  // not 1.4 N
  EXPECT_NEAR(across(0, 0.006), -0.2, 1e-12);
  EXPECT_NEAR(across(0, 0.02), -0.4, 1e-12);
  EXPECT_NEAR(across(0.001, -0.01), 0.4 * 3.5 / 2, 1e-12);
  EXPECT_NEAR(across(-0.001, -0.01), 0.2, 1e-12);
  EXPECT_EQ(reconstruct(answer, deeper_by(0) + Vec3(0.02, 0, 0)).stiffness.row(0).norm(), 0);
  answer.model->valid_radius = 0.01;
  EXPECT_NEAR(across(0, -0.01), 1.4, 1e-12);
  answer = RemoteForce{.model = LocalModel{.stiffness = 100 * Mat3::Identity()}};
  answer.model->contact = Contact{.normal = Vec3::UnitZ(), .gap = 0.001};  // not in contact
  EXPECT_EQ(reconstruct(answer, Vec3(0.01, 0, 0)).force, Vec3::Zero());
}

TEST(Answer, ATableReplacesStiffnessAlongTheNormalWithinItsEnds) {
  const RemoteForce answer = with_table();
  const auto along = [&](double depth) { return reconstruct(answer, deeper_by(depth)); };
  EXPECT_NEAR(along(0).force.z(), 2, 1e-12);
  EXPECT_NEAR(along(0.001).force.z(), 3.5, 1e-12);
  EXPECT_NEAR(along(0.0015).force.z(), 4.5, 1e-12);
  EXPECT_NEAR(along(0.0015).stiffness(2, 2), 2000, 1e-9);
  EXPECT_NEAR(along(-0.0015).force.z(), 0.7, 1e-12);
  EXPECT_EQ(along(0.1).force.z(), 8);
  EXPECT_EQ(along(0.1).stiffness(2, 2), 0);
  EXPECT_EQ(along(-0.1).force.z(), 0);
  EXPECT_EQ(along(1e12).force.z(), 8);
  RemoteForce narrow = answer;
  narrow.model->valid_radius = 1e-6;
  EXPECT_NEAR(reconstruct(narrow, deeper_by(0.001)).force.z(), 3.5, 1e-12);
  EXPECT_NEAR(reconstruct(narrow, deeper_by(0) + Vec3(0.001, 0, 0)).force.x(), 0.4 - 100 * 1e-6, 1e-12);
}

TEST(Answer, ATableMayPullAndIsNotGivenOutAsNegativeStiffness) {
  RemoteForce answer = pressed();
  answer.model->contact = Contact{.normal = Vec3::UnitZ(), .gap = -0.004, .table = table(0, 0.001, {2, 1, -1})};
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.0015)).force.z(), 0, 1e-12);
  EXPECT_NEAR(reconstruct(answer, deeper_by(0.002)).force.z(), -1, 1e-12);
  EXPECT_EQ(reconstruct(answer, deeper_by(0.0015)).stiffness(2, 2), 0);
}

TEST(Answer, TheStatedStiffnessIsTheSlopeOfTheForce) {
  RemoteForce answer = with_table();
  answer.model->stiffness << 100, 20, 30, 20, 200, 40, 30, 40, 500;
  for (const bool has_table : {true, false}) {
    if (!has_table) answer.model->contact->table.reset();
    const Vec3 at = deeper_by(0.0012);
    const Prediction there = reconstruct(answer, at);
    for (int axis = 0; axis < 3; ++axis) {
      const Vec3 h = 1e-6 * Vec3::Unit(axis);
      const Vec3 slope = (reconstruct(answer, at - h).force - reconstruct(answer, at + h).force) / 2e-6;
      EXPECT_LT((there.stiffness.col(axis) - slope).norm(), 1e-5) << has_table << axis;
    }
  }
}

TEST(Answer, NoTableIsSteeperThanWhatIsBelieved) {
  RemoteForce answer = with_table();
  answer.model->contact->table = table(-0.002, 0.001, {-1e9, 0, 2, 1e9, 1e9});
  const ForceTable kept = *believed(answer, 1000).model->contact->table;
  EXPECT_EQ(kept.force[2], 2);  // entry at the answered depth
  EXPECT_EQ(kept.force[1], 1);
  EXPECT_EQ(kept.force[0], 0);
  EXPECT_EQ(kept.force[3], 3);
  EXPECT_EQ(kept.force[4], 4);
  const ForceTable soft = *believed(with_table(), 1e4).model->contact->table;
  EXPECT_EQ(soft.force, with_table().model->contact->table->force);
  answer.model->contact->table = table(1, 0.001, {2, 9});
  EXPECT_EQ(believed(answer, 1000).model->contact->table->force[1], 3);
  answer.model->contact->table = table(-1, 0.001, {2, 9});
  EXPECT_EQ(believed(answer, 1000).model->contact->table->force[0], 8);
}

TEST(Answer, ANormalIsMadeAUnitVector) {
  RemoteForce answer = with_table();
  answer.model->contact->normal *= 1.0009;
  EXPECT_NEAR(believed(answer, kAnyStiffness).model->contact->normal.norm(), 1, 1e-15);
}

TEST(Answer, IsSoundOnlyWithEveryNumberInItsRange) {
  EXPECT_TRUE(is_sound(with_table()));
  EXPECT_TRUE(is_sound(RemoteForce{}));
  const auto with_torque = [] {
    RemoteForce answer = with_table();
    answer.torque = RemoteTorque{.torque = {0, -0.1, 0}, .model = RotationModel{}};
    answer.torque->model->at = {.w = 0.6, .x = 0, .y = -0.8, .z = 0};
    answer.grip_force = -1;
    return answer;
  };
  EXPECT_TRUE(is_sound(with_torque()));
  const struct {
    const char* what;
    void (*damage)(RemoteForce&);
  } kDamages[] = {
      {"force", [](RemoteForce& a) { a.force.y() = kNaN; }},
      {"error", [](RemoteForce& a) { a.error = kNaN; }},
      {"negative error", [](RemoteForce& a) { a.error = -1; }},
      {"infinite error", [](RemoteForce& a) { a.error = kInf; }},
      {"at", [](RemoteForce& a) { a.model->at.x() = kInf; }},
      {"stiffness", [](RemoteForce& a) { a.model->stiffness(1, 2) = kNaN; }},
      {"radius", [](RemoteForce& a) { a.model->valid_radius = kNaN; }},
      {"negative radius", [](RemoteForce& a) { a.model->valid_radius = -1e-9; }},
      {"normal", [](RemoteForce& a) { a.model->contact->normal.z() = kNaN; }},
      {"no normal", [](RemoteForce& a) { a.model->contact->normal.setZero(); }},
      {"long normal", [](RemoteForce& a) { a.model->contact->normal *= 1.002; }},
      {"gap", [](RemoteForce& a) { a.model->contact->gap = kInf; }},
      {"first", [](RemoteForce& a) { a.model->contact->table->first = kNaN; }},
      {"step", [](RemoteForce& a) { a.model->contact->table->step = kInf; }},
      {"no step", [](RemoteForce& a) { a.model->contact->table->step = 0; }},
      {"negative step", [](RemoteForce& a) { a.model->contact->table->step = -1e-3; }},
      {"one entry", [](RemoteForce& a) { a.model->contact->table->size = 1; }},
      {"17 entries", [](RemoteForce& a) { a.model->contact->table->size = 17; }},
      {"an entry", [](RemoteForce& a) { a.model->contact->table->force[8] = kNaN; }},
      {"torque", [](RemoteForce& a) { a.torque->torque.y() = kNaN; }},
      {"no rotation", [](RemoteForce& a) { a.torque->model->at.y = -0.81; }},
      {"orientation", [](RemoteForce& a) { a.torque->model->at.z = kNaN; }},
      {"angular stiffness", [](RemoteForce& a) { a.torque->model->stiffness(2, 1) = kInf; }},
      {"grip force", [](RemoteForce& a) { a.grip_force = kInf; }},
  };
  for (const auto& [what, damage] : kDamages) {
    RemoteForce answer = with_torque();
    damage(answer);
    EXPECT_FALSE(is_sound(answer)) << what;
  }
  RemoteForce unused = with_table();  // unused entries may have any value
  unused.model->contact->table->force[9] = kNaN;
  EXPECT_TRUE(is_sound(unused));
}

}  // namespace
}  // namespace tendon::answer_test
