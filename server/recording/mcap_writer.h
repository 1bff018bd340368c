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

/// Writes an indexed MCAP file with uncompressed chunks (https://mcap.dev/spec).
///
/// The first call of `flush_chunk` also writes the start of the file, and `close` writes the summary. Therefore, the
/// file can be read at any time up to the last chunk, but it is reported as truncated without the summary. The output
/// is deterministic. If the sink fails, all subsequent data is dropped, and `flush_chunk` and `close` return false.
/// Thread-safe: no. Realtime-safe: no.
class McapWriter {
 public:
  /// `sink` must outlive the writer.
  McapWriter(std::string_view library, ByteSink& sink);
  McapWriter(const McapWriter&) = delete;
  McapWriter& operator=(const McapWriter&) = delete;

  /// Must be called before adding the channels that use the schema.
  std::uint16_t add_schema(std::string_view name, std::string_view encoding, std::string_view data);

  /// Throws std::invalid_argument if the schema does not exist.
  std::uint16_t add_channel(std::uint16_t schema_id, std::string_view topic, std::string_view message_encoding);

  /// `log_time` in ns, in any order. Throws std::invalid_argument for unknown channels, std::logic_error after `close`.
  void write(std::uint16_t channel_id, std::uint64_t log_time, std::string_view data);

  std::size_t chunk_size() const noexcept { return records_.size(); }

  /// Writes the current chunk unless it is empty. Returns false if the sink has failed.
  bool flush_chunk();

  /// Flushes and writes the summary. Returns false if the sink has failed. Subsequent calls have no effect.
  bool close();

  /// The indexes of chunks are kept in memory until `close` is called.
  std::size_t chunks() const noexcept { return chunks_.size(); }

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
    std::uint64_t offset;
  };
  struct Channel {
    Buffer record;
    std::uint64_t messages = 0;
    std::vector<IndexEntry> index;
  };
  struct ChunkInfo {
    TimeRange time;
    std::uint64_t start;
    std::uint64_t length;  ///< of the record
    std::vector<std::pair<std::uint16_t, std::uint64_t>> index_offsets;
    std::uint64_t index_length;
    std::uint64_t records_size;
  };

  void put_chunk();
  void put_summary();
  void update_crc(std::size_t end);
  bool hand_over();

  ByteSink& sink_;
  Buffer out_;
  Buffer records_;
  TimeRange chunk_time_;
  std::vector<Buffer> schemas_;
  std::vector<Channel> channels_;
  std::vector<ChunkInfo> chunks_;
  TimeRange file_time_;
  std::uint64_t messages_ = 0;
  std::uint64_t written_ = 0;
  std::uint32_t crc_ = 0;   ///< of the file
  std::size_t in_crc_ = 0;  ///< the number of bytes of `out_` that `crc_` includes
  bool failed_ = false;
  bool closed_ = false;
};

}  // namespace tendon
