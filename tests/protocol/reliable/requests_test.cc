// SPDX-License-Identifier: Apache-2.0
#include "protocol/reliable/requests.h"

#include <gtest/gtest.h>

#include <chrono>

namespace tendon::requests_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

// After a slow link, the timeout can be many seconds. On a fast link, a lost copy would then cost this time.
TEST(OutgoingRequests, AreSentAgainWithinASecondHoweverSlowTheLink) {
  for (const Duration timeout : {Duration(milliseconds(20)), Duration(seconds(1)), Duration(seconds(12))}) {
    OutgoingRequests requests;
    LocalTime now(seconds(1000));
    ASSERT_TRUE(requests.add(Rearm{}).has_value());
    for (int copy = 0; copy < 12; ++copy) {
      ASSERT_NE(requests.next_due(now), nullptr);
      requests.sent(1, now, timeout);
      const LocalTime next = requests.next_due_time();
      EXPECT_GT(next, now);
      EXPECT_LE(next - now, seconds(1)) << copy;
      now = next;
    }
  }
}

TEST(IncomingRequests, AnAnswerThatIsDueStaysDueWhenItsRequestComesAgain) {
  IncomingRequests requests;
  const Control control{.id = 1, .request = SetStateRate{.hz = 100}};
  ASSERT_TRUE(requests.take(control));
  ASSERT_TRUE(requests.next());
  EXPECT_EQ(requests.next_due(), nullptr);
  requests.answer({.id = 1, .code = Code::kOk, .detail = {}});
  ASSERT_TRUE(requests.take(control));
  ASSERT_NE(requests.next_due(), nullptr);
  requests.sent(1);
  EXPECT_EQ(requests.next_due(), nullptr);
  ASSERT_TRUE(requests.take(control));
  EXPECT_NE(requests.next_due(), nullptr);
}

}  // namespace
}  // namespace tendon::requests_test
