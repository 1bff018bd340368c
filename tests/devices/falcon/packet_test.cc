// SPDX-License-Identifier: Apache-2.0
#include "devices/falcon/packet.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "tests/support/dice.h"

namespace tendon::falcon::packet_test {
namespace {

std::vector<std::uint8_t> bytes_of(std::string_view text) { return {text.begin(), text.end()}; }

std::optional<Reply> decoded(std::string_view text) {
  const auto bytes = bytes_of(text);
  return decode(std::span(bytes).first<kPacketBytes>());
}

TEST(FalconPacket, ACommandIsItsTorquesLeastNibbleFirstAndItsFlags) {
  const auto bytes = encode({.torque = {0x1234, -1, -4096}, .homing = true, .lamps = kGreen | kRed});
  EXPECT_EQ(std::string(bytes.begin(), bytes.end()), "<EDCBPPPPAAAPLA>");  // 0x41 + 1 + 2 + 8 = 'L'
  const auto rest = encode({.torque = {}, .homing = false, .lamps = 0});
  EXPECT_EQ(std::string(rest.begin(), rest.end()), "<AAAAAAAAAAAAAA>");
}

TEST(FalconPacket, LampsCannotSayAnythingElse) {
  EXPECT_EQ(encode({.torque = {}, .homing = false, .lamps = 0xF1})[13], 'A');
}

TEST(FalconPacket, AReplyIsItsEncodersButtonsAndHomedLegs) {
  const auto reply = decoded(
      "<EDCBPPPPAAAI\xB6"
      "A>");  // 'A' + 0x75
  ASSERT_TRUE(reply);
  EXPECT_EQ(reply->encoders, (Counts{0x1234, -1, -32768}));
  EXPECT_EQ(reply->buttons, 5);
  EXPECT_EQ(reply->homed, Reply::kAllHomed);
}

TEST(FalconPacket, EveryCountOf16BitsComesThrough) {
  for (int count = -32768; count <= 32767; ++count) {
    const auto value = static_cast<std::int16_t>(count);
    const auto reply = decode(encode({.torque = {value, 7, static_cast<std::int16_t>(-value - 1)}}));
    ASSERT_TRUE(reply);
    ASSERT_EQ(reply->encoders, (Counts{value, 7, static_cast<std::int16_t>(-value - 1)}));
  }
}

TEST(FalconPacket, AByteThatIsNoNibbleSpoilsTheReply) {
  const std::string good = "<AAAABBBBCCCCAA>";
  ASSERT_TRUE(decoded(good));
  for (std::size_t at = 0; at < kPacketBytes; ++at) {
    for (int byte = 0; byte < 256; ++byte) {
      std::string text = good;
      text[at] = static_cast<char>(byte);
      const bool frame = at == 0 ? byte == '<' : at == 15 ? byte == '>' : true;
      const bool nibble = at >= 1 && at <= 12 ? byte >= 'A' && byte <= 'P' : true;
      const bool flags = at == 13 ? byte >= 'A' && byte <= 'A' + 0x7F : true;
      EXPECT_EQ(decoded(text).has_value(), frame && nibble && flags) << at << ' ' << byte;
    }
  }
}

std::vector<Counts> parsed(ReplyParser& parser, std::span<const std::uint8_t> stream, Dice& dice) {
  std::vector<Counts> found;
  while (!stream.empty()) {
    const std::size_t piece = std::min<std::size_t>(stream.size(), 1 + dice.bits() % 62);
    EXPECT_EQ(parser.feed(stream.first(piece)), piece);
    while (const auto reply = parser.next()) found.push_back(reply->encoders);
    stream = stream.subspan(piece);
  }
  return found;
}

std::vector<std::uint8_t> packet_of(std::int16_t number) {
  const auto bytes = encode({.torque = {number, static_cast<std::int16_t>(~number), 0}});
  return {bytes.begin(), bytes.end()};
}

TEST(FalconPacket, RepliesComeThroughHoweverTheyAreCutIntoPieces) {
  Dice dice(1);
  ReplyParser parser;
  std::vector<std::uint8_t> stream;
  for (std::int16_t i = 0; i < 5000; ++i) {
    const auto packet = packet_of(i);
    stream.insert(stream.end(), packet.begin(), packet.end());
  }
  const auto found = parsed(parser, stream, dice);
  ASSERT_EQ(found.size(), 5000U);
  for (std::size_t i = 0; i < found.size(); ++i) EXPECT_EQ(found[i][0], static_cast<std::int16_t>(i));
  EXPECT_EQ(parser.left_out(), 0U);
}

TEST(FalconPacket, EveryWholeReplyIsFoundAmongAnyOtherBytes) {
  Dice dice(2);
  for (int round = 0; round < 200; ++round) {
    ReplyParser parser;
    std::vector<std::uint8_t> stream;
    std::vector<Counts> whole;
    for (std::int16_t i = 0; i < 50; ++i) {
      auto packet = packet_of(static_cast<std::int16_t>(dice.bits()));
      if (dice.chance(0.3)) {
        for (std::uint64_t n = dice.bits() % 40; n > 0; --n) {
          // Bytes that are common in frames, but not '<': a packet could start there and end with the next one.
          const auto noise = static_cast<std::uint8_t>(dice.chance(0.3) ? '>' : dice.bits());
          if (noise != '<') stream.push_back(noise);
        }
      }
      if (dice.chance(0.2)) {
        packet.resize(1 + dice.bits() % 11);  // truncated, with too many bytes missing for noise to complete it
      } else if (dice.chance(0.2)) {
        packet[1 + dice.bits() % 12] = 'Q';
      } else {
        whole.push_back(decode(std::span(packet).first<kPacketBytes>())->encoders);
      }
      stream.insert(stream.end(), packet.begin(), packet.end());
    }
    EXPECT_EQ(parsed(parser, stream, dice), whole) << round;
  }
}

}  // namespace
}  // namespace tendon::falcon::packet_test
