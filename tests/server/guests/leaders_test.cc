// SPDX-License-Identifier: Apache-2.0
//
// Three servers: a device with two leaders. And a guest at the follower's that moves the shares. On virtual time.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <functional>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "devices/simulated/simulated_device.h"
#include "protocol/connection.h"
#include "server/guests/couple.h"
#include "server/haptic_loop.h"
#include "server/network_loop.h"
#include "server/scene/scene.h"
#include "tests/support/wire.h"

namespace tendon {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t kTrainer = 1;  // channels of shared_follower.toml
constexpr std::uint32_t kTrainee = 2;

Scene scene_of(const std::string& name, const std::vector<std::string>& settings) {
  std::ifstream file(std::filesystem::path(TENDON_SOURCE_DIR) / "deploy" / "scenes" / name);
  return parse_scene(std::string{std::istreambuf_iterator<char>(file), {}}, name, ".", settings);
}

/// A server with one coupled device.
struct Place {
  Place(Wire& wire, const Scene& the_scene, std::uint64_t epoch, LocalTime now)
      : scene(the_scene), end(wire, scene.network.listen), device(scene.simulated()) {
    scene.loop.control.coupling->spring.epoch = epoch;
    haptic = std::make_unique<HapticLoop>(scene.loop, device, *mail);
    NetworkLoop::Config config;
    config.secret.fill(std::byte{7});
    config.first_connection_id = static_cast<std::uint32_t>(1000 * epoch);
    DeviceDescription about{.name = scene.name, .model = "device", .loop_hz = 1000};
    for (const Scene::Channel& channel : scene.channels)
      about.channels.push_back({.name = channel.name, .lease = channel.lease});
    config.devices = {about};
    config.couplings = {couple_of(*scene.loop.control.coupling)};
    auto& leaders = config.leaders.emplace_back();
    for (const CoupledLeader& leader : scene.loop.control.leaders) leaders.push_back(leader.channel);
    if (scene.teleoperation->dial) {
      config.dials.push_back({0,
                              {.server = *scene.teleoperation->dial,
                               .name = scene.name,
                               .seed = epoch,
                               .channel = scene.teleoperation->channel,
                               .couple = *config.couplings[0]}});
    }
    network = std::make_unique<NetworkLoop>(config, end, std::vector<Mailboxes*>{mail.get()});
    network->turn(now);
  }

  void step(LocalTime now) {
    haptic->step(now);
    network->turn(now);
    for (const PortRecord* port = mail->ports.front(); port != nullptr; port = mail->ports.front()) {
      newest[port->channel] = *port;
      mail->ports.pop();
    }
    while (const StepRecord* record = mail->steps.front()) {
      least_energy = std::min(least_energy, record->energy);
      position = record->hand.position;
      mail->steps.pop();
    }
    for (const auto& said : network->take_notices()) notices.push_back(said.text);
  }
  PortPhase phase(std::uint32_t channel = 0) { return newest[channel].sent.phase; }
  double share(std::uint32_t channel) { return newest[channel].sent.share.value_or(-1); }
  bool said(const std::string& words) const {
    return std::any_of(notices.begin(), notices.end(),
                       [&](const std::string& one) { return one.find(words) != std::string::npos; });
  }

  Scene scene;
  End end;
  SimulatedDevice device;
  std::unique_ptr<Mailboxes> mail =
      std::make_unique<Mailboxes>(Mailboxes::Capacities{.steps = 16, .ports = 32, .flight = 2, .datagrams = 1});
  std::unique_ptr<HapticLoop> haptic;
  std::unique_ptr<NetworkLoop> network;
  std::map<std::uint32_t, PortRecord> newest;  ///< by channel
  double least_energy = 0;                     ///< J
  Vec3 position = Vec3::Zero();
  std::vector<std::string> notices;
};

/// A guest that claims a channel and asks for things.
class Desk {
 public:
  Desk(Wire& wire, const std::string& address, const Address& server, const std::string& channel, LocalTime now)
      : end(wire, parse_address(address)), connection_(end, server, {.seed = std::uint64_t{77}}) {
    Hello hello;
    hello.role = Role::kController;
    hello.name = "desk";
    hello.features = {std::string(kFeatureChannels), std::string(kFeatureTeleoperation)};
    hello.claims = {{.device = "", .channel = channel, .role = Role::kController}};
    connection_.greet(now, hello);
  }
  void step(LocalTime now) {
    connection_.begin_turn();
    while (const auto event = connection_.next(now)) {
      const auto* of_session = std::get_if<Session::Event>(&*event);
      if (of_session == nullptr) continue;
      if (const auto* told = std::get_if<Session::RequestAnswered>(of_session)) answer = *told;
    }
    if (wanted_ && connection_.session() != nullptr && connection_.session()->request(*wanted_)) wanted_.reset();
    connection_.flush(now);
  }
  void ask(const Request& request) {
    answer.reset();
    wanted_ = request;
  }

