// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recording_reader.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_writer.h"
#include "server/recording/recorder.h"
#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"

namespace tendon::recording_reader_test {
namespace {

using testing::Contents;
using testing::read_all;
using testing::record_samples;
using testing::same;
using testing::sample_config;
using testing::sample_datagram;
using testing::sample_step;
using testing::ScratchFolder;

constexpr std::int64_t kYear = 31'557'600'000'000'000;  // ns

/// Any double: NaN, infinities, subnormals and both zeros are as likely as in random bits and a bit more.
double any_double() {
  return *rc::gen::weightedOneOf<double>(
      {{8, rc::gen::arbitrary<double>()},
       {1, rc::gen::element(-0.0, INFINITY, -INFINITY, std::numeric_limits<double>::quiet_NaN(),
                            -std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::denorm_min())}});
}

Vec3 any_vec3() {
  const double x = any_double();
  const double y = any_double();
  return {x, y, any_double()};
}

Duration any_duration() { return Duration(*rc::gen::inRange<std::int64_t>(-kYear, kYear)); }

StepRecord any_step() {
  StepRecord step;
  step.tick = *rc::gen::arbitrary<std::uint64_t>();
  step.scheduled = LocalTime(any_duration());
  step.hand = {.at = LocalTime(any_duration()), .position = any_vec3(), .velocity = any_vec3()};
  step.held = any_duration();
  step.was_applied = any_vec3();
  step.hand_force = any_vec3();
  step.wanted = any_vec3();
  step.permitted = any_double();
  step.force = any_vec3();
  step.applied = any_vec3();
  step.energy = any_double();
  step.reasons = Reasons::from_bits(*rc::gen::arbitrary<std::uint32_t>());
  step.mode = static_cast<Mode>(*rc::gen::inRange(1, 7));
  step.force_sequence = *rc::gen::arbitrary<std::uint64_t>();
  step.force_age = any_duration();
  step.loop_age = any_duration();
  if (*rc::gen::arbitrary<bool>()) step.force_error = any_double();
  return step;
}

DatagramRecord any_datagram() {
  DatagramRecord datagram = sample_datagram(LocalTime(any_duration()), *rc::gen::inRange<std::uint32_t>(0, 65536),
                                            *rc::gen::arbitrary<bool>());
  for (auto& byte : datagram.peer.ip) byte = *rc::gen::arbitrary<std::uint8_t>();
  if (*rc::gen::arbitrary<bool>()) datagram.peer.ip = {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xff, 0xff, 192, 0, 2, 1};
  datagram.peer.port = *rc::gen::arbitrary<std::uint16_t>();
  return datagram;
}

RC_GTEST_PROP(Recording, GivesBackEveryBitOfEveryRecord, ()) {
  Recorder::Config config = sample_config();
  config.scene.unix_offset = any_duration();
  config.scene.seed = *rc::gen::arbitrary<std::uint64_t>();
  config.started = LocalTime(any_duration());
  MemorySink sink;
  Recorder recorder(config, sink);
  std::vector<StepRecord> steps;
  std::vector<DatagramRecord> datagrams;
  for (int i = *rc::gen::inRange(0, 12); i > 0; --i) recorder.record(steps.emplace_back(any_step()));
  for (int i = *rc::gen::inRange(0, 4); i > 0; --i) recorder.record(datagrams.emplace_back(any_datagram()));
  recorder.close();

  const Contents contents = read_all(sink.bytes());
  RC_ASSERT(contents.error.empty());
  RC_ASSERT(!contents.truncated);
  RC_ASSERT(contents.scenes.size() == 1U);
  RC_ASSERT(contents.scenes[0] == config.scene);
  RC_ASSERT(contents.steps.size() == steps.size());
  RC_ASSERT(contents.datagrams.size() == datagrams.size());
  for (std::size_t i = 0; i < steps.size(); ++i) RC_ASSERT(same(contents.steps[i], steps[i]));
  for (std::size_t i = 0; i < datagrams.size(); ++i) RC_ASSERT(same(contents.datagrams[i], datagrams[i]));
}

TEST(RecordingReader, GivesTheNameOfTheWayInWhichEachForceWasMade) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  recorder.record(sample_step(0));
  recorder.record(sample_step(1), 0, "near");
  recorder.record(sample_step(2), 0, "tabulated");
  recorder.record(sample_step(3), 0, "near");
  recorder.close();
  RecordingReader reader(testing::stream(sink.bytes()), "a.mcap");
  const Contents contents = read_all(reader);
  ASSERT_EQ(contents.steps.size(), 4U);
  const std::string_view expected[] = {"", "near", "tabulated", "near"};
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(reader.ways().name_of(contents.steps[i].force_way), expected[i]) << i;
}

TEST(RecordingReader, AWayWhoseNameIsTooLongForOneIsReadAsNone) {
  Ways ways;
  const std::string bytes = recording::encode(sample_step(1), std::string(limits::kMaxLabel + 1, 'w'));
  EXPECT_EQ(recording::decode_step(bytes, LocalTime{}, ways).force_way, 0);
}

TEST(Recording, AStepOfAnEngineThatSaysNoWayTakesTheBytesThatItAlwaysTook) {
  EXPECT_EQ(recording::encode(sample_step(1), "near").size(), recording::encode(sample_step(1)).size() + 2 + 1 + 4)
      << "a tag of two bytes, a length, and the name";
}

TEST(RecordingReader, GivesTheWholeChunksOfARecordingCutAnywhere) {
  Recorder::Config config = sample_config();
  config.flush_after = std::chrono::milliseconds(5);
  MemorySink sink;
  Recorder recorder(config, sink);
  record_samples(recorder, 20);
  recorder.close();

  const std::span<const std::byte> file = sink.bytes();
  std::size_t seen = 0;
  for (std::size_t size = 0; size < file.size(); ++size) {
    const Contents contents = read_all(file.first(size));
    EXPECT_EQ(contents.error, "") << "cut at " << size;
    EXPECT_TRUE(contents.truncated) << "cut at " << size;
    EXPECT_GE(contents.records(), seen) << "cut at " << size;
    for (std::size_t i = 0; i < contents.steps.size(); ++i) EXPECT_TRUE(same(contents.steps[i], sample_step(i)));
    seen = contents.records();
  }
  EXPECT_EQ(seen, 1U + 20U + 4U);
}

TEST(RecordingReader, ReadsAFile) {
  const ScratchFolder folder;
  const auto path = folder.path() / "run.mcap";
  {
    FileSink sink(path);
    Recorder recorder(sample_config(), sink);
    record_samples(recorder, 2000);
    recorder.close();
  }
  RecordingReader reader(path);
  const Contents contents = read_all(reader);
  EXPECT_EQ(contents.error, "");
  EXPECT_EQ(contents.steps.size(), 2000U);
  EXPECT_EQ(contents.datagrams.size(), 400U);
  EXPECT_FALSE(contents.truncated);
}

TEST(RecordingReader, PutsWallClockTimeInTheFileAndLocalTimeInTheRecords) {
  Recorder::Config config = sample_config();
  config.scene.unix_offset = Duration(1'700'000'000'000'000'000);
  MemorySink sink;
  Recorder recorder(config, sink);
  recorder.record(sample_step(3));
  recorder.close();

  McapReader raw(testing::stream(sink.bytes()), "a.mcap");
  EXPECT_EQ(raw.next()->log_time, 1'700'000'000'000'000'000U);
  EXPECT_EQ(raw.next()->log_time, 1'700'000'000'003'017'000U);
  EXPECT_EQ(read_all(sink.bytes()).steps.at(0).hand.at, sample_step(3).hand.at);
}

TEST(RecordingReader, NamesThePathThatCannotBeRead) {
  const ScratchFolder folder;
  const auto what = [](const std::filesystem::path& path) -> std::string {
    try {
      RecordingReader reader(path);
      return "";
    } catch (const std::runtime_error& error) {
      return error.what();
    }
  };
  const auto missing = folder.path() / "none.mcap";
  EXPECT_EQ(what(missing), "cannot read recording " + missing.string() + ": No such file or directory");
  EXPECT_EQ(what(folder.path()), "cannot read recording " + folder.path().string() + ": Is a directory");
  const auto text = folder.path() / "text.mcap";
  std::ofstream(text) << "not a recording";
  EXPECT_EQ(what(text), text.string() + ": is not an MCAP file");
}

TEST(RecordingReader, RefusesAnMcapFileOfSomebodyElse) {
  MemorySink sink;
  McapWriter writer("other", sink);
  const auto channel = writer.add_channel(writer.add_schema("sensor_msgs/Imu", "ros1msg", ""), "/imu", "ros1");
  writer.write(channel, 1, "abc");
  writer.close();
  EXPECT_EQ(read_all(sink.bytes()).error,
            "a.mcap: is an MCAP file, but not a Tendon recording: it has no channel /scene");
}

TEST(RecordingReader, SaysWhatIsWrongWithAMessageAndWhere) {
  const auto error_of = [](const recording::Channel& kind, const std::string& message) {
    MemorySink sink;
    McapWriter writer("other", sink);
    const auto add = [&](const recording::Channel& c) {
      return writer.add_channel(writer.add_schema(c.schema, "protobuf", ""), c.topic, "protobuf");
    };
    const auto scene = add(recording::kScene);
    const auto other = add(kind);
    writer.write(scene, 0, recording::encode(SceneRecord{}));
    writer.flush_chunk();
    const auto offset = std::to_string(writer.bytes_written());
    writer.write(other, 0, message);
    writer.close();
    const std::string error = read_all(sink.bytes()).error;
    const std::string where = "a.mcap: byte " + offset + ": ";
    EXPECT_TRUE(error.starts_with(where)) << error;
    return error.substr(std::min(error.size(), where.size()));
  };
  EXPECT_EQ(error_of(recording::kStep, "\xff\xff"), "the bytes are not a tendon.recording.v1.Step");
  EXPECT_EQ(error_of(recording::kStep, ""), "step 0 has the unknown mode 0");
  StepRecord strange = sample_step(7);
  strange.mode = static_cast<Mode>(77);
  EXPECT_EQ(error_of(recording::kStep, recording::encode(strange)), "step 7 has the unknown mode 77");
  EXPECT_EQ(error_of(recording::kDatagram, ""), "a datagram has the unknown direction 0");
}

TEST(RecordingReader, RefusesRecordsBeforeTheScene) {
  MemorySink sink;
  McapWriter writer("other", sink);
  const auto schema = writer.add_schema(recording::kStep.schema, "protobuf", "");
  writer.write(writer.add_channel(schema, recording::kStep.topic, "protobuf"), 0, recording::encode(sample_step(0)));
  writer.close();
  EXPECT_NE(read_all(sink.bytes()).error.find("a record comes before the scene"), std::string::npos);
}

}  // namespace
}  // namespace tendon::recording_reader_test
