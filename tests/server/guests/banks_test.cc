// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "tests/server/guests/sealed_server.h"

namespace tendon::banks_test {
namespace {

using std::chrono::milliseconds;

/// An unencrypted server with 20 devices, "d-0" to "d-19": banks of 16 and 4.
class TwoBanks : public ::testing::Test {
 protected:
  static constexpr std::uint32_t kDevices = 20;

  TwoBanks() {
    NetworkLoop::Config config;
    config.secret.fill(std::byte{7});
    for (std::uint32_t i = 0; i < kDevices; ++i) {
      boxes_.push_back(std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 2, .flight = 2, .datagrams = 1}));
      config.devices.push_back(
          {.about = {.name = name(i), .model = "device", .loop_hz = 1000, .channels = {{.name = "main"}}},
           .mail = boxes_.back().get()});
    }
    loop_ = std::make_unique<NetworkLoop>(config, server_, now_);
  }

  static std::string name(std::uint32_t device) { return "d-" + std::to_string(device); }

  /// A controller of these devices. It returns a force for each state and sends the requests in `asks` once.
  struct Outcome {
    std::optional<Refused> refused;
    std::optional<Welcome> welcome;
    std::vector<std::uint64_t> states = std::vector<std::uint64_t>(limits::kMaxDevices);  ///< by number
    std::vector<std::uint32_t> seen{};  ///< device indices from the x positions of the states, by number
    std::vector<Session::RequestAnswered> answers{};
  };
  Outcome run(const std::vector<std::uint32_t>& devices, const std::vector<Request>& asks = {},
              const std::vector<std::string>& features = {}) {
    Outcome out;
    out.seen.resize(limits::kMaxDevices, 999);
    End end(wire_, parse_address("127.0.0.1:" + std::to_string(++port_)));
    Hello hello{.role = Role::kController, .name = "guest", .features = features};
    for (const std::uint32_t device : devices) hello.claims.push_back({name(device), "", Role::kController});
    ClientRandom random{};
    random.fill(static_cast<std::byte>(port_));
    ClientHandshake handshake({.hello = hello, .random = random}, now_);
    std::optional<Session> session;
    std::array<std::byte, kMaxDatagram> buffer;
    const auto say = [&](auto& mine) {
      while (const std::size_t size = mine.next_datagram(now_, buffer)) {
        server_.inbox.push_back(
            {end.self, server_.self, Bytes(buffer.begin(), buffer.begin() + static_cast<int>(size))});
      }
    };
    for (const LocalTime until = now_ + milliseconds(300); now_ < until && !out.refused; now_ += milliseconds(1)) {
      ++tick_;
      for (std::uint32_t i = 0; i < kDevices; ++i) {
        DeviceState state{.tick = tick_, .sampled = PeerTime(now_.time_since_epoch())};
        state.position.x() = i;
        boxes_[i]->state.put(state);
      }
      session ? say(*session) : say(handshake);
      loop_->turn(now_);
      const Wire arrived = std::exchange(wire_, {});
      for (const Datagram& datagram : arrived) {
        if (datagram.to != end.self) continue;
        session ? void(session->receive(now_, datagram.bytes)) : handshake.receive(now_, datagram.bytes);
      }
      if (!session) handshake.tick(now_);
      if (!session && handshake.outcome()) {
        const auto outcome = *handshake.outcome();
        if (const auto* refused = std::get_if<Refused>(&outcome)) out.refused = *refused;
        if (const auto* accepted = std::get_if<ClientHandshake::Accepted>(&outcome)) {
          out.welcome = accepted->welcome;
          session.emplace(Session::Config{.connection_id = accepted->connection_id}, now_);
          for (const Request& request : asks) session->request(request);
          if (says_bye_) {
            session->close(Code::kShutdown, "done");
            const std::size_t size = session->next_datagram(now_, buffer);
            server_.inbox.push_back(
                {end.self, server_.self, Bytes(buffer.begin(), buffer.begin() + static_cast<int>(size))});
            loop_->turn(now_);
            return out;
          }
        }
      }
      while (const auto event = session ? session->next_event() : nullptr) {
        if (const auto* answered = std::get_if<Session::RequestAnswered>(event)) out.answers.push_back(*answered);
        const auto* told = std::get_if<Session::StateArrived>(event);
        if (told == nullptr) continue;
        const DeviceState& state = told->state;
        ++out.states.at(state.device);
        out.seen.at(state.device) = static_cast<std::uint32_t>(state.position.x());
        session->send(ForceCommand{.sequence = state.tick,
                                   .based_on_tick = state.tick,
                                   .force = Vec3(state.position.x(), 0, 0),
                                   .valid_for = milliseconds(20),
                                   .device = state.device});
      }
    }
    return out;
  }

