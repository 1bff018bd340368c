// SPDX-License-Identifier: Apache-2.0
#include "protocol/secrets/hello_limit.h"

#include <gtest/gtest.h>

namespace tendon::hello_limit_test {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

int admitted(HelloLimit& limit, LocalTime now, const Address& from, int asked) {
  int count = 0;
  for (int i = 0; i < asked; ++i) count += limit.admit(now, from) ? 1 : 0;
  return count;
}

TEST(HelloLimit, LetsABurstThroughAndThenSoManyASecond) {
  HelloLimit limit({});
  const Address from = parse_address("192.0.2.1:4000");
  LocalTime now{seconds(1)};
  EXPECT_EQ(admitted(limit, now, from, 1000), HelloLimit::kBurst);
  int in_ten_seconds = 0;
  for (int i = 0; i < 1000; ++i) in_ten_seconds += admitted(limit, now += milliseconds(10), from, 1);
  EXPECT_EQ(in_ten_seconds, 10 * HelloLimit::kPerSecond);
  EXPECT_EQ(admitted(limit, now + seconds(3600), from, 1000), HelloLimit::kBurst);
}

TEST(HelloLimit, IsOnePerIpWhateverThePort) {
  HelloLimit limit({});
  const LocalTime now{seconds(1)};
  EXPECT_EQ(admitted(limit, now, parse_address("192.0.2.1:4000"), 100), HelloLimit::kBurst);
  EXPECT_EQ(admitted(limit, now, parse_address("192.0.2.1:4001"), 100), 0);
  EXPECT_EQ(admitted(limit, now, parse_address("192.0.2.2:4000"), 100), HelloLimit::kBurst);
}

TEST(HelloLimit, TakesAnIpv6NetworkForOneSource) {
  HelloLimit limit({});
  const LocalTime now{seconds(1)};
  EXPECT_EQ(admitted(limit, now, parse_address("[2001:db8::1]:4000"), 100), HelloLimit::kBurst);
  EXPECT_EQ(admitted(limit, now, parse_address("[2001:db8::ffff:1]:4000"), 100), 0);
  EXPECT_EQ(admitted(limit, now, parse_address("[2001:db8:0:1::1]:4000"), 100), HelloLimit::kBurst);
}

}  // namespace
}  // namespace tendon::hello_limit_test
