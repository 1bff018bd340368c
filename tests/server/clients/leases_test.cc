// SPDX-License-Identifier: Apache-2.0
#include "tests/server/clients/sealed_server.h"

#include <string>

namespace tendon::leases_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

TEST_F(TwoDevices, GivesEachEngineItsDeviceAndItsChannel) {
  Client left = controller(wall_, "192.0.2.1:4000");  // requests no particular device
  Client right = controller(other_, "192.0.2.2:4000", {.device = "right", .channel = "guidance"});
  run(seconds(1), {&left, &right});
  const auto channels = stats().channels;
  ASSERT_EQ(channels.size(), 3U);
  EXPECT_GT(channels[0].forces, 500U);
  EXPECT_GT(channels[1].forces, 500U);
  EXPECT_EQ(channels[2].forces, 0U);
  EXPECT_EQ(channels[0].holder, "wall");
  EXPECT_EQ(channels[1].holder, "other");
  EXPECT_EQ(stats().denied, 0U);
  EXPECT_NE(mail().forces[0].take(), nullptr);
  EXPECT_NE(mail(1).forces[0].take(), nullptr);
  EXPECT_EQ(mail(1).forces[1].take(), nullptr);
  ASSERT_TRUE(right->description().has_value());
  EXPECT_EQ(right->description()->name, "right");
  EXPECT_EQ(right->description()->channels.at(0).holder, "other");
}

TEST_F(TwoDevices, RefusesWhatIsNotThereAndSaysWhatIs) {
  Client a = controller(wall_, "192.0.2.1:4000", {.device = "middle"});
  run(milliseconds(50), {&a});
  EXPECT_EQ(a->stats().code, Code::kInvalid);
  EXPECT_EQ(a->stats().reason, "there is no device \"middle\", only \"left\", \"right\"");
  Client b = controller(wall_, "192.0.2.2:4000", {.device = "right", .channel = "bone"});
  run(milliseconds(50), {&b});
  EXPECT_EQ(b->stats().reason, "there is no channel \"bone\", only \"guidance\", \"tissue\"");
  Client c = controller(wall_, "192.0.2.3:4000", {.device = "rihgt"});
  run(milliseconds(50), {&c});
  EXPECT_EQ(c->stats().reason, "there is no device \"rihgt\", only \"left\", \"right\"; did you mean right?");
}

TEST_F(TwoDevices, ALeaseIsTakenFromAHolderThatHasFallenSilentAndNotBefore) {
  Client first = opened(other_, "192.0.2.1:4000", {.device = "right", .channel = "tissue"});
  EXPECT_TRUE(first->holds());
  Client second = controller(wall_, "192.0.2.2:4000", {.device = "right", .channel = "tissue", .take_lease = true});
  run(seconds(2), {&first, &second});
  EXPECT_FALSE(second->holds());
  EXPECT_EQ(phase(second), Phase::kOpen);
  EXPECT_EQ(second->stats().forces, 0U);
  EXPECT_EQ(tissue().holder, "other");

  const LocalTime silent = now_;  // the session continues for 2 s, but nothing is received from it
  run(milliseconds(400), {&second});
  EXPECT_EQ(tissue().holder, "other");
  while (!second->holds() && now_ - silent < seconds(1)) run(milliseconds(10), {&second});
  EXPECT_TRUE(second->holds());
  EXPECT_GE(now_ - silent, milliseconds(500));
  EXPECT_EQ(tissue().handovers, 1U);
  run(milliseconds(300), {&first, &second});
  EXPECT_FALSE(first->holds()) << "it was told that it has lost the lease";
  EXPECT_EQ(first->stats().lease_lost_to, "wall");
  EXPECT_EQ(phase(first), Phase::kOpen);
  EXPECT_EQ(tissue().holder, "wall");
}

TEST_F(TwoDevices, ForcesThatTheHandNeverFeelsDoNotRenewALease) {
  Client first = opened(other_, "192.0.2.1:4000", {.device = "right", .channel = "tissue"});
  Client second = controller(wall_, "192.0.2.2:4000", {.device = "right", .channel = "tissue", .take_lease = true});
  run(seconds(2), {&first, &second});
  ASSERT_TRUE(first->holds());
  tick_step_ = 4096;  // each state overwrites the previous one, so every force answers a forgotten state
  const std::uint64_t forces = first->stats().forces;
  run(seconds(1), {&first, &second});
  EXPECT_GT(first->stats().forces, forces + 400);
  EXPECT_GT(stats().unanswerable, 400U);
  EXPECT_TRUE(second->holds());
}

