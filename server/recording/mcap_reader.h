// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/recording/mcap_file.h"

namespace tendon {

/// Reads the messages of an MCAP file in the order of the file (https://mcap.dev/spec).
///
/// * If the file is truncated, or ends with zeros after a power failure, all messages in complete chunks are returned.
/// * If a CRC or a length is not valid, the chunk is skipped, and an error message is added to `damage()`. If the
///   record of a channel is damaged, the summary at the end of the file is used instead.
/// * The sequence numbers of each channel are used to count missing messages. McapWriter starts at 0.
///
/// Compressed chunks and messages outside of chunks are not supported because Tendon does not write them. The reader
/// requires memory for one record and, if the file is damaged, for the summary. Thread-safe: no.
class McapReader {
 public:
  struct Channel {
    std::string topic;
    std::string message_encoding;
    std::string schema_name;

    bool operator==(const Channel&) const = default;
  };
  struct Message {
    const Channel& channel;
    std::uint32_t sequence;
    std::uint64_t log_time;  ///< ns
    std::string_view data;   ///< valid until the next call of `next`
    std::uint64_t offset;    ///< position of the record in the file
    std::uint64_t missing = 0;
  };

  /// Throws std::runtime_error if this is not an MCAP file.
  McapReader(std::unique_ptr<std::istream> input, std::string name);

  /// Returns nothing at the end. Throws std::runtime_error if a chunk is compressed or the file cannot be read.
  std::optional<Message> next();

  bool truncated() const noexcept { return truncated_; }  ///< only valid after `next` has returned nothing

  /// Describes each damaged region so far: position, reason, and times of adjacent messages since the first message.
  std::vector<std::string> damage() const;

  /// The number of missing messages in the summary, or 0 without one. Only valid after `next` has returned nothing.
  std::uint64_t missing_at_end(std::string_view topic);

  /// Replaces the channels, including those of messages that have already been returned, with those in the summary.
  /// Returns false if this is not possible or has already been done.
  bool use_summary();

  std::uint64_t size() const noexcept { return file_.size(); }

  const std::map<std::uint16_t, Channel>& channels() const noexcept { return channels_; }

  void note(std::uint64_t offset, const std::string& what) { note(offset, offset, what); }
  /// Throws std::runtime_error "NAME: byte OFFSET: what".
  [[noreturn]] void corrupt(std::uint64_t offset, const std::string& what) const;

 private:
  struct Damage {
    std::uint64_t from;
    std::uint64_t to;
    std::string what;
    std::optional<std::uint64_t> after;   ///< log time of the previous message
    std::optional<std::uint64_t> before;  ///< log time of the next message
  };
  struct Count {
    std::uint64_t next = 0;
    std::size_t damage = 0;
  };

  bool next_record();
  void accept_record();
  bool skip_damage(const std::string& what);
  bool finish(bool truncated);
  void check_end();
  void open_chunk();
  std::optional<Message> take(mcap::Opcode opcode, std::span<const std::byte> content);
  std::optional<Message> take_message(mcap::Fields fields);
  void take_channel(mcap::Fields fields);
  void take_statistics(mcap::Fields fields);
  std::vector<std::byte> whole_summary();
  void note(std::uint64_t from, std::uint64_t to, std::string what);

  mcap::File file_;
  bool ends_with_magic_ = false;

  std::uint64_t position_ = 0;
  std::uint64_t sure_ = 0;  ///< the end of the last valid chunk
  mcap::File::Record record_;
  std::vector<std::byte> content_;
  std::span<const std::byte> chunk_;

  std::uint32_t crc_ = 0;  ///< of the file before `position_`
  std::uint32_t summary_crc_ = 0;
  bool in_summary_ = false;

  std::map<std::uint16_t, std::string> schemas_;
  std::map<std::uint16_t, Channel> channels_;
  std::set<std::uint16_t> doubtful_;  ///< channels with multiple definitions
  std::map<std::uint16_t, Count> taken_;
  std::map<std::uint16_t, std::uint64_t> total_;  ///< from the summary
  bool summary_tried_ = false;
  bool summary_used_ = false;

  std::vector<Damage> damage_;
  std::optional<std::uint64_t> first_time_;
  std::optional<std::uint64_t> last_time_;
  bool finished_ = false;
  bool truncated_ = false;
};

}  // namespace tendon
