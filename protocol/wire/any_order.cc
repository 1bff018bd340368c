// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/any_order.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "protocol/wire/fields/field.h"
#include "protocol/wire/text.h"

namespace tendon::wire {
namespace {

constexpr int kMostDepth = 100;  ///< nested messages and groups, as in libprotobuf

// The other wire types of protobuf.
constexpr unsigned kGroup = 3;
constexpr unsigned kEndOfGroup = 4;

unsigned type_of(Shape shape) noexcept {
  switch (shape) {
    case Shape::kFlag:
    case Shape::kCount32:
    case Shape::kCount64:
    case Shape::kCount32s:
    case Shape::kCount64s:
      return kVarint;
    case Shape::kBits32:
    case Shape::kBits32s:
      return kFixed32;
    case Shape::kBits64:
    case Shape::kBits64s:
      return kFixed64;
    case Shape::kText:
    case Shape::kBytes:
    case Shape::kMessage:
    case Shape::kTexts:
    case Shape::kMessages:
      break;
  }
  return kLength;
}

bool is_list_of_numbers(Shape shape) noexcept { return shape >= Shape::kCount32s && shape <= Shape::kBits64s; }

std::uint64_t cut(Shape shape, std::uint64_t value) noexcept {
  if (shape == Shape::kFlag) return value != 0 ? 1 : 0;
  return shape == Shape::kCount32 || shape == Shape::kCount32s ? value & 0xFFFFFFFFU : value;
}

/// Drops bits beyond the 64th.
template <class From>
bool take_varint(From& from, unsigned most, std::uint64_t& value) noexcept {
  value = 0;
  for (unsigned i = 0; i < most && from.at != from.end; ++i) {
    const Byte byte = *from.at++;
    value |= std::uint64_t{byte & 0x7FU} << (7 * i);
    if (byte < 0x80) return true;
  }
  return false;
}

/// Returns false if the tag is invalid.
template <class From>
bool take_tag(From& from, std::uint32_t& field, unsigned& type) noexcept {
  std::uint64_t tag = 0;
  if (!take_varint(from, 5, tag)) return false;
  field = static_cast<std::uint32_t>(tag) >> 3U;
  type = static_cast<unsigned>(tag & 7U);
  return field != 0;
}

template <class From>
bool take_bytes(From& from, std::uint64_t size, From& bytes) noexcept {
  if (size > static_cast<std::uint64_t>(from.end - from.at)) return false;
  bytes = {from.at, from.at + size};
  from.at += size;
  return true;
}

}  // namespace

bool AnyOrder::skip_group(Piece& from, std::uint32_t field, int depth) {
  if (depth > kMostDepth) return false;
  while (true) {
    std::uint32_t next = 0;
    Found found;
    if (!take_tag(from, next, found.type)) return false;
    if (found.type == kEndOfGroup) return next == field;
    if (!take(from, next, depth, found)) return false;
  }
}

bool AnyOrder::take(Piece& from, std::uint32_t field, int depth, Found& found) {
  std::uint64_t length = 0;
  switch (found.type) {
    case kVarint:
      return take_varint(from, 10, found.number);
    case kFixed64:
      return take_bytes(from, 8, found.piece);
    case kFixed32:
      return take_bytes(from, 4, found.piece);
    case kLength:
      return take_varint(from, 5, length) && take_bytes(from, length, found.piece);
    case kGroup:
      return skip_group(from, field, depth + 1);
    default:
      return false;
  }
}

bool AnyOrder::collect(const Schema& schema, Piece piece, int depth) {
  while (piece.at != piece.end) {
    std::uint32_t number = 0;
    Found found;
    if (!take_tag(piece, number, found.type) || !take(piece, number, depth, found)) return false;
    const auto known = std::ranges::find(schema.fields, number, &FieldShape::number);
    if (known == schema.fields.end()) continue;
    const bool packed = is_list_of_numbers(known->shape) && found.type == kLength;
    if (found.type != type_of(known->shape) && !packed) continue;
    found.field = static_cast<std::size_t>(known - schema.fields.begin());
    found_.push_back(found);
  }
  return true;
}

bool AnyOrder::write_all(const Schema& schema, std::size_t from, std::size_t to, int depth) {
  const auto is_arm = [&](const Found& found) { return schema.fields[found.field].arm; };
  std::size_t last = schema.fields.size();  // winning arm, initially unset
  for (std::size_t i = to; i-- > from;) {
    Found& found = found_[i];
    if (!is_arm(found)) continue;
    if (last == schema.fields.size()) last = found.field;
    found.replaced = found.field != last;
    if (found.replaced) last = schema.fields.size() + 1;
  }
  for (std::size_t place = 0; place < schema.fields.size(); ++place) {
    if (!write(schema.fields[place], place, from, to, depth)) return false;
  }
  found_.resize(from);
  return true;
}

/// Merges the parts in [from, to) that belong to the same message as `like`.
bool AnyOrder::write_merged(const Schema& schema, std::size_t from, std::size_t to, const Found& like, int depth) {
  const std::size_t begin = found_.size();
  for (std::size_t i = from; i < to; ++i) {
    if (found_[i].field != like.field || found_[i].replaced != like.replaced) continue;
    if (!collect(schema, found_[i].piece, depth)) return false;
  }
  return write_all(schema, begin, found_.size(), depth);
}

bool AnyOrder::write_message(const FieldShape& field, std::size_t from, std::size_t to, const Found& like, int depth) {
  const std::size_t whole = out_.size();
  put_tag(field, kLength);
  const std::size_t begin = out_.size();
  if (!write_merged(*field.inside, from, to, like, depth + 1)) return false;
  put_length(begin);
  if (like.replaced) out_.resize(whole);
  return true;
}

bool AnyOrder::write_text(const FieldShape& field, const Found& found) {
  const auto size = static_cast<std::size_t>(found.piece.end - found.piece.at);
  const std::string_view text(reinterpret_cast<const char*>(found.piece.at), size);
  if (field.shape != Shape::kBytes && clipped(text, size).size() != size) return false;
  put_tag(field, kLength);
  put_varint(size);
  out_.insert(out_.end(), found.piece.at, found.piece.end);
  return true;
}

/// Both packed and unpacked lists are accepted.
bool AnyOrder::write_list(const FieldShape& field, std::size_t place, std::size_t from, std::size_t to) {
  const unsigned type = type_of(field.shape);
  put_tag(field, kLength);
  const std::size_t begin = out_.size();
  for (std::size_t i = from; i < to; ++i) {
    if (found_[i].field != place) continue;
    Piece piece = found_[i].piece;
    if (type != kVarint) {
      if ((piece.end - piece.at) % (type == kFixed64 ? 8 : 4) != 0) return false;
      out_.insert(out_.end(), piece.at, piece.end);
    } else if (found_[i].type == kVarint) {
      put_varint(cut(field.shape, found_[i].number));
    } else {
      for (std::uint64_t value = 0; piece.at != piece.end; put_varint(cut(field.shape, value))) {
        if (!take_varint(piece, 10, value)) return false;
      }
    }
  }
  put_length(begin);
  return true;
}

bool AnyOrder::write(const FieldShape& field, std::size_t place, std::size_t from, std::size_t to, int depth) {
  const std::size_t whole = out_.size();
  bool there = false;
  bool replaced = false;
  for (std::size_t i = from; i < to; ++i) {
    const Found found = found_[i];
    if (found.field != place) continue;
    const bool first = !(found.replaced ? replaced : there);
    (found.replaced ? replaced : there) = true;
    switch (field.shape) {
      case Shape::kFlag:
      case Shape::kCount32:
      case Shape::kCount64:
        out_.resize(whole);
        put_tag(field, kVarint);
        put_varint(cut(field.shape, found.number));
        break;
      case Shape::kBits32:
      case Shape::kBits64:
        out_.resize(whole);
        if (found.replaced) break;
        put_tag(field, type_of(field.shape));
        out_.insert(out_.end(), found.piece.at, found.piece.end);
        break;
      case Shape::kText:
      case Shape::kBytes:
        out_.resize(whole);
        if (!write_text(field, found)) return false;
        break;
      case Shape::kTexts:
        if (!write_text(field, found)) return false;
        break;
      case Shape::kMessage:
        if (first && !write_message(field, from, to, found, depth)) return false;
        break;
      case Shape::kMessages:
        if (!write_message(field, i, i + 1, found, depth)) return false;
        break;
      case Shape::kCount32s:
      case Shape::kCount64s:
      case Shape::kBits32s:
      case Shape::kBits64s:
        if (first && !write_list(field, place, from, to)) return false;
        break;
    }
  }
  return true;
}

void AnyOrder::put_tag(const FieldShape& field, unsigned type) { put_varint(field.number << 3U | type); }

void AnyOrder::put_varint(std::uint64_t value) {
  for (; value >= 0x80; value >>= 7U) out_.push_back(static_cast<Byte>(value | 0x80U));
  out_.push_back(static_cast<Byte>(value));
}

void AnyOrder::put_length(std::size_t begin) {
  std::array<Byte, 3> length{};
  std::size_t bytes = 0;
  std::size_t size = out_.size() - begin;
  for (; size >= 0x80; size >>= 7U) length[bytes++] = static_cast<Byte>(size | 0x80U);
  length[bytes++] = static_cast<Byte>(size);
  out_.insert(out_.begin() + static_cast<std::ptrdiff_t>(begin), length.begin(),
              length.begin() + static_cast<std::ptrdiff_t>(bytes));
}

std::optional<std::span<const std::byte>> AnyOrder::in_order(const Schema& schema, std::span<const std::byte> message) {
  found_.clear();
  out_.clear();
  const auto* const begin = reinterpret_cast<const Byte*>(message.data());
  if (!collect(schema, {begin, begin + message.size()}, 0) || !write_all(schema, 0, found_.size(), 0)) return {};
  return std::as_bytes(std::span(out_));
}

}  // namespace tendon::wire
