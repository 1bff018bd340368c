// SPDX-License-Identifier: Apache-2.0
#include <memory>
#include <string>
#include <vector>

#include "server/clients/couple.h"
#include "tests/server/clients/place.h"

namespace tendon::leaders_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint32_t kTrainer = 1;  // channels of shared_follower.toml
constexpr std::uint32_t kTrainee = 2;

class TwoLeaders : public Places {
 protected:
  void start() {
    follower_ = place(shipped("shared_follower.toml"), 1);
    leader_ = place(shipped("trainer.toml"), 2);
    second_leader_ = place(shipped("trainee.toml"), 3);
    come(*follower_, "desk");
  }

  void come(const Place& server, const std::string& channel) {
    const Hello hello{.role = Role::kController,
                      .name = "desk",
                      .features = {std::string(kFeatureChannels), std::string(kFeatureTeleoperation)},
                      .claims = {{.device = "", .channel = channel, .role = Role::kController}}};
    desk_ = std::make_unique<Viewer>(wire_, "127.0.0.1:" + std::to_string(++port_), server.end.self, hello, now_);
    clients_ = {desk_.get()};
  }

  Session::RequestAnswered asked(const Request& request) {
    desk_->answer.reset();
    EXPECT_TRUE(desk_->session()->request(request));
    run(milliseconds(50));
    EXPECT_TRUE(desk_->answer);
    return desk_->answer.value_or(Session::RequestAnswered{});
  }

  std::unique_ptr<Viewer> desk_;
  std::uint16_t port_ = 50000;
};

TEST_F(TwoLeaders, AClientSetsTheScalesOfALeaderThatIsNotEngaged) {
  start();
  run(milliseconds(300));
  const SetScale wanted{.position_scale = 0.5, .force_scale = 2};
  const auto refused = asked(wanted);
  EXPECT_EQ(refused.code, Code::kUnsupported);
  EXPECT_EQ(refused.detail, "this device is the follower: only the leader sets the scales");
  come(*leader_, "main");
  run(milliseconds(100));
  EXPECT_EQ(asked(wanted).code, Code::kOk);
  run(milliseconds(50));
  EXPECT_EQ(follower_->newest(kTrainer).sent.position_scale, 0.5) << "the follower took it";
  EXPECT_EQ(follower_->newest(kTrainee).sent.position_scale, 0) << "of that leader only";
  run(milliseconds(1000));
  ASSERT_EQ(leader_->phase(), PortPhase::kEngaged);
  const auto busy = asked(wanted);
  EXPECT_EQ(busy.code, Code::kBusy);
  EXPECT_EQ(busy.detail, "the coupling is engaged: use the clutch or disengage it first");
  expect_sound();
}

/// The first leader started later, so it has the higher epoch.
TEST_F(TwoLeaders, WhoTakesAChannelOverIsHeardAndEngagesByAnActOfItsOwn) {
  follower_ = place(shipped("shared_follower.toml"), 1);
  leader_ = place(shipped("trainer.toml"), 20);
  come(*follower_, "desk");
  run(milliseconds(1500));
  ASSERT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  second_leader_ = place(shipped("trainee.toml", {"teleoperation.channel=\"trainer\""}), 3);
  run(milliseconds(1500));
  EXPECT_EQ(second_leader_->phase(), PortPhase::kAlone) << "the trainer has the channel";
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  cut_off_ = leader_->end.self;
  run(seconds(4));
  EXPECT_EQ(second_leader_->phase(), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled) << "engaged by nobody";
  cut_off_.reset();
  second_leader_->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(600));
  EXPECT_EQ(second_leader_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  EXPECT_NE(leader_->phase(), PortPhase::kEngaged) << "the one before is out, though it is back";
  const Vec3 from = follower_->position;
  run(milliseconds(600));
  EXPECT_GT((follower_->position - from).norm(), 2e-3) << "it leads";
  expect_sound();
}

TEST_F(TwoLeaders, EachEngagesByItsOwnButtonWithItsShare) {
  start();
  run(milliseconds(1500));
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled) << "its hand has not pressed yet";
  EXPECT_EQ(follower_->newest(kTrainer).sent.share, 0.7);
  run(seconds(1));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  EXPECT_EQ(second_leader_->phase(), PortPhase::kEngaged);
  EXPECT_EQ(second_leader_->newest(0).peer->share, 0.3);
  expect_sound();
}

