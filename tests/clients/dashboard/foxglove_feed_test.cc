// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_feed.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "foxglove.pb.h"
#include "recording.pb.h"

namespace tendon::dash::foxglove_feed_test {
namespace {

using nlohmann::json;

constexpr Duration kUnixOffset = std::chrono::seconds(1'700'000'000);
constexpr Duration kAhead = std::chrono::hours(5);

class FoxgloveFeedTest : public testing::Test {
 protected:
  FoxgloveFeedTest() {
    board_.tell(Contact::kOpen, "connected");
    describe(0, "left");
    describe(1, "right");
    board_.observe_clock(kAhead);
  }
  void describe(std::uint32_t device, const std::string& name) {
    board_.described({.device = device, .name = name, .loop_hz = 1000});
  }
  PeerTime sampled(std::uint64_t tick) const {
    return PeerTime(kAhead + std::chrono::milliseconds(static_cast<std::int64_t>(tick)));
  }
  void states(std::uint32_t device, int count) {
    for (int i = 0; i < count; ++i) {
      DeviceState state;
      state.tick = ++tick_;
      state.device = device;
      state.sampled = sampled(tick_);
      board_.observe(state);
    }
  }
  struct Told {
    std::vector<json> texts;
    std::vector<std::string> data;
  };
  Told told(FoxgloveFeed::ClientId client) {
    Told all;
    while (auto message = feed_.next(client)) {
      if (message->binary) {
        all.data.push_back(message->bytes);
      } else {
        all.texts.push_back(json::parse(message->bytes));
      }
    }
    return all;
  }
  std::uint32_t channel(FoxgloveFeed::ClientId client, const std::string& topic) {
    for (const json& text : told(client).texts) {
      if (text["op"] != "advertise") continue;
      for (const json& one : text["channels"]) channels_[one["topic"]] = one["id"];
    }
    return channels_.contains(topic) ? channels_[topic].get<std::uint32_t>() : 0;
  }
  bool subscribe(FoxgloveFeed::ClientId client, std::uint32_t subscription, const std::string& topic) {
    const std::uint32_t id = channel(client, topic);
    return id > 0 &&
           feed_.receive(
               now_, client,
               json{{"op", "subscribe"}, {"subscriptions", {{{"id", subscription}, {"channelId", id}}}}}.dump());
  }
  static std::uint64_t tick_of(const std::string& data) {
    recording::v1::Step step;
    EXPECT_TRUE(step.ParseFromString(data.substr(kMessageDataHead)));
    return step.tick();
  }
  static UnixTime time_of(const std::string& data) {
    UnixTime at = 0;
    for (std::size_t i = 8; i-- > 0;) at = at << 8 | static_cast<unsigned char>(data.at(5 + i));
    return at;
  }

  LocalTime now_{std::chrono::seconds(5)};
  Board board_;
  FoxgloveFeed feed_{board_, {.name = "dash", .unix_offset = kUnixOffset}};
  json channels_ = json::object();
  std::uint64_t tick_ = 0;
};

TEST_F(FoxgloveFeedTest, TellsANewClientTheTopicsAndHowTheServerDoes) {
  const auto client = feed_.join(now_);
  const auto texts = told(client).texts;
  ASSERT_EQ(texts.size(), 3U);
  EXPECT_EQ(texts[0]["op"], "serverInfo");
  std::vector<std::string> topics;
  for (const json& channel : texts[1]["channels"]) topics.push_back(channel["topic"]);
  EXPECT_EQ(topics,
            (std::vector<std::string>{"/haptic/step", "/left/device", "/left/peer", "/left/scene", "/right/haptic/step",
                                      "/right/device", "/right/peer", "/right/scene", "/tf"}));
  EXPECT_EQ(texts[2]["message"], "connected");
  EXPECT_EQ(texts[2]["level"], 0);
}

TEST_F(FoxgloveFeedTest, GivesEveryStateOnceFromTheSubscriptionOn) {
  const auto client = feed_.join(now_);
  states(1, 10);
  feed_.take(now_);
  ASSERT_TRUE(subscribe(client, 3, "/right/haptic/step"));
  for (int turn = 0; turn < 5; ++turn) {
    states(0, 3);
    states(1, 3);
    feed_.take(now_);
    feed_.take(now_);
    if (turn == 2) board_.take_states(1);
  }
  const auto steps = told(client).data;
  ASSERT_EQ(steps.size(), 15U);
  for (std::size_t i = 0; i < steps.size(); ++i) EXPECT_EQ(tick_of(steps[i]), 14 + 6 * (i / 3) + i % 3);
}

TEST_F(FoxgloveFeedTest, TimesAreThoseOfTheSamplesInUnixTime) {
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 3, "/haptic/step"));
  states(0, 1);
  feed_.take(now_ += std::chrono::milliseconds(3));
  board_.observe_clock(kAhead + std::chrono::microseconds(900));
  states(0, 1);
  feed_.take(now_ += std::chrono::milliseconds(3));
  board_.observe_clock(kAhead - std::chrono::microseconds(1500));
  states(0, 1);
  feed_.take(now_ += std::chrono::milliseconds(3));
  const auto steps = told(client).data;
  ASSERT_EQ(steps.size(), 3U);
  const auto expected = [](int tick_ms) { return (kUnixOffset + std::chrono::milliseconds(tick_ms)).count(); };
  EXPECT_EQ(time_of(steps[0]), expected(1));
  EXPECT_EQ(time_of(steps[1]), expected(2));
  EXPECT_EQ(time_of(steps[2]), expected(3) + 1'500'000) << "wrong by more than the slack: it is corrected";
}

TEST_F(FoxgloveFeedTest, BeforeTheClocksAreComparedAStateIsAsOldAsItsArrival) {
  board_.observe_clock(std::nullopt);
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 3, "/haptic/step"));
  states(0, 1);
  feed_.take(now_);
  EXPECT_EQ(time_of(told(client).data.at(0)), (kUnixOffset + now_.time_since_epoch()).count());
}

