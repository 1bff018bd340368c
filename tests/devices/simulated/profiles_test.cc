// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/profiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

namespace tendon::profiles_test {
namespace {

TEST(DeviceProfiles, AreFoundByTheirNames) {
  for (const char* name : {"phantom-premium", "touch", "falcon"}) {
    const DeviceProfile* profile = find_device_profile(name);
    ASSERT_NE(profile, nullptr) << name;
    EXPECT_EQ(profile->name, name);
  }
  EXPECT_EQ(find_device_profile("phantom"), nullptr);
}

TEST(DeviceProfiles, NeverPromiseTheLimiterMoreFrictionThanTheDeviceHas) {
  for (const DeviceProfile& profile : device_profiles()) {
    EXPECT_GT(profile.friction_bounds().viscous, 0) << profile.name;
    EXPECT_GT(profile.friction_bounds().coulomb, 0) << profile.name;
    EXPECT_LE(profile.friction_bounds().viscous, profile.device().viscous_friction) << profile.name;
    EXPECT_LE(profile.friction_bounds().coulomb, profile.device().coulomb_friction) << profile.name;
  }
}

TEST(DeviceProfiles, MakeDevicesThatSayWhatTheDataSheetSays) {
  const SimulatedDevice phantom(find_device_profile("phantom-premium")->device());
  EXPECT_EQ(phantom.info().name, "phantom-premium");
  EXPECT_EQ(phantom.info().max_force, 8.5);
  EXPECT_EQ(phantom.info().position_resolution, 0.03e-3);
  EXPECT_EQ(phantom.info().watchdog, std::chrono::milliseconds(5));
  const SimulatedDevice falcon(find_device_profile("falcon")->device());
  EXPECT_EQ(falcon.info().watchdog, Duration::zero()) << "its firmware documents none";
}

TEST(DeviceProfiles, PrintEveryNumberWithHowItIsKnown) {
  const std::string table = provenance_table(*find_device_profile("touch"));
  EXPECT_NE(table.find("largest force               3.3 N          quoted    read back"), std::string::npos) << table;
  EXPECT_NE(table.find("Coulomb friction            0.26 N         recalled"), std::string::npos) << table;
  EXPECT_NE(table.find("viscous friction            0.01 N s/m     assumed   unknown"), std::string::npos) << table;
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 10);
}

TEST(OperatorProfiles, AreRangesOfWhichTheHandIsTheMiddle) {
  std::string names;
  for (const OperatorProfile& profile : operator_profiles()) {
    EXPECT_EQ(find_operator_profile(profile.name), &profile);
    names += std::string(profile.name) + ' ';
    for (const KnownRange& range : {profile.stiffness, profile.damping, profile.mass}) {
      EXPECT_GT(range.least, 0) << profile.name;
      EXPECT_LT(range.least, range.most) << profile.name;
      EXPECT_FALSE(range.note.empty());
    }
    const auto hand = profile.hand(ScriptedMotion(ScriptedMotion::Sine{.amplitude = 0.01, .frequency = 1}));
    EXPECT_EQ(hand.stiffness, (profile.stiffness.least + profile.stiffness.most) / 2);
    EXPECT_EQ(hand.damping, profile.damping.middle());
    EXPECT_EQ(hand.mass, profile.mass.middle());
    EXPECT_NEAR(hand.motion.at(0.25).position.norm(), 0.01, 1e-12);
    // Over the published range, the damping ratio is 0.05 to 3, so the hand is at most slightly underdamped.
    const double zeta = hand.damping / (2 * std::sqrt(hand.stiffness * hand.mass));
    EXPECT_GT(zeta, 0.05) << profile.name;
    EXPECT_LT(zeta, 3) << profile.name;
  }
  EXPECT_EQ(names, "fingertip stylus arm ");
  EXPECT_EQ(find_operator_profile("foot"), nullptr);
}

TEST(OperatorProfiles, PrintEveryNumberWithHowItIsKnown) {
  const std::string table = provenance_table(*find_operator_profile("fingertip"));
  EXPECT_NE(table.find("fingertip (an operator)\n"), std::string::npos) << table;
  EXPECT_NE(table.find("stiffness                   255-1255 N/m   recalled  Hajian and Howe"), std::string::npos)
      << table;
  EXPECT_NE(table.find("mass                        0.005-0.006 kg recalled"), std::string::npos) << table;
  EXPECT_EQ(std::count(table.begin(), table.end(), '\n'), 4);
}

}  // namespace
}  // namespace tendon::profiles_test
