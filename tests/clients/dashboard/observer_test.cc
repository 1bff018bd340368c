// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/observer.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "server/network_loop.h"
#include "tests/support/wire.h"

// The observer and the server's NetworkLoop on virtual time, over a network without loss.

namespace tendon::dash::observer_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

class ObserverTest : public testing::Test {
 protected:
  void serve(const std::vector<std::string>& names, std::uint32_t first_id = 1) {
    NetworkLoop::Config config;
    config.secret.fill(static_cast<std::byte>(first_id));
    config.first_connection_id = first_id;
    mail_.clear();
    for (const std::string& name : names) {
      mail_.push_back(std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .flight = 16, .datagrams = 1}));
      const std::string number = std::to_string(config.devices.size());
      ServedDevice::Config& device = config.devices.emplace_back();
      device.about = {
          .name = name, .model = "model of " + name, .max_force = 8, .loop_hz = 1000, .channels = {{.name = "main"}}};
      device.handle.buttons = {"button " + number};
      if (port_) device.coupling = Couple{.role = PortRole::kLeader};
      device.mail = mail_.back().get();
    }
    server_.inbox.clear();
    loop_ = std::make_unique<NetworkLoop>(config, server_, now_);
  }
  void run(Duration length) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      ++tick_;
      for (std::size_t i = 0; i < mail_.size(); ++i) {
        DeviceState state;
        state.tick = tick_;
        state.sampled = PeerTime(now_.time_since_epoch());
        state.device = static_cast<std::uint32_t>(i);
        state.force_wanted = Vec3(1, 2, 3);
        state.buttons = 2;
        mail_[i]->state.put(state);
        if (port_) mail_[i]->port_out[0].put(*port_);
      }
      if (loop_) loop_->turn(now_);
      observer_->turn(now_);
      for (; !wire_.empty(); wire_.pop_front()) {
        Datagram& datagram = wire_.front();
        (datagram.to == server_.self ? server_ : own_).inbox.push_back(std::move(datagram));
      }
    }
  }
  static std::vector<std::string> many(int devices) {
    std::vector<std::string> names;
    for (int i = 0; i < devices; ++i) names.push_back("d-" + std::to_string(i));
    return names;
  }
  void watch(const std::string& device) {
    observer_.emplace(own_, server_.self, Observer::Config{.device = device, .seed = 1}, board_, now_);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& [number, device] : board_.devices()) names.push_back(device.about ? device.about->name : "?");
    return names;
  }
  double seconds_since(PeerTime at) const { return tendon::seconds(now_.time_since_epoch() - at.time_since_epoch()); }
  using Names = std::vector<std::string>;

  LocalTime now_{seconds(1000)};
  Wire wire_;
  End server_{wire_, parse_address("127.0.0.1:47100")};
  End own_{wire_, parse_address("127.0.0.1:5000")};
  std::vector<std::unique_ptr<Mailboxes>> mail_;
  std::unique_ptr<NetworkLoop> loop_;
  std::uint64_t tick_ = 0;
  std::optional<PortState> port_;  ///< if set, the state of the coupling of every device
  Board board_;
  std::optional<Observer> observer_{std::in_place, own_, server_.self, Observer::Config{.seed = 1}, board_, now_};
};

TEST_F(ObserverTest, TriesEveryAddressOfTheServerAndStaysWhereItIsAnswered) {
  serve({"left"});
  const Address first = parse_address("[::1]:47100");
  const Address second = parse_address("192.0.2.1:47100");
  observer_.emplace(own_, first, Observer::Config{.further = {second, server_.self}, .seed = 1}, board_, now_);
  run(milliseconds(2500));
  EXPECT_EQ(observer_->server(), second);
  EXPECT_EQ(board_.words(), "no answer from [::1]:47100: is tendond running there?");
  run(seconds(3));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(observer_->server(), server_.self);
  loop_.reset();
  run(seconds(5));
  EXPECT_EQ(board_.contact(), Contact::kUnanswered);
  serve({"left"}, 2);
  run(seconds(15));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(observer_->server(), server_.self);
}

TEST_F(ObserverTest, WatchesTheOnlyDeviceOfAServer) {
  serve({"left"});
  run(seconds(2));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(names(), Names{"left"});
  EXPECT_EQ(board_.sessions(), 1U) << "one session is enough";
  EXPECT_GT(board_.devices().at(0).states, 1900U);
  EXPECT_EQ(board_.link().lost, 0U);
}

TEST_F(ObserverTest, ComesBackForAllTheDevicesOfAServerWithSeveral) {
  serve({"left", "right", "foot"});
  run(seconds(2));
  EXPECT_EQ(names(), (Names{"left", "right", "foot"}));
  EXPECT_EQ(board_.sessions(), 2U);
  for (std::uint32_t device : {0U, 1U, 2U}) EXPECT_GT(board_.devices().at(device).states, 1800U) << device;
  EXPECT_EQ(loop_->stats().timed_out, 0U) << "the first session was ended by a Bye";
}

TEST_F(ObserverTest, OfALargeServerItWatchesTheBankOfTheDeviceThatItIsTold) {
  const Names all = many(40);
  serve(all);
  watch("d-20");
  run(seconds(2));
  EXPECT_EQ(names(), Names(all.begin() + 16, all.begin() + 32));
  EXPECT_EQ(board_.sessions(), 2U);
  for (std::uint32_t number = 0; number < 16; ++number) EXPECT_GT(board_.devices().at(number).states, 1800U) << number;
}

