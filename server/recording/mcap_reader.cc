// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_reader.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <stdexcept>
#include <utility>

#include "core/base/bytes.h"

namespace tendon {

using mcap::extend_crc;
using mcap::Fields;
using mcap::kMagic;
using mcap::kRecordHead;
using mcap::Opcode;

namespace {

constexpr std::size_t kFooter = kRecordHead + 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t);

constexpr std::uint64_t kLongestSummary = std::uint64_t{16} << 20;

std::string seconds_of(std::uint64_t time, std::uint64_t start) {
  char text[32];
  std::snprintf(text, sizeof text, "%.3f s", 1e-9 * static_cast<double>(static_cast<std::int64_t>(time - start)));
  return text;
}

}  // namespace

McapReader::McapReader(std::unique_ptr<std::istream> input, std::string name)
    : file_(std::move(input), std::move(name)) {
  const auto head = file_.read(0, std::min<std::uint64_t>(file_.size(), kMagic.size()));
  ends_with_magic_ = file_.size() > kMagic.size() && file_.magic_at(file_.size() - kMagic.size());
  // Less than the size of the head if the file is truncated or ends with zeros.
  const auto written = static_cast<std::ptrdiff_t>(std::min<std::uint64_t>(file_.zeros_from(), kMagic.size()));
  if (!std::equal(head.begin(), head.begin() + written, kMagic.begin())) {
    const bool zeros = std::ranges::all_of(head, [](std::byte b) { return b == std::byte{0}; });
    const bool more = file_.zeros_from() > kMagic.size();
    const bool mcap = more && (ends_with_magic_ || file_.goes_on_at(kMagic.size()) ||
                               (zeros && file_.find_record(kMagic.size(), file_.size())));
    if (!mcap) throw std::runtime_error(file_.name() + ": not an MCAP file");
    note(0, 0, "the file does not start with the MCAP magic");
  }
  if (file_.zeros_from() < kMagic.size()) {
    finish(true);
    return;
  }
  position_ = kMagic.size();
  crc_ = extend_crc(0, head);
}

std::optional<McapReader::Message> McapReader::next() {
  for (;;) {
    if (!chunk_.empty()) {
      Fields records(chunk_);
      const auto opcode = records.bytes(1);
      const auto content = records.bytes(records.u64());
      chunk_ = records.rest();
      if (!records.ok()) {
        note(record_.at, record_.at, "the records of a chunk do not have the lengths in their headers");
        chunk_ = {};
      } else if (auto message = take(static_cast<Opcode>(opcode.front()), content)) {
        return message;
      }
      continue;
    }
    if (!next_record()) return std::nullopt;
    if (record_.opcode == Opcode::kChunk) {
      open_chunk();
    } else {
      take(record_.opcode, content_);
    }
  }
}

bool McapReader::next_record() {
  while (!finished_) {
    if (position_ >= file_.zeros_from()) return finish(!ends_with_magic_);
    const auto record = file_.record_at(position_);
    if (!record) {
      if (skip_damage("a record extends beyond the end of the file, or is too large")) return true;
      continue;
    }
    record_ = *record;
    content_.resize(static_cast<std::size_t>(record_.end - record_.at - kRecordHead));
    file_.read(record_.at + kRecordHead, content_);
    std::string what = mcap::why_damaged(record_.opcode, content_);
    if (what.empty() && !in_summary_ && !mcap::is_checked(record_.opcode)) {
      const auto chunk = file_.chunk_at(position_);
      if (chunk && chunk->end == record_.end) what = "a chunk has a wrong opcode";
    }
    if (what.empty()) {
      accept_record();
      return true;
    }
    if (skip_damage(what)) return true;
  }
  return false;
}

void McapReader::accept_record() {
  position_ = record_.end;
  if (record_.opcode == Opcode::kChunk) sure_ = position_;
  std::array<std::byte, kRecordHead> head{static_cast<std::byte>(record_.opcode)};
  put_little_endian<std::uint64_t>(content_.size(), head.data() + 1);
  if (in_summary_) summary_crc_ = extend_crc(summary_crc_, head);
  if (record_.opcode == Opcode::kFooter) return check_end();
  if (in_summary_) summary_crc_ = extend_crc(summary_crc_, content_);
  if (record_.opcode == Opcode::kDataEnd) {
    in_summary_ = true;
    const auto expected = Fields(content_).u32();
    // If the file is damaged, the CRC cannot match.
    if (expected != 0 && expected != crc_ && damage_.empty() && record_.end <= file_.zeros_from())
      note(record_.at, record_.at, "the CRC of the preceding data does not match");
  }
  crc_ = extend_crc(extend_crc(crc_, head), content_);
}

