// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_file.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <utility>

#include "core/base/bytes.h"

namespace tendon::mcap {
namespace {

constexpr std::uint64_t kBlock = std::uint64_t{1} << 20;

}  // namespace

std::string_view text_of(std::span<const std::byte> bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

std::uint16_t Fields::u16() {
  const auto taken = bytes(sizeof(std::uint16_t));
  return taken.empty() ? std::uint16_t{0} : get_little_endian<std::uint16_t>(taken.data());
}

std::uint32_t Fields::u32() {
  const auto taken = bytes(sizeof(std::uint32_t));
  return taken.empty() ? 0 : get_little_endian<std::uint32_t>(taken.data());
}

std::uint64_t Fields::u64() {
  const auto taken = bytes(sizeof(std::uint64_t));
  return taken.empty() ? 0 : get_little_endian<std::uint64_t>(taken.data());
}

std::string_view Fields::string() { return text_of(bytes(u32())); }

std::span<const std::byte> Fields::bytes(std::uint64_t size) {
  ok_ = ok_ && size <= rest_.size();
  if (!ok_) return {};
  const auto taken = rest_.first(static_cast<std::size_t>(size));
  rest_ = rest_.subspan(taken.size());
  return taken;
}

std::optional<ChunkHead> chunk_head(std::span<const std::byte> content) {
  Fields fields(content);
  fields.bytes(2 * sizeof(std::uint64_t));  // start time and end time
  ChunkHead head;
  head.size = fields.u64();
  head.crc = fields.u32();
  head.compression = fields.string();
  head.records = fields.bytes(fields.u64());
  if (!fields.done()) return std::nullopt;
  return head;
}

bool mend_chunk(std::span<std::byte> content) {
  constexpr std::size_t kSizeAt = 2 * sizeof(std::uint64_t);
  constexpr std::size_t kCrcAt = kSizeAt + sizeof(std::uint64_t);
  constexpr std::size_t kCompressionAt = kCrcAt + sizeof(std::uint32_t);
  constexpr std::size_t kRecordsAt = kCompressionAt + sizeof(std::uint32_t);
  const auto records = content.subspan(ChunkHead::kSize);
  const auto crc = get_little_endian<std::uint32_t>(content.data() + kCrcAt);
  if (crc == 0 || crc != extend_crc(0, records)) return false;
  put_little_endian<std::uint64_t>(records.size(), content.data() + kSizeAt);
  put_little_endian<std::uint32_t>(0, content.data() + kCompressionAt);
  put_little_endian<std::uint64_t>(records.size(), content.data() + kRecordsAt);
  return true;
}

bool is_checked(Opcode opcode) {
  switch (opcode) {
    case Opcode::kHeader:
    case Opcode::kFooter:
    case Opcode::kSchema:
    case Opcode::kChannel:
    case Opcode::kChunk:
    case Opcode::kMessageIndex:
    case Opcode::kSummaryOffset:
    case Opcode::kDataEnd:
      return true;
    default:
      return false;
  }
}

std::string why_damaged(Opcode opcode, std::span<const std::byte> content) {
  Fields fields(content);
  constexpr const char* kWrongLength = "the length of a record does not match its fields";
  const auto whole = [&] { return std::string(fields.done() ? "" : kWrongLength); };
  if (opcode == Opcode{}) return "a record has the invalid opcode 0";
  switch (opcode) {
    case Opcode::kHeader:
      fields.string();
      fields.string();
      return whole();
    case Opcode::kSchema:
      fields.u16();
      for (int i = 0; i < 3; ++i) fields.string();
      return whole();
    case Opcode::kChannel:
      fields.bytes(2 * sizeof(std::uint16_t));
      for (int i = 0; i < 3; ++i) fields.string();
      return whole();
    case Opcode::kMessage:
      return "a message is outside of a chunk";
    case Opcode::kMessageIndex: {
      fields.u16();
      const auto entries = fields.string();
      return entries.size() % (2 * sizeof(std::uint64_t)) == 0 ? whole() : kWrongLength;
    }
    case Opcode::kDataEnd:
      fields.u32();
      return whole();
    case Opcode::kFooter:
      fields.bytes(2 * sizeof(std::uint64_t) + sizeof(std::uint32_t));
      return whole();
    case Opcode::kSummaryOffset:
      fields.bytes(1 + 2 * sizeof(std::uint64_t));
      return whole();
    case Opcode::kChunk: {
      const auto head = chunk_head(content);
      if (!head) return "a chunk does not have the size in its header";
      if (!head->compression.empty()) return {};
      if (head->size != head->records.size()) return "a chunk does not have the size in its header";
      if (head->crc != 0 && head->crc != extend_crc(0, head->records)) return "the CRC of a chunk does not match";
      return {};
    }
    default:
      return {};
  }
}

File::File(std::unique_ptr<std::istream> input, std::string name) : input_(std::move(input)), name_(std::move(name)) {
  input_->seekg(0, std::ios::end);
  const auto end = static_cast<std::streamoff>(input_->tellg());
  if (!*input_ || end < 0) throw std::runtime_error(name_ + ": cannot read the file");
  size_ = zeros_from_ = static_cast<std::uint64_t>(end);
  while (zeros_from_ > 0) {
    // The first read is only one byte, because most files do not end with zeros.
    const std::uint64_t step = zeros_from_ == size_ ? 1 : std::min(zeros_from_, kBlock);
    const auto block = read(zeros_from_ - step, step);
    const auto last = std::find_if(block.rbegin(), block.rend(), [](std::byte b) { return b != std::byte{0}; });
    zeros_from_ -= static_cast<std::uint64_t>(last - block.rbegin());
    if (last != block.rend()) break;
  }
}

void File::read(std::uint64_t at, std::span<std::byte> bytes) {
  // Seeking would discard the buffer of the stream.
  if (cursor_ != at) input_->seekg(static_cast<std::streamoff>(at));
  input_->read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!*input_) throw std::runtime_error(name_ + ": byte " + std::to_string(at) + ": cannot read the file");
  cursor_ = at + bytes.size();
}

std::vector<std::byte> File::read(std::uint64_t at, std::uint64_t size) {
  std::vector<std::byte> bytes(static_cast<std::size_t>(size));
  read(at, bytes);
  return bytes;
}

bool File::magic_at(std::uint64_t at) {
  if (size_ < kMagic.size() || at > size_ - kMagic.size()) return false;
  std::array<std::byte, kMagic.size()> found{};
  read(at, found);
  return found == kMagic;
}

std::optional<File::Record> File::record_at(std::uint64_t at) {
  if (at > size_ || size_ - at < kRecordHead) return std::nullopt;
  std::array<std::byte, kRecordHead> head{};
  read(at, head);
  const auto length = get_little_endian<std::uint64_t>(head.data() + 1);
  if (length > kMaxRecord || length > size_ - at - head.size()) return std::nullopt;
  return Record{static_cast<Opcode>(head[0]), at, at + head.size() + length};
}

std::optional<File::Record> File::chunk_at(std::uint64_t at) {
  constexpr std::size_t kHead = kRecordHead + ChunkHead::kSize;
  if (at > size_ || size_ - at < kHead) return std::nullopt;
  std::array<std::byte, kHead> head{};
  read(at, head);
  const auto number = [&](std::size_t place) { return get_little_endian<std::uint64_t>(head.data() + place); };
  const std::uint64_t by_record = number(1) - ChunkHead::kSize;
  const std::uint64_t by_size = number(kRecordHead + 16);
  const std::uint64_t by_records = number(kHead - 8);
  if (by_size != by_records && by_record != by_size && by_record != by_records) return std::nullopt;
  const std::uint64_t length = by_size == by_records ? by_size : by_record;
  if (length == 0 || length > kMaxRecord || length > size_ - at - kHead) return std::nullopt;
  return Record{Opcode::kChunk, at, at + kHead + length};
}

bool File::sound_at(std::uint64_t at) {
  const auto record = record_at(at);
  return record && is_checked(record->opcode) &&
         why_damaged(record->opcode, read(at + kRecordHead, record->end - at - kRecordHead)).empty();
}

bool File::goes_on_at(std::uint64_t at) { return at >= zeros_from_ || sound_at(at); }

std::optional<std::uint64_t> File::find(std::uint64_t from, std::uint64_t end, bool chunks_only) {
  end = std::min(end, zeros_from_);
  for (std::uint64_t block_at = from; block_at < end; block_at += kBlock) {
    const auto block = read(block_at, std::min(kBlock, end - block_at));
    for (std::size_t i = 0; i < block.size(); ++i) {
      const auto opcode = static_cast<Opcode>(block[i]);
      const std::uint64_t at = block_at + i;
      if (opcode == Opcode::kChunk) {
        // The lengths are checked first because computing a CRC for each possible opcode would be too slow.
        const auto chunk = chunk_at(at);
        const auto record = record_at(at);
        if (chunk && record && chunk->end == record->end && sound_at(at) && goes_on_at(record->end)) return at;
      } else if (!chunks_only && (opcode == Opcode::kSchema || opcode == Opcode::kChannel)) {
        const auto record = record_at(at);
        if (record && sound_at(at) && goes_on_at(record->end)) return at;
      }
    }
  }
  return std::nullopt;
}

}  // namespace tendon::mcap
