// SPDX-License-Identifier: Apache-2.0
#include "protocol/lease_request.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdint>

namespace tendon::lease_request_test {
namespace {

using std::chrono::milliseconds;

constexpr Duration kAgain = milliseconds(500);
constexpr LocalTime kNow = LocalTime(std::chrono::seconds(1));

class LeaseRequests : public ::testing::Test {
 protected:
  void open_as(Role role) { lease.open({.device = 2, .channel = 3, .role = role}, kNow); }
  bool answer(std::uint32_t id, Code code, Duration wait = {}) {
    return lease.take({.id = id, .code = code, .detail = {}, .wait = wait}, kNow);
  }
  bool lose() { return lease.take({.device = 2, .channel = 3, .to = "b"}, session, kNow); }

  Session session{{}, kNow};
  LeaseRequest lease{kAgain, true};
};

TEST_F(LeaseRequests, AControllerHoldsTheLeaseFromTheStart) {
  open_as(Role::kController);
  EXPECT_TRUE(lease.holds());
  EXPECT_EQ(lease.due(), LocalTime::max());
}

TEST_F(LeaseRequests, AnObserverAsksAtOnceAndHoldsTheLeaseOnceItIsGranted) {
  open_as(Role::kObserver);
  EXPECT_EQ(lease.due(), kNow);
  ASSERT_TRUE(lease.ask(session));
  EXPECT_EQ(lease.due(), LocalTime::max());
  EXPECT_FALSE(answer(2, Code::kOk)) << "the answer to another request";
  EXPECT_FALSE(lease.holds());
  EXPECT_TRUE(answer(1, Code::kOk));
  EXPECT_TRUE(lease.holds());
}

TEST_F(LeaseRequests, ARefusalIsRepeatedWhenTheLeaseMayBeFreeAndNotTooOften) {
  open_as(Role::kObserver);
  lease.ask(session);
  answer(1, Code::kBusy, milliseconds(800));
  EXPECT_EQ(lease.due(), kNow + milliseconds(800));
  lease.ask(session);
  answer(2, Code::kBusy, milliseconds(1));
  EXPECT_EQ(lease.due(), kNow + kAgain);
  lease.ask(session);
  answer(3, Code::kDenied);
  EXPECT_EQ(lease.due(), LocalTime::max());
}

TEST_F(LeaseRequests, ALossIsFollowedByARequestUnlessNoneIsWanted) {
  open_as(Role::kController);
  EXPECT_TRUE(lose());
  EXPECT_FALSE(lease.holds());
  EXPECT_EQ(lease.due(), kNow + kAgain);

  lease = LeaseRequest(kAgain, false);
  open_as(Role::kController);
  EXPECT_TRUE(lose());
  EXPECT_EQ(lease.due(), LocalTime::max());
}

TEST_F(LeaseRequests, TheLossOfAnotherChannelChangesNothing) {
  open_as(Role::kController);
  EXPECT_FALSE(lease.take({.device = 2, .channel = 4, .to = "b"}, session, kNow));
  EXPECT_FALSE(lease.take({.device = 1, .channel = 3, .to = "b"}, session, kNow));
  EXPECT_TRUE(lease.holds());
}

// SESSION.md: the loss may be older or newer than the grant in flight.
TEST_F(LeaseRequests, ALossThatCrossesTheAnswerIsFollowedByANewRequest) {
  open_as(Role::kObserver);
  lease.ask(session);
  EXPECT_TRUE(lose());
  EXPECT_FALSE(answer(1, Code::kOk));
  EXPECT_FALSE(lease.holds());
  EXPECT_TRUE(answer(2, Code::kOk));
  EXPECT_TRUE(lease.holds());
}

TEST_F(LeaseRequests, AfterGivingTheLeaseUpAnOlderGrantDoesNotCount) {
  open_as(Role::kObserver);
  lease.ask(session);
  ASSERT_TRUE(lease.give(session));
  EXPECT_FALSE(answer(1, Code::kOk));
  EXPECT_FALSE(lease.holds());
}

TEST_F(LeaseRequests, AServerWithoutLeasesLeavesTheChannelAsItIs) {
  open_as(Role::kController);
  lease.ask(session);
  EXPECT_TRUE(answer(1, Code::kUnsupported));
  EXPECT_TRUE(lease.holds());
}

TEST_F(LeaseRequests, WhenTheSessionEndsNothingIsHeldOrDue) {
  open_as(Role::kController);
  lease.close();
  EXPECT_FALSE(lease.holds());
  EXPECT_EQ(lease.due(), LocalTime::max());
}

TEST_F(LeaseRequests, ARequestThatHasNoRoomInTheSessionIsNotWaitedFor) {
  open_as(Role::kObserver);
  while (session.request(Rearm{})) {
  }
  EXPECT_FALSE(lease.ask(session));
  EXPECT_EQ(lease.due(), kNow);
}

}  // namespace
}  // namespace tendon::lease_request_test
