// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/observer.h"

#include <cstddef>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "tests/server/servers.h"

// Runs the observer and the network loop of a server in virtual time. The network does not lose datagrams.

namespace tendon::dash::observer_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

const std::string kCoupled =
    "[teleoperation]\nrole = \"leader\"\n[teleoperation.energy_tank]\n"
    "[teleoperation.coupling]\nstiffness_n_per_m = 400\ndamping_n_s_per_m = 4\n";

class ObserverTest : public Servers {
 protected:
  void serve(const std::vector<std::string>& names, std::uint32_t first_id = 1, std::size_t max_observers = 8) {
    std::vector<Scene> scenes;
    for (const std::string& name : names) {
      const std::string group = "group = \"of-" + name + "\"\n";
      scenes.push_back(device_named(name, group + (port_ ? kCoupled : "") + more_));
    }
    scenes[0].network.max_observers = max_observers;
    Assembly::Config config{.watched = Mailboxes::Capacities{.steps = 16, .flight = 16, .datagrams = 1}};
    config.network.secret.fill(static_cast<std::byte>(first_id));
    config.network.first_connection_id = first_id;
    Servers::serve(scenes, 1, config);
  }
  void run(Duration length) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      ++tick_;
      if (assembly_) run_server();
      observer_->turn(now_);
      for (; !wire_.empty(); wire_.pop_front()) {
        Datagram& datagram = wire_.front();
        if (datagram.to == own_.self)
          own_.inbox.push_back(std::move(datagram));
        else if (assembly_ && datagram.to == server_)
          ends_[0].inbox.push_back(std::move(datagram));
      }
    }
  }
  void run_server() {
    for (std::size_t i = 0; i < devices_.size(); ++i) {
      DeviceState state;
      state.tick = tick_;
      state.sampled = PeerTime(now_.time_since_epoch());
      state.device = static_cast<std::uint32_t>(i);
      state.force_wanted = Vec3(1, 2, 3);
      state.buttons = 2;
      state.field = FieldState{.generation = 3, .depth = 0.5};
      mail(i).state.put(state);
      if (port_) mail(i).port_out[0].put(*port_);
    }
    assembly_->turn_network(0, now_);
  }
  static std::vector<std::string> many(int devices) {
    std::vector<std::string> names;
    for (int i = 0; i < devices; ++i) names.push_back("d-" + std::to_string(i));
    return names;
  }
  void watch(const std::string& device) {
    observer_.emplace(own_, server_, Observer::Config{.device = device, .seed = 1}, board_, now_);
  }
  std::vector<std::string> names() const {
    std::vector<std::string> names;
    for (const auto& [number, device] : board_.devices()) names.push_back(device.about ? device.about->name : "?");
    return names;
  }
  double seconds_since(PeerTime at) const { return tendon::seconds(now_.time_since_epoch() - at.time_since_epoch()); }
  using Names = std::vector<std::string>;

  End own_{wire_, parse_address("127.0.0.1:5000")};
  std::uint64_t tick_ = 0;
  std::optional<PortState> port_;  ///< if set, the state of the coupling of every device
  std::string more_;               ///< of every scene
  Board board_;
  std::optional<Observer> observer_{std::in_place, own_, server_, Observer::Config{.seed = 1}, board_, now_};
};

TEST_F(ObserverTest, TriesEveryAddressOfTheServerAndStaysWhereItIsAnswered) {
  serve({"left"});
  const Address first = parse_address("[::1]:47100");
  const Address second = parse_address("192.0.2.1:47100");
  observer_.emplace(own_, first, Observer::Config{.further = {second, server_}, .seed = 1}, board_, now_);
  run(milliseconds(2500));
  EXPECT_EQ(observer_->server(), second);
  EXPECT_EQ(board_.words(), "no answer from [::1]:47100: is tendond running there?");
  run(seconds(3));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(observer_->server(), server_);
  stop();
  run(seconds(5));
  EXPECT_EQ(board_.contact(), Contact::kUnanswered);
  serve({"left"}, 2);
  run(seconds(15));
  EXPECT_EQ(board_.contact(), Contact::kOpen);
  EXPECT_EQ(observer_->server(), server_);
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
  EXPECT_EQ(assembly_->network().stats().timed_out, 0U) << "the first session was ended by a Bye";
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

TEST_F(ObserverTest, IsToldWhichFieldTheDeviceRenders) {
  more_ = "[field]\nallow = [\"main\"]\n[[channel]]\nname = \"main\"\n";
  serve({"left"});
  run(milliseconds(200));
  const auto& field = board_.devices().at(0).newest->field;
  ASSERT_TRUE(field);
  EXPECT_EQ(field->generation, 3U);
  EXPECT_EQ(field->depth, 0.5);
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
    EXPECT_EQ(handle->group, device == 0 ? "of-left" : "of-right");
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
  stop();
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
  serve({"left"}, 1, 0);
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
  stop();
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
  EXPECT_EQ(assembly_->network().stats().timed_out, 0U);
  EXPECT_EQ(observer_->turn(now_), LocalTime::max());
  const auto states = board_.devices().at(0).states;
  run(seconds(1));
  EXPECT_EQ(board_.devices().at(0).states, states);
}

}  // namespace
}  // namespace tendon::dash::observer_test
