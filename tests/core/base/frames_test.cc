// SPDX-License-Identifier: Apache-2.0
#include "core/base/frames.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <numbers>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "tests/support/dice.h"
#include "tests/support/refusal.h"

namespace tendon::frames_test {
namespace {

std::vector<Mat3> axis_aligned_bases() {
  std::vector<Mat3> bases;
  std::array<Eigen::Index, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 m = Mat3::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) m(i, order[static_cast<std::size_t>(i)]) = (signs >> i & 1) != 0 ? -1 : 1;
      bases.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return bases;
}

std::string words_of(const Mat3& m) {
  std::string text;
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      if (m(i, j) == 0) continue;
      text += (i == 0 ? "right=" : i == 1 ? " up=" : " user=") + std::string(m(i, j) < 0 ? "-" : "") + "xyz"[j];
    }
  }
  return text;
}

std::string refusal(const std::string& axes) {
  return thrown_by([&] { operator_from_device(axes); });
}

bool ends_with(const std::string& text, const std::string& end) { return text.ends_with(end); }

Vec3 any_vector(Dice& dice) { return dice.direction() * dice.within(0, 2); }

Mat3 any_rotation(Dice& dice) {
  const Vec3 axis = dice.direction();
  return Eigen::AngleAxisd(dice.within(0, std::numbers::pi), axis).toRotationMatrix();
}

TEST(Axes, EachOfThe24RightHandedBasesIsReadAndSaidAgain) {
  int right_handed = 0;
  for (const Mat3& basis : axis_aligned_bases()) {
    const std::string words = words_of(basis);
    if (basis.determinant() < 0) {
      EXPECT_TRUE(ends_with(refusal(words), "these three axes form a left-handed frame")) << words;
      continue;
    }
    ++right_handed;
    EXPECT_EQ(operator_from_device(words), basis) << words;
    EXPECT_EQ(axes_in_words(basis), words);
  }
  EXPECT_EQ(right_handed, 24);
}

TEST(Axes, TheWordsMayComeInAnyOrder) {
  EXPECT_EQ(operator_from_device(" user=-x  up=z right=-y "), operator_from_device("right=-y up=z user=-x"));
}

TEST(Axes, ARefusalSaysWhatIsWrong) {
  EXPECT_EQ(refusal("right=x up=y"),
            "axes = \"right=x up=y\": expected three words like \"right=x up=y user=z\": user is missing");
  EXPECT_TRUE(ends_with(refusal(""), "right is missing"));
  EXPECT_TRUE(ends_with(refusal("right=x up=y user=z up=-y"), "up occurs twice"));
  EXPECT_TRUE(ends_with(refusal("right=x up=-x user=z"), "x is used twice"));
  for (const char* word : {"left=x", "right", "right=", "right=w", "right=--x", "right=xy", "=x", "right=-"}) {
    EXPECT_NE(refusal(std::string(word) + " up=y user=z").find("\"" + std::string(word) + "\" is not right="),
              std::string::npos)
        << word << ": " << refusal(std::string(word) + " up=y user=z");
  }
}

TEST(Axes, ARotationBetweenAxesHasNoWords) {
  EXPECT_EQ(axes_in_words(Eigen::AngleAxisd(0.1, Vec3::UnitX()).toRotationMatrix()), "");
}

TEST(Axes, ThoseOfAWoodenHapticsAreTheQuaternionOfHalves) {
  const Quat q = quaternion_of(operator_from_device("right=-y up=z user=-x"));
  const double sign = q.w < 0 ? -1 : 1;
  EXPECT_NEAR(sign * q.w, 0.5, 1e-15);
  EXPECT_NEAR(sign * q.x, -0.5, 1e-15);
  EXPECT_NEAR(sign * q.y, 0.5, 1e-15);
  EXPECT_NEAR(sign * q.z, 0.5, 1e-15);
}

TEST(Axes, AQuaternionAndItsNegativeAreTheSameMatrix) {
  Dice random(1);
  for (int i = 0; i < 1000; ++i) {
    const Mat3 rotation = any_rotation(random);
    const Quat q = quaternion_of(rotation);
    EXPECT_LT((matrix_of(q) - rotation).norm(), 1e-14);
    EXPECT_LT((matrix_of({-2 * q.w, -2 * q.x, -2 * q.y, -2 * q.z}) - rotation).norm(), 1e-14);
  }
}

