// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/operator.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "clients/dashboard/observer.h"
#include "devices/safety/safe_device.h"
#include "server/assembly.h"
#include "tests/support/wire.h"

// The operator, the observer and an engine are used with the loops and the safety layer of the server, in virtual time.

namespace tendon::dash::operator_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;
using State = Press::State;

class Handle final : public Device {
 public:
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    return PositionSample{.at = now, .position = position};
  }
  Vec3 apply(const Vec3& force) noexcept override { return force; }
  Vec3 position = Vec3::Zero();

 private:
  DeviceInfo info_{.name = "handle", .max_force = 8};
};

ClientKey key_of(const std::string& name, std::uint64_t seed, Role role = Role::kController) {
  return {.name = name, .role = role, .key = Ratchet(seed).next()};
}

class OperatorTest : public testing::Test {
 protected:
  OperatorTest() { serve(true); }

  void serve(bool guarded, std::vector<std::string> takeover = {}) {
    Scene scene;
    scene.name = "left";
    scene.channels = {{.name = "main", .lease = milliseconds(500)}, {.name = "operator"}};
    scene.network.takeover = std::move(takeover);
    HapticController::Config& control = scene.loop.control;
    control.limiter.law = Law::kNone;
    control.limiter.longest_hold = milliseconds(2);
    control.max_force = 8;
    control.max_slew = 1e6;
    control.channels = {ChannelRule::kSum, ChannelRule::kSum};
    if (port_) {
      scene.teleoperation = Scene::Teleoperation{};
      control.coupling = Coupling::Config{.spring = {.stiffness = 100, .own_damping = 1, .period = milliseconds(1)}};
    }
    Assembly::Config config{.now = now_, .watched = Mailboxes::Capacities{.steps = 16, .flight = 16, .datagrams = 1}};
    config.network.secret.fill(std::byte{7});
    config.network.keys = {engine_key_, operator_key_};
    loops_.reset();
    safe_ = guarded ? std::make_unique<SafeDevice>(SafeDevice::Config{}, handle_) : nullptr;
    loops_.emplace(std::vector<Assembly::Part>{{.scene = scene, .device = handle_, .safe = safe_.get()}}, config,
                   std::vector<Link*>{&server_});
  }

  ForceClient::Config engine_config(const ClientKey& key, const std::string& channel) const {
    ForceClient::Config config;
    config.name = key.name;
    config.device = "left";
    config.channel = channel;
    config.key = key.key;
    config.seed = 5;
    return config;
  }
  void start_engine(const ClientKey& key, const std::string& channel) {
    engine_.emplace(
        engine_end_, server_.self, engine_config(key, channel),
        [](const DeviceState&) { return Touch(Vec3(-2, 0, 0)); }, now_);
  }
  Operator& with(const ClientKey& key, const std::string& channel) {
    return operator_.emplace(operator_end_, server_.self,
                             Operator::Config{.channel = channel, .key = key.key, .seed = 3}, board_);
  }

  void run(Duration length) {
    for (const LocalTime end = now_ + length; now_ < end; now_ += milliseconds(1)) {
      if (shaking_) handle_.position.x() += 1e-3 * ((++steps_ / 20) % 2 == 0 ? 1 : -1);
      Mailboxes& mail = loops_->devices().front().mail;
      if (port_) obey(mail.orders.front());
      loops_->haptic_groups().front().turn(now_);
      while (mail.steps.front() != nullptr) mail.steps.pop();
      if (port_) mail.port_out[0].put(*port_);
      loops_->log().turn(now_, 0);
      loops_->turn_network(0, now_);
      observer_.turn(now_);
      if (operator_) operator_->turn(now_);
      if (engine_) engine_->turn(now_);
      for (; !wire_.empty(); wire_.pop_front()) {
        for (End* end_of : {&server_, &observer_end_, &operator_end_, &engine_end_}) {
          if (blind_ && end_of == &observer_end_) continue;
          if (wire_.front().to == end_of->self) end_of->inbox.push_back(wire_.front());
        }
      }
    }
  }
  /// Replaces the coupling, which has no peer in this test.
  void obey(const HapticOrder* order) {
    if (order != nullptr && obeys_ && order->kind == HapticOrder::Kind::kEngage) port_->phase = PortPhase::kEngaged;
    if (order != nullptr && obeys_ && order->kind == HapticOrder::Kind::kDisengage) port_->phase = PortPhase::kCoupled;
    ++port_->sequence;
  }
  void serve_leader() {
    port_.emplace();
    port_->epoch = 1;
    port_->phase = PortPhase::kCoupled;
    serve(false);
  }
  const Press& settle() {
    for (int i = 0; i < 200 && board_.press()->state == State::kUnderWay; ++i) run(milliseconds(50));
    return *board_.press();
  }
  Vec3 applied() const { return board_.devices().at(0).newest->force_applied; }
  std::string holder(std::size_t channel) { return loops_->network().stats().channels.at(channel).holder; }

