// SPDX-License-Identifier: Apache-2.0
#include "server/recording/recording_reader.h"

#include <gtest/gtest.h>
#include <rapidcheck/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <fstream>
#include <limits>
#include <set>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_writer.h"
#include "server/recording/recorder.h"
#include "tests/server/recording/recording_samples.h"
#include "tests/server/scratch_folder.h"
#include "tests/support/refusal.h"

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

/// Returns random doubles, including NaN, infinities, subnormals and both zeros.
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

TEST(RecordingReader, GivesTheRecordsOfEveryDeviceWhenAllAreAskedFor) {
  MemorySink sink;
  Recorder::Config config = sample_config();
  config.more_devices = {{.name = "left", .scene = config.scene, .ports = true}, {.name = "up", .scene = config.scene}};
  config.more_devices[0].scene.unix_offset = std::chrono::hours(1);  // all times use the offset of the first device
  Recorder recorder(config, sink);
  recorder.record(sample_step(1), 2);
  recorder.record(sample_step(2), 0);
  recorder.record(PortRecord{.tick = 3, .at = testing::ms(3)}, 1);
  recorder.record(sample_step(3), 1);
  recorder.close();
  RecordingReader reader(testing::stream(sink.bytes()), "a.mcap", RecordingReader::Devices::kAll);
  std::vector<std::size_t> of;
  while (const auto record = reader.next()) {
    of.push_back(reader.device());
    if (const auto* step = std::get_if<StepRecord>(&*record)) {
      EXPECT_TRUE(same(*step, sample_step(step->tick)));
    }
  }
  EXPECT_EQ(of, (std::vector<std::size_t>{0, 1, 2, 2, 0, 1, 1}));
  EXPECT_EQ(reader.devices(), (std::vector<std::string>{"", "left", "up"}));

  RecordingReader first(testing::stream(sink.bytes()), "a.mcap");
  std::size_t records = 0;
  while (first.next()) ++records;
  EXPECT_EQ(records, 2U);
  EXPECT_EQ(first.devices().size(), 1U);
}

TEST(RecordingReader, AWayWhoseNameIsTooLongForOneIsReadAsNone) {
  SolverPaths ways;
  const std::string bytes = recording::encode(sample_step(1), std::string(limits::kMaxLabel + 1, 'w'));
  EXPECT_EQ(recording::decode_step(bytes, LocalTime{}, ways).force_way, 0);
}

TEST(Recording, AStepOfAnEngineThatSaysNoWayTakesTheBytesThatItAlwaysTook) {
  EXPECT_EQ(recording::encode(sample_step(1), "near").size(), recording::encode(sample_step(1)).size() + 2 + 1 + 4)
      << "a tag of two bytes, a length, and the name";
}

TEST(RecordingReader, SaysWhyItHasNoStep) {
  MemorySink sink;
  Recorder recorder(sample_config(), sink);
  recorder.close();
  const auto said = [](std::span<const std::byte> bytes) {
    RecordingReader reader(testing::stream(bytes), "a.mcap");
    read_all(reader);
    return reader.without_steps();
  };
  const std::span<const std::byte> file = sink.bytes();
  EXPECT_EQ(said(file.first(0)), "a.mcap: the file is empty");
  EXPECT_EQ(said(file.first(20)), "a.mcap: truncated before the first haptic step");
  EXPECT_EQ(said(file), "a.mcap: contains no haptic step");
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
  const auto what = [](const std::filesystem::path& path) {
    return thrown_by<std::runtime_error>([&] { RecordingReader reader(path); });
  };
  const auto missing = folder.path() / "none.mcap";
  EXPECT_EQ(what(missing), "cannot read recording " + missing.string() + ": No such file or directory");
  EXPECT_EQ(what(folder.path()), "cannot read recording " + folder.path().string() + ": Is a directory");
  const auto text = folder.path() / "text.mcap";
  std::ofstream(text) << "not a recording";
  EXPECT_EQ(what(text), text.string() + ": not an MCAP file");
}

TEST(RecordingReader, RefusesAnMcapFileOfSomebodyElse) {
  MemorySink sink;
  McapWriter writer("other", sink);
  const auto channel = writer.add_channel(writer.add_schema("sensor_msgs/Imu", "ros1msg", ""), "/imu", "ros1");
  writer.write(channel, 1, "abc");
  writer.close();
  EXPECT_EQ(read_all(sink.bytes()).error, "a.mcap: an MCAP file, but not a Tendon recording: it has no channel /scene");
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
    const Contents contents = read_all(sink.bytes());
    EXPECT_EQ(contents.error, "");
    EXPECT_EQ(contents.records(), 1U) << "the scene";
    const std::string damage = contents.damage.empty() ? "" : contents.damage.front();
    const std::string where = "a.mcap: byte " + offset + ": ";
    const std::string end = "; the record is skipped, after 0.000 s";
    EXPECT_TRUE(damage.starts_with(where) && damage.ends_with(end)) << damage;
    if (damage.size() < where.size() + end.size()) return damage;
    return damage.substr(where.size(), damage.size() - where.size() - end.size());
  };
  EXPECT_EQ(error_of(recording::kStep, "\xff\xff"), "the data are not a tendon.recording.v1.Step");
  EXPECT_EQ(error_of(recording::kStep, ""), "step 0 has the unknown mode 0");
  StepRecord strange = sample_step(7);
  strange.mode = static_cast<Mode>(77);
  EXPECT_EQ(error_of(recording::kStep, recording::encode(strange)), "step 7 has the unknown mode 77");
  EXPECT_EQ(error_of(recording::kDatagram, ""), "a datagram has the unknown direction 0");
}

