// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_reader.h"

#include <algorithm>
#include <array>
#include <concepts>
#include <stdexcept>
#include <utility>

#include "core/base/bytes.h"

namespace tendon {

using mcap::extend_crc;
using mcap::Opcode;

namespace {

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

}  // namespace

/// Takes the fields of a record off the front of its content, one after the other.
class McapReader::Fields {
 public:
  Fields(const McapReader& reader, std::span<const std::byte> bytes) : reader_(reader), rest_(bytes) {}

  template <std::unsigned_integral T>
  T number() {
    return get_little_endian<T>(bytes(sizeof(T)).data());
  }

  std::string_view string() { return text_of(bytes(number<std::uint32_t>())); }

  std::span<const std::byte> bytes(std::uint64_t size) {
    if (size > rest_.size()) reader_.corrupt(reader_.record_offset_, "a record ends before its fields do");
    const auto taken = rest_.first(static_cast<std::size_t>(size));
    rest_ = rest_.subspan(taken.size());
    return taken;
  }

  std::span<const std::byte> rest() { return bytes(rest_.size()); }

 private:
  const McapReader& reader_;
  std::span<const std::byte> rest_;
};

McapReader::McapReader(std::unique_ptr<std::istream> input, std::string name)
    : input_(std::move(input)), name_(std::move(name)) {
  const auto unreadable = [&] { return std::runtime_error(name_ + ": cannot be read"); };
  std::array<std::byte, mcap::kMagic.size()> magic{};
  const auto read_magic = [&](std::uint64_t at, std::size_t size) {
    input_->seekg(static_cast<std::streamoff>(at));
    input_->read(reinterpret_cast<char*>(magic.data()), static_cast<std::streamsize>(size));
    if (!*input_) throw unreadable();
    return std::equal(mcap::kMagic.begin(), mcap::kMagic.begin() + static_cast<std::ptrdiff_t>(size), magic.begin());
  };

  input_->seekg(0, std::ios::end);
  const auto end = static_cast<std::streamoff>(input_->tellg());
  if (!*input_ || end < 0) throw unreadable();
  size_ = static_cast<std::uint64_t>(end);
  const auto head = static_cast<std::size_t>(std::min<std::uint64_t>(size_, magic.size()));
  if (head > 0 && !read_magic(0, head)) throw std::runtime_error(name_ + ": is not an MCAP file");
  if (size_ > magic.size()) ends_with_magic_ = read_magic(size_ - magic.size(), magic.size());

  if (head < magic.size()) {
    truncated_ = finished_ = true;
    return;
  }
  position_ = magic.size();
  crc_ = extend_crc(0, mcap::kMagic);
  input_->seekg(static_cast<std::streamoff>(position_));
}

std::optional<McapReader::Message> McapReader::next() {
  while (!finished_) {
    if (!chunk_.empty()) {
      Fields records(*this, chunk_);
      const auto opcode = static_cast<Opcode>(records.number<std::uint8_t>());
      const auto content = records.bytes(records.number<std::uint64_t>());
      chunk_ = records.rest();
      if (auto message = take(opcode, content)) return message;
      continue;
    }
    if (!next_record()) return std::nullopt;
    if (opcode_ == Opcode::kChunk) {
      open_chunk();
    } else if (auto message = take(opcode_, content_)) {
      return message;
    }
  }
  return std::nullopt;
}

/// Reads one whole record of the file. False: there is none.
bool McapReader::next_record() {
  const auto cut_off = [&] {
    if (ends_with_magic_) corrupt(position_, "a record reaches past the end of the file");
    truncated_ = finished_ = true;
    return false;
  };
  const auto read = [&](std::span<std::byte> bytes) {
    input_->read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
    if (!*input_) throw std::runtime_error(name_ + ": byte " + std::to_string(position_) + ": cannot be read");
  };

  const std::uint64_t rest = size_ - position_;
  if (rest < mcap::kRecordHead) return cut_off();
  std::array<std::byte, mcap::kRecordHead> head{};
  read(head);
  opcode_ = static_cast<Opcode>(head[0]);
  const auto length = get_little_endian<std::uint64_t>(head.data() + 1);
  if (length > rest - head.size()) return cut_off();
  if (opcode_ == Opcode{}) corrupt(position_, "there is no record with opcode 0");
  if (length > kMaxRecord) corrupt(position_, "a record of " + std::to_string(length) + " bytes is too large to read");
  content_.resize(static_cast<std::size_t>(length));
  read(content_);

  record_offset_ = position_;
  position_ += head.size() + length;
  if (opcode_ == Opcode::kDataEnd) {
    const auto expected = Fields(*this, content_).number<std::uint32_t>();
    if (expected != 0 && expected != crc_) corrupt(record_offset_, "the CRC of the data before it does not match");
    in_summary_ = true;
  } else if (opcode_ == Opcode::kFooter) {
    summary_crc_ = extend_crc(summary_crc_, head);
    check_end();
  } else if (in_summary_) {
    summary_crc_ = extend_crc(extend_crc(summary_crc_, head), content_);
  }
  crc_ = extend_crc(extend_crc(crc_, head), content_);
  return true;
}

/// At the footer: checks what holds for every complete file.
void McapReader::check_end() {
  finished_ = true;
  Fields footer(*this, content_);
  const auto start_fields = footer.bytes(2 * sizeof(std::uint64_t));
  const auto expected = footer.number<std::uint32_t>();
  if (expected != 0 && expected != extend_crc(summary_crc_, start_fields))
    corrupt(record_offset_, "the CRC of the summary does not match");
  if (size_ - position_ < mcap::kMagic.size()) {
    truncated_ = true;
  } else if (size_ - position_ > mcap::kMagic.size() || !ends_with_magic_) {
    corrupt(position_, "the file does not end after its footer");
  }
}

void McapReader::open_chunk() {
  Fields chunk(*this, content_);
  chunk.bytes(2 * sizeof(std::uint64_t));  // first and last time
  const auto size = chunk.number<std::uint64_t>();
  const auto expected = chunk.number<std::uint32_t>();
  const auto compression = chunk.string();
  if (!compression.empty())
    corrupt(record_offset_, "a chunk is compressed (" + std::string(compression) + "), which is not supported");
  const auto records = chunk.bytes(chunk.number<std::uint64_t>());
  if (records.size() != size) corrupt(record_offset_, "a chunk does not have the size it names");
  if (expected != 0 && expected != extend_crc(0, records)) corrupt(record_offset_, "the CRC of a chunk does not match");
  chunk_ = records;
}

/// Takes in a record of the data section or of a chunk, and gives the message if it is one.
std::optional<McapReader::Message> McapReader::take(Opcode opcode, std::span<const std::byte> content) {
  Fields fields(*this, content);
  switch (opcode) {
    case Opcode::kSchema: {
      const auto id = fields.number<std::uint16_t>();
      schemas_[id] = fields.string();
      return std::nullopt;
    }
    case Opcode::kChannel: {
      const auto id = fields.number<std::uint16_t>();
      const auto schema = schemas_.find(fields.number<std::uint16_t>());
      const auto topic = fields.string();
      const auto encoding = fields.string();
      channels_[id] = {std::string(topic), std::string(encoding), schema != schemas_.end() ? schema->second : ""};
      return std::nullopt;
    }
    case Opcode::kMessage: {
      const auto channel = channels_.find(fields.number<std::uint16_t>());
      if (channel == channels_.end()) corrupt(record_offset_, "a message belongs to no channel");
      const auto sequence = fields.number<std::uint32_t>();
      const auto log_time = fields.number<std::uint64_t>();
      fields.number<std::uint64_t>();  // publish time
      return Message{channel->second, sequence, log_time, text_of(fields.rest()), record_offset_};
    }
    default:
      return std::nullopt;
  }
}

void McapReader::corrupt(std::uint64_t offset, const std::string& what) const {
  throw std::runtime_error(name_ + ": byte " + std::to_string(offset) + ": " + what);
}

}  // namespace tendon
