// SPDX-License-Identifier: Apache-2.0
#include "tests/server/guests/sealed_server.h"

#include <string>

namespace tendon::leases_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(TwoDevices, GivesEachEngineItsDeviceAndItsChannel) {
  Client left = controller(wall_, "192.0.2.1:4000");  // requests no particular device
  Client right = controller_of(other_, "192.0.2.2:4000", "right", "guidance");
  run(seconds(1), {&left, &right});
  const auto channels = loop_->stats().channels;
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_GT(channels[0].forces, 500U);
  EXPECT_GT(channels[1].forces, 500U);
  EXPECT_EQ(channels[2].forces, 0U);
  EXPECT_EQ(channels[0].holder, "wall");
  EXPECT_EQ(channels[1].holder, "other");
  EXPECT_EQ(loop_->stats().denied, 0U);
  EXPECT_NE(mail_->forces[0].take(), nullptr);
  EXPECT_NE(second_->forces[0].take(), nullptr);
  EXPECT_EQ(second_->forces[1].take(), nullptr);
  ASSERT_TRUE(right.client->description().has_value());
  EXPECT_EQ(right.client->description()->name, "right");
  EXPECT_EQ(right.client->description()->channels.at(0).holder, "other");
}

TEST_F(TwoDevices, RefusesWhatIsNotThereAndSaysWhatIs) {
  Client a = controller_of(wall_, "192.0.2.1:4000", "middle", "");
  run(milliseconds(50), {&a});
  EXPECT_EQ(a.client->stats().code, Code::kInvalid);
  EXPECT_EQ(a.client->stats().reason, "there is no device \"middle\", only \"left\", \"right\"");
  Client b = controller_of(wall_, "192.0.2.2:4000", "right", "bone");
  run(milliseconds(50), {&b});
  EXPECT_EQ(b.client->stats().reason, "there is no channel \"bone\", only \"guidance\", \"tissue\"");
  Client c = controller_of(wall_, "192.0.2.3:4000", "rihgt", "");
  run(milliseconds(50), {&c});
  EXPECT_EQ(c.client->stats().reason, "there is no device \"rihgt\", only \"left\", \"right\"; did you mean right?");
}

TEST_F(TwoDevices, ALeaseIsTakenFromAHolderThatHasFallenSilentAndNotBefore) {
  Client first = controller_of(other_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->holds());
  Client second = controller_of(wall_, "192.0.2.2:4000", "right", "tissue", true);
  run(seconds(2), {&first, &second});
  EXPECT_FALSE(second.client->holds());
  EXPECT_EQ(phase(second), Phase::kOpen);
  EXPECT_EQ(second.client->stats().forces, 0U);
  EXPECT_EQ(tissue().holder, "other");

  const LocalTime silent = now_;  // the session continues for 2 s, but nothing is received from it
  run(milliseconds(400), {&second});
  EXPECT_EQ(tissue().holder, "other");
  while (!second.client->holds() && now_ - silent < seconds(1)) run(milliseconds(10), {&second});
  EXPECT_TRUE(second.client->holds());
  EXPECT_GE(now_ - silent, milliseconds(500));
  EXPECT_EQ(tissue().handovers, 1U);
  run(milliseconds(300), {&first, &second});
  EXPECT_FALSE(first.client->holds()) << "it was told that it has lost the lease";
  EXPECT_EQ(first.client->stats().lease_lost_to, "wall");
  EXPECT_EQ(phase(first), Phase::kOpen);
  EXPECT_EQ(tissue().holder, "wall");
}

TEST_F(TwoDevices, ForcesThatTheHandNeverFeelsDoNotRenewALease) {
  Client first = controller_of(other_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  Client second = controller_of(wall_, "192.0.2.2:4000", "right", "tissue", true);
  run(seconds(2), {&first, &second});
  ASSERT_TRUE(first.client->holds());
  tick_step_ = 4096;  // each state overwrites the previous one, so every force answers a forgotten state
  const std::uint64_t forces = first.client->stats().forces;
  run(seconds(1), {&first, &second});
  EXPECT_GT(first.client->stats().forces, forces + 400);
  EXPECT_GT(loop_->stats().unanswerable, 400U);
  EXPECT_TRUE(second.client->holds());
}

TEST_F(TwoDevices, WhoMayTakeOverNeedNotWait) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "tissue", true);
  run(milliseconds(100), {&first, &second});
  EXPECT_TRUE(second.client->holds());
  EXPECT_FALSE(first.client->holds());
  const std::uint64_t forces = first.client->stats().forces;
  run(milliseconds(300), {&first, &second});
  EXPECT_EQ(first.client->stats().forces, forces) << "the loser sends no more";
  EXPECT_GT(loop_->stats().denied, 0U) << "and what it sent before it knew was not taken";
  EXPECT_EQ(tissue().handovers, 1U);
}

