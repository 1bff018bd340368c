// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_json.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <limits>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <vector>

#include "clients/bridge/view.h"
#include "clients/cpp/web/origin.h"

namespace tendon::bridge::inverse_json_test {
namespace {

using nlohmann::json;

/// All signed permutations. Each positive sign is tested both written and omitted.
std::vector<std::string> every_permutation() {
  std::vector<std::string> all;
  for (const std::string letters : {"XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"}) {
    for (unsigned signs = 0; signs < 8; ++signs) {
      std::string text;
      for (unsigned i = 0; i < 3; ++i) {
        if ((signs >> i & 1U) != 0) text += '-';
        text += letters[i];
      }
      all.push_back(text);
    }
  }
  return all;
}

std::string force_message(const std::string& command) {
  return R"({"inverse3":[{"device_id":"0A","commands":{"set_cursor_force":)" + command + "}}]}";
}

TEST(InverseBasis, EveryPermutationTurnsAllThereAndBack) {
  const Quat lies = quaternion_of(operator_from_device("right=-y up=z user=-x"));
  const Vec3 base(0.1, -0.2, 0.3);
  const Mat3 turned = Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized()).toRotationMatrix();
  std::set<std::string> different;
  int left_handed = 0;
  for (const std::string& permutation : every_permutation()) {
    const auto basis = basis_of(permutation);
    ASSERT_TRUE(basis) << permutation;
    const Frame frame = inverse_frame(*basis);
    const View view(frame, lies);
    if (!frame.is_right_handed()) ++left_handed;
    EXPECT_EQ(view.base_position(view.position(base)), base) << permutation;
    EXPECT_EQ(view.base_force(view.force(base)), base) << permutation;
    EXPECT_EQ(view.base_torque(view.torque(base)), base) << permutation;
    // A point that is fixed to the rotated handle has only one position in the base frame.
    const Mat3 seen = view.orientation(quaternion_of(turned));
    EXPECT_NEAR(seen.determinant(), 1, 1e-12) << permutation;
    const Vec3 point = frame.position(Vec3(1, 2, 3));  // in the handle frame, whose axes are the operator's
    EXPECT_TRUE((seen * point).isApprox(view.position(turned * Vec3(1, 2, 3)), 1e-12)) << permutation;
    const Vec3 shown = view.position(base);
    different.insert(std::to_string(shown.x()) + std::to_string(shown.y()) + std::to_string(shown.z()));
  }
  EXPECT_EQ(different.size(), 48U);
  EXPECT_EQ(left_handed, 24);
}

TEST(InverseBasis, TheFirstLetterSaysWhichAxisOfTheServiceIsTheClientsX) {
  const Vec3 service(1, 2, 3);  // right, forward, up
  EXPECT_EQ(*basis_of("XYZ") * service, Vec3(1, 2, 3));
  EXPECT_EQ(*basis_of("XZY") * service, Vec3(1, 3, 2)) << "the client's y is up";
  EXPECT_EQ(*basis_of("YZX") * service, Vec3(2, 3, 1)) << "its x is forward";
  EXPECT_EQ(*basis_of("X-YZ") * service, Vec3(1, -2, 3));
  EXPECT_EQ(*basis_of("+X+Y-Z") * service, Vec3(1, 2, -3));
}

TEST(InverseBasis, AnyOtherTextIsNone) {
  for (const char* text :
       {"", "X", "XY", "XYZX", "XXZ", "xyz", "X Y Z", "XY-", "X--YZ", "XYW", "-", "X,Y,Z", "+-XYZ"}) {
    EXPECT_FALSE(basis_of(text)) << text;
  }
}

TEST(InverseWish, AForceIsReadAsVectorAndAsValues) {
  for (const char* name : {"vector", "values"}) {
    const Wish wish = read_wish(force_message("{\"" + std::string(name) + R"(":{"x":1,"y":-2.5,"z":3e-1}})"));
    EXPECT_TRUE(wish.read);
    ASSERT_EQ(wish.devices.size(), 1U) << name;
    EXPECT_EQ(wish.devices[0].device_id, "0A");
    EXPECT_EQ(wish.devices[0].force, Vec3(1, -2.5, 0.3));
    EXPECT_TRUE(wish.refused.empty());
  }
  const Wish both = read_wish(force_message(R"({"values":{"x":1,"y":1,"z":1},"vector":{"x":2,"y":2,"z":2}})"));
  EXPECT_EQ(both.devices[0].force, Vec3(2, 2, 2)) << "the newer word";
}

TEST(InverseWish, AForceWithoutThreeNumbersIsRefusedInASentence) {
  for (const char* command :
       {"{}", "null", "3", "[]", R"({"vector":null})", R"({"vector":{"x":1,"y":2}})", R"({"values":[1,2,3]})",
        R"({"vector":{"x":1,"y":2,"z":"3"}})", R"({"vector":{"x":1,"y":2,"z":null}})",
        R"({"vector":{},"values":{"x":1,"y":1,"z":1}})"}) {
    const Wish wish = read_wish(force_message(command));
    EXPECT_TRUE(wish.read);
    ASSERT_EQ(wish.refused.size(), 1U) << command;
    EXPECT_NE(wish.refused[0].find("\"vector\" or \"values\""), std::string::npos);
    ASSERT_EQ(wish.devices.size(), 1U);
    EXPECT_FALSE(wish.devices[0].force) << command;
  }
}

TEST(InverseWish, APositionServoIsRefusedAndProbesAreNot) {
  const Wish wish = read_wish(R"({"inverse3":[{"device_id":"0A","commands":{
      "set_cursor_position":{"position":{"x":0,"y":0,"z":0}},"probe_position":{},"set_led":{}}}],
      "wireless_verse_grip":[{"device_id":"0B","commands":{"probe_orientation":{}}}],"unheard_of":1})");
  ASSERT_EQ(wish.refused.size(), 1U);
  EXPECT_EQ(wish.refused[0].rfind("set_cursor_position: ", 0), 0U);
  EXPECT_EQ(wish.ignored, 2U) << "set_led and unheard_of";
}