/// Returns true if only the opcode or a length of a chunk is damaged, and sets `record_` to the chunk.
bool McapReader::skip_damage(const std::string& what) {
  const std::uint64_t at = position_;
  const auto by_length = file_.record_at(at);
  std::optional<mcap::File::Record> as_chunk;
  if (!in_summary_) as_chunk = file_.chunk_at(at);
  if (as_chunk) {
    content_ = file_.read(at + kRecordHead, as_chunk->end - at - kRecordHead);
    if (mcap::mend_chunk(content_)) {
      note(at, at, what);
      record_ = *as_chunk;
      position_ = sure_ = record_.end;
      return true;
    }
  }
  use_summary();
  // If bytes are missing, the last record may contain the start of the next chunk.
  std::optional<std::uint64_t> next;
  if (!in_summary_) next = file_.find_chunk(sure_, at);
  for (const auto& record : {by_length, as_chunk}) {
    if (!next && record && record->end <= file_.zeros_from() && file_.goes_on_at(record->end)) next = record->end;
  }
  if (!next && !in_summary_) next = file_.find_record(at + 1, file_.size());
  // If the file ends in this record, it is truncated, but not damaged.
  const bool torn = !next && !ends_with_magic_ && (!by_length || by_length->end > file_.zeros_from());
  if (!torn) note(at, next.value_or(file_.zeros_from()), what);
  if (!next) return finish(!ends_with_magic_);
  position_ = sure_ = *next;
  return false;
}

void McapReader::check_end() {
  const std::uint64_t end = position_ + kMagic.size();
  finish(file_.zeros_from() < end);
  if (truncated_) return;
  Fields footer(content_);
  const auto start_fields = footer.bytes(2 * sizeof(std::uint64_t));
  const auto expected = footer.u32();
  if (!in_summary_ && damage_.empty()) {
    note(record_.at, record_.at, "the record that ends the data before the summary is missing");
  } else if (in_summary_ && expected != 0 && expected != extend_crc(summary_crc_, start_fields)) {
    note(record_.at, record_.at, "the CRC of the summary does not match");
  }
  if (file_.zeros_from() > end || !file_.magic_at(position_)) {
    note(position_, position_, "there are data after the footer");
  }
}

bool McapReader::finish(bool truncated) {
  finished_ = true;
  truncated_ = truncated;
  return false;
}

void McapReader::open_chunk() {
  const auto head = mcap::chunk_head(content_);
  if (!head->compression.empty())
    corrupt(record_.at, "a chunk is compressed (" + std::string(head->compression) + "), which is not supported");
  chunk_ = head->records;
}

std::optional<McapReader::Message> McapReader::take(Opcode opcode, std::span<const std::byte> content) {
  Fields fields(content);
  switch (opcode) {
    case Opcode::kSchema: {
      const auto id = fields.u16();
      if (!summary_used_) schemas_[id] = fields.string();
      return std::nullopt;
    }
    case Opcode::kChannel:
      take_channel(fields);
      return std::nullopt;
    case Opcode::kMessage:
      return take_message(fields);
    default:
      return std::nullopt;
  }
}

void McapReader::take_statistics(Fields fields) {
  // Skip the number of messages, schemas, channels, attachments, metadata and chunks, and the start and end times.
  fields.bytes(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8);
  Fields counts(fields.bytes(fields.u32()));
  while (!counts.rest().empty()) {
    const auto id = counts.u16();
    const auto messages = counts.u64();
    if (!counts.ok()) break;
    total_[id] = messages;
  }
}

void McapReader::take_channel(Fields fields) {
  const auto id = fields.u16();
  const auto schema = schemas_.find(fields.u16());
  const auto topic = fields.string();
  const auto encoding = fields.string();
  if (!fields.ok()) return;
  const Channel channel{std::string(topic), std::string(encoding), schema != schemas_.end() ? schema->second : ""};
  const auto [known, anew] = channels_.try_emplace(id, channel);
  if (!anew && !summary_used_ && known->second != channel) doubtful_.insert(id);
}

std::optional<McapReader::Message> McapReader::take_message(Fields fields) {
  const auto id = fields.u16();
  const auto sequence = fields.u32();
  const auto log_time = fields.u64();
  fields.u64();  // publish time
  if (!fields.ok()) {
    note(record_.at, record_.at, "a message is shorter than its fields");
    return std::nullopt;
  }
  const auto is_known = [&] { return channels_.contains(id) && !doubtful_.contains(id); };
  if (!is_known() && !(use_summary() && is_known())) {
    note(record_.at, record_.at, "a message has an unknown channel");
    return std::nullopt;
  }
  Count& count = taken_[id];
  const std::uint64_t missing = sequence > count.next ? sequence - count.next : 0;
  if (missing > 0 && count.damage == damage_.size()) {
    note(record_.at, record_.at, "preceding messages are missing: a part of the file was lost");
  }
  for (auto damage = damage_.rbegin(); damage != damage_.rend() && !damage->before; ++damage) damage->before = log_time;
  count = {.next = std::uint64_t{sequence} + 1, .damage = damage_.size()};
  last_time_ = log_time;
  if (!first_time_) first_time_ = log_time;
  return Message{channels_.at(id), sequence, log_time, mcap::text_of(fields.rest()), record_.at, missing};
}