TEST_F(TwoDevices, AGivenLeaseIsFree) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_FALSE(first.client->holds());
  EXPECT_EQ(tissue().holder, "");
  EXPECT_TRUE(first.client->take_lease());
  run(milliseconds(50), {&first});
  EXPECT_TRUE(first.client->holds());
}

TEST_F(TwoDevices, ALeaseGivenBackBeforeItsAnswerCameIsNotHeld) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&first});
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_TRUE(first.client->take_lease());
  EXPECT_TRUE(first.client->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_EQ(tissue().holder, "");
  EXPECT_FALSE(first.client->holds()) << "what was asked before is answered after";
}

TEST_F(TwoDevices, AControllerArmsAndDisarmsWhileAnotherHoldsTheLease) {
  Client holder = controller_of(wall_, "192.0.2.1:4000", "right", "tissue");
  run(milliseconds(300), {&holder});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "tissue");
  run(milliseconds(100), {&holder, &second});
  ASSERT_FALSE(second.client->holds());
  const auto orders = [](Mailboxes& mail) {
    std::vector<HapticOrder::Kind> kinds;
    for (; mail.orders.front() != nullptr; mail.orders.pop()) kinds.push_back(mail.orders.front()->kind);
    return kinds;
  };
  orders(*second_);
  loop_->take_notices();
  ASSERT_TRUE(second.client->disarm());
  ASSERT_TRUE(second.client->rearm());
  run(milliseconds(100), {&holder, &second});
  EXPECT_EQ(orders(*second_), (std::vector{HapticOrder::Kind::kDisarm, HapticOrder::Kind::kRearm}));
  EXPECT_TRUE(orders(*mail_).empty()) << "the device of another";
  std::vector<std::string> said;
  for (const auto& notice : loop_->take_notices()) said.push_back(notice.text);
  EXPECT_EQ(said, (std::vector<std::string>{"disarmed by \"other\"", "rearmed by \"other\""}));
  EXPECT_TRUE(holder.client->holds());
}

TEST_F(TwoDevices, WhoCannotBeDisarmedAtOnceIsToldToAskAgain) {
  Client a = controller_of(wall_, "192.0.2.1:4000", "right", "guidance");
  run(milliseconds(300), {&a});
  while (second_->orders.try_push({.kind = HapticOrder::Kind::kRelease})) {
  }
  loop_->take_notices();
  ASSERT_TRUE(a.client->disarm());
  run(milliseconds(100), {&a});
  EXPECT_TRUE(loop_->take_notices().empty()) << "what was not done is not told";
  ASSERT_TRUE(a.client->order_answer().has_value());
  EXPECT_EQ(a.client->order_answer()->code, Code::kBusy);
}

TEST_F(SealedServer, AnObserverMayNotDisarm) {
  Client a = observer(screen_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  ASSERT_TRUE(a.client->disarm());
  run(milliseconds(100), {&a});
  EXPECT_EQ(loop_->stats().denied, 1U);
  EXPECT_EQ(mail_->orders.front(), nullptr);
}

TEST_F(TwoDevices, AChannelWithoutALeaseIsNotTakenFromItsHolder) {
  Client first = controller_of(wall_, "192.0.2.1:4000", "right", "guidance");
  run(milliseconds(300), {&first});
  Client second = controller_of(other_, "192.0.2.2:4000", "right", "guidance", true);
  run(milliseconds(100), {&first, &second});
  EXPECT_EQ(second.client->stats().code, Code::kBusy);
  EXPECT_TRUE(first.client->holds());
}

}  // namespace
}  // namespace tendon::leases_test