TEST(InverseWish, OurOwnWordAsksForTorqueAndGripForce) {
  const Wish wish = read_wish(R"({"inverse3":[{"device_id":"0A","commands":{"tendon":{
      "torque_nm":{"x":0.1,"y":0.2,"z":0.3},"grip_force_n":-0.5}}}]})");
  ASSERT_EQ(wish.devices.size(), 1U);
  EXPECT_EQ(wish.devices[0].torque, Vec3(0.1, 0.2, 0.3));
  EXPECT_EQ(wish.devices[0].grip_force, -0.5);
  EXPECT_FALSE(wish.devices[0].force);
}

TEST(InverseWish, ABasisIsSetForTheSessionOrForOneDevice) {
  const Wish wish = read_wish(R"({"session":{"configure":{"basis":{"permutation":"XZY"},"profile":{"name":"x"}}},
      "inverse3":[{"device_id":"0A","configure":{"basis":{"permutation":"-XYZ"}}}]})");
  EXPECT_EQ(wish.permutation, "XZY");
  EXPECT_EQ(wish.devices[0].permutation, "-XYZ");
  const Wish wrong = read_wish(R"({"session":{"configure":{"basis":{"permutation":"XXY"}}}})");
  EXPECT_FALSE(wrong.permutation);
  EXPECT_EQ(wrong.refused.size(), 1U);
}

TEST(InverseWish, NonsenseOfEachKindIsNotReadAndSaysWhy) {
  const std::string deep = std::string(17, '[') + std::string(17, ']');
  for (const std::string& text : std::vector<std::string>{
           "", "null", "7", "\"text\"", "[]", "{", "{}{}", "hello", deep, force_message(deep), std::string(70000, ' '),
           force_message(R"({"vector":{"x":1e999,"y":0,"z":0}})"), force_message(R"({"vector":{"x":NaN,"y":0,"z":0}})"),
           force_message(R"({"vector":{"x":-Infinity,"y":0,"z":0}})"), "{\"inverse3\":\"\xff\xfe\"}"}) {
    const Wish wish = read_wish(text);
    EXPECT_FALSE(wish.read) << text.substr(0, 80);
    ASSERT_EQ(wish.refused.size(), 1U);
    EXPECT_EQ(wish.refused[0].rfind("not read: ", 0), 0U);
    EXPECT_TRUE(wish.devices.empty());
  }
}

