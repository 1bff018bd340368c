// SPDX-License-Identifier: Apache-2.0
#include "server/clients/unknown_keys.h"

#include <gtest/gtest.h>

namespace tendon::unknown_keys_test {
namespace {

using namespace std::chrono_literals;

TEST(UnknownKeys, AreToldAtOnceAndThenAtMostOnceAMinute) {
  UnknownKeys keys;
  LocalTime now{100s};
  EXPECT_FALSE(keys.due(now));
  EXPECT_FALSE(keys.take("refused \"wall\" at 192.0.2.1:4000: busy"));
  ASSERT_TRUE(keys.take(UnknownKeys::notice(parse_address("192.0.2.1:4000"))));
  ASSERT_TRUE(keys.due(now));
  EXPECT_EQ(keys.line(now, 1),
            "1 Hello with a key that is not in the folder `keys` of [network], the newest from 192.0.2.1:4000: this "
            "client gets no reply");
  EXPECT_FALSE(keys.due(now + 1h)) << "there is nothing new";
  for (int i = 0; i < 45; ++i) keys.take(UnknownKeys::notice(parse_address("[2001:db8::7]:" + std::to_string(i + 1))));
  EXPECT_FALSE(keys.due(now + UnknownKeys::kPeriod - Duration{1}));
  now += UnknownKeys::kPeriod;
  ASSERT_TRUE(keys.due(now));
  const std::string line = keys.line(now, 46);
  EXPECT_TRUE(line.starts_with("45 Hellos with a key")) << line;
  EXPECT_NE(line.find("the newest from [2001:db8::7]:45: "), std::string::npos) << line;
}

}  // namespace
}  // namespace tendon::unknown_keys_test