  ClientKey engine_key_ = key_of("wall", 1);
  ClientKey operator_key_ = key_of("operator", 2);
  LocalTime now_{seconds(1000)};
  Wire wire_;
  End server_{wire_, parse_address("192.0.2.1:47100")};
  End observer_end_{wire_, parse_address("192.0.2.2:5000")};
  End operator_end_{wire_, parse_address("192.0.2.2:5001")};
  End engine_end_{wire_, parse_address("192.0.2.3:5000")};
  Handle handle_;
  std::unique_ptr<SafeDevice> safe_;
  std::optional<Assembly> loops_;
  int steps_ = 0;
  bool shaking_ = false;
  std::optional<PortState> port_;
  bool obeys_ = true;
  bool blind_ = false;  ///< whether all messages to the observer are lost
  Board board_;
  Observer observer_{observer_end_, server_.self, {.key = operator_key_.key, .seed = 1}, board_, now_};
  std::optional<ForceClient> engine_;
  std::optional<Operator> operator_;
};

TEST_F(OperatorTest, ArmsAndDisarmsBesideAnEngineAndLeaves) {
  Operator& person = with(operator_key_, "operator");
  start_engine(engine_key_, "main");
  run(seconds(3));
  ASSERT_EQ(applied(), Vec3::Zero());
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  EXPECT_EQ(board_.press()->state, State::kUnderWay);
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(board_.press()->words, "Armed: the device exerts forces.");
  EXPECT_EQ(safe_->status().state, SafetyState::kArmed);
  run(seconds(1));
  EXPECT_EQ(applied(), Vec3(-2, 0, 0));
  EXPECT_EQ(holder(1), "");

  const std::uint64_t forces = loops_->network().stats().channels.at(1).forces;
  ASSERT_EQ(person.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(safe_->status().state, SafetyState::kHomed);
  EXPECT_EQ(applied(), Vec3::Zero());
  run(seconds(2));
  EXPECT_EQ(applied(), Vec3::Zero());
  EXPECT_EQ(holder(0), "wall");
  EXPECT_EQ(holder(1), "");
  EXPECT_EQ(engine_->stats().sessions, 1U) << "the engine was not disturbed";
  EXPECT_EQ(loops_->network().stats().channels.at(1).forces, forces) << "an operator sends no force";
  EXPECT_EQ(loops_->network().stats().timed_out, 0U) << "it has said Bye";
  EXPECT_EQ(board_.sessions(), 1U) << "the observer was not taken for it";
}

TEST_F(OperatorTest, TakesNothingFromTheHolderAndSaysWhoThatIs) {
  serve(true, {"operator"});
  Operator& person = with(operator_key_, "main");
  start_engine(engine_key_, "main");
  run(seconds(3));
  const std::uint64_t welcomed = loops_->network().stats().welcomed;
  const std::string words =
      "\"wall\" holds the channel \"main\", until 500 ms after its last force. It is not taken over.";
  EXPECT_EQ(person.objection(0), words);
  EXPECT_EQ(person.press(now_, 0, Order::kDisarm), words);
  EXPECT_FALSE(board_.press());
  run(seconds(1));
  EXPECT_EQ(loops_->network().stats().welcomed, welcomed) << "nothing was sent";
  EXPECT_EQ(holder(0), "wall");
}

TEST_F(OperatorTest, AnEngineThatHasJustComeIsNotDisturbedEither) {
  serve(true, {"operator"});
  Operator& person = with(operator_key_, "main");
  run(seconds(3));
  ASSERT_EQ(person.objection(0), "");
  start_engine(engine_key_, "main");
  while (holder(0).empty()) run(milliseconds(1));
  ASSERT_EQ(person.objection(0), "") << "else this shows nothing";
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_NE(board_.press()->words.find("Not done: \"wall\" holds the channel \"main\""), std::string::npos)
      << board_.press()->words;
  run(seconds(1));
  EXPECT_EQ(holder(0), "wall");
  EXPECT_EQ(engine_->stats().sessions, 1U);
  EXPECT_EQ(safe_->status().state, SafetyState::kHomed);
}

TEST_F(OperatorTest, SaysThatTheSafetyLayerHasNotGrantedIt) {
  Operator& person = with(operator_key_, "operator");
  shaking_ = true;
  run(seconds(3));
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_NE(board_.press()->words.find("Not armed. It is homed. The handle must be at rest"), std::string::npos)
      << board_.press()->words;
}

TEST_F(OperatorTest, DoesNotBelieveAReportFromBeforeItsOrder) {
  Operator& person = with(operator_key_, "operator");
  run(seconds(3));
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  ASSERT_EQ(settle().state, State::kDone);
  shaking_ = true;
  ASSERT_EQ(person.press(now_, 0, Order::kDisarm), "");
  ASSERT_EQ(settle().state, State::kDone);
  ASSERT_EQ(board_.devices().at(0).report->safety, Safety::kArmed) << "else this shows nothing";
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  EXPECT_EQ(settle().state, State::kFailed) << board_.press()->words;
}

TEST_F(OperatorTest, ADeviceWithoutASafetyLayerIsDisarmedAndArmedToo) {
  serve(false);
  Operator& person = with(operator_key_, "operator");
  start_engine(engine_key_, "main");
  run(seconds(3));
  ASSERT_EQ(applied(), Vec3(-2, 0, 0));
  ASSERT_EQ(person.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(settle().state, State::kDone);
  run(seconds(1));
  EXPECT_EQ(applied(), Vec3::Zero());
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  EXPECT_EQ(settle().state, State::kDone);
  EXPECT_NE(board_.press()->words.find("no safety layer"), std::string::npos);
  run(seconds(1));
  EXPECT_EQ(applied(), Vec3(-2, 0, 0));
}

TEST_F(OperatorTest, ADisarmingGoesBeforeAnArmingAndNothingBeforeADisarming) {
  Operator& person = with(operator_key_, "operator");
  run(seconds(3));
  ASSERT_EQ(person.press(now_, 0, Order::kArm), "");
  run(milliseconds(2));
  EXPECT_EQ(person.press(now_, 0, Order::kArm), "") << "the same again is the same";
  EXPECT_EQ(person.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(board_.press()->order, Order::kDisarm);
  EXPECT_EQ(person.press(now_, 0, Order::kArm), "Another order is in progress.");
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(board_.press()->order, Order::kDisarm);
  run(seconds(3));
  EXPECT_EQ(safe_->status().state, SafetyState::kHomed);
}

TEST_F(OperatorTest, SaysWhatIsMissing) {
  Operator& person = with(operator_key_, "foot");
  EXPECT_EQ(person.objection(0), "There is no connection to the server.");
  run(seconds(2));
  EXPECT_EQ(person.objection(7), "The server has no such device.");
  EXPECT_EQ(person.objection(0),
            "This device has no channel \"foot\", which is set by --arm; it has \"main\", \"operator\".");
  EXPECT_EQ(person.press(now_, 0, Order::kArm), person.objection(0));
}

TEST_F(OperatorTest, SaysThatTheServerDoesNotAnswer) {
  Operator& stranger = with(key_of("stranger", 9), "operator");
  run(seconds(2));
  ASSERT_EQ(stranger.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_EQ(board_.press()->words, "Not done: no answer from 192.0.2.1:47100.");
}

// The observer may have connected to another server with fewer devices.
TEST_F(OperatorTest, ADeviceThatIsGoneWhenTheAnswerComesShowsNothing) {
  Operator& person = with(operator_key_, "operator");
  run(seconds(2));
  blind_ = true;
  run(milliseconds(10));
  ASSERT_EQ(person.press(now_, 0, Order::kDisarm), "");
  board_.counted(0);
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_NE(board_.press()->words.find("does not show it"), std::string::npos) << board_.press()->words;
}

TEST_F(OperatorTest, AnOrderIsNotDoneBeforeTheDeviceShowsIt) {
  Operator& person = with(operator_key_, "operator");
  run(seconds(2));
  blind_ = true;
  ASSERT_EQ(person.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_EQ(board_.press()->words,
            "The server has accepted the order, but the device does not show it. Switch off its power.");
}

TEST_F(OperatorTest, EngagesAndDisengagesALeader) {
  serve_leader();
  Operator& person = with(operator_key_, "operator");
  start_engine(engine_key_, "main");
  run(seconds(2));
  ASSERT_EQ(person.press(now_, 0, Order::kEngage), "");
  EXPECT_EQ(board_.press()->order, Order::kEngage);
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(board_.press()->words, "Engaged: the two handles are coupled.");
  EXPECT_EQ(person.press(now_, 0, Order::kEngage), "The coupling is already engaged.");
  ASSERT_EQ(person.press(now_, 0, Order::kDisengage), "");
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(port_->phase, PortPhase::kCoupled);
  EXPECT_EQ(holder(0), "wall");
  EXPECT_EQ(engine_->stats().sessions, 1U) << "the engine was not disturbed";
}

TEST_F(OperatorTest, SaysWhyNothingIsEngaged) {
  Operator& person = with(operator_key_, "operator");
  run(seconds(2));
  EXPECT_EQ(person.press(now_, 0, Order::kEngage), "This device has no coupling.");
  serve_leader();
  run(seconds(8));
  const std::pair<PortPhase, const char*> cases[] = {{PortPhase::kAlone, "The other end is not connected."},
                                                     {PortPhase::kLost, "The other end does not respond."},
                                                     {PortPhase::kFault, "This device exerts no force at the moment."}};
  for (const auto& [phase, words] : cases) {
    port_->phase = phase;
    run(milliseconds(100));
    EXPECT_EQ(person.press(now_, 0, Order::kEngage), words);
  }
  port_->phase = PortPhase::kCoupled;
  obeys_ = false;
  run(milliseconds(100));
  ASSERT_EQ(person.press(now_, 0, Order::kEngage), "");
  EXPECT_EQ(settle().state, State::kFailed);
  EXPECT_NE(board_.press()->words.find("Not engaged."), std::string::npos) << board_.press()->words;
}

TEST_F(OperatorTest, DisengagingEndsAnEngagingAndADisarmingBoth) {
  serve_leader();
  obeys_ = false;
  Operator& person = with(operator_key_, "operator");
  run(seconds(2));
  ASSERT_EQ(person.press(now_, 0, Order::kEngage), "");
  run(milliseconds(2));
  EXPECT_EQ(person.press(now_, 0, Order::kArm), "Another order is in progress.");
  EXPECT_EQ(person.press(now_, 0, Order::kDisengage), "");
  EXPECT_EQ(person.press(now_, 0, Order::kEngage), "Another order is in progress.");
  EXPECT_EQ(person.press(now_, 0, Order::kDisarm), "");
  EXPECT_EQ(settle().state, State::kDone) << board_.press()->words;
  EXPECT_EQ(board_.press()->order, Order::kDisarm);
}

}  // namespace
}  // namespace tendon::dash::operator_test
