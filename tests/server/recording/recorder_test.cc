// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recorder.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <span>
#include <string>
#include <vector>

#include "server/recording/byte_sink.h"
#include "tests/server/recording/recording_samples.h"

namespace tendon::recorder_test {
namespace {

using testing::Contents;
using testing::ms;
using testing::read_all;
using testing::record_samples;
using testing::sample_config;
using testing::sample_datagram;
using testing::sample_step;

/// A disk of `capacity` bytes. Like FileSink, it only writes complete pieces.
class SmallDisk final : public ByteSink {
 public:
  explicit SmallDisk(std::size_t capacity) : capacity_(capacity) {}

  bool append(std::span<const std::byte> bytes) override {
    if (kept.bytes().size() + bytes.size() > capacity_) {
      full_ = true;
      return false;
    }
    borders.push_back(kept.bytes().size() + bytes.size());
    return kept.append(bytes);
  }
  std::string error() const override { return full_ ? "the disk is full" : ""; }

  MemorySink kept;
  std::vector<std::size_t> borders;  ///< end positions of the accepted pieces

 private:
  std::size_t capacity_;
  bool full_ = false;
};

TEST(Recorder, WritesTheSceneAtOnce) {
  MemorySink sink;
  const Recorder recorder(sample_config(), sink);
  const Contents contents = read_all(sink.bytes());
  ASSERT_EQ(contents.scenes.size(), 1U);
  EXPECT_EQ(contents.scenes[0], sample_config().scene);
  EXPECT_TRUE(contents.truncated);
}

TEST(Recorder, GivesTheSameBytesForTheSameRecords) {
  MemorySink first;
  MemorySink second;
  for (MemorySink* sink : {&first, &second}) {
    Recorder recorder(sample_config(), *sink);
    record_samples(recorder, 1000);
    recorder.close();
  }
  EXPECT_GT(first.bytes().size(), 100'000U);
  EXPECT_EQ(first.bytes(), second.bytes());
}

TEST(Recorder, KeepsAllButTheLastQuarterSecondOfAKilledServer) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  for (std::uint64_t tick = 0; tick < 3000; ++tick) {
    recorder.record(sample_step(tick));
    if (tick % 50 != 0) continue;  // server killed here
    const Contents contents = read_all(sink.bytes());
    EXPECT_EQ(contents.error, "");
    EXPECT_LE(tick + 1 - contents.steps.size(), 251U) << "at step " << tick;
  }
}

TEST(Recorder, FlushesWhatIsOldThoughNothingNewComes) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  recorder.record(sample_step(0));
  recorder.tick(ms(200));
  EXPECT_EQ(read_all(sink.bytes()).steps.size(), 0U);
  recorder.tick(ms(251));
  EXPECT_EQ(read_all(sink.bytes()).steps.size(), 1U);
}

TEST(Recorder, ClosesAChunkThatIsLarge) {
  MemorySink sink;
  Recorder::Config config = sample_config();
  config.flush_size = 4096;
  Recorder recorder(config, sink);
  for (int i = 0; i < 4; ++i) recorder.record(sample_datagram(ms(0), 1200, true));
  EXPECT_EQ(read_all(sink.bytes()).datagrams.size(), 4U);
}

TEST(Recorder, TellsTheReaderWhereRecordsAreMissing) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  recorder.record(sample_step(0));
  recorder.lost({.at = ms(5), .steps = 4, .datagrams = 2});
  recorder.record(sample_step(5));
  recorder.close();
  const Contents contents = read_all(sink.bytes());
  ASSERT_EQ(contents.losses.size(), 1U);
  EXPECT_EQ(contents.losses[0], (LossRecord{ms(5), 4, 2}));
  EXPECT_EQ(recorder.status().steps, 2U);
  EXPECT_EQ(recorder.status().lost_steps, 4U);
  EXPECT_EQ(recorder.status().lost_datagrams, 2U);
}

TEST(Recorder, SaysOfEachLossWhatItWas) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  const std::vector<LossRecord> losses = {
      {.at = ms(1), .steps = 7, .datagrams = 9, .cause = LossRecord::Cause::kDisk},
      {.at = ms(2), .datagrams = 5, .cause = LossRecord::Cause::kByteBudget},
      {.at = ms(3), .cause = LossRecord::Cause::kSample, .unauthenticated = 39'000},
  };
  for (const LossRecord& loss : losses) recorder.lost(loss);
  recorder.close();
  EXPECT_EQ(read_all(sink.bytes()).losses, losses);
}

TEST(Recorder, CountsWhatComesAfterTheEndAsLost) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  recorder.close();
  const auto size = sink.bytes().size();
  recorder.record(sample_step(0));
  recorder.lost({.at = ms(1), .steps = 1, .datagrams = 1});
  recorder.tick(ms(1000));
  recorder.close();
  EXPECT_EQ(sink.bytes().size(), size);
  EXPECT_EQ(recorder.status().lost_steps, 2U);
}

TEST(Recorder, LeavesAReadableFileAndAnHonestCountOnADiskOfAnySize) {
  Recorder::Config config = sample_config();
  config.flush_after = std::chrono::milliseconds(5);
  SmallDisk endless(std::numeric_limits<std::size_t>::max());
  {
    Recorder recorder(config, endless);
    record_samples(recorder, 40);
    recorder.close();
  }
  ASSERT_GE(endless.borders.size(), 8U);
  // The capacities are on both sides of the end of each piece, because the result can only change there.
  std::vector<std::size_t> capacities = {0};
  for (const std::size_t border : endless.borders) {
    capacities.push_back(border - 1);
    capacities.push_back(border);
  }
  capacities.pop_back();  // large enough

  for (const std::size_t capacity : capacities) {
    SmallDisk disk(capacity);
    Recorder recorder(config, disk);
    record_samples(recorder, 40);
    recorder.close();

    const Recorder::Status status = recorder.status();
    EXPECT_EQ(status.error, "the disk is full") << capacity;
    EXPECT_EQ(status.bytes, disk.kept.bytes().size()) << capacity;
    EXPECT_EQ(status.steps + status.lost_steps, 40U) << capacity;
    EXPECT_EQ(status.datagrams + status.lost_datagrams, 8U) << capacity;
    const Contents contents = read_all(disk.kept.bytes());
    EXPECT_EQ(contents.error, "") << capacity;
    EXPECT_TRUE(contents.truncated) << capacity;
    EXPECT_EQ(contents.steps.size(), status.steps) << capacity;
    EXPECT_EQ(contents.datagrams.size(), status.datagrams) << capacity;
  }
}

}  // namespace
}  // namespace tendon::recorder_test
