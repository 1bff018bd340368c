// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_peer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "tests/clients/bridge/vrpn/program.h"

namespace tendon::bridge::vrpn::vrpn_peer_test {
namespace {

using std::chrono::milliseconds;

class VrpnPeer : public testing::Test {
 protected:
  VrpnPeer() {
    stations_[0].name = "Phantom0";
    stations_[1].name = "Phantom1";
    stations_[0].buttons = 2;
  }

  void comes(const Buffer& bytes) {
    peer_.take_stream(now_, bytes);
    peer_.end_of_batch(now_);
  }
  void comes_by_datagram(const Buffer& bytes) {
    peer_.take_datagram(now_, bytes);
    peer_.end_of_batch(now_);
  }
  void introduces_itself() {
    comes(program_.hello());
    comes(Program::description(Program::kSender, kSenderDescription, "Phantom0"));
    comes(Program::all_types());
  }
  void has_port() {
    Buffer text(10);
    comes(Program::message(40001, kUdpDescription, text));
  }
  std::vector<Said> by_stream() {
    const Buffer bytes(peer_.stream().begin(), peer_.stream().end());
    peer_.sent(bytes.size());
    return reader_.take(bytes, std::exchange(first_, false));
  }
  std::vector<Said> by_datagrams() {
    std::vector<Said> all;
    for (const Buffer& datagram : peer_.datagrams()) {
      EXPECT_LE(datagram.size(), kLongestDatagram);
      for (Said& one : reader_.take(datagram)) all.push_back(std::move(one));
    }
    peer_.datagrams().clear();
    return all;
  }
  static std::vector<Said> of(const std::vector<Said>& all, std::string_view type) {
    std::vector<Said> some;
    for (const Said& one : all) {
      if (one.type == type) some.push_back(one);
    }
    return some;
  }
  DeviceState state(std::uint64_t tick) const {
    DeviceState one;
    one.tick = tick;
    one.position = {0.01, 0.02, 0.03};
    one.velocity = {0.1, 0.2, 0.3};
    one.force_applied = {3, 4, 0};
    one.energy = 0.25;
    return one;
  }
  void pass(Duration time) {
    now_.at += time;
    now_.since_1970 += time;
  }

