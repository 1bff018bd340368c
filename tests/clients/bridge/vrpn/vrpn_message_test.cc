// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_message.h"

#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <iterator>
#include <limits>
#include <map>
#include <random>
#include <regex>
#include <sstream>
#include <string>

#include "tests/clients/bridge/vrpn/program.h"

namespace tendon::bridge::vrpn::vrpn_message_test {
namespace {

constexpr Stamp kStamp{1'700'000'000, 250'000};
constexpr std::uint32_t kSequence = 7;

std::map<std::string, Buffer> golden() {
  std::ifstream file(TENDON_VRPN_MD);
  const std::string page{std::istreambuf_iterator<char>(file), {}};
  std::map<std::string, Buffer> all;
  static const std::regex kBlock("```golden ([a-z-]+)\n([^`]*)```");
  for (std::sregex_iterator block(page.begin(), page.end(), kBlock), end; block != end; ++block) {
    Buffer& bytes = all[block->str(1)];
    std::istringstream lines(block->str(2));
    for (std::string line; std::getline(lines, line);) {
      std::istringstream words(line.substr(0, line.find(';')));
      for (std::string word; words >> word;) bytes.push_back(static_cast<std::byte>(std::stoi(word, nullptr, 16)));
    }
  }
  return all;
}

Bytes payload_of(const Buffer& message) { return first_message(message).message.value().payload; }

TEST(VrpnMessage, TheGoldenMessagesOfThePageAreTheBytesOfTheCode) {
  auto page = golden();
  const auto is = [&](const std::string& name, const Buffer& bytes) {
    EXPECT_EQ(page.at(name), bytes) << name;
    page.erase(name);
  };
  const auto message = [&](std::int32_t sender, std::int32_t type, const Buffer& payload) {
    Buffer out;
    append(out, {kStamp, sender, type, payload}, kSequence);
    return out;
  };
  const auto of = [&](const std::string& name, Type type, auto&& fill) {
    Buffer payload;
    fill(payload);
    is(name, message(0, static_cast<std::int32_t>(type), payload));
  };
  const Quat turned{.w = 0.8, .x = 0, .y = 0.6, .z = 0};
  Buffer payload;
  append_description(payload, "Phantom0");
  is("sender-description", message(0, kSenderDescription, payload));
  payload.clear();
  append_description(payload, "vrpn_ForceDevice Force");
  is("type-description", message(12, kTypeDescription, payload));
  payload.clear();
  for (const char one : std::string("127.0.0.1")) payload.push_back(static_cast<std::byte>(one));
  payload.push_back(std::byte{0});
  is("udp-description", message(40001, kUdpDescription, payload));
  const auto ours = cookie();
  is("cookie", {ours.begin(), ours.end()});
  of("pose", Type::kPosQuat, [&](Buffer& out) { append_pose(out, {0.01, -0.02, 0.03}, turned); });
  of("velocity", Type::kVelocity, [&](Buffer& out) { append_velocity(out, {0.1, 0.2, -0.3}, turned, 0.01); });
  of("workspace", Type::kWorkspace, [](Buffer& out) {
    append_workspace(out, {-0.05, -0.06, -0.07}, {0.05, 0.06, 0.07});
  });
  of("to-room", Type::kToRoom, [](Buffer& out) { append_identity_to_room(out); });
  of("unit-to-sensor", Type::kUnitToSensor, [](Buffer& out) { append_pose(out, Vec3::Zero(), Quat{}); });
  of("button", Type::kButtonChange, [](Buffer& out) { append_button(out, 2, true); });
  of("buttons", Type::kButtonStates, [](Buffer& out) { append_buttons(out, 5, 3); });
  of("channels", Type::kChannel, [](Buffer& out) {
    const std::array<double, 4> channels = {0.5, 1.25, -0.001, 0.04};
    append_channels(out, channels);
  });
  of("force", Type::kForce, [](Buffer& out) { append_force(out, {0.5, -1.5, 2}); });
  of("force-error", Type::kForceError, [](Buffer& out) { append_error(out, 2); });
  of("text", Type::kText, [](Buffer& out) { append_text(out, Severity::kWarning, "no"); });
  of("ping", Type::kPing, [](Buffer&) {});
  of("pong", Type::kPong, [](Buffer&) {});

  EXPECT_EQ(port_in_hello(page.at("hello")), 40000);
  EXPECT_EQ(read_update_rate(payload_of(page.at("update-rate"))), 60);
  const auto field = read_field(payload_of(page.at("force-field"))).value();
  EXPECT_TRUE(field.origin.isApprox(Vec3(0.01, 0.02, 0.03), 1e-6));
  EXPECT_EQ(field.force, Vec3(1, -2, 3));
  EXPECT_EQ(field.jacobian(0, 0), -100);
  EXPECT_EQ(field.jacobian(2, 0), 5) << "row by row";
  EXPECT_EQ(field.jacobian(0, 2), 0);
  EXPECT_EQ(field.radius, 0.25);
  const auto plane = read_plane(payload_of(page.at("plane"))).value();
  EXPECT_EQ(plane.normal, Vec3(0, 2, 0));
  EXPECT_NEAR(plane.offset, 0.02, 1e-9);
  EXPECT_NEAR(plane.spring, 0.8, 1e-7);
  EXPECT_NEAR(plane.damping, 0.001, 1e-9);
  EXPECT_EQ(plane.dynamic_friction, 0.25);
  EXPECT_EQ(plane.static_friction, 0.5);
  EXPECT_EQ(plane.index, 1);
  for (const char* const name : {"hello", "update-rate", "force-field", "plane"}) page.erase(name);
  EXPECT_TRUE(page.empty()) << page.begin()->first << " is on the page, and nothing reads it";
}

TEST(VrpnMessage, ACookieOfAnotherMinorVersionIsKinAndOneOfAnotherMajorIsNot) {
  auto theirs = cookie();
  EXPECT_EQ(kinship(theirs), Kinship::kSame);
  theirs[15] = std::byte{'1'};
  EXPECT_EQ(kinship(theirs), Kinship::kOtherMinor);
  theirs[12] = std::byte{'8'};
  EXPECT_EQ(kinship(theirs), Kinship::kOtherMajor);
}

TEST(VrpnMessage, AHelloHasAHostWhichIsNotReadAndAPortOfAProgram) {
  const auto port = [](std::string_view text) { return port_in_hello(std::as_bytes(std::span(text))); };
  EXPECT_EQ(port("10.0.0.1 1024"), 1024);
  EXPECT_EQ(port("anyone 65535"), 65535);
  for (const std::string_view wrong : {"", " ", "host", "host ", " 4000", "host 1023", "host 65536", "host -4000",
                                       "host 4000x", "host 99999999999999", "host  4000"}) {
    EXPECT_FALSE(port(wrong)) << wrong;
  }
}

TEST(VrpnMessage, ALengthThatIsImpossibleBreaksTheStream) {
  for (const std::uint32_t length : {0U, 23U, 24U + 64001U, 0x7fffffffU, 0x80000000U, 0xffffffffU}) {
    Buffer bytes;
    put(bytes, length, 4);
    bytes.resize(kHeaderSize + 8);
    EXPECT_TRUE(first_message(bytes).broken) << length;
  }
  Buffer longest;
  put(longest, 24 + 64000, 4);
  longest.resize(kHeaderSize);
  EXPECT_FALSE(first_message(longest).broken);
  EXPECT_FALSE(first_message(longest).message) << "it waits for the rest";
}

TEST(VrpnMessage, NumbersThatAreNotFiniteAreNoForceFieldAndNoPlane) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  for (const double wrong : {nan, infinite, -infinite, 1e13}) {
    for (std::size_t i = 0; i < 15; ++i) {
      Buffer payload = field_payload({.radius = 1});
      const Buffer one = floats({wrong});
      std::copy(one.begin(), one.end(), payload.begin() + static_cast<long>(4 * i));
      EXPECT_FALSE(read_field(payload)) << wrong << " at " << i;
      if (i >= 8) continue;
      payload = plane_payload({.normal = Vec3::UnitX()});
      std::copy(one.begin(), one.end(), payload.begin() + static_cast<long>(4 * i));
      EXPECT_FALSE(read_plane(payload)) << wrong << " at " << i;
    }
  }
  EXPECT_FALSE(read_field(field_payload({.radius = nan})));
  EXPECT_FALSE(read_field(field_payload({.radius = -1})));
  EXPECT_TRUE(read_field(field_payload({.radius = std::numeric_limits<float>::max()}))) << "everywhere";
  EXPECT_TRUE(read_field(field_payload({.radius = infinite}))) << "likewise";
  Buffer shorter = field_payload({});
  shorter.pop_back();
  EXPECT_FALSE(read_field(shorter));
}

TEST(VrpnMessage, ATextThatIsLongerThanItsMessageIsNoName) {
  Buffer payload;
  append_description(payload, "Phantom0");
  EXPECT_EQ(read_description(payload), "Phantom0");
  for (const std::uint32_t length : {0U, 10U, 101U, 0x7fffffffU, 0xffffffffU}) {
    Buffer wrong;
    put(wrong, length, 4);
    wrong.insert(wrong.end(), payload.begin() + 4, payload.end());
    EXPECT_FALSE(read_description(wrong)) << length;
  }
  EXPECT_FALSE(read_description(Bytes(payload).first(3)));
  Buffer longest;
  append_description(longest, std::string(99, 'a'));
  EXPECT_TRUE(read_description(longest));
  append_description(longest = {}, std::string(100, 'a'));
  EXPECT_FALSE(read_description(longest));
}

}  // namespace
}  // namespace tendon::bridge::vrpn::vrpn_message_test
