// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/view.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <numbers>
#include <string>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::bridge::view_test {
namespace {

std::vector<Quat> axis_aligned_rotations() {
  std::vector<Quat> all;
  std::array<Eigen::Index, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Mat3 m = Mat3::Zero();
      for (Eigen::Index i = 0; i < 3; ++i) m(i, order[static_cast<std::size_t>(i)]) = (signs >> i & 1) != 0 ? -1 : 1;
      if (m.determinant() > 0) all.push_back(quaternion_of(m));
    }
  } while (std::next_permutation(order.begin(), order.end()));
  return all;
}

TEST(View, AMotionAlongEachAxisOfADeviceComesOutOnTheProgramsAxis) {
  // WoodenHaptics' base frame is x forward, y left, z up. CHAI3D's is x to the user, y right, z up.
  const Quat wooden = quaternion_of(operator_from_device("right=-y up=z user=-x"));
  const View view(*find_frame("chai3d"), wooden);
  EXPECT_TRUE(view.position(Vec3(1, 0, 0)).isApprox(Vec3(-1, 0, 0))) << "ahead is away from the user";
  EXPECT_TRUE(view.position(Vec3(0, 1, 0)).isApprox(Vec3(0, -1, 0))) << "left is not right";
  EXPECT_TRUE(view.position(Vec3(0, 0, 1)).isApprox(Vec3(0, 0, 1))) << "up is up";
  EXPECT_TRUE(view.base_force(Vec3(0, 2, 0)).isApprox(Vec3(0, -2, 0))) << "a push to the right";
}

TEST(View, EveryWayAndEveryFrameGoThereAndBack) {
  Dice dice(5);
  int ways = 0;
  for (const Frame& frame : frames()) {
    for (const Quat& lies : axis_aligned_rotations()) {
      const View view(frame, lies);
      const Vec3 v = dice.direction() * dice.within(0.1, 2);
      EXPECT_TRUE(view.base_position(view.position(v)).isApprox(v, 1e-12)) << frame.name;
      EXPECT_TRUE(view.base_force(view.force(v)).isApprox(v, 1e-12)) << frame.name;
      EXPECT_TRUE(view.base_torque(view.torque(v)).isApprox(v, 1e-12)) << frame.name;
      EXPECT_NEAR(view.force(v).norm(), v.norm(), 1e-12) << "newtons stay newtons in " << frame.name;
      ++ways;
    }
  }
  EXPECT_EQ(ways, 24 * static_cast<int>(frames().size()));
}

TEST(View, ASpringOfTheProgramPushesTheHandWhereTheProgramMeant) {
  Dice dice(6);
  for (const Frame& frame : frames()) {
    const View view(frame, rotation_by(Vec3(0.3, -0.5, 0.7)));
    const Vec3 normal = dice.direction();
    const Mat3 there = 500 * normal * normal.transpose();
    const Vec3 moved = dice.direction();  // in base axes
    const Vec3 force_there = -there * view.position(moved) / frame.per_metre;
    EXPECT_TRUE((-view.base_stiffness(there) * moved).isApprox(view.base_force(force_there), 1e-9)) << frame.name;
  }
}

TEST(View, AHandleInItsMiddleIsNotTurnedWhateverTheFrame) {
  const Quat lies = quaternion_of(operator_from_device("right=-y up=z user=-x"));
  for (const Frame& frame : frames()) {
    const View view(frame, lies);
    EXPECT_TRUE(view.orientation(inverse(lies)).isIdentity(1e-12)) << frame.name;
    EXPECT_NEAR(view.orientation(rotation_by(Vec3(0.1, 0.2, 0.3))).determinant(), 1, 1e-12) << frame.name;
  }
}

/// Formats M·(x, y, z) in the same way as the README:
std::string in_words(const Frame& frame) {
  std::string text = frame.per_metre == 1 ? "(" : std::to_string(std::lround(frame.per_metre)) + " (";
  for (Eigen::Index i = 0; i < 3; ++i) {
    for (Eigen::Index j = 0; j < 3; ++j) {
      if (frame.from_operator(i, j) == 0) continue;
      text += std::string(i > 0 ? ", " : "") + (frame.from_operator(i, j) < 0 ? "\u2212" : "") + "xyz"[j];
    }
  }
  return text + ")";
}

TEST(View, ThePageForNewcomersTellsTheFramesAsTheyAre) {
  std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "clients" / "COMING_FROM.md");
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  for (const auto& [name, row] : std::map<std::string, std::string>{{"chai3d", "| CHAI3D | to the user, right, up |"},
                                                                    {"openhaptics", "| right, up, to the user |"},
                                                                    {"inverse", "| right, forward, up |"},
                                                                    {"ros", "| forward, left, up |"},
                                                                    {"ras", "| right, anterior, superior |"},
                                                                    {"unity", "| right, up, forward |"},
                                                                    {"unreal", "| forward, right, up |"}}) {
    ASSERT_NE(find_frame(name), nullptr) << name;
    EXPECT_NE(page.find(row + " " + in_words(*find_frame(name)) + " |"), std::string::npos)
        << name << ": " << row << " " << in_words(*find_frame(name));
  }
}

TEST(View, TurnsTheStylusAboutTheProgramsOwnAxis) {
  const Quat left = rotation_by(Vec3(0, std::numbers::pi / 2, 0));
  EXPECT_TRUE((View(*find_frame("ros"), {}).orientation(left) * Vec3::UnitX()).isApprox(Vec3::UnitY(), 1e-12))
      << "ahead has become left";
  EXPECT_TRUE(
      (View(*find_frame("openhaptics"), {}).orientation(left) * -Vec3::UnitZ()).isApprox(-Vec3::UnitX(), 1e-12));
}

}  // namespace
}  // namespace tendon::bridge::view_test