  End end;
  std::optional<Session::RequestAnswered> answer;

 private:
  Connection connection_;
  std::optional<Request> wanted_;
};

class TwoLeaders : public testing::Test {
 protected:
  void place(const std::vector<std::string>& settings = {}, const std::vector<std::string>& follower = {}) {
    follower_ = std::make_unique<Place>(wire_, scene_of("shared_follower.toml", follower), 1, now_);
    trainer_ = std::make_unique<Place>(wire_, scene_of("trainer.toml", settings), 2, now_);
    trainee_ = std::make_unique<Place>(wire_, scene_of("trainee.toml", settings), 3, now_);
    desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50001", follower_->end.self, "desk", now_);
  }

  void deliver(const Datagram& datagram) {
    if (cut_ && (datagram.from == *cut_ || datagram.to == *cut_)) return;
    for (Place* one : {follower_.get(), trainer_.get(), trainee_.get()}) {
      if (one != nullptr && one->end.self == datagram.to) one->end.inbox.push_back(datagram);
    }
    if (desk_->end.self == datagram.to) desk_->end.inbox.push_back(datagram);
  }

  void run(Duration length, const std::function<void()>& each = {}) {
    for (const LocalTime until = now_ + length; now_ < until; now_ += milliseconds(1)) {
      for (Place* one : {follower_.get(), trainer_.get(), trainee_.get()}) {
        if (one != nullptr) one->step(now_);
      }
      desk_->step(now_);
      for (const std::size_t count = wire_.size(); count_ < count; ++count_) deliver(wire_[count_]);
      if (each) each();
    }
  }

  Session::RequestAnswered asked(const Request& request) {
    desk_->ask(request);
    run(milliseconds(50));
    EXPECT_TRUE(desk_->answer);
    return desk_->answer.value_or(Session::RequestAnswered{});
  }

  void expect_sound() {
    for (const Place* one : {follower_.get(), trainer_.get(), trainee_.get()}) {
      if (one != nullptr) {
        EXPECT_GE(one->least_energy, -1e-9) << one->scene.name;
      }
    }
  }

