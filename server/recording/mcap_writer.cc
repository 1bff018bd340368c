// SPDX-License-Identifier: Apache-2.0
#include "server/recording/mcap_writer.h"

#include <algorithm>
#include <concepts>
#include <limits>
#include <stdexcept>

#include "core/base/bytes.h"

namespace tendon {
namespace {

using mcap::extend_crc;
using mcap::Opcode;
using Buffer = std::vector<std::byte>;

template <std::unsigned_integral T>
void put(Buffer& out, T value) {
  const auto bytes = little_endian(value);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

void put(Buffer& out, Opcode opcode) { out.push_back(static_cast<std::byte>(opcode)); }

void put_bytes(Buffer& out, std::span<const std::byte> bytes) { out.insert(out.end(), bytes.begin(), bytes.end()); }

std::span<const std::byte> bytes_of(std::string_view text) { return std::as_bytes(std::span(text)); }

std::uint32_t length32(std::size_t size) {
  if (size > std::numeric_limits<std::uint32_t>::max()) throw std::length_error("too long for an MCAP field");
  return static_cast<std::uint32_t>(size);
}

void put_string(Buffer& out, std::string_view text) {
  put(out, length32(text.size()));
  put_bytes(out, bytes_of(text));
}

void overwrite(Buffer& out, std::size_t at, std::uint64_t value) { put_little_endian(value, out.data() + at); }

template <class Fill>
void put_record(Buffer& out, Opcode opcode, Fill fill) {
  put(out, opcode);
  const std::size_t length_at = out.size();
  put(out, std::uint64_t{0});
  fill();
  overwrite(out, length_at, out.size() - length_at - sizeof(std::uint64_t));
}

}  // namespace

void McapWriter::TimeRange::include(std::uint64_t time) noexcept {
  first = std::min(first, time);
  last = std::max(last, time);
}

McapWriter::McapWriter(std::string_view library, ByteSink& sink) : sink_(sink) {
  put_bytes(out_, mcap::kMagic);
  put_record(out_, Opcode::kHeader, [&] {
    put_string(out_, "");  // profile
    put_string(out_, library);
  });
}

std::uint16_t McapWriter::add_schema(std::string_view name, std::string_view encoding, std::string_view data) {
  const auto id = static_cast<std::uint16_t>(schemas_.size() + 1);
  Buffer& record = schemas_.emplace_back();
  put_record(record, Opcode::kSchema, [&] {
    put(record, id);
    put_string(record, name);
    put_string(record, encoding);
    put_string(record, data);
  });
  put_bytes(out_, record);
  return id;
}

std::uint16_t McapWriter::add_channel(std::uint16_t schema_id, std::string_view topic,
                                      std::string_view message_encoding) {
  if (schema_id == 0 || schema_id > schemas_.size()) throw std::invalid_argument("MCAP channel without a schema");
  const auto id = static_cast<std::uint16_t>(channels_.size() + 1);
  Buffer& record = channels_.emplace_back().record;
  put_record(record, Opcode::kChannel, [&] {
    put(record, id);
    put(record, schema_id);
    put_string(record, topic);
    put_string(record, message_encoding);
    put(record, std::uint32_t{0});  // metadata
  });
  put_bytes(out_, record);
  return id;
}

void McapWriter::write(std::uint16_t channel_id, std::uint64_t log_time, std::string_view data) {
  if (closed_) throw std::logic_error("MCAP message after the end of the file");
  if (channel_id == 0 || channel_id > channels_.size()) throw std::invalid_argument("MCAP message without a channel");
  Channel& channel = channels_[channel_id - 1U];
  channel.index.push_back({log_time, records_.size()});
  constexpr std::size_t kFront = sizeof channel_id + sizeof(std::uint32_t) + 2 * sizeof log_time;
  std::array<std::byte, mcap::kRecordHead + kFront> front;
  std::byte* at = front.data();
  const auto add = [&at](auto value) {
    put_little_endian(value, at);
    at += sizeof value;
  };
  add(static_cast<std::uint8_t>(Opcode::kMessage));
  add(std::uint64_t{kFront + data.size()});
  add(channel_id);
  add(static_cast<std::uint32_t>(channel.messages));
  add(log_time);
  add(log_time);  // publish time
  put_bytes(records_, front);
  put_bytes(records_, bytes_of(data));
  chunk_time_.include(log_time);
  ++channel.messages;
}

bool McapWriter::flush_chunk() {
  if (!records_.empty()) put_chunk();
  return hand_over();
}

bool McapWriter::close() {
  if (!closed_) {
    if (flush_chunk()) {
      put_summary();
      hand_over();
    }
    closed_ = true;
  }
  return !failed_;
}

void McapWriter::put_chunk() {
  ChunkInfo info{.time = chunk_time_,
                 .start = written_ + out_.size(),
                 .length = 0,
                 .index_offsets = {},
                 .index_length = 0,
                 .records_size = records_.size()};
  const std::uint32_t records_crc = extend_crc(0, records_);
  put_record(out_, Opcode::kChunk, [&] {
    put(out_, info.time.first);
    put(out_, info.time.last);
    put(out_, std::uint64_t{records_.size()});
    put(out_, records_crc);
    put_string(out_, "");  // compression
    put(out_, std::uint64_t{records_.size()});
    put_bytes(out_, records_);
  });
  update_crc(out_.size() - records_.size());
  crc_ = mcap::join_crcs(crc_, records_crc, records_.size());
  in_crc_ = out_.size();
  const std::uint64_t chunk_end = written_ + out_.size();
  info.length = chunk_end - info.start;

  for (std::size_t i = 0; i < channels_.size(); ++i) {
    auto& index = channels_[i].index;
    if (index.empty()) continue;
    const auto channel_id = static_cast<std::uint16_t>(i + 1);
    info.index_offsets.emplace_back(channel_id, written_ + out_.size());
    std::ranges::stable_sort(index, {}, &IndexEntry::log_time);
    put_record(out_, Opcode::kMessageIndex, [&] {
      put(out_, channel_id);
      put(out_, length32(index.size() * sizeof(IndexEntry)));
      for (const IndexEntry& entry : index) {
        put(out_, entry.log_time);
        put(out_, entry.offset);
      }
    });
    messages_ += index.size();
    index.clear();
  }
  info.index_length = written_ + out_.size() - chunk_end;

  file_time_.include(info.time.first);
  file_time_.include(info.time.last);
  chunks_.push_back(std::move(info));
  chunk_time_ = {};
  records_.clear();
}

void McapWriter::put_summary() {
  put_record(out_, Opcode::kDataEnd, [&] { put(out_, crc_); });

  const std::size_t begin = out_.size();
  const auto position = [&] { return written_ + out_.size(); };
  struct Group {
    Opcode opcode;
    std::uint64_t start;
    std::uint64_t length;
  };
  std::vector<Group> groups;
  const auto put_group = [&](Opcode opcode, auto fill) {
    const std::uint64_t start = position();
    fill();
    if (position() > start) groups.push_back({opcode, start, position() - start});
  };

  put_group(Opcode::kSchema, [&] {
    for (const Buffer& schema : schemas_) put_bytes(out_, schema);
  });
  put_group(Opcode::kChannel, [&] {
    for (const Channel& channel : channels_) put_bytes(out_, channel.record);
  });
  put_group(Opcode::kStatistics, [&] {
    put_record(out_, Opcode::kStatistics, [&] {
      put(out_, messages_);
      put(out_, static_cast<std::uint16_t>(schemas_.size()));
      put(out_, static_cast<std::uint32_t>(channels_.size()));
      put(out_, std::uint32_t{0});  // attachments
      put(out_, std::uint32_t{0});  // metadata
      put(out_, static_cast<std::uint32_t>(chunks_.size()));
      put(out_, messages_ > 0 ? file_time_.first : 0);
      put(out_, file_time_.last);
      put(out_, length32(channels_.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
      for (std::size_t i = 0; i < channels_.size(); ++i) {
        put(out_, static_cast<std::uint16_t>(i + 1));
        put(out_, channels_[i].messages);
      }
    });
  });
  put_group(Opcode::kChunkIndex, [&] {
    for (const ChunkInfo& chunk : chunks_) {
      put_record(out_, Opcode::kChunkIndex, [&] {
        put(out_, chunk.time.first);
        put(out_, chunk.time.last);
        put(out_, chunk.start);
        put(out_, chunk.length);
        put(out_, length32(chunk.index_offsets.size() * (sizeof(std::uint16_t) + sizeof(std::uint64_t))));
        for (const auto& [channel_id, offset] : chunk.index_offsets) {
          put(out_, channel_id);
          put(out_, offset);
        }
        put(out_, chunk.index_length);
        put_string(out_, "");  // compression
        put(out_, chunk.records_size);
        put(out_, chunk.records_size);
      });
    }
  });

  const std::uint64_t offsets_start = position();
  for (const Group& group : groups) {
    put_record(out_, Opcode::kSummaryOffset, [&] {
      put(out_, group.opcode);
      put(out_, group.start);
      put(out_, group.length);
    });
  }
  put_record(out_, Opcode::kFooter, [&] {
    put(out_, written_ + begin);
    put(out_, offsets_start);
    // The CRC includes the opcode of the footer, its length, which is updated later, and its first two fields.
    const std::size_t length_at = out_.size() - 2 * sizeof(std::uint64_t) - sizeof(std::uint64_t);
    overwrite(out_, length_at, 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t));
    put(out_, extend_crc(0, std::span(out_).subspan(begin)));
  });
  put_bytes(out_, mcap::kMagic);
}

/// Adds the bytes of `out_` before `end` to the CRC of the file.
void McapWriter::update_crc(std::size_t end) {
  crc_ = extend_crc(crc_, std::span(out_).subspan(in_crc_, end - in_crc_));
  in_crc_ = end;
}

bool McapWriter::hand_over() {
  update_crc(out_.size());
  failed_ = failed_ || (!out_.empty() && !sink_.append(out_));
  if (!failed_) written_ += out_.size();
  out_.clear();
  in_crc_ = 0;
  return !failed_;
}

}  // namespace tendon