TEST(Frames, EachMatrixIsWhatItsWordsSay) {
  const std::map<std::string, Vec3> ways = {{"right", {1, 0, 0}}, {"left", {-1, 0, 0}},    {"up", {0, 1, 0}},
                                            {"down", {0, -1, 0}}, {"forward", {0, 0, -1}}, {"user", {0, 0, 1}}};
  for (const Frame& frame : frames()) {
    std::string text(frame.axes.substr(0, frame.axes.find(';')));
    std::erase(text, ',');
    std::istringstream words(text);
    Mat3 expected = Mat3::Zero();
    for (std::string axis, way; words >> axis >> way;) {
      if (way == "to") words >> way >> way;  // "to the user"
      expected.row(axis[0] - 'x') = ways.at(way).transpose();
    }
    EXPECT_EQ(frame.from_operator, expected) << frame.name;
    EXPECT_EQ(frame.is_right_handed(), frame.axes.find("left-handed") == std::string_view::npos) << frame.name;
    EXPECT_EQ(frame.per_metre == 100, frame.axes.ends_with("cm")) << frame.name;
    EXPECT_EQ(frame.per_metre == 1000, frame.axes.ends_with("mm")) << frame.name;
  }
}

TEST(Frames, HaveANameOfTheirOwnByWhichTheyAreFound) {
  std::set<std::string_view> names;
  for (const Frame& frame : frames()) {
    EXPECT_TRUE(names.insert(frame.name).second) << frame.name;
    EXPECT_EQ(find_frame(frame.name), &frame);
  }
  EXPECT_EQ(find_frame("maya"), nullptr);
}

TEST(Frames, WorkAndTurnsAreTheSameSeenFromAnyOfThe48Bases) {
  Dice random(7);
  for (const Mat3& basis : axis_aligned_bases()) {
    const Frame frame{.name = {}, .axes = {}, .source = {}, .from_operator = basis, .per_metre = 100};
    const Mat3 turn = any_rotation(random);
    const Vec3 place = any_vector(random);
    const Vec3 force = any_vector(random);
    // The result must not depend on whether a point of the handle is rotated first or the frame is changed first.
    EXPECT_LT((frame.orientation(turn) * frame.position(place) - frame.position(turn * place)).norm(), 1e-12);
    EXPECT_NEAR(frame.orientation(turn).determinant(), 1, 1e-12);
    EXPECT_LT((frame.torque(place.cross(force)) - (frame.position(place) / 100).cross(frame.force(force))).norm(),
              1e-12);
    EXPECT_NEAR(frame.force(force).dot(frame.position(place)) / 100, force.dot(place), 1e-12);
    EXPECT_LT((frame.operator_position(frame.position(place)) - place).norm(), 1e-12);
    EXPECT_LT((frame.operator_force(frame.force(force)) - force).norm(), 1e-12);
    EXPECT_LT((frame.operator_torque(frame.torque(force)) - force).norm(), 1e-12);
    EXPECT_LT((frame.operator_orientation(frame.orientation(turn)) - turn).norm(), 1e-12);
  }
}

/// Regression for ZeroSimROSUnity issue #7: changing signs by hand kept yaw correct and swapped roll and pitch.
TEST(Frames, AYawToTheLeftTurnsNegativeAboutUnitysUp) {
  const Frame& unity = *find_frame("unity");
  const Mat3 left = Eigen::AngleAxisd(0.5, Vec3::UnitY()).toRotationMatrix();  // seen from above, counter-clockwise
  EXPECT_LT((unity.orientation(left) - Eigen::AngleAxisd(-0.5, Vec3::UnitY()).toRotationMatrix()).norm(), 1e-15);
  const Mat3 roll = Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix();
  EXPECT_LT((unity.orientation(roll) - Eigen::AngleAxisd(0.5, Vec3::UnitZ()).toRotationMatrix()).norm(), 1e-15);
}

}  // namespace
}  // namespace tendon::frames_test