  LocalTime now_{std::chrono::seconds(1000)};
  Wire wire_;
  End server_{wire_, parse_address("127.0.0.1:47100")};
  std::vector<std::unique_ptr<Mailboxes>> boxes_;
  std::unique_ptr<NetworkLoop> loop_;
  bool says_bye_ = false;  ///< this is in the first datagram; the others are lost
  std::uint64_t tick_ = 0;
  std::uint16_t port_ = 4000;
};

TEST_F(TwoBanks, ASessionNumbersTheDevicesOfItsBankByTheirPlacesInIt) {
  const Outcome told = run({17, 19});
  ASSERT_TRUE(told.welcome.has_value());
  ASSERT_EQ(told.welcome->grants.size(), 2U);
  EXPECT_EQ(told.welcome->grants[0].device, 1U);
  EXPECT_EQ(told.welcome->grants[1].device, 3U);
  EXPECT_GT(told.states[1], 200U);
  EXPECT_EQ(told.seen[1], 17U);
  EXPECT_EQ(told.seen[3], 19U);
  EXPECT_EQ(told.states[0] + told.states[2], 0U) << "which it has not claimed";
  for (const std::uint32_t device : {17U, 19U}) {
    const RemoteForce* const force = boxes_[device]->forces[0].take();
    ASSERT_NE(force, nullptr);
    EXPECT_EQ(force->force.x(), device);
  }
  for (const std::uint32_t device : {1U, 3U}) EXPECT_EQ(boxes_[device]->forces[0].take(), nullptr) << device;
  EXPECT_EQ(loop_->stats().denied, 0U);
}

TEST_F(TwoBanks, InColumnsTheStatesAreOfThatBankToo) {
  const Outcome told = run({16, 17, 18, 19}, {}, {std::string(kFeatureStateColumns)});
  for (std::uint32_t number = 0; number < 4; ++number) EXPECT_EQ(told.seen[number], 16 + number);
  EXPECT_GT(told.states[3], 200U);
}

TEST_F(TwoBanks, ARequestIsForTheDeviceOfThatBank) {
  const Outcome told = run({18}, {Describe{.device = 2}, Describe{.device = 1, .handle = true}, Disarm{.device = 2},
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
    const HapticOrder* const order = boxes_[device]->orders.front();
    return order != nullptr && order->kind == HapticOrder::Kind::kDisarm;
  };
  EXPECT_TRUE(disarmed(18));
  EXPECT_FALSE(disarmed(2));
}

TEST_F(TwoBanks, WhatIsInTwoBanksIsRefusedWithASentence) {
  const Outcome told = run({15, 16});
  ASSERT_TRUE(told.refused.has_value());
  EXPECT_EQ(told.refused->code, Code::kInvalid);
  EXPECT_EQ(told.refused->detail,
            "all devices of a session must be in the same bank: expected \"d-0\" to \"d-15\", and not \"d-16\"");
  const Outcome other = run({19, 3});
  ASSERT_TRUE(other.refused.has_value());
  EXPECT_EQ(other.refused->detail,
            "all devices of a session must be in the same bank: expected \"d-16\" to \"d-19\", and not \"d-3\"");
}

TEST_F(TwoBanks, OfManyDevicesTheFirstAndTheLastAreNamed) {
  const Outcome told = run({20});
  ASSERT_TRUE(told.refused.has_value());
  EXPECT_EQ(told.refused->detail, "there is no device \"d-20\", only \"d-0\" to \"d-19\"");
}

TEST_F(TwoBanks, WhoKnowsNoClaimsHasTheFirstDevice) {
  const Outcome told = run({});
  ASSERT_TRUE(told.welcome.has_value());
  EXPECT_TRUE(told.welcome->grants.empty());
  EXPECT_GT(told.states[0], 200U);
  EXPECT_EQ(told.seen[0], 0U);
}

TEST_F(TwoBanks, WhoseFirstWordIsByeHasLeft) {
  says_bye_ = true;
  run({17});
  EXPECT_EQ(loop_->stats().welcomed, 1U);
  EXPECT_EQ(loop_->stats().channels.at(17).holder, "");
}

TEST_F(TwoBanks, MoreDevicesThanAServerMayHaveAreRefused) {
  NetworkLoop::Config config;
  for (std::uint32_t i = 0; i <= kMostDevices; ++i) {
    config.devices.push_back({.about = {.name = name(i)}, .mail = boxes_[0].get()});
  }
  EXPECT_THROW(NetworkLoop(config, server_, now_), std::invalid_argument);
}

}  // namespace
}  // namespace tendon::banks_test
