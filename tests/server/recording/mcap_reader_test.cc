// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_reader.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <memory>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_writer.h"

namespace tendon::mcap_reader_test {
namespace {

/// The file has two chunks of three messages, "0" to "5". The number of a message is its time in ns.
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
  std::vector<std::string> damage;
  std::uint64_t missing = 0;
  bool truncated = false;
};

Outcome read(const std::string& file) {
  Outcome outcome;
  try {
    McapReader reader(std::make_unique<std::istringstream>(file), "a.mcap");
    while (const auto message = reader.next()) {
      outcome.messages += message->data;
      outcome.missing += message->missing;
    }
    outcome.missing += reader.missing_at_end("/t");
    outcome.damage = reader.damage();
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

/// In `sample_file` (see McapWriter.WritesTheBytesOfTheSpecification), a chunk has three messages of 32 bytes, and its
/// index has three entries of 16 bytes.
constexpr std::size_t kFirstChunk = 8 + 20 + 26 + 28;
constexpr std::size_t kChunk = 9 + 40 + 3 * 32;
constexpr std::size_t kSecondChunk = kFirstChunk + kChunk + 9 + 6 + 3 * 16;

std::string outside_of(std::size_t from, std::size_t to) {
  const auto whole = [&](std::size_t chunk) { return to <= chunk || from >= chunk + kChunk; };
  return std::string(whole(kFirstChunk) ? "012" : "") + (whole(kSecondChunk) ? "345" : "");
}

/// It must contain the messages in `least`, and only complete chunks.
void expect_at_least(const Outcome& outcome, const std::string& least) {
  EXPECT_EQ(outcome.error, "");
  for (const std::string& chunk : {std::string("012"), std::string("345")}) {
    if (least.find(chunk) != std::string::npos) {
      EXPECT_NE(outcome.messages.find(chunk), std::string::npos);
    }
  }
  EXPECT_TRUE(outcome.messages.empty() || outcome.messages == "012" || outcome.messages == "345" ||
              outcome.messages == "012345")
      << outcome.messages;
}

TEST(McapReader, NoticesEveryFlippedBitAndLosesNoOtherChunk) {
  const std::string file = sample_file();
  for (std::size_t at = 0; at < file.size(); ++at) {
    for (int bit = 0; bit < 8; ++bit) {
      SCOPED_TRACE("byte " + std::to_string(at) + " bit " + std::to_string(bit));
      std::string flipped = file;
      flipped[at] = static_cast<char>(static_cast<unsigned char>(flipped[at]) ^ (1U << bit));
      const Outcome outcome = read(flipped);
      EXPECT_FALSE(outcome.damage.empty());
      EXPECT_FALSE(outcome.truncated);
      expect_at_least(outcome, outside_of(at, at + 1));
      EXPECT_EQ(outcome.missing, 6 - outcome.messages.size());
    }
  }
}

TEST(McapReader, LosesOnlyTheChunksThatZerosCover) {
  const std::string file = sample_file();
  for (const std::size_t length : {1U, 4U, 8U, 16U, 40U, 64U, 200U}) {
    for (std::size_t at = 8; at + length <= file.size(); ++at) {
      SCOPED_TRACE(std::to_string(length) + " zeros at " + std::to_string(at));
      std::string damaged = file;
      damaged.replace(at, length, length, '\0');
      expect_at_least(read(damaged), outside_of(at, at + length));
    }
  }
}

TEST(McapReader, TakesZerosAtTheEndAsTheEnd) {
  const std::string file = sample_file();
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Outcome cut = read(file.substr(0, size));
    for (const std::size_t zeros : {1U, 100U, 5000U}) {
      SCOPED_TRACE("cut at " + std::to_string(size) + ", then " + std::to_string(zeros) + " zeros");
      const Outcome outcome = read(file.substr(0, size) + std::string(zeros, '\0'));
      EXPECT_EQ(outcome.error, "");
      EXPECT_EQ(outcome.messages.substr(0, cut.messages.size()), cut.messages);
      EXPECT_TRUE(outcome.truncated);
      EXPECT_TRUE(outcome.damage.empty()) << outcome.damage.front();
    }
  }
}

TEST(McapReader, TakesZerosBehindAWholeFileAsNothing) {
  for (const std::size_t zeros : {0U, 5000U}) {
    const Outcome outcome = read(sample_file() + std::string(zeros, '\0'));
    EXPECT_EQ(outcome.messages, "012345");
    EXPECT_EQ(outcome.error, "");
    EXPECT_FALSE(outcome.truncated);
    EXPECT_TRUE(outcome.damage.empty());
  }
}

TEST(McapReader, FindsTheNextChunkBehindBytesThatAreGone) {
  const std::string file = sample_file();
  for (const std::size_t length : {1U, 7U, 50U, 145U, 208U}) {
    for (std::size_t at = 8; at + length <= file.size(); ++at) {
      SCOPED_TRACE(std::to_string(length) + " bytes gone at " + std::to_string(at));
      std::string damaged = file;
      damaged.erase(at, length);
      const Outcome outcome = read(damaged);
      expect_at_least(outcome, outside_of(at, at + length));
    }
  }
}

TEST(McapReader, SaysThatAWholeChunkIsGone) {
  std::string file = sample_file();
  file.erase(kFirstChunk, kSecondChunk - kFirstChunk);
  const Outcome outcome = read(file);
  EXPECT_EQ(outcome.messages, "345");
  EXPECT_EQ(outcome.missing, 3U);
  ASSERT_EQ(outcome.damage.size(), 1U);
  EXPECT_EQ(outcome.damage[0], "a.mcap: byte " + std::to_string(kFirstChunk) +
                                   ": preceding messages are missing: a part of the file was lost, before 0.000 s");
}

TEST(McapReader, NamesFileBytesAndTimesOfDamage) {
  std::string file = sample_file();
  ASSERT_EQ(file[kSecondChunk], '\x06');
  file[kSecondChunk + 9 + 40 + 31] = 'x';  // data of the first message
  const Outcome outcome = read(file);
  EXPECT_EQ(outcome.messages, "012");
  ASSERT_EQ(outcome.damage.size(), 1U);
  EXPECT_EQ(outcome.damage[0], "a.mcap: byte " + std::to_string(kSecondChunk) +
                                   ": the CRC of a chunk does not match; 145 bytes are skipped, after 0.000 s");
}

// If a recorded datagram contains a chunk, this chunk must not be used when the length of the outer chunk is damaged.
TEST(McapReader, ReadsNoChunkWithinAChunkWhoseLengthIsDamaged) {
  const std::string whole = sample_file();
  MemorySink sink;
  McapWriter writer("lib", sink);
  const auto channel = writer.add_channel(writer.add_schema("S", "e", "d"), "/t", "e");
  writer.write(channel, 0, whole.substr(kFirstChunk, kSecondChunk - kFirstChunk) + "  ");
  writer.flush_chunk();
  writer.write(channel, 1, "z");
  writer.close();
  const std::string file(reinterpret_cast<const char*>(sink.bytes().data()), sink.bytes().size());
  for (const std::size_t length_at : {1U, 9U + 16U, 9U + 32U}) {
    for (const bool crc_too : {false, true}) {
      std::string damaged = file;
      damaged[kFirstChunk + length_at] ^= 4;
      if (crc_too) damaged[kFirstChunk + 9 + 24] ^= 1;
      const Outcome outcome = read(damaged);
      EXPECT_EQ(outcome.error, "");
      EXPECT_EQ(outcome.messages.find("012"), std::string::npos);
      EXPECT_EQ(outcome.messages.back(), 'z');
      EXPECT_EQ(outcome.missing, crc_too ? 1U : 0U);
    }
  }
}

TEST(McapReader, RefusesWhatIsNotMcap) {
  EXPECT_EQ(read("time,position\n0,0\n").error, "a.mcap: not an MCAP file");
  EXPECT_EQ(read("x").error, "a.mcap: not an MCAP file");
}

TEST(McapReader, CallsAnEmptyFileTruncated) {
  const Outcome outcome = read("");
  EXPECT_TRUE(outcome.truncated);
  EXPECT_EQ(outcome.error, "");
}

TEST(McapReader, SaysThatBytesFollowTheEnd) {
  const std::string file = sample_file();
  for (const std::string& more : {std::string("x"), file}) {
    const Outcome outcome = read(file + more);
    EXPECT_EQ(outcome.messages, "012345");
    ASSERT_EQ(outcome.damage.size(), 1U);
    EXPECT_NE(outcome.damage[0].find("there are data after the footer"), std::string::npos);
  }
}

}  // namespace
}  // namespace tendon::mcap_reader_test
