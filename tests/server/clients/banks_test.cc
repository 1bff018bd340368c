// SPDX-License-Identifier: Apache-2.0
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/server/clients/sealed_server.h"

namespace tendon::banks_test {
namespace {

using std::chrono::milliseconds;

/// An unencrypted server with 20 devices, "d-0" to "d-19", in banks of 16 and 4.
class TwoBanks : public SealedServer {
 protected:
  TwoBanks() {
    config_.keys.clear();
    restart_with_many(20, 1);
  }

  /// Returns a force for each state, and sends each request in `asks` once.
  struct Outcome {
    std::optional<Connection::Ended> refused{};
    std::optional<Welcome> welcome{};
    std::vector<std::uint64_t> states = std::vector<std::uint64_t>(limits::kMaxDevices);     ///< by number
    std::vector<std::uint32_t> seen = std::vector<std::uint32_t>(limits::kMaxDevices, 999);  ///< by number: x
    std::vector<Session::RequestAnswered> answers{};
  };
  Outcome come(const std::vector<std::uint32_t>& devices, const std::vector<Request>& asks = {},
               const std::vector<std::string>& features = {}) {
    Outcome out;
    Hello hello{.role = Role::kController, .name = "guest", .features = features};
    for (const std::uint32_t device : devices) {
      hello.claims.push_back({"d-" + std::to_string(device), "", Role::kController});
    }
    Foreign client(wire_, "127.0.0.1:" + std::to_string(++port_), server_, hello, now_);
    client.leaves_at_once = leaves_at_once_;
    const auto take = [&](const Session::Event& event) {
      if (const auto* answered = std::get_if<Session::RequestAnswered>(&event)) out.answers.push_back(*answered);
      const auto* told = std::get_if<Session::StateArrived>(&event);
      if (told == nullptr) return;
      const DeviceState& state = told->state;
      ++out.states.at(state.device);
      out.seen.at(state.device) = static_cast<std::uint32_t>(state.position.x());
      client.session()->send(ForceCommand{.sequence = state.tick,
                                          .based_on_tick = state.tick,
                                          .force = Vec3(state.position.x(), 0, 0),
                                          .valid_for = milliseconds(20),
                                          .device = state.device});
    };
    run_with(client, milliseconds(10), take);
    for (const Request& request : asks) client.session()->request(request);
    run_with(client, milliseconds(290), take);
    out.refused = client.refused;
    out.welcome = client.welcome;
    return out;
  }

  bool leaves_at_once_ = false;
  std::uint16_t port_ = 4000;
};

TEST_F(TwoBanks, ASessionNumbersTheDevicesOfItsBankByTheirPlacesInIt) {
  const Outcome told = come({17, 19});
  ASSERT_TRUE(told.welcome.has_value());
  ASSERT_EQ(told.welcome->grants.size(), 2U);
  EXPECT_EQ(told.welcome->grants[0].device, 1U);
  EXPECT_EQ(told.welcome->grants[1].device, 3U);
  EXPECT_GT(told.states[1], 200U);
  EXPECT_EQ(told.seen[1], 17U);
  EXPECT_EQ(told.seen[3], 19U);
  EXPECT_EQ(told.states[0] + told.states[2], 0U) << "which it has not claimed";
  for (const std::uint32_t device : {17U, 19U}) {
    const RemoteForce* const force = mail(device).forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force.x(), device);
  }
  for (const std::uint32_t device : {1U, 3U}) EXPECT_EQ(mail(device).forces[0].take(), nullptr) << device;
  EXPECT_EQ(stats().denied, 0U);
}

TEST_F(TwoBanks, InColumnsTheStatesAreOfThatBankToo) {
  const Outcome told = come({16, 17, 18, 19}, {}, {std::string(kFeatureStateColumns)});
  for (std::uint32_t number = 0; number < 4; ++number) EXPECT_EQ(told.seen[number], 16 + number);
  EXPECT_GT(told.states[3], 200U);
}

TEST_F(TwoBanks, ARequestIsForTheDeviceOfThatBank) {
  const Outcome told = come({18}, {Describe{.device = 2}, Describe{.device = 1, .handle = true}, Disarm{.device = 2},
                                   Disarm{.device = 1}, SetStateRate{.hz = 100, .device = 2}, Describe{.device = 4}});
  ASSERT_EQ(told.answers.size(), 6U);
  ASSERT_TRUE(told.answers[0].device.has_value());
  EXPECT_EQ(told.answers[0].device->name, "d-18");
  EXPECT_EQ(told.answers[0].device->device, 2U);
  EXPECT_EQ(told.answers[0].device->channels.at(0).holder, "guest");
  ASSERT_TRUE(told.answers[1].handle.has_value());
  EXPECT_EQ(told.answers[1].handle->device, 1U);
  EXPECT_EQ(told.answers[2].code, Code::kOk);
  EXPECT_EQ(told.answers[3].code, Code::kDenied);
  EXPECT_EQ(told.answers[4].code, Code::kOk);
  EXPECT_LT(told.states[2], 60U);
  EXPECT_EQ(told.answers[5].code, Code::kInvalid) << "the last bank has four";
  const auto disarmed = [this](std::uint32_t device) {
    const HapticOrder* const order = mail(device).orders.front();
    return order != nullptr && order->kind == HapticOrder::Kind::kDisarm;
  };
  EXPECT_TRUE(disarmed(18));
  EXPECT_FALSE(disarmed(2));
}

TEST_F(TwoBanks, WhatIsInTwoBanksIsRefusedWithASentence) {
  const Outcome told = come({15, 16});
  ASSERT_TRUE(told.refused.has_value());
  EXPECT_EQ(told.refused->code, Code::kInvalid);
  EXPECT_EQ(told.refused->reason,
            "all devices of a session must be in the same bank: expected \"d-0\" to \"d-15\", and not \"d-16\"");
  const Outcome other = come({19, 3});
  ASSERT_TRUE(other.refused.has_value());
  EXPECT_EQ(other.refused->reason,
            "all devices of a session must be in the same bank: expected \"d-16\" to \"d-19\", and not \"d-3\"");
}

TEST_F(TwoBanks, WhoKnowsNoClaimsHasTheFirstDevice) {
  const Outcome told = come({});
  ASSERT_TRUE(told.welcome.has_value());
  EXPECT_TRUE(told.welcome->grants.empty());
  EXPECT_GT(told.states[0], 200U);
  EXPECT_EQ(told.seen[0], 0U);
}

TEST_F(TwoBanks, WhoseFirstWordIsByeHasLeft) {
  leaves_at_once_ = true;
  come({17});
  EXPECT_EQ(stats().welcomed, 1U);
  EXPECT_EQ(stats().channels.at(17).holder, "");
}

TEST_F(TwoBanks, MoreDevicesThanAServerMayHaveAreRefused) {
  EXPECT_THROW(restart_with_many(kMostDevices + 1, 1), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::banks_test
