// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/chai3d/shared_hand.h"

#include <gtest/gtest.h>

#include <atomic>
#include <memory>
#include <thread>
#include <vector>

namespace tendon::bridge::chai3d::shared_hand_test {
namespace {

TEST(Box, IsEmptyUntilSomethingWasPut) {
  const auto box = std::make_unique<Box<Asked>>();
  Asked asked{.count = 7};
  EXPECT_FALSE(box->get(asked));
  EXPECT_EQ(asked.count, 7U) << "what the caller had stays";
  box->put({.count = 8});
  EXPECT_TRUE(box->get(asked));
  EXPECT_EQ(asked.count, 8U);
}

TEST(Box, NoReaderSeesHalfOfAValue) {
  const auto box = std::make_unique<Box<HandNow>>();
  std::atomic<bool> stop{false};
  std::atomic<long> read{0};
  std::atomic<long> torn{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] {
      HandNow hand;
      while (!stop) {
        if (!box->get(hand)) continue;
        ++read;
        const auto whole = static_cast<double>(hand.tick);
        if (hand.position[0] != whole || hand.rotation[8] != whole || hand.buttons != hand.tick) ++torn;
      }
    });
  }
  for (std::uint64_t i = 1; i <= 200'000 || (read < 1000 && i < 50'000'000); ++i) {
    HandNow hand{.tick = i, .buttons = i};
    hand.position.fill(static_cast<double>(i));
    hand.rotation.fill(static_cast<double>(i));
    box->put(hand);
  }
  stop = true;
  for (std::thread& reader : readers) reader.join();
  EXPECT_GE(read, 1000);
  EXPECT_EQ(torn, 0);
}

TEST(Box, AWriterThatDiedWhileItWroteBlocksNoReader) {
  // The writer has only written the first word: its counter is odd.
  Box<Asked> box;
  box.put({.count = 1});
  std::uint64_t turn = 0;
  std::memcpy(&turn, static_cast<void*>(&box), sizeof turn);
  turn |= 1U;
  std::memcpy(static_cast<void*>(&box), &turn, sizeof turn);
  Asked asked;
  EXPECT_FALSE(box.get(asked));
  box.put({.count = 2});
  EXPECT_TRUE(box.get(asked)) << "the next writer mends it";
  EXPECT_EQ(asked.count, 2U);
}

}  // namespace
}  // namespace tendon::bridge::chai3d::shared_hand_test
