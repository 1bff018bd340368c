// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_session.h"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <string>

namespace tendon::dash::foxglove_session_test {
namespace {

using nlohmann::json;

constexpr UnixTime kStart = 1'700'000'000'000'000'000;
constexpr UnixTime kMillisecond = 1'000'000;

UnixTime time_of(const std::string& bytes) {
  UnixTime at = 0;
  for (std::size_t i = 8; i-- > 0;) at = at << 8 | static_cast<unsigned char>(bytes.at(5 + i));
  return at;
}

TEST(FoxgloveSession, GivesOutWhatItSubscribesToAndNothingElse) {
  FoxgloveSession session;
  session.put(1, kStart, "before");
  EXPECT_TRUE(session.subscribe(7, 1));
  session.put(1, kStart + 1, "one");
  session.put(2, kStart, "another channel");
  const auto message = session.next();
  ASSERT_TRUE(message);
  EXPECT_TRUE(message->binary);
  EXPECT_EQ(message->bytes, message_data(7, kStart + 1, "one"));
  EXPECT_FALSE(session.next());
  EXPECT_EQ(session.waiting_bytes(), 0U);
}

TEST(FoxgloveSession, AnIdAndAChannelAreSubscribedOnce) {
  FoxgloveSession session;
  EXPECT_TRUE(session.subscribe(7, 1));
  EXPECT_FALSE(session.subscribe(7, 2));
  EXPECT_FALSE(session.subscribe(8, 1));
  EXPECT_FALSE(session.subscribes_to(2));
  EXPECT_TRUE(session.unsubscribe(7));
  EXPECT_FALSE(session.unsubscribe(7));
  EXPECT_TRUE(session.subscribe(7, 2));
}

TEST(FoxgloveSession, WhatWaitsOfASubscriptionEndsWithIt) {
  FoxgloveSession session;
  session.subscribe(7, 1);
  session.subscribe(8, 2);
  for (int i = 0; i < 100; ++i) {
    session.put(1, kStart, "of 1");
    session.put(2, kStart, "of 2");
  }
  session.unsubscribe(7);
  session.forget(3);
  int left = 0;
  for (auto message = session.next(); message; message = session.next()) {
    EXPECT_EQ(message->bytes, message_data(8, kStart, "of 2"));
    ++left;
  }
  EXPECT_EQ(left, 100);
  session.put(2, kStart, "of 2");
  session.forget(2);
  EXPECT_FALSE(session.next());
  EXPECT_EQ(session.waiting_bytes(), 0U);
}

TEST(FoxgloveSession, DropsTheOldestTenthsWholeAndSaysHowMany) {
  FoxgloveSession session;
  session.subscribe(0, 1);
  session.subscribe(1, 2);
  const std::string payload(200, 'x');
  std::uint64_t put = 0;
  for (int i = 0; i < 10'000; ++i) {
    session.put(1, kStart + i * kMillisecond, payload);
    if (i % 16 == 0) session.put(2, kStart + i * kMillisecond, payload);
    put += i % 16 == 0 ? 2 : 1;
    ASSERT_LE(session.waiting_bytes(), FoxgloveSession::kMaxBytes);
  }
  const auto first = session.next();
  ASSERT_TRUE(first && !first->binary);
  const json status = json::parse(first->bytes);
  EXPECT_EQ(status.at("op"), "status");
  EXPECT_EQ(status.at("level"), 1);
  std::uint64_t read = 0;
  std::map<UnixTime, int> tenths;
  for (auto message = session.next(); message; message = session.next()) {
    ASSERT_TRUE(message->binary) << "it says so once";
    ++read;
    if (message->bytes.at(1) == 0) ++tenths[time_of(message->bytes) / FoxgloveSession::kDropped];
  }
  EXPECT_NE(status.at("message").get<std::string>().find(" " + std::to_string(put - read) + " messages"),
            std::string::npos)
      << status;
  for (const auto& [tenth, steps] : tenths) EXPECT_EQ(steps, 100) << tenth;
  EXPECT_EQ(tenths.rbegin()->first, (kStart + 9'999 * kMillisecond) / FoxgloveSession::kDropped) << "the newest stay";
  EXPECT_GT(tenths.size(), 35U) << "a megabyte is 4.4 s of this";
}

TEST(FoxgloveSession, SaysAgainWhatItDroppedLater) {
  FoxgloveSession session;
  session.subscribe(0, 1);
  const std::string payload(FoxgloveSession::kMaxBytes / 2, 'x');
  for (int round = 0; round < 2; ++round) {
    for (int i = 0; i < 3; ++i) session.put(1, kStart + (10 * round + i) * FoxgloveSession::kDropped, payload);
    EXPECT_FALSE(session.next()->binary);
    EXPECT_TRUE(session.next()->binary);
    EXPECT_FALSE(session.next());
  }
  session.put(1, kStart, std::string(FoxgloveSession::kMaxBytes, 'x'));
  EXPECT_FALSE(session.next()->binary) << "a message that never fits is dropped";
  EXPECT_FALSE(session.next());
}

TEST(FoxgloveSession, TextsComeFirstInTheirOrderAndOnlyTheNewestOfTheServer) {
  FoxgloveSession session;
  session.subscribe(0, 1);
  session.put(1, kStart, "data");
  session.put_server_state("lost");
  session.put_text("one");
  session.put_text("two");
  session.put_server_state("connected");
  for (const char* text : {"one", "two", "connected"}) EXPECT_EQ(session.next()->bytes, text);
  EXPECT_TRUE(session.next()->binary);
  EXPECT_FALSE(session.too_slow());
  for (std::size_t i = 0; i <= FoxgloveSession::kMaxTexts; ++i) session.put_text("more");
  EXPECT_TRUE(session.too_slow());
}

}  // namespace
}  // namespace tendon::dash::foxglove_session_test
