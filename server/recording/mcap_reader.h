// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/recording/mcap_format.h"

namespace tendon {

/// Reads the messages of an MCAP file from start to end, in the order of the file (https://mcap.dev/spec).
///
/// * A file that was cut off anywhere gives every message of its whole records; then `truncated()` is true.
/// * Every CRC in the file is checked. Corruption throws std::runtime_error that names the file, the byte offset of
///   the record, and what is wrong with it; the messages before it have been given.
/// * Compressed chunks are refused in the same way: Tendon writes none.
///
/// Memory: one record. Thread-safe: no. Realtime-safe: no.
class McapReader {
 public:
  struct Channel {
    std::string topic;
    std::string message_encoding;
    std::string schema_name;
  };
  struct Message {
    const Channel& channel;
    std::uint32_t sequence;
    std::uint64_t log_time;  ///< ns
    std::string_view data;   ///< valid until the next `next`
    std::uint64_t offset;    ///< byte offset in the file of the record that it is in
  };

  /// No record may be larger: what a flipped bit in a length can make us allocate. Our chunks are 256 KiB.
  static constexpr std::uint64_t kMaxRecord = std::uint64_t{64} << 20;

  /// `name` is what messages call the file. Throws std::runtime_error when it is not an MCAP file.
  McapReader(std::unique_ptr<std::istream> input, std::string name);

  /// The next message; empty at the end of the data.
  std::optional<Message> next();

  /// True when the file ended before its own end mark. Known once `next` has returned empty.
  bool truncated() const noexcept { return truncated_; }

  /// Channels met so far.
  const std::map<std::uint16_t, Channel>& channels() const noexcept { return channels_; }

  /// Throws "NAME: byte OFFSET: what": for callers that find a message's content wrong.
  [[noreturn]] void corrupt(std::uint64_t offset, const std::string& what) const;

 private:
  class Fields;

  bool next_record();
  std::optional<Message> take(mcap::Opcode opcode, std::span<const std::byte> content);
  void open_chunk();
  void check_end();

  std::unique_ptr<std::istream> input_;
  std::string name_;
  std::uint64_t size_ = 0;
  bool ends_with_magic_ = false;

  std::uint64_t position_ = 0;       ///< of the next record
  std::uint64_t record_offset_ = 0;  ///< of the record in `content_`
  mcap::Opcode opcode_{};
  std::vector<std::byte> content_;
  std::span<const std::byte> chunk_;  ///< records of the open chunk that are still to be taken

  std::uint32_t crc_ = 0;          ///< of the file before `position_`
  std::uint32_t summary_crc_ = 0;  ///< of the summary before `position_`
  bool in_summary_ = false;

  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  bool finished_ = false;
  bool truncated_ = false;
};

}  // namespace tendon