TEST(InverseWish, SixteenDeepAndBracketsInTextsAreRead) {
  EXPECT_TRUE(read_wish("{\"a\":" + std::string(15, '[') + std::string(15, ']') + "}").read);
  EXPECT_TRUE(read_wish(R"({"a":"[[[[[[[[[[[[[[[[[[[[\"[[[[[[[[{{{{{{{{{{{"})").read);
}

TEST(InverseWish, ThousandRefusalsAreEightSentences) {
  std::string many = R"({"inverse3":[0)";
  for (int i = 0; i < 1000; ++i) many += ",{}";
  EXPECT_EQ(read_wish(many + "]}").refused.size(), kMostRefusals);
}

TEST(InverseJson, AReplyHasWhatIsaacLabAndTheTutorialsRead) {
  DeviceNews device{.name = "right", .device_id = "0A", .grip_id = "0B", .permutation = "XYZ"};
  device.state.emplace();
  device.state->position = Vec3(1, 2, 3);
  device.state->velocity = Vec3(4, 5, 6);
  device.state->force = Vec3(7, 8, 9);
  device.state->orientation = {.w = 0.5, .x = 0.5, .y = -0.5, .z = 0.5};
  device.state->buttons = 0b1010;
  device.state->permitted_force_n = std::numeric_limits<double>::infinity();
  const json reply = json::parse(to_json({.devices = {device}}));
  EXPECT_FALSE(reply.contains("session_id"));
  const json& arm = reply["inverse3"][0];
  EXPECT_FALSE(arm.contains("config"));
  EXPECT_EQ(arm["device_id"], "0A");
  EXPECT_EQ(arm["state"]["cursor_position"], (json{{"x", 1}, {"y", 2}, {"z", 3}}));
  EXPECT_EQ(arm["state"]["cursor_velocity"], (json{{"x", 4}, {"y", 5}, {"z", 6}}));
  EXPECT_EQ(arm["state"]["current_cursor_force"], (json{{"x", 7}, {"y", 8}, {"z", 9}}));
  EXPECT_EQ(arm["state"]["control_mode"], "idle");
  const json& grip = reply["wireless_verse_grip"][0];
  EXPECT_EQ(grip["device_id"], "0B");
  EXPECT_EQ(grip["state"]["orientation"], (json{{"w", 0.5}, {"x", 0.5}, {"y", -0.5}, {"z", 0.5}}));
  EXPECT_EQ(grip["state"]["buttons"], (json{{"a", false},
                                            {"b", true},
                                            {"c", false},
                                            {"button_0", false},
                                            {"button_1", true},
                                            {"button_2", false},
                                            {"button_3", true}}));
  EXPECT_TRUE(reply["tendon"]["devices"][0]["permitted_force_n"].is_null()) << "no bound";
}

TEST(InverseJson, TheFirstMessageHasTheConfigurations) {
  DeviceNews device{.name = "left", .device_id = "0A", .grip_id = "0B", .permutation = "XZY", .left_handed = true};
  const json first = json::parse(to_json({.session_id = 3, .devices = {device}}));
  EXPECT_EQ(first["session_id"], 3);
  EXPECT_EQ(
      first["inverse3"][0]["config"],
      (json{
          {"type", "inverse3"}, {"handedness", "left"}, {"preset", "defaults"}, {"basis", {{"permutation", "XZY"}}}}));
  EXPECT_FALSE(first["inverse3"][0].contains("state")) << "none is known, and none is made up";
  EXPECT_EQ(first["inverse3"][0]["status"]["ready"], false);
  EXPECT_EQ(first["tendon"]["devices"][0]["connected"], false);
}

TEST(InverseJson, AnIdIsEightDigitsOfTheName) {
  EXPECT_EQ(id_of("right"), id_of("right"));
  EXPECT_NE(id_of("right"), id_of("left"));
  EXPECT_EQ(id_of("right").size(), 8U);
  EXPECT_EQ(id_of("right").find_first_not_of("0123456789ABCDEF"), std::string::npos);
}

TEST(InverseOrigin, PagesOfThisMachineAndAllowedOnesComeIn) {
  const std::vector<std::string> allowed = {"https://lab.example", "null"};
  for (const char* origin :
       {"http://localhost", "http://localhost:8000", "https://page.localhost:1", "http://127.0.0.1:80",
        "http://127.3.2.1", "http://[::1]:8000", "https://lab.example", "null"}) {
    EXPECT_TRUE(web::may_come_from(origin, allowed)) << origin;
  }
  for (const char* origin :
       {"", "http://", "https://evil.example", "http://localhost.evil.example", "http://127.0.0.1.evil.example",
        "http://evil.example:80@localhost", "http://localhost:80@evil.example", "http://evil.example/.localhost",
        "https://lab.example:8443", "https://LAB.example", "file://", "ftp://localhost", "http://[::2]", "http://[::1",
        "http://10.0.0.1", "localhost"}) {
    EXPECT_FALSE(web::may_come_from(origin, allowed)) << origin;
  }
  EXPECT_FALSE(web::may_come_from("null", {}));
}

}  // namespace
}  // namespace tendon::bridge::inverse_json_test
