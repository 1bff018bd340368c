// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/repair.h"

#include <cstddef>
#include <cstdint>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "server/build_info.h"
#include "server/recording/recording_codec.h"
#include "tests/support/json_line.h"
#include "tests/tools/replay/copy.h"

namespace tendon::replay {
namespace {

constexpr std::size_t kChunk = std::size_t{256} * 1024;
const McapReader::Channel kLossChannel{.topic = std::string(recording::kLoss.topic),
                                       .message_encoding = std::string(recording::kEncoding),
                                       .schema_name = std::string(recording::kLoss.schema)};

struct Copied {
  std::uint64_t messages = 0;
  std::uint64_t lost_steps = 0;
  std::uint64_t lost_datagrams = 0;
};

class Repair {
 public:
  explicit Repair(const std::filesystem::path& path)
      : sink_(path), writer_("tendon " + std::string(version_text()), sink_) {}

  void copy(const McapReader::Message& message) {
    lose(message.channel.topic, message.missing, message.log_time);
    writer_.write(channels_.in(writer_, message.channel), message.log_time, message.data);
    ++copied_.messages;
    newest_ = message.log_time;
    if (writer_.chunk_size() > kChunk) check_written(writer_.flush_chunk(), sink_);
  }
  Copied finish(McapReader& reader) {
    for (const auto& kind : {recording::kStep, recording::kDatagram}) {
      lose(kind.topic, reader.missing_at_end(kind.topic), newest_);
    }
    check_written(writer_.close(), sink_);
    return copied_;
  }

 private:
  void lose(std::string_view topic, std::uint64_t count, std::uint64_t at) {
    LossRecord loss{.cause = LossRecord::Cause::kDisk};
    if (topic == recording::kStep.topic) loss.steps = count;
    if (topic == recording::kDatagram.topic) loss.datagrams = count;
    if (loss.steps + loss.datagrams == 0) return;
    copied_.lost_steps += loss.steps;
    copied_.lost_datagrams += loss.datagrams;
    writer_.write(channels_.in(writer_, kLossChannel), at, recording::encode(loss));
  }

  FileSink sink_;
  McapWriter writer_;
  CopiedChannels channels_;
  std::uint64_t newest_ = 0;
  Copied copied_;
};

}  // namespace

void repair(const RepairOptions& options, std::ostream& out) {
  if (std::filesystem::exists(options.out)) {
    throw std::runtime_error(options.out.string() + ": the file exists and is not overwritten");
  }
  McapReader reader = open_mcap(options.recording);
  reader.use_summary();
  std::optional<Repair> repair;
  while (const auto message = reader.next()) {
    if (!repair) repair.emplace(options.out);
    repair->copy(*message);
  }
  if (!repair) throw std::runtime_error(options.recording.string() + ": contains no readable message");
  const Copied copied = repair->finish(reader);
  const std::vector<std::string> damage = reader.damage();
  if (options.json) {
    out << JsonLine()
               .add("into", options.out.string())
               .add("messages", copied.messages)
               .add("lost_steps", copied.lost_steps)
               .add("lost_datagrams", copied.lost_datagrams)
               .add("truncated", reader.truncated())
               .add("damage", damage)
               .str()
        << '\n';
    return;
  }
  out << options.out.string() << ": " << copied.messages << " messages; " << copied.lost_steps << " steps and "
      << copied.lost_datagrams << " datagrams are missing\n";
  if (reader.truncated()) out << options.recording.string() << ": truncated; data after the last chunk is lost\n";
  for (const std::string& sentence : damage) out << sentence << '\n';
}

}  // namespace tendon::replay
