// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/recording/byte_sink.h"
#include "server/recording/mcap_format.h"

namespace tendon {

/// Writes an indexed MCAP file (https://mcap.dev/spec): messages in uncompressed chunks with a CRC and a message
/// index, and at the end a summary that lets a reader seek. It does not know what the messages mean.
///
/// Bytes leave in whole pieces, one `ByteSink::append` each: the first `flush_chunk` takes the beginning of the file
/// along, `close` writes the summary. So a file is readable at any time, up to its last chunk; without the summary a
/// reader calls it truncated. The same calls give the same bytes.
///
/// When the sink fails, this and every later piece is dropped, and `flush_chunk` and `close` say so.
///
/// Thread-safe: no. Realtime-safe: no.
class McapWriter {
 public:
  /// `library` names the program that writes. `sink` must outlive the writer.
  McapWriter(std::string_view library, ByteSink& sink);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Returns the schema's id. Call before the channels that use it.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);

  /// Returns the channel's id. Throws std::invalid_argument for an unknown schema.
  std::uint16_t add_channel(std::uint16_t schema_id, std::string_view topic, std::string_view message_encoding);

  /// Adds a message to the open chunk. `log_time` in ns; need not be monotone. Throws std::invalid_argument for an
  /// unknown channel and std::logic_error after `close`.
  void write(std::uint16_t channel_id, std::uint64_t log_time, std::string_view data);

  /// Bytes of messages in the open chunk.
  std::size_t chunk_size() const noexcept { return records_.size(); }

  /// Closes the open chunk and hands it to the sink. Without messages there is no chunk. False: the sink has failed.
  bool flush_chunk();

  /// Flushes, and ends the file with summary and footer. False: the sink has failed. Later calls do nothing.
  bool close();

  /// Chunks so far. The index of each stays in memory until `close`.
  std::size_t chunks() const noexcept { return chunks_.size(); }

  /// Bytes that the sink has taken.
  std::uint64_t bytes_written() const noexcept { return written_; }

 private:
  using Buffer = std::vector<std::byte>;
  struct TimeRange {
    std::uint64_t first = UINT64_MAX;
    std::uint64_t last = 0;
    void include(std::uint64_t time) noexcept;
  };
  struct IndexEntry {
    std::uint64_t log_time;
    std::uint64_t offset;  ///< in the chunk's records
  };
  struct Channel {
    Buffer record;
    std::uint64_t messages = 0;     ///< in the whole file
    std::vector<IndexEntry> index;  ///< of the open chunk
  };
  struct ChunkInfo {
    TimeRange time;
    std::uint64_t start;   ///< byte offset in the file
    std::uint64_t length;  ///< of the chunk's record
    std::vector<std::pair<std::uint16_t, std::uint64_t>> index_offsets;
    std::uint64_t index_length;
    std::uint64_t records_size;
  };

  void put_chunk();
  void put_summary();
  bool hand_over();

  ByteSink& sink_;
  Buffer out_;      ///< the next piece
  Buffer records_;  ///< messages of the open chunk
  TimeRange chunk_time_;
  std::vector<Buffer> schemas_;
  std::vector<Channel> channels_;
  std::vector<ChunkInfo> chunks_;
  TimeRange file_time_;
  std::uint64_t messages_ = 0;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;  ///< of all bytes written
  bool failed_ = false;
  bool closed_ = false;
};

}  // namespace tendon