  std::array<Station, 2> stations_;
  Moment now_{LocalTime(std::chrono::seconds(100)), std::chrono::seconds(1'700'000'000)};
  Program program_;
  Peer peer_{stations_, now_};
  Reader reader_;
  bool first_ = true;
};

TEST_F(VrpnPeer, SaysItsCookieAtOnceAndItsNamesOnceTheProgramHasSaidItsOwn) {
  EXPECT_EQ(peer_.stream().size(), kCookieSize);
  const Buffer hello = program_.hello();
  peer_.take_stream(now_, Bytes(hello).first(23));
  EXPECT_FALSE(peer_.open());
  EXPECT_EQ(peer_.stream().size(), kCookieSize);
  peer_.take_stream(now_, Bytes(hello).subspan(23));
  EXPECT_TRUE(peer_.open());
  EXPECT_GT(peer_.stream().size(), 20 * kHeaderSize);
  EXPECT_TRUE(by_stream().empty()) << "descriptions, and nothing else";
}

TEST_F(VrpnPeer, TalksToAnotherMinorVersionAndSaysSo) {
  Buffer hello = program_.hello();
  hello[15] = std::byte{'0'};
  comes(hello);
  EXPECT_TRUE(peer_.open());
  EXPECT_NE(peer_.next_sentence().value_or("").find("another minor version"), std::string::npos);
}

TEST_F(VrpnPeer, EndsWithAnotherMajorVersionAndWithWhoSpeaksNoVrpn) {
  Buffer hello = program_.hello();
  hello[12] = std::byte{'6'};
  comes(hello);
  EXPECT_FALSE(peer_.open());
  EXPECT_FALSE(peer_.end().empty());
  Peer other(stations_, now_);
  const std::string http = "GET / HTTP/1.1\r\nHost: lab\r\n\r\n";
  other.take_stream(now_, std::as_bytes(std::span(http)));
  EXPECT_FALSE(other.end().empty());
}

TEST_F(VrpnPeer, ReportsAPoseAtEveryStateAndTheRestAtEveryTenth) {
  introduces_itself();
  for (std::uint64_t tick = 1; tick <= 30; ++tick) peer_.report(now_, 0, state(tick), milliseconds(40));
  const auto said = by_stream();
  const auto poses = of(said, "vrpn_Tracker Pos_Quat");
  ASSERT_EQ(poses.size(), 30U);
  EXPECT_EQ(poses[0].sender, "Phantom0");
  EXPECT_EQ(poses[0].number(8), 0.01);
  EXPECT_EQ(poses[0].number(24), 0.03);
  EXPECT_EQ(poses[0].number(56), 1) << "w comes last; not turned";
  const auto velocities = of(said, "vrpn_Tracker Velocity");
  ASSERT_EQ(velocities.size(), 3U);
  EXPECT_EQ(velocities[0].number(16), 0.2);
  const auto forces = of(said, "vrpn_ForceDevice Force");
  ASSERT_EQ(forces.size(), 3U);
  EXPECT_EQ(forces[0].number(8), 4);
  const auto channels = of(said, "vrpn_Analog Channel");
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_EQ(channels[0].number(0), 4) << "channels";
  EXPECT_EQ(channels[0].number(16), 5) << "‖force‖";
  EXPECT_EQ(channels[0].number(24), 0.25) << "energy";
  EXPECT_NEAR(channels[0].number(32), 0.04, 1e-12) << "round trip";
  EXPECT_EQ(peer_.counts().reports, 30U);
}

TEST_F(VrpnPeer, SendsOneDatagramAStateOnceAPortIsDescribedAndButtonsByTcp) {
  introduces_itself();
  has_port();
  EXPECT_EQ(peer_.udp_port(), 40001);
  by_stream();
  DeviceState one = state(1);
  one.buttons = 2;
  peer_.report(now_, 0, one, {});
  EXPECT_EQ(peer_.datagrams().size(), 1U);
  EXPECT_EQ(by_datagrams().size(), 4U);
  const auto first = by_stream();
  ASSERT_EQ(first.size(), 1U);
  EXPECT_EQ(first[0].type, "vrpn_Button States");
  EXPECT_EQ(first[0].whole(0), 2U);
  EXPECT_EQ(first[0].whole(4), 0U);
  EXPECT_EQ(first[0].whole(8), 1U);
  one.tick = 2;
  one.buttons = 1;
  peer_.report(now_, 0, one, {});
  const auto changes = by_stream();
  ASSERT_EQ(changes.size(), 2U);
  EXPECT_EQ(changes[0].type, "vrpn_Button Change");
  EXPECT_EQ(changes[0].whole(0), 0U);
  EXPECT_EQ(changes[0].whole(4), 1U);
  EXPECT_EQ(changes[1].whole(0), 1U);
  EXPECT_EQ(changes[1].whole(4), 0U);
}

TEST_F(VrpnPeer, TellsHowTheHandleIsTurnedAndHowFast) {
  introduces_itself();
  DeviceState one = state(1);
  one.turning = Turning{.orientation = {.w = 0.8, .x = 0, .y = 0.6, .z = 0}, .angular_velocity = {0, 0, 2}};
  one.grip = Grip{.opening = 0.3, .velocity = 0};
  peer_.report(now_, 0, one, {});
  const auto said = by_stream();
  EXPECT_NEAR(of(said, "vrpn_Tracker Pos_Quat")[0].number(40), 0.6, 1e-12) << "y of x, y, z, w";
  EXPECT_NEAR(of(said, "vrpn_Tracker Velocity")[0].number(48), std::sin(0.5 * 2 * 0.01), 1e-12) << "z";
  EXPECT_EQ(of(said, "vrpn_Tracker Velocity")[0].number(64), 0.01) << "s";
  EXPECT_EQ(of(said, "vrpn_Analog Channel")[0].number(8), 0.3) << "the gripper";
}

TEST_F(VrpnPeer, GivesAProgramTheRateThatItAsksForAndOnlyThatOne) {
  introduces_itself();
  Buffer hz;
  put(hz, std::bit_cast<std::uint64_t>(60.0), 8);
  comes(Program::say(Type::kUpdateRate, hz));
  by_stream();
  Peer other(stations_, now_);
  other.take_stream(now_, program_.hello());
  for (std::uint64_t tick = 1; tick <= 1000; ++tick) {
    peer_.report(now_, 0, state(tick), {});
    other.report(now_, 0, state(tick), {});
    other.sent(other.stream().size());
    by_stream();
  }
  EXPECT_NEAR(static_cast<double>(peer_.counts().reports), 60, 1);
  EXPECT_EQ(other.counts().reports, 1000U);
  peer_.report(now_, 0, state(1), {});
  EXPECT_NEAR(static_cast<double>(peer_.counts().reports), 61, 1) << "a server that starts anew is not waited for";
}

TEST_F(VrpnPeer, ANumberMeansWhatItWasDescribedAsLast) {
  comes(program_.hello());
  comes(Program::draw(ForceField{.force = Vec3(1, 0, 0), .radius = 1}));
  EXPECT_TRUE(peer_.drawing(0).empty()) << "not described yet";
  EXPECT_EQ(peer_.counts().nonsense, 1U);
  comes(Program::description(Program::kSender, kSenderDescription, "Phantom1"));
  comes(Program::all_types());
  comes(Program::draw(ForceField{.force = Vec3(1, 0, 0), .radius = 1}));
  EXPECT_FALSE(peer_.drawing(1).empty());
  // All type numbers are shifted by one, so the former plane is now a field. The sender number changes as well.
  comes(Program::all_types(Program::kFirstType + 1));
  comes(Program::description(Program::kSender, kSenderDescription, "Phantom0"));
  comes(Program::message(Program::kSender, Program::kFirstType + static_cast<std::int32_t>(Type::kPlane),
                         field_payload({.force = Vec3(0, 1, 0), .radius = 1})));
  EXPECT_FALSE(peer_.drawing(0).empty());
}

TEST_F(VrpnPeer, AnswersPingsAndWhatATrackerIsAskedFor) {
  introduces_itself();
  stations_[0].workspace = DeviceDescription::Box{.min = {-0.1, -0.2, -0.3}, .max = {0.1, 0.2, 0.3}};
  stations_[0].view = View(*find_frame("openhaptics"), quaternion_of(operator_from_device("right=y up=z user=x")));
  comes(Program::say(Type::kPing));
  comes(Program::say(Type::kRequestWorkspace));
  comes(Program::say(Type::kRequestToRoom));
  comes(Program::say(Type::kRequestUnitToSensor));
  const auto said = by_stream();
  ASSERT_EQ(said.size(), 4U);
  EXPECT_EQ(said[0].type, "vrpn_Base pong_message");
  EXPECT_EQ(said[0].sender, "Phantom0");
  EXPECT_EQ(said[1].type, "vrpn_Tracker Workspace");
  EXPECT_NEAR(said[1].number(0), -0.2, 1e-12) << "the program's x is the device's y";
  EXPECT_NEAR(said[1].number(40), 0.1, 1e-12);
  EXPECT_EQ(said[2].type, "vrpn_Tracker To_Room");
  EXPECT_EQ(said[3].type, "vrpn_Tracker Unit_To_Sensor");
  EXPECT_EQ(said[3].number(56), 1);
}

TEST_F(VrpnPeer, ListsTheNamesThatThereAreWhenAProgramAsksForAnother) {
  comes(program_.hello());
  comes(Program::description(3, kSenderDescription, "Tracker0"));
  comes(Program::description(4, kSenderDescription, "Tracker0"));
  comes(Program::description(1, kSenderDescription, "VRPN Control"));
  const std::string sentence = peer_.next_sentence().value_or("");
  EXPECT_NE(sentence.find("\"Tracker0\""), std::string::npos) << sentence;
  EXPECT_NE(sentence.find("Phantom0, Phantom1"), std::string::npos) << sentence;
  EXPECT_FALSE(peer_.next_sentence()) << "once";
  for (int i = 0; i < 100; ++i) {
    comes(Program::description(5, kSenderDescription, "\n\x1b" + std::to_string(i)));
  }
  int more = 0;
  for (std::optional<std::string> one; (one = peer_.next_sentence()); ++more) {
    EXPECT_EQ(one->find('\x1b'), std::string::npos);
  }
  EXPECT_LE(more, 8);
}

TEST_F(VrpnPeer, SaysOnceWhatItDoesNotRender) {
  introduces_itself();
  comes(Program::description(300, kTypeDescription, "vrpn_ForceDevice setVertex"));
  by_stream();
  for (int i = 0; i < 5; ++i) comes(Program::message(Program::kSender, 300, Buffer(16)));
  comes(Program::say(Type::kPlaneEffects, floats({0, 0, 0, 0.01, 0, 60})));
  auto said = by_stream();
  ASSERT_EQ(said.size(), 1U) << "a wavelength and a frequency alone are no effects";
  EXPECT_EQ(said[0].type, "vrpn_Base text_message");
  EXPECT_EQ(said[0].whole(0), 1U) << "a warning";
  const std::string text(reinterpret_cast<const char*>(said[0].payload.data()) + 8);
  EXPECT_NE(text.find("setVertex"), std::string::npos) << text;
  EXPECT_EQ(peer_.counts().not_rendered, 5U);
  comes(Program::say(Type::kPlaneEffects, floats({0, 0, 0, 0, 0.5, 60})));
  EXPECT_EQ(by_stream().size(), 1U);
}

TEST_F(VrpnPeer, TellsOfADeviceThatStopsGivingForceOnce) {
  introduces_itself();
  DeviceState one = state(1);
  peer_.report(now_, 0, one, {});
  by_stream();
  for (std::uint64_t tick = 2; tick < 10; ++tick) {
    one.tick = tick;
    one.mode = Mode::kFault;
    one.reasons = static_cast<std::uint32_t>(Reason::kFault);
    peer_.report(now_, 0, one, {});
  }
  const auto said = by_stream();
  ASSERT_EQ(of(said, "vrpn_ForceDevice Force_Error").size(), 1U);
  EXPECT_EQ(of(said, "vrpn_ForceDevice Force_Error")[0].whole(0), 2U);
  EXPECT_EQ(of(said, "vrpn_Base text_message").size(), 1U);
}

TEST_F(VrpnPeer, OfTooManyMessagesTheNewestOfEachBatchIsTaken) {
  introduces_itself();
  double newest = 0;
  for (int batch = 0; batch < 10; ++batch) {
    for (int i = 0; i < 1000; ++i) {
      newest += 1e-4;
      peer_.take_datagram(now_, Program::draw(ForceField{.force = Vec3(newest, 0, 0), .radius = 1}));
    }
    peer_.end_of_batch(now_);
    EXPECT_NEAR(peer_.drawing(0).touch({}, 1000).force.x(), newest, 1e-6) << batch;
    pass(milliseconds(100));
  }
  EXPECT_EQ(peer_.counts().messages, 10'000U);
  EXPECT_NEAR(static_cast<double>(peer_.counts().skipped), 10'000 - Peer::kBurst - 9 * 256 - 10, 20);
}

TEST_F(VrpnPeer, ThatDoesNotReadIsDroppedAt64Kilobytes) {
  introduces_itself();
  std::uint64_t tick = 0;
  while (peer_.end().empty() && tick < 10'000) peer_.report(now_, 0, state(++tick), {});
  EXPECT_NE(peer_.end().find("does not read"), std::string::npos);
  EXPECT_LE(peer_.stream().size(), Peer::kMaxUnread + 256);
  const std::size_t before = peer_.stream().size();
  peer_.report(now_, 0, state(++tick), {});
  EXPECT_EQ(peer_.stream().size(), before);
}

TEST_F(VrpnPeer, ALengthOfTwoToThe31EndsIt) {
  introduces_itself();
  Buffer bytes;
  put(bytes, 0x80000000U, 4);
  bytes.resize(kHeaderSize);
  comes(bytes);
  EXPECT_NE(peer_.end().find("invalid length"), std::string::npos);
}

TEST_F(VrpnPeer, DescriptionsByDatagramAndPortsOfOthersAreNonsense) {
  introduces_itself();
  comes_by_datagram(Program::description(Program::kSender, kSenderDescription, "Phantom1"));
  comes_by_datagram(Program::message(40001, kUdpDescription, Buffer(4)));
  comes(Program::message(80, kUdpDescription, Buffer(4)));
  comes(Program::message(70000, kUdpDescription, Buffer(4)));
  comes(Program::message(2000, kTypeDescription, Buffer(4)));
  comes(Program::description(2000, kTypeDescription, "vrpn_Base ping_message"));
  comes(Program::description(-5, kSenderDescription, "Phantom0"));
  comes(Program::message(3, -4, Buffer(10)));
  EXPECT_EQ(peer_.counts().nonsense, 8U);
  EXPECT_FALSE(peer_.udp_port());
  comes(Program::draw(ForceField{.force = Vec3(1, 0, 0), .radius = 1}));
  EXPECT_FALSE(peer_.drawing(0).empty()) << "the sender is still Phantom0";
}

/// NAME.stream contains the data that VRPN's own programs sent to a TCP server. It starts with the cookie.
TEST(VrpnCaptures, WhatRealProgramsSentIsUnderstood) {
  const char* const data = std::getenv("TENDON_DATA");  // NOLINT(concurrency-mt-unsafe): one thread
  if (data == nullptr) GTEST_SKIP() << "TENDON_DATA is not set: no bytes of real programs";
  const std::filesystem::path folder = std::filesystem::path(data) / "vrpn";
  if (!std::filesystem::is_directory(folder)) GTEST_SKIP() << folder << " is not there: no bytes of real programs";
  int replayed = 0;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    if (entry.path().extension() != ".stream") continue;
    std::ifstream file(entry.path(), std::ios::binary);
    const std::string bytes{std::istreambuf_iterator<char>(file), {}};
    std::array<Station, 1> stations;
    stations[0].name = "Tracker0";
    for (const std::size_t piece : {std::size_t{1}, std::size_t{1000}, bytes.size()}) {
      const Moment now{LocalTime(std::chrono::seconds(1)), {}};
      Peer peer(stations, now);
      for (std::size_t at = 0; at < bytes.size(); at += piece) {
        peer.take_stream(now, std::as_bytes(std::span(bytes)).subspan(at, std::min(piece, bytes.size() - at)));
        peer.end_of_batch(now);
      }
      EXPECT_TRUE(peer.open()) << entry.path();
      EXPECT_EQ(peer.end(), "") << entry.path();
      EXPECT_EQ(peer.counts().nonsense, 0U) << entry.path();
      EXPECT_GT(peer.counts().messages, 0U) << entry.path();
    }
    ++replayed;
  }
  EXPECT_GT(replayed, 0) << folder << " has no NAME.stream";
}

}  // namespace
}  // namespace tendon::bridge::vrpn::vrpn_peer_test