TEST_F(FoxgloveFeedTest, WantsStatesOnlyWhileSomebodySubscribesToThem) {
  const auto client = feed_.join(now_);
  EXPECT_FALSE(feed_.wants_states());
  ASSERT_TRUE(subscribe(client, 1, "/left/device"));
  EXPECT_FALSE(feed_.wants_states());
  for (const char* topic : {"/haptic/step", "/right/haptic/step", "/tf", "/right/scene"}) {
    ASSERT_TRUE(subscribe(client, 2, topic));
    EXPECT_TRUE(feed_.wants_states()) << topic;
    EXPECT_TRUE(feed_.receive(now_, client, R"({"op":"unsubscribe","subscriptionIds":[2]})"));
    EXPECT_FALSE(feed_.wants_states()) << topic;
  }
  ASSERT_TRUE(subscribe(client, 2, "/tf"));
  feed_.leave(client);
  EXPECT_FALSE(feed_.wants_states());
  EXPECT_EQ(feed_.clients(), 0U);
}

TEST_F(FoxgloveFeedTest, GivesEachReportOnce) {
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 1, "/left/device"));
  ASSERT_TRUE(subscribe(client, 2, "/left/peer"));
  for (int second = 1; second <= 3; ++second) {
    DeviceReport report;
    report.until = PeerTime(kAhead + std::chrono::seconds(second));
    board_.observe(report);
    for (const std::uint32_t channel : {0U, 1U}) {
      PeerReport engine;
      engine.channel = channel;
      engine.link.until = report.until;
      board_.observe(engine);
    }
    feed_.take(now_);
    feed_.take(now_);
  }
  const auto data = told(client).data;
  ASSERT_EQ(data.size(), 9U) << "three of the loop, and of each of two engines";
  EXPECT_EQ(time_of(data.back()), (kUnixOffset + std::chrono::seconds(3)).count());
}