TEST_F(TwoLeaders, AClientMovesTheSharesWithinHalfASecond) {
  start();
  run(milliseconds(2600));
  ASSERT_EQ(asked(SetShare{.device = 0, .channel = kTrainee, .share = 0.9}).code, Code::kOk);
  EXPECT_GT(follower_->newest(kTrainee).sent.share, 0.3);
  EXPECT_LT(follower_->newest(kTrainee).sent.share, 0.4) << "on a straight line";
  run(milliseconds(500));
  EXPECT_EQ(follower_->newest(kTrainee).sent.share, 0.9);
  EXPECT_NEAR(follower_->newest(kTrainer).sent.share.value_or(-1), 0.1, 1e-12);
  EXPECT_TRUE(follower_->said("\"trainee\" has the share 0.9, set by \"desk\""));
  EXPECT_EQ(second_leader_->phase(), PortPhase::kEngaged);
  expect_sound();
}

TEST_F(TwoLeaders, ASentenceSaysWhyAShareIsNotMoved) {
  start();
  run(milliseconds(300));
  const auto detail = [this](const SetShare& wanted) {
    const auto answer = asked(wanted);
    EXPECT_EQ(answer.code, Code::kUnsupported);
    return answer.detail;
  };
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}), "this channel is not used by a leader");
  follower_ = place(shipped("shared_follower.toml", {"teleoperation.leader="}), 9);
  come(*follower_, "desk");
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = kTrainer, .share = 0.5}), "this device has only one leader");
  come(*leader_, "main");
  run(milliseconds(300));
  EXPECT_EQ(detail({.device = 0, .channel = 0, .share = 0.5}),
            "this device is a leader: the shares are set at the follower");
}

TEST_F(TwoLeaders, AChannelHasOneOtherEndAndAnotherChannelAnother) {
  start();
  run(milliseconds(800));
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  Couple couple = couple_of(*leader_->scene.loop.control.coupling);
  couple.channel = 0;
  EXPECT_EQ(asked(couple).detail, "this channel is not used by a leader");
  come(*follower_, "trainer");
  couple.channel = kTrainer;
  run(milliseconds(300));
  const auto answer = asked(couple);
  EXPECT_EQ(answer.code, Code::kBusy);
  EXPECT_EQ(answer.detail, "the device is coupled with \"" + leader_->scene.name + "\"");
}

TEST_F(TwoLeaders, WhoeverTakesTheChannelOfASilentLeaderMayCouple) {
  start();
  run(seconds(3));
  cut_off_ = leader_->end.self;
  come(*follower_, "trainer");
  run(milliseconds(700));  // the lease has expired, but the session has not
  ASSERT_EQ(asked(TakeLease{.device = 0, .channel = kTrainer}).code, Code::kOk);
  Couple couple = couple_of(*leader_->scene.loop.control.coupling);
  couple.channel = kTrainer;
  EXPECT_EQ(asked(couple).code, Code::kOk);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
}

TEST_F(TwoLeaders, OfWhomOneFallsSilentTheOtherGoesOn) {
  start();
  run(seconds(3));
  ASSERT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  cut_off_ = second_leader_->end.self;
  run(milliseconds(400), [this] { EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged); });
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kLost);
  EXPECT_EQ(second_leader_->phase(), PortPhase::kLost);
  cut_off_.reset();
  run(seconds(5), [this] { EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged); });
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled) << "nobody has pressed";
  second_leader_->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  expect_sound();
}

TEST_F(TwoLeaders, AClientThatIsNoLeaderEndsBothAndALeaderItself) {
  start();
  run(seconds(3));
  ASSERT_EQ(asked(Disengage{.device = 0}).code, Code::kOk);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  for (Place* one : {leader_.get(), second_leader_.get()}) one->mail().orders.try_push({HapticOrder::Kind::kEngage});
  run(milliseconds(100));
  ASSERT_EQ(follower_->phase(kTrainee), PortPhase::kEngaged);
  second_leader_->mail().orders.try_push({HapticOrder::Kind::kDisengage});
  run(milliseconds(100));
  EXPECT_EQ(follower_->phase(kTrainee), PortPhase::kCoupled);
  EXPECT_EQ(follower_->phase(kTrainer), PortPhase::kEngaged);
}

}  // namespace
}  // namespace tendon::leaders_test