std::vector<std::byte> McapReader::whole_summary() {
  if (!ends_with_magic_ || file_.size() < 2 * kMagic.size() + kFooter) return {};
  const std::uint64_t end = file_.size() - kMagic.size() - kFooter;
  const auto record = file_.record_at(end);
  if (!record || record->opcode != Opcode::kFooter || record->end != end + kFooter) return {};
  const auto crc = get_little_endian<std::uint32_t>(file_.read(record->end - sizeof(std::uint32_t), 4).data());
  if (crc == 0) return {};
  // Search for the end of the data section because the position in the footer is not correct if bytes are missing.
  const std::uint64_t from = std::max<std::uint64_t>(end, kLongestSummary) - kLongestSummary;
  const auto bytes = file_.read(from, record->end - sizeof crc - from);
  const std::string_view text = mcap::text_of(bytes);
  constexpr std::string_view kDataEnd("\x0F\x04\0\0\0\0\0\0\0", kRecordHead);
  constexpr int kMostTries = 16;
  std::size_t at = text.size();
  for (int i = 0; i < kMostTries && at > 0; ++i) {
    at = text.rfind(kDataEnd, at - 1);
    if (at == std::string_view::npos) break;
    const std::size_t start = at + kRecordHead + sizeof crc;
    const std::size_t footer = text.size() - (kFooter - sizeof crc);
    if (start > footer || extend_crc(0, std::span(bytes).subspan(start)) != crc) continue;
    return {bytes.begin() + static_cast<std::ptrdiff_t>(start), bytes.begin() + static_cast<std::ptrdiff_t>(footer)};
  }
  return {};
}

bool McapReader::use_summary() {
  if (std::exchange(summary_tried_, true)) return false;
  const auto summary = whole_summary();
  if (summary.empty()) return false;
  schemas_.clear();
  Fields records(summary);
  std::map<std::uint16_t, Channel> before;
  // The elements of this map must not be moved because there are references to them.
  before.swap(channels_);
  while (!records.rest().empty()) {
    const auto opcode = records.bytes(1);
    const auto fields = records.bytes(records.u64());
    if (!records.ok()) break;
    if (static_cast<Opcode>(opcode.front()) == Opcode::kStatistics) {
      take_statistics(Fields(fields));
    } else {
      take(static_cast<Opcode>(opcode.front()), fields);
    }
  }
  before.swap(channels_);
  for (auto& [id, channel] : before) channels_[id] = std::move(channel);
  doubtful_.clear();
  return summary_used_ = true;
}

void McapReader::note(std::uint64_t from, std::uint64_t to, std::string what) {
  if (!damage_.empty() && damage_.back().from == from && damage_.back().what == what) return;
  damage_.push_back({from, to, std::move(what), last_time_, std::nullopt});
}

std::vector<std::string> McapReader::damage() const {
  std::vector<std::string> sentences;
  for (const Damage& damage : damage_) {
    std::string text = file_.name() + ": byte " + std::to_string(damage.from) + ": " + damage.what;
    if (damage.to > damage.from) text += "; " + std::to_string(damage.to - damage.from) + " bytes are skipped";
    if (damage.after) text += ", after " + seconds_of(*damage.after, *first_time_);
    if (damage.before)
      text += std::string(damage.after ? " and" : ",") + " before " + seconds_of(*damage.before, *first_time_);
    sentences.push_back(std::move(text));
  }
  return sentences;
}

std::uint64_t McapReader::missing_at_end(std::string_view topic) {
  if (damage_.empty()) return 0;
  use_summary();
  for (const auto& [id, total] : total_) {
    const auto channel = channels_.find(id);
    if (channel == channels_.end() || channel->second.topic != topic) continue;
    const auto taken = taken_.find(id);
    const std::uint64_t next = taken != taken_.end() ? taken->second.next : 0;
    return total > next ? total - next : 0;
  }
  return 0;
}

void McapReader::corrupt(std::uint64_t offset, const std::string& what) const {
  throw std::runtime_error(file_.name() + ": byte " + std::to_string(offset) + ": " + what);
}

}  // namespace tendon