TEST_F(ObserverTest, OfABankWithOneDeviceOneSessionIsEnough) {
  serve(many(17));
  watch("d-16");
  run(seconds(2));
  EXPECT_EQ(names(), Names{"d-16"});
  EXPECT_EQ(board_.sessions(), 1U);
  EXPECT_GT(board_.devices().at(0).states, 1900U);
}

TEST_F(ObserverTest, SaysWhichDevicesThereAreWhereItsOwnIsNot) {
  serve(many(40));
  watch("d-40");
  run(seconds(1));
  EXPECT_EQ(board_.contact(), Contact::kRefused);
  EXPECT_NE(board_.words().find("there is no device \"d-40\", only \"d-0\" to \"d-39\""), std::string::npos)
      << board_.words();
}

TEST_F(ObserverTest, IsToldWhatTheEnginesWant) {
  serve({"left", "right"});
  run(seconds(1));
  for (std::uint32_t device : {0U, 1U}) {
    ASSERT_TRUE(board_.devices().at(device).newest->force_wanted) << device;
    EXPECT_EQ(*board_.devices().at(device).newest->force_wanted, Vec3(1, 2, 3));
  }
}

TEST_F(ObserverTest, ComparesTheServersClockWithOurs) {
  serve({"left"});
  EXPECT_FALSE(board_.server_ahead());
  run(seconds(2));
  ASSERT_TRUE(board_.server_ahead());
  EXPECT_LE(std::chrono::abs(*board_.server_ahead()), milliseconds(1)) << "both are told the same time here";
}

TEST_F(ObserverTest, IsToldWhatTheHandlesAre) {
  serve({"left", "right"});
  run(seconds(1));
  for (std::uint32_t device : {0U, 1U}) {
    const auto& handle = board_.devices().at(device).handle;
    ASSERT_TRUE(handle) << device;
    EXPECT_EQ(handle->buttons, Names{"button " + std::to_string(device)});
  }
  const auto version = board_.version();
  run(seconds(3));
  EXPECT_EQ(board_.version(), version) << "it asks once";
  EXPECT_EQ(board_.devices().at(1).newest->buttons, 2U);
}

TEST_F(ObserverTest, AsksForFewStatesWhileNobodyLooks) {
  serve({"left", "right"});
  observer_->set_watched(false);
  run(seconds(1));
  const auto states = [&](std::uint32_t device) { return board_.devices().at(device).states; };
  const auto [left, right] = std::pair(states(0), states(1));
  run(seconds(10));
  EXPECT_NEAR(static_cast<double>(states(0) - left), 10.0 * Observer::kIdleStateHz, 5);
  EXPECT_NEAR(static_cast<double>(states(1) - right), 10.0 * Observer::kIdleStateHz, 5);
  observer_->set_watched(true);
  const auto before = states(1);
  run(seconds(1));
  EXPECT_GT(states(1) - before, 900U);
}

TEST_F(ObserverTest, FindsAServerThatComesLate) {
  run(seconds(5));
  EXPECT_EQ(board_.contact(), Contact::kUnanswered);
  EXPECT_EQ(board_.words(), "no answer from 127.0.0.1:47100: is tendond running there?");
  serve({"left"});
  run(seconds(5));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
}

TEST_F(ObserverTest, FindsAServerAgainThatHasOtherDevicesNow) {
  serve({"left", "right", "foot"});
  run(seconds(1));
  loop_.reset();
  mail_.clear();
  run(seconds(5));
  EXPECT_EQ(board_.contact(), Contact::kUnanswered);
  serve({"only"}, 77);
  run(seconds(8));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(names(), Names{"only"});
  const auto states = board_.devices().at(0).states;
  run(seconds(1));
  EXPECT_GT(board_.devices().at(0).states, states + 900);
}

TEST_F(ObserverTest, SaysWhyItIsRefused) {
  serve({"left"});
  loop_.reset();
  NetworkLoop::Config config;
  config.max_observers = 0;
  config.devices = {{.about = {.name = "left", .model = "model", .loop_hz = 1000, .channels = {{.name = "main"}}},
                     .mail = mail_[0].get()}};
  loop_ = std::make_unique<NetworkLoop>(config, server_, now_);
  run(seconds(1));
  EXPECT_EQ(board_.contact(), Contact::kRefused);
  EXPECT_EQ(board_.words(), "127.0.0.1:47100 refused the connection: there are 0 observers already");
}

TEST_F(ObserverTest, IsToldTheEndsOfACoupling) {
  port_.emplace();
  port_->epoch = port_->sequence = 1;
  serve({"left"});
  for (int i = 0; i < 1000; ++i, ++port_->sequence) run(milliseconds(1));
  ASSERT_TRUE(board_.devices().at(0).ports);
  EXPECT_EQ(role_of(*board_.devices().at(0).ports), PortRole::kLeader);
  EXPECT_FALSE(board_.devices().at(0).ports->peer);
  EXPECT_NEAR(seconds_since(board_.devices().at(0).ports->at), 0, 0.03);
  EXPECT_GT(board_.take_ports(0).size(), 10U);
  port_.reset();
  loop_.reset();
  run(seconds(4));
  serve({"left"}, 1000);
  run(seconds(3));
  EXPECT_FALSE(board_.devices().at(0).ports) << "another server, without a coupling";
}

TEST_F(ObserverTest, SaysByeWhenItStops) {
  serve({"left"});
  run(seconds(1));
  observer_->stop(now_);
  run(seconds(1));
  EXPECT_EQ(loop_->stats().timed_out, 0U);
  EXPECT_EQ(observer_->turn(now_), LocalTime::max());
  const auto states = board_.devices().at(0).states;
  run(seconds(1));
  EXPECT_EQ(board_.devices().at(0).states, states);
}

}  // namespace
}  // namespace tendon::dash::observer_test
