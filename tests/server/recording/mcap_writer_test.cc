// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_writer.h"

#include <gtest/gtest.h>

#include <cctype>
#include <stdexcept>
#include <string>
#include <string_view>

#include "server/recording/byte_sink.h"

namespace tendon::mcap_writer_test {
namespace {

std::string bytes(std::string_view hex) {
  std::string out;
  std::string digits;
  for (const char c : hex) {
    if (std::isxdigit(static_cast<unsigned char>(c)) == 0) continue;
    digits += c;
    if (digits.size() < 2) continue;
    out += static_cast<char>(std::stoi(digits, nullptr, 16));
    digits.clear();
  }
  return out;
}

std::string written(const MemorySink& sink) {
  return {reinterpret_cast<const char*>(sink.bytes().data()), sink.bytes().size()};
}

class FailingSink final : public ByteSink {
 public:
  bool append(std::span<const std::byte> /*bytes*/) override {
    ++calls;
    return false;
  }
  std::string error() const override { return "full"; }

  int calls = 0;
};

// This was written by hand from https://mcap.dev/spec. The CRCs were computed by Python's zlib.crc32.
TEST(McapWriter, WritesTheBytesOfTheSpecification) {
  MemorySink sink;
  McapWriter writer("lib", sink);
  const auto schema = writer.add_schema("S", "e", "d");
  const auto channel = writer.add_channel(schema, "/t", "e");
  writer.write(channel, 7, "a");
  writer.write(channel, 5, "b");
  ASSERT_TRUE(writer.close());

  const std::string magic = bytes("89 4d 43 41 50 30 0d 0a");
  const std::string header = bytes("01 0b00000000000000  00000000  03000000 6c6962");
  const std::string schema_record = bytes("03 1100000000000000  0100  01000000 53  01000000 65  01000000 64");
  const std::string channel_record = bytes("04 1300000000000000  0100 0100  02000000 2f74  01000000 65  00000000");
  const std::string chunk = bytes(
      "06 6800000000000000  0500000000000000 0700000000000000"  // first and last time, not in writing order
      "4000000000000000 ef8e05d5 00000000 4000000000000000"     // size, CRC, no compression, size
      "05 1700000000000000  0100 00000000 0700000000000000 0700000000000000 61"
      "05 1700000000000000  0100 01000000 0500000000000000 0500000000000000 62");
  const std::string message_index = bytes(
      "07 2600000000000000  0100 20000000"
      "0500000000000000 2000000000000000"  // sorted by time
      "0700000000000000 0000000000000000");
  const std::string data_end = bytes("0f 0400000000000000  39ecfc10");
  const std::string statistics = bytes(
      "0b 3800000000000000  0200000000000000 0100 01000000 00000000 00000000 01000000"
      "0500000000000000 0700000000000000  0a000000 0100 0200000000000000");
  const std::string chunk_index = bytes(
      "08 4a00000000000000  0500000000000000 0700000000000000"
      "5200000000000000 7100000000000000"             // chunk at 82, 113 bytes
      "0a000000 0100 c300000000000000"                // index of channel 1 at 195
      "2f00000000000000"                              // 47 bytes of indexes
      "00000000 4000000000000000 4000000000000000");  // both sizes are 64 bytes, since it is not compressed
  const std::string summary_offsets = bytes(
      "0e 1100000000000000  03 ff00000000000000 1a00000000000000"
      "0e 1100000000000000  04 1901000000000000 1c00000000000000"
      "0e 1100000000000000  0b 3501000000000000 4100000000000000"
      "0e 1100000000000000  08 7601000000000000 5300000000000000");
  const std::string footer = bytes("02 1400000000000000  ff00000000000000 c901000000000000 359f3ebb");

  EXPECT_EQ(written(sink), magic + header + schema_record + channel_record + chunk + message_index + data_end +
                               schema_record + channel_record + statistics + chunk_index + summary_offsets + footer +
                               magic);
  EXPECT_EQ(writer.bytes_written(), sink.bytes().size());
}

TEST(McapWriter, WritesNothingBeforeTheFirstFlush) {
  MemorySink sink;
  McapWriter writer("lib", sink);
  const auto channel = writer.add_channel(writer.add_schema("S", "e", ""), "/t", "e");
  writer.write(channel, 1, "a");
  EXPECT_TRUE(sink.bytes().empty());
  EXPECT_GT(writer.chunk_size(), 0U);
  ASSERT_TRUE(writer.flush_chunk());
  EXPECT_FALSE(sink.bytes().empty());
  EXPECT_EQ(writer.chunk_size(), 0U);
}

TEST(McapWriter, MakesNoChunkOutOfNothingAndEndsTheFileOnlyOnce) {
  for (const auto write : {&McapWriter::flush_chunk, &McapWriter::close}) {
    MemorySink sink;
    McapWriter writer("lib", sink);
    ASSERT_TRUE((writer.*write)());
    const auto size = sink.bytes().size();
    ASSERT_TRUE((writer.*write)());
    EXPECT_EQ(sink.bytes().size(), size);
  }
}

TEST(McapWriter, RefusesMessagesWithoutAChannelAndAfterTheEnd) {
  MemorySink sink;
  McapWriter writer("lib", sink);
  EXPECT_THROW(writer.add_channel(1, "/t", "e"), std::invalid_argument);
  EXPECT_THROW(writer.write(0, 1, "a"), std::invalid_argument);
  EXPECT_THROW(writer.write(1, 1, "a"), std::invalid_argument);
  const auto channel = writer.add_channel(writer.add_schema("S", "e", ""), "/t", "e");
  writer.close();
  EXPECT_THROW(writer.write(channel, 1, "a"), std::logic_error);
}

TEST(McapWriter, NeverCallsASinkAgainThatHasFailed) {
  FailingSink sink;
  McapWriter writer("lib", sink);
  const auto channel = writer.add_channel(writer.add_schema("S", "e", ""), "/t", "e");
  EXPECT_FALSE(writer.flush_chunk());
  writer.write(channel, 1, "a");
  EXPECT_FALSE(writer.flush_chunk());
  EXPECT_FALSE(writer.close());
  EXPECT_EQ(sink.calls, 1);
  EXPECT_EQ(writer.bytes_written(), 0U);
}

}  // namespace
}  // namespace tendon::mcap_writer_test