  Wire wire_;
  std::size_t count_ = 0;
  LocalTime now_{seconds(1)};
  std::optional<Address> cut_;  ///< nothing reaches it or comes from it
  std::unique_ptr<Place> follower_;
  std::unique_ptr<Place> trainer_;
  std::unique_ptr<Place> trainee_;
  std::unique_ptr<Desk> desk_;
};

/// The first was started later than the other, so that its epoch is the higher one.
TEST_F(TwoLeaders, WhoTakesAChannelOverIsHeardAndEngagesByAnActOfItsOwn) {
  follower_ = std::make_unique<Place>(wire_, scene_of("shared_follower.toml", {}), 1, now_);
  trainer_ = std::make_unique<Place>(wire_, scene_of("trainer.toml", {}), 20, now_);
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50001", follower_->end.self, "desk", now_);
  run(milliseconds(1500));
  ASSERT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  trainee_ = std::make_unique<Place>(wire_, scene_of("trainee.toml", {"teleoperation.channel=\"trainer\""}), 3, now_);
  run(milliseconds(1500));
  EXPECT_EQ(trainee_->phase(), PortPhase::kAlone) << "the trainer has the channel";
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  cut_ = trainer_->end.self;
  run(seconds(4));
  EXPECT_EQ(trainee_->phase(), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled) << "engaged by nobody";
  cut_.reset();
  trainee_->mail->orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(600));
  EXPECT_EQ(trainee_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  EXPECT_NE(trainer_->phase(), PortPhase::kEngaged) << "the one before is out, though it is back";
  const Vec3 from = follower_->position;
  run(milliseconds(600));
  EXPECT_GT((follower_->position - from).norm(), 2e-3) << "it leads";
  expect_sound();
}

TEST_F(TwoLeaders, EachEngagesByItsOwnButtonAndTheFollowerIsBetweenThem) {
  place();
  run(milliseconds(1500));
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled) << "its hand has not pressed yet";
  EXPECT_EQ(follower_->share(kTrainer), 0.7);
  run(seconds(1));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  EXPECT_EQ(trainee_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(trainee_->newest[0].peer->share, 0.3);
  run(milliseconds(400));  // the ramp
  const std::array from{follower_->position, trainer_->position, trainee_->position};
  run(milliseconds(400));
  const Vec3 mean = 0.7 * (trainer_->position - from[1]) + 0.3 * (trainee_->position - from[2]);
  EXPECT_GT(mean.norm(), 3e-3);
  EXPECT_LT((follower_->position - from[0] - mean).norm(), 0.2 * mean.norm());
  expect_sound();
}

TEST_F(TwoLeaders, AGuestMovesTheSharesWithinHalfASecond) {
  place();
  run(milliseconds(2600));
  ASSERT_EQ(asked(SetShare{.device = 0, .channel = kTrainee, .share = 0.9}).code, Code::kOk);
  EXPECT_GT(follower_->share(kTrainee), 0.3);
  EXPECT_LT(follower_->share(kTrainee), 0.4) << "on a straight line";
  run(milliseconds(500));
  EXPECT_EQ(follower_->share(kTrainee), 0.9);
  EXPECT_NEAR(follower_->share(kTrainer), 0.1, 1e-12);
  EXPECT_TRUE(follower_->said("\"trainee\" is to count 0.9, said by \"desk\""));
  EXPECT_EQ(trainee_->phase(), PortPhase::kEngaged);
  expect_sound();
}

TEST_F(TwoLeaders, ASentenceSaysWhyAShareIsNotMoved) {
  place();
  run(milliseconds(300));
  const auto detail = [this](const SetShare& wanted) {
    const auto answer = asked(wanted);
    EXPECT_EQ(answer.code, Code::kUnsupported);
    return answer.detail;
  };
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}), "no leader comes by this channel");
  follower_->network = nullptr;
  follower_ = std::make_unique<Place>(wire_, scene_of("shared_follower.toml", {"teleoperation.leader="}), 9, now_);
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "desk", now_);
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = kTrainer, .share = 0.5}), "this device has one leader only");
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50003", trainer_->end.self, "main", now_);
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}), "this device is a leader: its follower has the shares");
}

TEST_F(TwoLeaders, AChannelHasOneOtherEndAndAnotherChannelAnother) {
  place();
  run(milliseconds(800));
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  Couple couple = couple_of(*trainer_->scene.loop.control.coupling);
  couple.channel = 0;
  EXPECT_EQ(asked(couple).detail, "no leader comes by this channel");
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "trainer", now_);
  couple.channel = kTrainer;
  run(milliseconds(300));
  const auto answer = asked(couple);
  EXPECT_EQ(answer.code, Code::kBusy);
  EXPECT_EQ(answer.detail, "it is coupled with \"" + trainer_->scene.name + "\"");
}

TEST_F(TwoLeaders, WhoeverTakesTheChannelOfASilentLeaderMayCouple) {
  place();
  run(seconds(3));
  cut_ = trainer_->end.self;
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "trainer", now_);
  run(milliseconds(700));  // the lease is over, and the session is not
  ASSERT_EQ(asked(TakeLease{.device = 0, .channel = kTrainer}).code, Code::kOk);
  Couple couple = couple_of(*trainer_->scene.loop.control.coupling);
  couple.channel = kTrainer;
  EXPECT_EQ(asked(couple).code, Code::kOk);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
}

TEST_F(TwoLeaders, OfWhomOneFallsSilentTheOtherGoesOn) {
  place();
  run(seconds(3));
  ASSERT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  cut_ = trainee_->end.self;
  run(milliseconds(400), [this] { EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged); });
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kLost);
  EXPECT_EQ(trainee_->phase(), PortPhase::kLost);
  cut_.reset();
  run(seconds(5), [this] { EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged); });
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled) << "nobody has pressed";
  trainee_->mail->orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  expect_sound();
}

TEST_F(TwoLeaders, AGuestThatIsNoLeaderEndsBothAndALeaderItself) {
  place();
  run(seconds(3));
  ASSERT_EQ(asked(Disengage{.device = 0}).code, Code::kOk);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  for (Place* one : {trainer_.get(), trainee_.get()}) one->mail->orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  ASSERT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  trainee_->mail->orders.try_push({HapticOrder::Kind::kDisengage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
}

}  // namespace
}  // namespace tendon
