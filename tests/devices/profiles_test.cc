// SPDX-License-Identifier: Apache-2.0
#include "devices/simulated/profiles.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>

namespace tendon {
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

}  // namespace
}  // namespace tendon