TEST_F(TwoDevices, WhoMayTakeOverNeedNotWait) {
  Client first = opened(wall_, "192.0.2.1:4000", {.device = "right", .channel = "tissue"});
  Client second = controller(other_, "192.0.2.2:4000", {.device = "right", .channel = "tissue", .take_lease = true});
  run(milliseconds(100), {&first, &second});
  EXPECT_TRUE(second->holds());
  EXPECT_FALSE(first->holds());
  const std::uint64_t forces = first->stats().forces;
  run(milliseconds(300), {&first, &second});
  EXPECT_EQ(first->stats().forces, forces) << "the loser sends no more";
  EXPECT_GT(stats().denied, 0U) << "and what it sent before it knew was not taken";
  EXPECT_EQ(tissue().handovers, 1U);
}

TEST_F(TwoDevices, AGivenLeaseIsFreeAlsoIfItWasAskedForJustBefore) {
  Client first = opened(wall_, "192.0.2.1:4000", {.device = "right", .channel = "tissue"});
  EXPECT_TRUE(first->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_FALSE(first->holds());
  EXPECT_EQ(tissue().holder, "");
  EXPECT_TRUE(first->take_lease());
  EXPECT_TRUE(first->give_lease());
  run(milliseconds(50), {&first});
  EXPECT_EQ(tissue().holder, "");
  EXPECT_FALSE(first->holds()) << "what was asked before is answered after";
  EXPECT_TRUE(first->take_lease());
  run(milliseconds(50), {&first});
  EXPECT_TRUE(first->holds());
}

TEST_F(TwoDevices, AControllerArmsAndDisarmsWhileAnotherHoldsTheLease) {
  Client holder = opened(wall_, "192.0.2.1:4000", {.device = "right", .channel = "tissue"});
  Client second = controller(other_, "192.0.2.2:4000", {.device = "right", .channel = "tissue"});
  run(milliseconds(100), {&holder, &second});
  ASSERT_FALSE(second->holds());
  const auto orders = [](Mailboxes& mail) {
    std::vector<HapticOrder::Kind> kinds;
    for (; mail.orders.front() != nullptr; mail.orders.pop()) kinds.push_back(mail.orders.front()->kind);
    return kinds;
  };
  orders(mail(1));
  loop().take_notices();
  ASSERT_TRUE(second->disarm());
  ASSERT_TRUE(second->rearm());
  run(milliseconds(100), {&holder, &second});
  EXPECT_EQ(orders(mail(1)), (std::vector{HapticOrder::Kind::kDisarm, HapticOrder::Kind::kRearm}));
  EXPECT_TRUE(orders(mail()).empty()) << "the device of another";
  EXPECT_EQ(take_notices(), (std::vector<std::string>{"disarmed by \"other\"", "rearmed by \"other\""}));
  EXPECT_TRUE(holder->holds());
}

TEST_F(TwoDevices, WhoCannotBeDisarmedAtOnceIsToldToAskAgain) {
  Client a = opened(wall_, "192.0.2.1:4000", {.device = "right", .channel = "guidance"});
  while (mail(1).orders.try_push({.kind = HapticOrder::Kind::kRelease})) {
  }
  loop().take_notices();
  ASSERT_TRUE(a->disarm());
  run(milliseconds(100), {&a});
  EXPECT_TRUE(loop().take_notices().empty()) << "what was not done is not told";
  ASSERT_TRUE(a->order_answer().has_value());
  EXPECT_EQ(a->order_answer()->code, Code::kBusy);
}

TEST_F(SealedServer, AnObserverMayNotDisarm) {
  Client a = observer(screen_, "192.0.2.1:4000");
  run(milliseconds(300), {&a});
  ASSERT_TRUE(a->disarm());
  run(milliseconds(100), {&a});
  EXPECT_EQ(stats().denied, 1U);
  EXPECT_EQ(mail().orders.front(), nullptr);
}

TEST_F(TwoDevices, AChannelWithoutALeaseIsNotTakenFromItsHolder) {
  Client first = opened(wall_, "192.0.2.1:4000", {.device = "right", .channel = "guidance"});
  Client second = controller(other_, "192.0.2.2:4000", {.device = "right", .channel = "guidance", .take_lease = true});
  run(milliseconds(100), {&first, &second});
  EXPECT_EQ(second->stats().code, Code::kBusy);
  EXPECT_TRUE(first->holds());
}

}  // namespace
}  // namespace tendon::leases_test
