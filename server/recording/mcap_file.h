// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <istream>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "server/recording/mcap_format.h"

namespace tendon::mcap {

std::string_view text_of(std::span<const std::byte> bytes);

/// Reads the fields of a record. If one extends past the end, `ok` becomes false, and all later ones are empty or zero.
class Fields {
 public:
  explicit Fields(std::span<const std::byte> bytes) : rest_(bytes) {}

  std::uint16_t u16();
  std::uint32_t u32();
  std::uint64_t u64();
  std::string_view string();
  std::span<const std::byte> bytes(std::uint64_t size);
  std::span<const std::byte> rest() const noexcept { return rest_; }
  bool ok() const noexcept { return ok_; }
  bool done() const noexcept { return ok_ && rest_.empty(); }

 private:
  std::span<const std::byte> rest_;
  bool ok_ = true;
};

struct ChunkHead {
  static constexpr std::size_t kSize = 8 + 8 + 8 + 4 + 4 + 8;  ///< in bytes, without compression

  std::uint64_t size = 0;  ///< of the uncompressed records, in bytes
  std::uint32_t crc = 0;   ///< of the uncompressed records, or 0
  std::string_view compression;
  std::span<const std::byte> records;  ///< may be compressed
};
std::optional<ChunkHead> chunk_head(std::span<const std::byte> content);

/// Corrects the lengths in the content of a chunk. Returns false if the CRC of the records does not match.
bool mend_chunk(std::span<std::byte> content);

bool is_checked(Opcode opcode);

/// Returns "the CRC of a chunk does not match", for example, or an empty string. Checks lengths of fields and CRCs.
std::string why_damaged(Opcode opcode, std::span<const std::byte> content);

/// Provides random access to an MCAP file that may be damaged. Thread-safe: no.
class File {
 public:
  /// Limits the memory that is allocated if a length is damaged. Tendon writes chunks of 256 KiB.
  static constexpr std::uint64_t kMaxRecord = std::uint64_t{64} << 20;

  struct Record {
    Opcode opcode{};
    std::uint64_t at = 0;
    std::uint64_t end = 0;
  };

  /// `name` is used in error messages. All functions that read from the file throw std::runtime_error.
  File(std::unique_ptr<std::istream> input, std::string name);

  const std::string& name() const noexcept { return name_; }
  std::uint64_t size() const noexcept { return size_; }
  /// The position after the last nonzero byte. A power failure can leave zeros at the end of the file.
  std::uint64_t zeros_from() const noexcept { return zeros_from_; }

  void read(std::uint64_t at, std::span<std::byte> bytes);
  std::vector<std::byte> read(std::uint64_t at, std::uint64_t size);
  bool magic_at(std::uint64_t at);

  /// Returns nothing if the record is too large or extends past the end of the file.
  std::optional<Record> record_at(std::uint64_t at);
  /// Returns the chunk at `at`, even if its opcode is damaged, or nothing if all three copies of its length differ.
  std::optional<Record> chunk_at(std::uint64_t at);
  /// Returns true if there is a valid record at `at`, or if the remaining bytes are zero.
  bool goes_on_at(std::uint64_t at);
  /// Returns the first valid chunk, schema or channel in [from, end). The next record must also be valid, because
  /// schemas and channels have no CRC.
  std::optional<std::uint64_t> find_record(std::uint64_t from, std::uint64_t end) { return find(from, end, false); }
  std::optional<std::uint64_t> find_chunk(std::uint64_t from, std::uint64_t end) { return find(from, end, true); }

 private:
  bool sound_at(std::uint64_t at);
  std::optional<std::uint64_t> find(std::uint64_t from, std::uint64_t end, bool chunks_only);

  std::unique_ptr<std::istream> input_;
  std::string name_;
  std::uint64_t size_ = 0;
  std::uint64_t zeros_from_ = 0;
  std::uint64_t cursor_ = UINT64_MAX;
};

}  // namespace tendon::mcap
