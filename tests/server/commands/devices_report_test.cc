// SPDX-License-Identifier: Apache-2.0
#include "server/commands/devices_report.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <iomanip>
#include <nlohmann/json.hpp>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include "devices/driver.h"
#include "server/scene/scene.h"

namespace tendon::devices_report_test {
namespace {

usb::PluggedIn falcon(bool may_open) {
  return {.id = {0x0403, 0xCB48}, .port = "1-2.3", .node = "/dev/bus/usb/001/007", .may_open = may_open};
}

const usb::PluggedIn kMouse = {
    .id = {0x046D, 0xC077}, .port = "1-1", .node = "/dev/bus/usb/001/002", .may_open = false};

TEST(DevicesReport, NamesWhatTendonHasADriverForAndNothingElse) {
  const std::vector<usb::PluggedIn> plugged = {kMouse, falcon(true)};
  const auto devices = report_devices(plugged, "");
  ASSERT_EQ(devices.size(), 1U);
  EXPECT_EQ(devices[0].kind, "falcon");
  EXPECT_TRUE(devices[0].lacks.empty());
  const std::string words = in_words(devices);
  EXPECT_NE(words.find("Novint Falcon  0403:cb48  port 1-2.3  /dev/bus/usb/001/007\n"), std::string::npos) << words;
  EXPECT_NE(words.find("nothing is missing"), std::string::npos) << words;
  EXPECT_NE(in_words({}).find("no device"), std::string::npos);
  EXPECT_EQ(in_json({}), "");
}

TEST(DevicesReport, SomeWantNoFirmwareButTheRightToBeOpened) {
  const struct {
    usb::Id id;
    const char* kind;
    const char* name;
  } cases[] = {{{0x256F, 0xC635}, "spacemouse", ""},
               {{0x1234, 0x0006}, "woodenhaptics", "or another HID gadget of mbed"}};
  for (const auto& [id, kind, name] : cases) {
    std::vector<usb::PluggedIn> plugged = {falcon(true)};
    plugged[0].id = id;
    const auto devices = report_devices(plugged, std::nullopt);
    ASSERT_EQ(devices.size(), 1U);
    EXPECT_EQ(devices[0].kind, kind);
    EXPECT_NE(devices[0].name.find(name), std::string::npos);
    EXPECT_TRUE(devices[0].lacks.empty());
    plugged[0].may_open = false;
    EXPECT_EQ(report_devices(plugged, std::nullopt)[0].lacks.size(), 1U);
  }
}

TEST(DevicesReport, AMissingNodeIsMendedByTheContainerNotByRights) {
  std::vector<usb::PluggedIn> plugged = {falcon(false)};
  plugged[0].has_node = false;
  const auto devices = report_devices(plugged, "");
  ASSERT_EQ(devices[0].lacks.size(), 1U);
  EXPECT_NE(devices[0].lacks[0].what.find("/dev/bus/usb/001/007"), std::string::npos);
  EXPECT_NE(devices[0].lacks[0].mend.find("container"), std::string::npos);
}

TEST(DevicesReport, SaysWhatIsMissingAndHowToMendIt) {
  const std::vector<usb::PluggedIn> plugged = {falcon(false), falcon(true)};
  const auto devices = report_devices(plugged, std::nullopt);
  ASSERT_EQ(devices.size(), 2U);
  ASSERT_EQ(devices[0].lacks.size(), 2U);
  EXPECT_NE(devices[0].lacks[0].mend.find("deploy/udev/60-tendon.rules"), std::string::npos);
  EXPECT_NE(devices[0].lacks[1].mend.find("--falcon-firmware"), std::string::npos);
  EXPECT_EQ(devices[1].lacks.size(), 1U);
  const auto refused = report_devices(std::span(plugged).subspan(1), "a\"b: expected something else");
  ASSERT_EQ(refused[0].lacks.size(), 1U);
  EXPECT_EQ(refused[0].lacks[0].what, "a\"b: expected something else");
}

TEST(DevicesReport, IsOneJsonObjectForEachDevice) {
  const std::vector<usb::PluggedIn> plugged = {falcon(false)};
  const std::string text = in_json(report_devices(plugged, "a\\b\"\n: no"));
  EXPECT_EQ(text.find('\n'), text.size() - 1);
  const auto json = nlohmann::json::parse(text);
  EXPECT_EQ(json["id"], "0403:cb48");
  EXPECT_EQ(json["may_open"], false);
  ASSERT_EQ(json["missing"].size(), 2U);
  EXPECT_EQ(json["missing"][1]["what"], "a\\b\"\n: no");
}

std::string hex4(std::uint16_t number) {
  std::ostringstream text;
  text << std::hex << std::setfill('0') << std::setw(4) << number;
  return text.str();
}

// `tendond devices` prints the name of a udev rule, which must exist and must contain every device that has a driver.
TEST(DevicesReport, TheUdevRulesNameEveryIdOfEveryDriver) {
  std::size_t ids = 0;
  for (const Driver* driver : drivers()) {
    for (const usb::Id& id : driver->ids) {
      ++ids;
      std::ifstream file(std::filesystem::path(TENDON_SCENES).parent_path() / "udev" / "60-tendon.rules");
      const std::string start = "ATTR{idVendor}==\"" + hex4(id.vendor) + "\", ATTR{idProduct}==\"";
      bool opens = false;
      bool stays_awake = false;
      for (std::string line; std::getline(file, line);) {
        const std::size_t at = line.find(start);
        if (at == std::string::npos) continue;
        const std::size_t from = at + start.size();
        const std::string products = '|' + line.substr(from, line.find('"', from) - from) + '|';
        if (products.find('|' + hex4(id.product) + '|') == std::string::npos) continue;
        opens = opens || line.find("MODE=\"0660\", GROUP=\"plugdev\", TAG+=\"uaccess\"") != std::string::npos;
        stays_awake = stays_awake || line.find("ATTR{power/control}=\"on\"") != std::string::npos;
      }
      EXPECT_TRUE(opens) << driver->kind << ' ' << hex4(id.vendor) << ':' << hex4(id.product);
      EXPECT_EQ(stays_awake, driver->moves_a_hand) << "the kernel must not put motors to sleep: " << driver->kind;
    }
  }
  EXPECT_GT(ids, 20U);
}

TEST(DevicesReport, EveryDriverWithMotorsHasALastWordAndAWayHome) {
  for (const Driver* driver : drivers()) {
    EXPECT_EQ(driver->zero_packet.empty(), !driver->moves_a_hand) << driver->kind;
    EXPECT_EQ(driver->homing.empty(), !driver->moves_a_hand) << driver->kind;
    EXPECT_EQ(driver->buttons_in_words.empty(), !driver->moves_a_hand || driver->buttons.empty()) << driver->kind;
  }
}

}  // namespace
}  // namespace tendon::devices_report_test
