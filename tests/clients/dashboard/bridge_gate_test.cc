// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/bridge_gate.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <vector>

#include "protocol/wire/header.h"

namespace tendon::dash::bridge_gate_test {
namespace {

using std::chrono::milliseconds;
using Datagram = std::vector<std::byte>;

Datagram datagram(std::uint64_t number, Suite suite = Suite::kPlain, std::size_t size = 40) {
  const auto header =
      encode_header({.type = DatagramType::kData, .suite = suite, .connection_id = 1, .packet_number = number});
  Datagram bytes(size, static_cast<std::byte>(number));
  std::copy(header.begin(), header.end(), bytes.begin());
  return bytes;
}

class BridgeGateTest : public testing::Test {
 protected:
  LocalTime now_{};
  BridgeCounts counts_;
};

TEST_F(BridgeGateTest, PassesDatagramsOfAPageOfThisMachine) {
  BridgeGate gate({}, true, counts_, now_);
  EXPECT_TRUE(gate.passes(now_, datagram(1), true));
  EXPECT_TRUE(gate.passes(now_, datagram(2, Suite::kNoise), true));
  EXPECT_EQ(counts_.to_server, 2U);
}

TEST_F(BridgeGateTest, PassesFromElsewhereWhatIsSealedAndNothingElse) {
  BridgeGate gate({}, false, counts_, now_);
  EXPECT_FALSE(gate.passes(now_, datagram(1), true));
  EXPECT_TRUE(gate.passes(now_, datagram(2, Suite::kNoise), true));
  EXPECT_EQ(counts_.plain, 1U);
  EXPECT_EQ(counts_.to_server, 1U);
}

TEST_F(BridgeGateTest, CountsWhatIsNoDatagram) {
  BridgeGate gate({}, true, counts_, now_);
  EXPECT_FALSE(gate.passes(now_, datagram(1), false)) << "a text message";
  EXPECT_FALSE(gate.passes(now_, {}, true));
  EXPECT_FALSE(gate.passes(now_, Datagram(100, std::byte{7}), true));
  EXPECT_FALSE(gate.passes(now_, Datagram(15, std::byte{0x54}), true));
  EXPECT_FALSE(gate.passes(now_, datagram(1, Suite::kPlain, 1201), true));
  EXPECT_EQ(counts_.malformed, 5U);
  EXPECT_EQ(counts_.to_server, 0U);
}

TEST_F(BridgeGateTest, HoldsAPageToItsRateAndForgivesItWithTime) {
  BridgeGate gate({.max_rate_hz = 100}, true, counts_, now_);
  for (int i = 0; i < 500; ++i) gate.passes(now_, datagram(1), true);
  EXPECT_EQ(counts_.to_server, 10U) << "a tenth of a second at once";
  EXPECT_EQ(counts_.too_fast, 490U);
  now_ += milliseconds(50);
  for (int i = 0; i < 500; ++i) gate.passes(now_, datagram(1), true);
  EXPECT_EQ(counts_.to_server, 15U);
  now_ += std::chrono::hours(1);
  for (int i = 0; i < 500; ++i) gate.passes(now_, datagram(1), true);
  EXPECT_EQ(counts_.to_server, 25U) << "an hour of silence buys no flood";
}

TEST_F(BridgeGateTest, KeepsNoMoreThanItsBytesForAPageThatDoesNotRead) {
  BridgeGate gate({.max_waiting = 1000}, true, counts_, now_);
  for (std::uint64_t i = 0; i < 100; ++i) gate.offer(datagram(i, Suite::kPlain, 100));
  EXPECT_EQ(counts_.too_slow, 90U);
  for (std::uint64_t i = 0; i < 10; ++i) EXPECT_EQ(gate.next(), datagram(i, Suite::kPlain, 100));
  EXPECT_FALSE(gate.next());
  gate.offer(datagram(7, Suite::kPlain, 1000));
  EXPECT_TRUE(gate.next()) << "there is room again";
  EXPECT_EQ(counts_.to_page, 11U);
}

}  // namespace
}  // namespace tendon::dash::bridge_gate_test
