// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_text.h"

#include <gtest/gtest.h>

#include <array>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <string_view>
#include <variant>

namespace tendon::dash::foxglove_text_test {
namespace {

using nlohmann::json;

/// Base64 (RFC 4648), independently of the encoder.
std::string decoded(std::string_view text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  EXPECT_EQ(text.size() % 4, 0U);
  std::string bytes;
  unsigned bits = 0;
  int have = 0;
  for (const char c : text) {
    if (c == '=') break;
    bits = bits << 6 | static_cast<unsigned>(digits.find(c));
    have += 6;
    if (have >= 8) bytes += static_cast<char>(bits >> (have -= 8) & 0xffU);
  }
  return bytes;
}

template <class Order>
Order order(std::string_view text) {
  const FoxgloveOrder read = parse_foxglove_order(text);
  EXPECT_TRUE(std::holds_alternative<Order>(read)) << text;
  return std::holds_alternative<Order>(read) ? std::get<Order>(read) : Order{};
}

TEST(FoxgloveText, SaysWhoItIsAndThatItCanNothingElse) {
  const json info = json::parse(server_info_text("tendon-dash of a:1", "17"));
  EXPECT_EQ(info.at("op"), "serverInfo");
  EXPECT_EQ(info.at("name"), "tendon-dash of a:1");
  EXPECT_EQ(info.at("sessionId"), "17");
  EXPECT_EQ(info.at("capabilities"), json::array());
}

TEST(FoxgloveText, AdvertisesEachChannelWithItsSchema) {
  const std::array channels = {FoxgloveChannel{.id = 1, .topic = "/haptic/step"},
                               FoxgloveChannel{.id = 4294967295, .topic = "/tf", .kind = FoxgloveKind::kTransforms}};
  const json text = json::parse(advertise_text(channels));
  EXPECT_EQ(text.at("op"), "advertise");
  ASSERT_EQ(text.at("channels").size(), 2U);
  for (std::size_t i = 0; i < channels.size(); ++i) {
    const json& channel = text["channels"][i];
    EXPECT_EQ(channel.at("id"), channels[i].id);
    EXPECT_EQ(channel.at("topic"), channels[i].topic);
    EXPECT_EQ(channel.at("encoding"), "protobuf");
    EXPECT_EQ(channel.at("schemaEncoding"), "protobuf");
    EXPECT_EQ(channel.at("schemaName"), foxglove_schema_name(channels[i].kind));
    EXPECT_EQ(decoded(channel.at("schema").get<std::string>()), foxglove_schema(channels[i].kind));
  }
  const std::array<std::uint32_t, 2> gone = {3, 4};
  EXPECT_EQ(json::parse(unadvertise_text(gone)), json::parse(R"({"op":"unadvertise","channelIds":[3,4]})"));
}

TEST(FoxgloveText, AStatusIsASentenceHoweverOddItsBytesAre) {
  EXPECT_EQ(json::parse(status_text(StatusLevel::kWarning, "server", "lost")),
            json::parse(R"({"op":"status","level":1,"message":"lost","id":"server"})"));
  EXPECT_TRUE(json::accept(status_text(StatusLevel::kError, "server", "\xff\xfe\"\n")));
}

TEST(FoxgloveText, MessageDataIsLittleEndian) {
  const std::string bytes = message_data(0x01020304, 0x1112131415161718, "abc");
  EXPECT_EQ(bytes, std::string("\x01\x04\x03\x02\x01\x18\x17\x16\x15\x14\x13\x12\x11", 13) + "abc");
  EXPECT_EQ(bytes.size(), kMessageDataHead + 3);
}

TEST(FoxgloveText, ReadsOrders) {
  const auto subscribe = order<Subscribe>(
      R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3},{"id":4294967295,"channelId":1,"more":[]}]})");
  ASSERT_EQ(subscribe.all.size(), 2U);
  EXPECT_EQ(subscribe.all[0].channel, 3U);
  EXPECT_EQ(subscribe.all[1].subscription, 4294967295U);
  EXPECT_EQ(order<Unsubscribe>(R"({"op":"unsubscribe","subscriptionIds":[7,8]})").subscriptions,
            (std::vector<std::uint32_t>{7, 8}));
}

TEST(FoxgloveText, RefusesWhatIsNoOrderInASentence) {
  for (const char* text :
       {"", "null", "[]", "{", "{}", R"({"op":1})", R"({"op":"subscribe"})", R"({"op":"subscribe","subscriptions":{}})",
        R"({"op":"subscribe","subscriptions":[1]})", R"({"op":"subscribe","subscriptions":[{"id":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":-1,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":1.5,"channelId":1}]})",
        R"({"op":"subscribe","subscriptions":[{"id":4294967296,"channelId":1}]})",
        R"({"op":"unsubscribe","subscriptionIds":["1"]})", R"({"op":"unsubscribe"})"}) {
    EXPECT_TRUE(order<NotUnderstood>(text).sentence.ends_with('.')) << text;
  }
  const std::string long_name = R"({"op":")" + std::string(10'000, 'x') + "\"}";
  EXPECT_LT(order<NotUnderstood>(long_name).sentence.size(), 200U);
  EXPECT_NE(order<NotUnderstood>(R"({"op":"advertise"})").sentence.find("“advertise”"), std::string::npos);
}

TEST(FoxgloveText, NoBytesMakeTheReaderThrow) {
  std::mt19937_64 random(22);
  const std::string good = R"({"op":"subscribe","subscriptions":[{"id":0,"channelId":3}]})";
  for (int i = 0; i < 20'000; ++i) {
    std::string text = good;
    for (int k = 0; k < 3; ++k) text[random() % text.size()] = static_cast<char>(random() & 0xff);
    EXPECT_NO_THROW(parse_foxglove_order(text));
  }
}

}  // namespace
}  // namespace tendon::dash::foxglove_text_test
