// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

// Protobuf allows encodings that our Writer never uses: fields in any order, duplicate or unknown fields, split lists,
// and varints that are too long. AnyOrder converts a message to the form of our Writer, which the Reader requires.

namespace tendon::wire {

enum class Shape : std::uint8_t {
  kFlag,     ///< varint
  kCount32,  ///< varint, truncated; also for enums
  kCount64,  ///< varint
  kBits32,   ///< 4 bytes
  kBits64,   ///< 8 bytes
  kText,
  kBytes,
  kMessage,
  // Repeated:
  kCount32s,
  kCount64s,
  kBits32s,
  kBits64s,
  kTexts,
  kMessages,
};

struct Schema;
struct FieldShape {
  std::uint32_t number;
  Shape shape;
  const Schema* inside = nullptr;
  bool arm = false;  ///< of a oneof
};
/// Sorted by field number (wire/generated/schema.h).
struct Schema {
  std::span<const FieldShape> fields;
};

/// Keeps its memory between calls. Thread-safe: no.
class AnyOrder {
 public:
  /// Returns the message as interpreted by libprotobuf (tests/protocol/wire/protobuf_test.cc). The last number, text or
  /// arm of a oneof is used, messages are merged, lists are joined, and unknown fields are dropped. Returns nullopt if
  /// the message is truncated, if a text is not UTF-8, or if groups do not match or are nested more than 100 deep. The
  /// result is valid until the next call.
  std::optional<std::span<const std::byte>> in_order(const Schema& schema, std::span<const std::byte> message);

 private:
  struct Piece {
    const std::uint8_t* at;
    const std::uint8_t* end;
  };
  struct Found {
    std::size_t field = 0;
    unsigned type = 0;
    bool replaced = false;  ///< by a later arm of the oneof
    std::uint64_t number = 0;
    Piece piece{};
  };

  bool collect(const Schema& schema, Piece piece, int depth);
  static bool take(Piece& from, std::uint32_t field, int depth, Found& found);
  static bool skip_group(Piece& from, std::uint32_t field, int depth);
  bool write_merged(const Schema& schema, std::size_t from, std::size_t to, const Found& like, int depth);
  bool write_all(const Schema& schema, std::size_t from, std::size_t to, int depth);
  bool write(const FieldShape& field, std::size_t place, std::size_t from, std::size_t to, int depth);
  bool write_list(const FieldShape& field, std::size_t place, std::size_t from, std::size_t to);
  bool write_message(const FieldShape& field, std::size_t from, std::size_t to, const Found& like, int depth);
  bool write_text(const FieldShape& field, const Found& found);
  void put_tag(const FieldShape& field, unsigned type);
  void put_varint(std::uint64_t value);
  void put_length(std::size_t begin);

  std::vector<Found> found_;
  std::vector<std::uint8_t> out_;
};

}  // namespace tendon::wire