TEST(RecordingReader, ReadsARecordingWithoutItsSceneAndSaysSo) {
  MemorySink sink;
  McapWriter writer("other", sink);
  const auto schema = writer.add_schema(recording::kStep.schema, "protobuf", "");
  writer.write(writer.add_channel(schema, recording::kStep.topic, "protobuf"), 0, recording::encode(sample_step(0)));
  writer.close();
  const Contents contents = read_all(sink.bytes());
  EXPECT_EQ(contents.error, "");
  EXPECT_EQ(contents.steps.size(), 1U);
  ASSERT_EQ(contents.damage.size(), 1U);
  EXPECT_NE(contents.damage[0].find("a record precedes the scene, which is missing"), std::string::npos);
}

struct Chunked {
  struct Chunk {
    std::size_t from;
    std::size_t to;
    std::vector<std::uint64_t> ticks;
  };
  std::string bytes;
  std::vector<Chunk> chunks;  ///< except the first one, which contains the scene
};

Chunked chunked() {
  Recorder::Config config = sample_config();
  config.flush_after = std::chrono::milliseconds(8);
  MemorySink sink;
  Recorder recorder(config, sink);
  record_samples(recorder, 40);
  recorder.close();
  Chunked file{.bytes = {reinterpret_cast<const char*>(sink.bytes().data()), sink.bytes().size()}, .chunks = {}};
  RecordingReader reader(testing::stream(sink.bytes()), "a.mcap");
  McapReader raw(testing::stream(sink.bytes()), "a.mcap");
  while (const auto message = raw.next()) {
    if (message->channel.topic == recording::kScene.topic) continue;
    if (file.chunks.empty() || file.chunks.back().from != message->offset) {
      const auto length = static_cast<std::size_t>(static_cast<unsigned char>(file.bytes[message->offset + 1])) |
                          static_cast<std::size_t>(static_cast<unsigned char>(file.bytes[message->offset + 2])) << 8U |
                          static_cast<std::size_t>(static_cast<unsigned char>(file.bytes[message->offset + 3])) << 16U;
      file.chunks.push_back({message->offset, message->offset + 9 + length, {}});
    }
    if (message->channel.topic == recording::kStep.topic) {
      SolverPaths ways;
      file.chunks.back().ticks.push_back(recording::decode_step(message->data, LocalTime{}, ways).tick);
    }
  }
  return file;
}

// The damage is a flipped bit, a sector of zeros or of random bytes, or missing bytes.
RC_GTEST_PROP(RecordingReader, DamageLosesOnlyTheStepsOfTheChunksThatItMeets, ()) {
  static const Chunked file = chunked();
  RC_PRE(file.chunks.size() >= 4U);
  std::string damaged = file.bytes;
  const std::size_t from = *rc::gen::inRange<std::size_t>(8, damaged.size());
  std::size_t to = std::min(damaged.size(), from + *rc::gen::element<std::size_t>(1, 8, 64, 512, 4096));
  switch (*rc::gen::inRange(0, 4)) {
    case 0:
      to = from + 1;
      damaged[from] = static_cast<char>(damaged[from] ^ (1 << *rc::gen::inRange(0, 8)));
      break;
    case 1:
      for (std::size_t i = from; i < to; ++i) damaged[i] = 0;
      break;
    case 2:
      for (std::size_t i = from; i < to; ++i) damaged[i] = static_cast<char>(*rc::gen::arbitrary<std::uint8_t>());
      break;
    default:
      damaged.erase(from, to - from);
  }
  // If the server was killed, the file ends before a chunk and does not have a summary.
  const auto& last = file.chunks.back();
  const bool killed = from >= file.chunks.front().from && to <= last.from && *rc::gen::arbitrary<bool>();
  if (killed) damaged.resize(last.from - (file.bytes.size() - damaged.size()));

  const Contents contents = read_all(std::as_bytes(std::span(damaged)));
  RC_ASSERT(contents.error.empty());
  std::set<std::uint64_t> given;
  for (const StepRecord& step : contents.steps) {
    RC_ASSERT(step.tick < 40U);
    RC_ASSERT(same(step, sample_step(step.tick)));
    RC_ASSERT(given.insert(step.tick).second);
  }
  for (const auto& chunk : file.chunks) {
    const bool damaged_too = to > chunk.from && from < chunk.to;
    if (damaged_too || (killed && chunk.from == last.from)) continue;
    for (const std::uint64_t tick : chunk.ticks) RC_ASSERT(given.contains(tick));
  }
  std::uint64_t lost = 0;
  for (const LossRecord& loss : contents.losses) lost += loss.steps;
  RC_ASSERT(lost <= 40U - given.size());
  if (!killed && to <= last.to) RC_ASSERT(lost == 40U - given.size());
}

}  // namespace
}  // namespace tendon::recording_reader_test
