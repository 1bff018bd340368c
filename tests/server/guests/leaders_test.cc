// SPDX-License-Identifier: Apache-2.0
//
// Three servers in virtual time: a device with two leaders, and a client of the follower that changes the shares.
#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "protocol/connection.h"
#include "server/guests/couple.h"
#include "tests/server/guests/place.h"
#include "tests/support/wire.h"

namespace tendon::leaders_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t kTrainer = 1;  // channels of shared_follower.toml
constexpr std::uint32_t kTrainee = 2;

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
      const auto* of_session = std::get_if<const Session::Event*>(event);
      if (of_session == nullptr) continue;
      if (const auto* told = std::get_if<Session::RequestAnswered>(*of_session)) answer = *told;
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

class TwoLeaders : public ::testing::Test {
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
  std::optional<Address> cut_;  ///< unreachable address
  std::unique_ptr<Place> follower_;
  std::unique_ptr<Place> trainer_;
  std::unique_ptr<Place> trainee_;
  std::unique_ptr<Desk> desk_;
};

TEST_F(TwoLeaders, AGuestSetsTheScalesOfALeaderThatIsNotEngaged) {
  place();
  run(milliseconds(300));
  const SetScale wanted{.position_scale = 0.5, .force_scale = 2};
  const auto refused = asked(wanted);
  EXPECT_EQ(refused.code, Code::kUnsupported);
  EXPECT_EQ(refused.detail, "this device is the follower: only the leader sets the scales");
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", trainer_->end.self, "main", now_);
  run(milliseconds(100));
  EXPECT_EQ(asked(wanted).code, Code::kOk);
  run(milliseconds(50));
  EXPECT_EQ(follower_->newest(kTrainer).sent.position_scale, 0.5) << "the follower took it";
  EXPECT_EQ(follower_->newest(kTrainee).sent.position_scale, 0) << "of that leader only";
  run(milliseconds(1000));
  ASSERT_EQ(trainer_->phase(), PortPhase::kEngaged);
  const auto busy = asked(wanted);
  EXPECT_EQ(busy.code, Code::kBusy);
  EXPECT_EQ(busy.detail, "the coupling is engaged: use the clutch or disengage it first");
  expect_sound();
}

/// The first leader started later, so it has the higher epoch.
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
  trainee_->mail().orders.try_push({HapticOrder::Kind::kEngage});
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
  EXPECT_EQ(follower_->newest(kTrainer).sent.share, 0.7);
  run(seconds(1));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  EXPECT_EQ(trainee_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(trainee_->newest(0).peer->share, 0.3);
  run(milliseconds(400));  // ramp time
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
  EXPECT_GT(follower_->newest(kTrainee).sent.share, 0.3);
  EXPECT_LT(follower_->newest(kTrainee).sent.share, 0.4) << "on a straight line";
  run(milliseconds(500));
  EXPECT_EQ(follower_->newest(kTrainee).sent.share, 0.9);
  EXPECT_NEAR(follower_->newest(kTrainer).sent.share.value_or(-1), 0.1, 1e-12);
  EXPECT_TRUE(follower_->said("\"trainee\" has the share 0.9, set by \"desk\""));
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
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}), "this channel is not used by a leader");
  follower_.reset();
  follower_ = std::make_unique<Place>(wire_, scene_of("shared_follower.toml", {"teleoperation.leader="}), 9, now_);
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "desk", now_);
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = kTrainer, .share = 0.5}), "this device has only one leader");
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50003", trainer_->end.self, "main", now_);
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}),
            "this device is a leader: the shares are set at the follower");
}

TEST_F(TwoLeaders, AChannelHasOneOtherEndAndAnotherChannelAnother) {
  place();
  run(milliseconds(800));
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  Couple couple = couple_of(*trainer_->scene.loop.control.coupling);
  couple.channel = 0;
  EXPECT_EQ(asked(couple).detail, "this channel is not used by a leader");
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "trainer", now_);
  couple.channel = kTrainer;
  run(milliseconds(300));
  const auto answer = asked(couple);
  EXPECT_EQ(answer.code, Code::kBusy);
  EXPECT_EQ(answer.detail, "the device is coupled with \"" + trainer_->scene.name + "\"");
}

TEST_F(TwoLeaders, WhoeverTakesTheChannelOfASilentLeaderMayCouple) {
  place();
  run(seconds(3));
  cut_ = trainer_->end.self;
  desk_ = std::make_unique<Desk>(wire_, "127.0.0.1:50002", follower_->end.self, "trainer", now_);
  run(milliseconds(700));  // the lease has expired, the session has not
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
  trainee_->mail().orders.try_push({HapticOrder::Kind::kEngage});
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
  for (Place* one : {trainer_.get(), trainee_.get()}) one->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  ASSERT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  trainee_->mail().orders.try_push({HapticOrder::Kind::kDisengage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
}

}  // namespace
}  // namespace tendon::leaders_test