TEST_F(FoxgloveFeedTest, DrawsTheNewestStateAtEachTickWhileTheServerIsThere) {
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 1, "/tf"));
  ASSERT_TRUE(subscribe(client, 2, "/right/scene"));
  feed_.tick(now_);
  EXPECT_TRUE(told(client).data.empty()) << "there is no state yet";
  states(0, 5);
  states(1, 5);
  feed_.tick(now_);
  const auto data = told(client).data;
  ASSERT_EQ(data.size(), 2U);
  foxglove::FrameTransforms frames;
  ASSERT_TRUE(frames.ParseFromString(data[1].substr(kMessageDataHead)));
  EXPECT_EQ(frames.transforms_size(), 4);
  EXPECT_EQ(time_of(data[1]), (kUnixOffset + std::chrono::milliseconds(10)).count());
  board_.tell(Contact::kLost, "lost");
  feed_.tick(now_);
  EXPECT_TRUE(told(client).data.empty());
}

TEST_F(FoxgloveFeedTest, SubscriptionsOutliveTheServerAndAStatusSaysHowItDoes) {
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 3, "/haptic/step"));
  feed_.take(now_);
  told(client);
  board_.tell(Contact::kLost, "lost 127.0.0.1:1");
  feed_.take(now_);
  feed_.take(now_);
  auto texts = told(client).texts;
  ASSERT_EQ(texts.size(), 1U);
  EXPECT_EQ(texts[0]["message"], "lost 127.0.0.1:1");
  EXPECT_EQ(texts[0]["level"], 1);
  EXPECT_EQ(texts[0]["id"], "server");
  board_.welcomed({});
  board_.tell(Contact::kOpen, "connected again");
  describe(0, "left");
  states(0, 2);
  feed_.take(now_);
  const auto after = told(client);
  ASSERT_EQ(after.texts.size(), 1U) << "the same channels are still there";
  EXPECT_EQ(after.texts[0]["message"], "connected again");
  EXPECT_EQ(after.data.size(), 2U);
}

TEST_F(FoxgloveFeedTest, AnotherServersDevicesTakeThePlaceOfTheOld) {
  const auto client = feed_.join(now_);
  ASSERT_TRUE(subscribe(client, 3, "/left/scene"));
  ASSERT_TRUE(subscribe(client, 4, "/tf"));
  told(client);
  describe(0, "new");
  board_.counted(1);
  feed_.take(now_);
  const auto texts = told(client).texts;
  ASSERT_GE(texts.size(), 2U);
  ASSERT_EQ(texts[0]["op"], "unadvertise");
  EXPECT_EQ(texts[0]["channelIds"].size(), 7U) << "three of the first, four of the second";
  ASSERT_EQ(texts[1]["op"], "advertise");
  EXPECT_EQ(texts[1]["channels"].size(), 3U) << "/haptic/step and /tf stay";
  states(0, 1);
  feed_.tick(now_);
  EXPECT_EQ(told(client).data.size(), 1U) << "only /tf";
}

TEST_F(FoxgloveFeedTest, ObjectsInSentencesAndClosesWhoDoesNotStop) {
  const auto client = feed_.join(now_);
  told(client);
  EXPECT_TRUE(feed_.receive(now_, client, "hello"));
  EXPECT_TRUE(feed_.receive(now_, client, R"({"op":"subscribe","subscriptions":[{"id":1,"channelId":99}]})"));
  EXPECT_TRUE(feed_.receive(now_, client, R"({"op":"unsubscribe","subscriptionIds":[5]})"));
  const auto texts = told(client).texts;
  ASSERT_EQ(texts.size(), 3U);
  EXPECT_EQ(texts[1]["message"], "There is no channel 99.");
  EXPECT_EQ(texts[2]["message"], "There is no subscription 5.");
  std::string many = R"({"op":"unsubscribe","subscriptionIds":[0)";
  for (int i = 1; i < 1000; ++i) many += "," + std::to_string(i);
  EXPECT_FALSE(feed_.receive(now_, client, many + "]}")) << "it does not read what it is told";
  const auto second = feed_.join(now_);
  int heard = 0;
  while (feed_.receive(now_, second, R"({"op":"subscribe","subscriptions":[]})") && heard < 1000) ++heard;
  EXPECT_EQ(heard, 200) << "a tenth of what is permitted in a second, at once";
  EXPECT_FALSE(feed_.receive(now_, 99, "{}")) << "nobody";
}

}  // namespace
}  // namespace tendon::dash::foxglove_feed_test
