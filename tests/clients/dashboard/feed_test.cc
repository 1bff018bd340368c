// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/feed.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "tests/clients/dashboard/full_board.h"

namespace tendon::dash::feed_test {
namespace {

using nlohmann::json;

class FeedTest : public testing::Test {
 protected:
  FeedTest() {
    for (std::uint32_t device : {0U, 1U}) {
      board_.described(
          {.device = device, .name = device == 0 ? "left" : "right", .loop_hz = 1000, .channels = {{.name = "main"}}});
    }
  }
  void states(std::uint32_t device, int count) {
    for (int i = 0; i < count; ++i) {
      DeviceState state;
      state.tick = ++tick_;
      state.device = device;
      board_.observe(state);
    }
  }
  void tick() { feed_.tick(now_ += Feed::kTick); }
  std::vector<json> all(Feed::PageId page) {
    std::vector<json> texts;
    while (const auto text = feed_.next(page)) texts.push_back(json::parse(*text));
    return texts;
  }
  static std::vector<std::string> types(const std::vector<json>& texts) {
    std::vector<std::string> types;
    for (const json& text : texts) types.push_back(text.at("type"));
    return types;
  }
  using Types = std::vector<std::string>;

  LocalTime now_{std::chrono::seconds(5)};
  Board board_;
  WebCounts counts_;
  Feed feed_{board_, {.server = "127.0.0.1:47100"}, counts_, now_};
  std::uint64_t tick_ = 0;
};

TEST_F(FeedTest, TellsANewPageOfTheServerThenOfWhatIsNew) {
  const auto page = feed_.join(now_);
  EXPECT_EQ(counts_.pages, 1U);
  states(0, 16);
  tick();
  auto texts = all(page);
  EXPECT_EQ(types(texts), (Types{"server", "reports", "states"}));
  EXPECT_EQ(texts[0]["devices"][1]["name"], "right");
  EXPECT_EQ(texts[2]["tick"].size(), 16U);
  tick();
  EXPECT_TRUE(all(page).empty()) << "nothing is new";
  states(0, 1);
  tick();
  EXPECT_EQ(types(all(page)), Types{"states"});
  board_.tell(Contact::kLost, "gone");
  tick();
  EXPECT_EQ(types(all(page)), Types{"server"});
}

TEST_F(FeedTest, TellsEachPageOfTheDeviceThatItLooksAt) {
  const auto left = feed_.join(now_);
  const auto right = feed_.join(now_);
  tick();
  all(left);
  all(right);
  EXPECT_TRUE(feed_.receive(now_, right, "watch 1"));
  states(0, 3);
  states(1, 5);
  tick();
  const auto of_left = all(left);
  const auto of_right = all(right);
  EXPECT_EQ(types(of_left), Types{"states"});
  EXPECT_EQ(of_left[0]["device"], 0);
  EXPECT_EQ(types(of_right), (Types{"reports", "states"}));
  EXPECT_EQ(of_right[1]["device"], 1);
  EXPECT_EQ(of_right[1]["tick"].size(), 5U);
}

TEST_F(FeedTest, TellsOfTheOtherDevicesBesideWhereAPageAsks) {
  const auto page = feed_.join(now_);
  const auto plain = feed_.join(now_);
  EXPECT_TRUE(feed_.receive(now_, page, "watch 1 beside"));
  tick();
  all(page);
  all(plain);
  states(0, 3);
  states(1, 5);
  tick();
  states(0, 2);
  tick();
  auto texts = all(page);
  ASSERT_EQ(types(texts), (Types{"states", "states"}));
  EXPECT_EQ(texts[0]["device"], 0);
  EXPECT_EQ(texts[0]["tick"], json{10}) << "the newest one";
  EXPECT_EQ(texts[1]["device"], 1);
  EXPECT_EQ(texts[1]["tick"].size(), 5U);
  for (const json& text : all(plain)) EXPECT_EQ(text.at("device"), 0);
  EXPECT_TRUE(feed_.receive(now_, page, "watch 1"));
  states(0, 1);
  tick();
  EXPECT_EQ(types(all(page)), Types{"reports"});
}

TEST_F(FeedTest, TellsOfTheCouplingOfTheWatchedDevice) {
  const auto left = feed_.join(now_);
  const auto right = feed_.join(now_);
  EXPECT_TRUE(feed_.receive(now_, right, "watch 1"));
  tick();
  all(left);
  all(right);
  board_.observe(both_ends().own);
  board_.observe(*both_ends().peer);
  tick();
  const auto texts = all(left);
  ASSERT_EQ(types(texts), Types{"ports"});
  EXPECT_EQ(texts[0]["rows"].size(), 1U);
  EXPECT_TRUE(all(right).empty());
  tick();
  EXPECT_TRUE(all(left).empty());
  board_.observe(both_ends().own);
  tick();
  EXPECT_TRUE(feed_.receive(now_, left, "watch 1"));
  tick();
  EXPECT_EQ(types(all(left)), Types{"reports"}) << "of the device before";
}

TEST_F(FeedTest, ReportsOnceASecond) {
  const auto page = feed_.join(now_);
  int reports = 0;
  for (int i = 0; i < 599; ++i) {
    tick();
    for (const json& text : all(page)) reports += text.at("type") == "reports" ? 1 : 0;
  }
  EXPECT_EQ(reports, 10);
}

TEST_F(FeedTest, KeepsTheNewestForAPageThatDoesNotRead) {
  const auto page = feed_.join(now_);
  for (int i = 0; i < 1000; ++i) {
    states(0, 10);
    board_.tell(Contact::kOpen, "change " + std::to_string(i));
    tick();
  }
  const auto texts = all(page);
  EXPECT_EQ(texts.size(), 2 + PagePost::kMaxBatches);
  EXPECT_EQ(texts[0]["words"], "change 999");
  EXPECT_EQ(texts.back()["tick"].back(), 10'000);
  EXPECT_EQ(counts_.states_skipped, 10'000U - 10 * PagePost::kMaxBatches);
}

TEST_F(FeedTest, SendsAwayWhoSpeaksAnotherLanguage) {
  for (const char* line :
       {"", "watch", "watch ", "watch -1", "watch 16", "watch 1 ", "watch 1e1", "watch beside", " beside",
        "watch 1 beside beside", "watch 99999999999", "hello", "arm 0", "{\"type\":\"watch\"}"}) {
    const auto page = feed_.join(now_);
    EXPECT_FALSE(feed_.receive(now_, page, line)) << line;
    feed_.leave(page);
  }
  EXPECT_FALSE(feed_.receive(now_, 12345, "watch 0")) << "nobody";
  EXPECT_EQ(counts_.pages, 0U);
}

TEST_F(FeedTest, SendsAwayWhoSpeaksTooFast) {
  const auto page = feed_.join(now_);
  EXPECT_TRUE(feed_.receive(now_, page, "watch 1"));
  EXPECT_TRUE(feed_.receive(now_, page, "watch 0"));
  EXPECT_FALSE(feed_.receive(now_, page, "watch 1"));
  now_ += std::chrono::seconds(1);
  EXPECT_TRUE(feed_.receive(now_, page, "watch 1"));
}

}  // namespace
}  // namespace tendon::dash::feed_test
