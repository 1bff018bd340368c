// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_reader.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_writer.h"

namespace tendon::mcap_reader_test {
namespace {

/// Two chunks of three messages each: "0", "1" … "5" at their number in ns.
std::string sample_file() {
  MemorySink sink;
  McapWriter writer("lib", sink);
  const auto channel = writer.add_channel(writer.add_schema("S", "e", "d"), "/t", "e");
  for (int i = 0; i < 6; ++i) {
    writer.write(channel, static_cast<std::uint64_t>(i), std::to_string(i));
    if (i == 2) writer.flush_chunk();
  }
  writer.close();
  return {reinterpret_cast<const char*>(sink.bytes().data()), sink.bytes().size()};
}

struct Outcome {
  std::string messages;
  std::string error;
  bool truncated = false;
};

Outcome read(const std::string& file) {
  Outcome outcome;
  try {
    McapReader reader(std::make_unique<std::istringstream>(file), "a.mcap");
    while (const auto message = reader.next()) {
      outcome.messages += message->data;
    }
    outcome.truncated = reader.truncated();
  } catch (const std::runtime_error& error) {
    outcome.error = error.what();
  }
  return outcome;
}

TEST(McapReader, GivesEveryMessageInTheOrderOfTheFile) {
  McapReader reader(std::make_unique<std::istringstream>(sample_file()), "a.mcap");
  for (std::uint32_t i = 0; i < 6; ++i) {
    const auto message = reader.next();
    ASSERT_TRUE(message);
    EXPECT_EQ(message->channel.topic, "/t");
    EXPECT_EQ(message->channel.message_encoding, "e");
    EXPECT_EQ(message->channel.schema_name, "S");
    EXPECT_EQ(message->sequence, i);
    EXPECT_EQ(message->log_time, i);
    EXPECT_EQ(message->data, std::to_string(i));
  }
  EXPECT_FALSE(reader.next());
}

TEST(McapReader, KnowsAWholeFile) {
  const Outcome outcome = read(sample_file());
  EXPECT_EQ(outcome.messages, "012345");
  EXPECT_FALSE(outcome.truncated);
  EXPECT_EQ(outcome.error, "");
}

TEST(McapReader, GivesTheWholeChunksOfAFileCutAnywhere) {
  const std::string file = sample_file();
  std::size_t seen = 0;
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Outcome outcome = read(file.substr(0, size));
    EXPECT_EQ(outcome.error, "") << "cut at " << size;
    EXPECT_TRUE(outcome.truncated) << "cut at " << size;
    EXPECT_EQ(std::string("012345").substr(0, outcome.messages.size()), outcome.messages);
    EXPECT_EQ(outcome.messages.size() % 3, 0U) << "cut at " << size;
    EXPECT_GE(outcome.messages.size(), seen) << "cut at " << size;
    seen = outcome.messages.size();
  }
  EXPECT_EQ(seen, 6U);
}

TEST(McapReader, NoticesEveryFlippedBit) {
  const std::string file = sample_file();
  for (std::size_t at = 0; at < file.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string flipped = file;
      flipped[at] = static_cast<char>(static_cast<unsigned char>(flipped[at]) ^ (1U << bit));
      const Outcome outcome = read(flipped);
      EXPECT_NE(outcome.error, "") << "byte " << at << " bit " << bit;
    }
  }
}

TEST(McapReader, NamesFileAndByteOfCorruption) {
  std::string file = sample_file();
  // Magic, header, schema and channel as in McapWriter.WritesTheBytesOfTheSpecification; a chunk of three messages of
  // 32 bytes, its index of three entries of 16 bytes; and then the second chunk.
  const std::size_t second_chunk = 8 + 20 + 26 + 28 + (9 + 40 + 3 * 32) + (9 + 6 + 3 * 16);
  ASSERT_EQ(file[second_chunk], '\x06');
  file[second_chunk + 9 + 40 + 31] = 'x';  // the first message's data
  const Outcome outcome = read(file);
  EXPECT_EQ(outcome.messages, "012") << "what comes before the corruption is given";
  EXPECT_EQ(outcome.error, "a.mcap: byte " + std::to_string(second_chunk) + ": the CRC of a chunk does not match");
}

TEST(McapReader, RefusesWhatIsNotMcap) {
  EXPECT_EQ(read("time,position\n0,0\n").error, "a.mcap: is not an MCAP file");
  EXPECT_EQ(read("x").error, "a.mcap: is not an MCAP file");
}

TEST(McapReader, CallsAnEmptyFileTruncated) {
  const Outcome outcome = read("");
  EXPECT_TRUE(outcome.truncated);
  EXPECT_EQ(outcome.error, "");
}

TEST(McapReader, RefusesBytesAfterTheEnd) {
  const std::string file = sample_file();
  EXPECT_NE(read(file + "x").error.find("the file does not end after its footer"), std::string::npos);
  EXPECT_NE(read(file + file).error.find("the file does not end after its footer"), std::string::npos);
}

}  // namespace
}  // namespace tendon::mcap_reader_test
