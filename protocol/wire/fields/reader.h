// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstddef>
#include <cstring>
#include <span>
#include <string>
#include <vector>

#include "core/base/arithmetic.h"
#include "core/base/bytes.h"
#include "core/base/rotation.h"
#include "protocol/messages.h"
#include "protocol/wire/fields/field.h"
#include "protocol/wire/text.h"

namespace tendon::wire {

/// Accepts 1 entry (k·I), 3 entries (diagonal) or 9 entries (row-major).
inline bool matrix_of(std::span<const double> entries, Mat3& to) noexcept {
  switch (entries.size()) {
    case 1:
      to = entries[0] * Mat3::Identity();
      return true;
    case 3:
      to = Vec3(entries[0], entries[1], entries[2]).asDiagonal();
      return true;
    case 9:
      to = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data());
      return true;
    default:
      return false;
  }
}

/// Constructs the value in place without zeroing it first, as emplace() would do.
template <class Value>
Value& made(std::optional<Value>& value) {
  struct Parsed {
    operator Value() const noexcept {
      Value one;
      return one;
    }
  };
  return value.emplace(Parsed{});
}

/// Decodes fields in the order of their numbers. If a field is not next, it is absent. There are two kinds of errors:
/// * If the encoding differs from the Writer's (unknown, duplicate or reordered fields, overlong varints, invalid
///   UTF-8, or a truncated message), `done` returns false and the value must not be used. AnyOrder can convert the
///   message, or determine that it is malformed.
/// * If a number is out of bounds, `refused` returns the name of the first such field.
///
/// The value must be newly constructed.
class Reader {
 public:
  Reader(const Byte* at, const Byte* end) noexcept : at_(at), end_(end) {}
  explicit Reader(std::span<const std::byte> bytes) noexcept
      : Reader(reinterpret_cast<const Byte*>(bytes.data()),
               reinterpret_cast<const Byte*>(bytes.data()) + bytes.size()) {}
  bool done() const noexcept { return at_ == end_ && good_; }
  Name refused() const noexcept { return refused_; }

  template <unsigned kField>
  [[gnu::always_inline]] void count(Field<kField> f, Name name, std::uint64_t& value, Counts bound = {}) noexcept {
    value = count_up_to(f, std::numeric_limits<std::uint64_t>::max());
    require(name, value >= bound.least && value <= bound.most);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void count(Field<kField> f, Name name, std::uint32_t& value, Counts bound = {}) noexcept {
    value = static_cast<std::uint32_t>(count_up_to(f, std::numeric_limits<std::uint32_t>::max()));
    require(name, value >= bound.least && value <= bound.most);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void flag(Field<kField> f, Name /*name*/, bool& value) noexcept {
    value = count_up_to(f, 1) != 0;
  }
  /// `offset` is the number on the wire minus the number in C++.
  template <unsigned kField, class Enum>
  [[gnu::always_inline]] void choice(Field<kField> f, Name name, Enum& value, Enum first, Enum last,
                                     unsigned offset = 0) noexcept {
    const std::uint64_t number = count_up_to(f, std::numeric_limits<std::uint32_t>::max()) - offset;
    require(name, number >= static_cast<std::uint64_t>(first) && number <= static_cast<std::uint64_t>(last));
    value = static_cast<Enum>(number);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void duration(Field<kField> f, Name name, Duration& value,
                                       Duration most = limits::kMaxTime) noexcept {
    const std::uint64_t ns = count_up_to(f, std::numeric_limits<std::uint64_t>::max());
    require(name, ns <= static_cast<std::uint64_t>(most.count()));
    value = Duration(static_cast<std::int64_t>(ns));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void period(Field<kField> f, Name name, Duration& value, const Period& bound) noexcept {
    const std::uint64_t units = count_up_to(f, std::numeric_limits<std::uint32_t>::max());
    value = static_cast<std::int64_t>(units) * bound.unit;
    require(name, bound.holds(value));
  }
  template <unsigned kField>
  void difference(Field<kField> f, Name name, Duration& value) noexcept {
    const std::uint64_t zigzag = count_up_to(f, std::numeric_limits<std::uint64_t>::max());
    value = Duration(static_cast<std::int64_t>(zigzag >> 1U ^ (0 - (zigzag & 1U))));
    require(name, in_time(value));
  }
  template <unsigned kField, class Clock>
  [[gnu::always_inline]] void time(Field<kField> f, Name name,
                                   std::chrono::time_point<Clock, Duration>& value) noexcept {
    Duration since{};
    time(f, name, since);
    value = std::chrono::time_point<Clock, Duration>(since);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void time(Field<kField> /*unused*/, Name name, Duration& value) noexcept {
    std::uint64_t ns = 0;
    fixed<kField, kFixed64>(ns);
    value = Duration(static_cast<std::int64_t>(ns));
    require(name, in_time(value));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void bits(Field<kField> /*unused*/, Name /*name*/, std::uint32_t& value) noexcept {
    value = 0;
    fixed<kField, kFixed32>(value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void number(Field<kField> f, Name name, double& value, const Within& bound = {}) noexcept {
    value = 0;
    present(f, name, value, bound);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void present(Field<kField> /*unused*/, Name name, double& value,
                                      const Within& bound = {}) noexcept {
    fixed<kField, kFixed64>(value);
    require(name, bound.holds(value));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void present(Field<kField> /*unused*/, Name name, std::uint32_t& bits, Counts bound) noexcept {
    fixed<kField, kFixed32>(bits);
    require(name, bits >= bound.least && bits <= bound.most);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void radius(Field<kField> f, Name name, double& value) noexcept {
    value = std::numeric_limits<double>::infinity();
    present(f, name, value, Within{.least = 0, .infinity = true});
  }
  template <unsigned kField>
  [[gnu::always_inline]] void vector(Field<kField> /*unused*/, Name name, Vec3& value) noexcept {
    if (!take_three<kField>(value)) {  // if a number is 0 and was omitted
      value.setZero();
      inside<kField>([&]() TENDON_INLINE {
        fixed<1, kFixed64>(value.x());
        fixed<2, kFixed64>(value.y());
        fixed<3, kFixed64>(value.z());
      });
    }
    require(name, (value.array().abs() <= limits::kMaxValue).all());
  }
  template <unsigned kField>
  [[gnu::always_inline]] void normal(Field<kField> f, Name name, Vec3& value) noexcept {
    vector(f, name, value);
    require(name, is_unit(value));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void vector_unless_zero(Field<kField> f, Name name, Vec3& value) noexcept {
    vector(f, name, value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void rotation(Field<kField> /*unused*/, Name name, Quat& value) noexcept {
    value = {.w = 0, .x = 0, .y = 0, .z = 0};
    inside<kField>([&]() TENDON_INLINE {
      fixed<1, kFixed64>(value.w);
      fixed<2, kFixed64>(value.x);
      fixed<3, kFixed64>(value.y);
      fixed<4, kFixed64>(value.z);
    });
    require(name, is_rotation(value));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void matrix(Field<kField> f, Name name, Mat3& value) noexcept {
    std::array<double, 9> entries;
    const std::size_t size = entries_of(f, name, std::span(entries));
    require(name, size <= entries.size() && matrix_of(std::span(entries).first(size), value) &&
                      (value.array().abs() <= limits::kMaxValue).all());
  }
  template <unsigned kField>
  [[gnu::always_inline]] void matrix(Field<kField> f, Name name, std::optional<Mat3>& value) noexcept {
    std::array<double, 9> entries;
    const std::size_t size = entries_of(f, name, std::span(entries));
    if (size == 0 || refused_ != nullptr) return;
    require(name, matrix_of(std::span(entries).first(size), value.emplace()) &&
                      (value->array().abs() <= limits::kMaxValue).all());
  }
  template <unsigned kField, class Array, class Size>
  [[gnu::always_inline]] void numbers(Field<kField> f, Name name, Array& value, Size& size, std::size_t least = 0,
                                      const Within& bound = {}) noexcept {
    size = static_cast<Size>(entries_of(f, name, std::span<double>(value)));
    const auto all = std::span<const double>(value).first(size);
    require(name, size >= least && std::ranges::all_of(all, [&](double number) { return bound.holds(number); }));
  }
  template <unsigned kAngles, unsigned kVelocities>
  [[gnu::always_inline]] void joints(Field<kAngles> angles, Field<kVelocities> velocities, Name name,
                                     std::optional<Joints>& value) noexcept {
    if (!next_is<kAngles, kLength>() && !next_is<kVelocities, kLength>()) return;
    Joints joints;
    std::size_t moving = 0;
    numbers(angles, name, joints.angle, joints.count);
    numbers(velocities, name, joints.velocity, moving);
    if (joints.count == 0) return;  // velocities without angles
    std::fill(joints.velocity.begin() + static_cast<std::ptrdiff_t>(joints.count), joints.velocity.end(), 0.0);
    value = joints;
  }
  template <unsigned kField, std::size_t kSize>
  void counts(Field<kField> /*unused*/, Name name, std::array<std::uint64_t, kSize>& value) noexcept {
    value.fill(0);
    inside<kField>([&]() TENDON_INLINE {
      std::size_t size = 0;
      for (; at_ != end_ && good_; ++size) {
        std::uint64_t count = 0;
        varint(count);
        if (size < kSize) value[size] = count;
      }
      require(name, size <= kSize);
    });
  }
  template <unsigned kField>
  void text(Field<kField> /*unused*/, Name name, std::string& value, std::size_t most) {
    value.clear();
    entry<kField>(name, value, most);
  }
  template <unsigned kField>
  void texts(Field<kField> /*unused*/, Name name, std::vector<std::string>& value, Entries bound, std::size_t most) {
    std::size_t size = 0;
    for (; next_is<kField, kLength>() && good_; ++size) {
      std::string beyond;
      entry<kField>(name, size < bound.most ? value.emplace_back() : beyond, most);
    }
    require(name, size >= bound.least && size <= bound.most);
  }
  /// An array is filled up with zeros. A span refers to the memory of this Reader.
  template <unsigned kField, class Bytes>
  void bytes(Field<kField> /*unused*/, Name name, Bytes& value, Entries bound) {
    std::span<const std::byte> all;
    inside<kField>([&]() TENDON_INLINE {
      all = {reinterpret_cast<const std::byte*>(at_), static_cast<std::size_t>(end_ - at_)};
      at_ = end_;
    });
    const bool fits = all.size() >= bound.least && all.size() <= bound.most;
    require(name, fits);
    if (!fits) all = {};
    if constexpr (requires { value.fill({}); }) {
      std::copy(all.begin(), all.end(), value.begin());
      std::fill(value.begin() + static_cast<std::ptrdiff_t>(all.size()), value.end(), std::byte{0});
    } else {
      value = Bytes(all.begin(), all.end());
    }
  }
  template <unsigned kField, class Value, class List>
  void messages(Field<kField> /*unused*/, Name name, std::vector<Value>& value, Entries bound, List list) {
    std::size_t size = 0;
    for (; next_is<kField, kLength>() && good_; ++size) {
      Value beyond;
      inside<kField>([&]() TENDON_INLINE { list(*this, size < bound.most ? value.emplace_back() : beyond); });
    }
    require(name, size >= bound.least && size <= bound.most);
  }
  /// Refuses absent messages.
  template <unsigned kField, class Value, class List>
  [[gnu::always_inline]] void message(Field<kField> /*unused*/, Name name, Value& value, List list) {
    if (!inside<kField>([&]() TENDON_INLINE { list(*this, value); })) require(name, false);
  }
  template <unsigned kField, class Value, class List>
  [[gnu::always_inline]] void message(Field<kField> f, Name name, std::optional<Value>& value, List list) {
    if (next_is<kField, kLength>()) message(f, name, made(value), list);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, std::optional<Vec3>& value) noexcept {
    if (next_is<kField, kLength>()) vector(f, name, value.emplace());
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, std::optional<Quat>& value) noexcept {
    if (next_is<kField, kLength>()) rotation(f, name, value.emplace());
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, std::optional<double>& value,
                                    const Within& bound = {}) noexcept {
    if (next_is<kField, kFixed64>()) present(f, name, value.emplace(), bound);
  }
  /// The part is present if this field is present and, if it is a varint, not 0.
  template <unsigned kField, unsigned kType, class Value, class Fields>
  [[gnu::always_inline]] void part(Field<kField, kType> /*unused*/, std::optional<Value>& value, Fields fields) {
    if (!next_is<kField, kType>()) return;
    if constexpr (kType == kVarint) {
      if (is_zero<kField>()) {
        at_ += Tag<kField, kType>::kSize + 1;
        return;
      }
    }
    fields(value ? *value : made(value));
  }
  /// Only checks the bound if the part is absent.
  template <unsigned kField, unsigned kType, class Value, class Fields>
  [[gnu::always_inline]] void rest(Field<kField, kType> /*unused*/, std::optional<Value>& value, Fields fields) {
    if (!next_is<kField, kType>()) return;
    Value none;
    fields(value ? *value : none);
  }
  /// Refuses a box with a single corner.
  template <unsigned kLeast, unsigned kMost, class Box>
  void box(Field<kLeast> least, Field<kMost> most, Name name, std::optional<Box>& value) noexcept {
    const bool begins = next_is<kLeast, kLength>();
    Box box{};
    if (begins) vector(least, name, box.min);
    require(name, begins == next_is<kMost, kLength>());
    if (!next_is<kMost, kLength>()) return;
    vector(most, name, box.max);
    require(name, !begins || (box.min.array() <= box.max.array()).all());
    value = box;
  }
  /// Returns true if this arm is present. The caller then skips the other arms, so a second one is not read.
  template <unsigned kField, class Value, class OneOf, class List>
  bool arm(Field<kField, kLength> /*unused*/, Name name, Kind<Value> /*unused*/, OneOf& one, List list) {
    if (!next_is<kField, kLength>()) return false;
    message(field<kField>, name, make_arm<Value>(one), list);
    return true;
  }
  template <unsigned kField, class Value, class OneOf, class Fields>
  bool arm(Field<kField, kFixed32> /*unused*/, Name /*name*/, Kind<Value> /*unused*/, OneOf& one, Fields fields) {
    if (!next_is<kField, kFixed32>()) return false;
    fields(*this, make_arm<Value>(one));
    return true;
  }
  /// Refuses messages without any of these arms.
  template <unsigned... kFields, unsigned... kTypes>
  void one_of(Name name, Field<kFields, kTypes>... /*arms*/) noexcept {
    require(name, (next_is<kFields, kTypes>() || ...));
  }
  [[gnu::always_inline]] void require(Name name, bool holds) noexcept {
    if (holds) [[likely]]
      return;
    if (refused_ == nullptr) refused_ = name;
  }
  [[gnu::always_inline]] void require(Name name, std::invocable auto holds) noexcept {
    require(name, static_cast<bool>(holds()));
  }

  /// Refuses columns of another length.
  template <unsigned kField, class Number>
  void column(Field<kField> /*unused*/, Name name, std::span<Number> to) noexcept {
    bool fits = false;
    inside<kField>([&]() TENDON_INLINE {
      const auto size = static_cast<std::size_t>(end_ - at_);
      if (size % sizeof(Number) != 0) return stop();
      fits = size == to.size_bytes();
      if (fits) copy(to);
      at_ = end_;
    });
    require(name, fits);
  }
  /// If the column is absent, `to` is unchanged.
  template <unsigned kField>
  void column(Field<kField> /*unused*/, Name name, std::span<std::uint64_t> to, std::uint64_t most) noexcept {
    inside<kField>([&]() TENDON_INLINE {
      std::size_t size = 0;
      for (; at_ != end_ && good_; ++size) {
        std::uint64_t value = 0;
        varint(value);
        if (value > most) return stop();
        if (size < to.size()) to[size] = value;
      }
      require(name, size == to.size() || size == 0);
    });
  }
  /// If this field is next, skips it and sets `inside` to its content.
  template <unsigned kField>
  [[gnu::always_inline]] bool enter(Reader& inside) noexcept {
    if (!take<kField, kLength>()) return false;
    const std::uint64_t length = length_of_it();
    if (length > static_cast<std::uint64_t>(end_ - at_)) stop();
    if (!good_) return false;
    inside = Reader(at_, at_ + length);
    at_ += length;
    return true;
  }
  template <unsigned kField, unsigned kType>
  [[gnu::always_inline]] bool next_is() const noexcept {
    using T = Tag<kField, kType>;
    if (static_cast<std::size_t>(end_ - at_) < T::kSize || at_[0] != T::kFirst) return false;
    return T::kSize == 1 || at_[1] == T::kSecond;
  }

 private:
  void stop() noexcept { good_ = false; }
  /// Requires that this varint is next.
  template <unsigned kField>
  bool is_zero() const noexcept {
    constexpr std::ptrdiff_t kTag = Tag<kField, kVarint>::kSize;
    return end_ - at_ > kTag && at_[kTag] == 0;
  }
  [[gnu::always_inline]] std::uint64_t length_of_it() noexcept {
    if (at_ != end_ && *at_ < 0x80) return *at_++;
    std::uint64_t length = 0;
    varint(length);
    return length;
  }
  /// Calls `fields` for reading this field. Returns false if it is not next.
  template <unsigned kField, class Fields>
  [[gnu::always_inline]] bool inside(Fields fields) {
    if (!take<kField, kLength>()) return false;
    const std::uint64_t length = length_of_it();
    if (length > static_cast<std::uint64_t>(end_ - at_)) {
      stop();
      return true;
    }
    const Byte* const end = end_;
    end_ = at_ + length;
    fields();
    if (at_ != end_) stop();
    at_ = end_;
    end_ = end;
    return true;
  }
  /// Fast path if all three numbers are present.
  template <unsigned kField>
  [[gnu::always_inline]] bool take_three(Vec3& value) noexcept {
    constexpr std::size_t kTag = Tag<kField, kLength>::kSize;
    constexpr std::size_t kNumber = 1 + sizeof(double);
    constexpr std::size_t kSize = kTag + 1 + 3 * kNumber;
    if (static_cast<std::size_t>(end_ - at_) < kSize || !next_is<kField, kLength>()) return false;
    const Byte* const x = at_ + kTag + 1;
    const Byte* const y = x + kNumber;
    const Byte* const z = y + kNumber;
    if (x[-1] != 3 * kNumber || *x != Tag<1, kFixed64>::kFirst || *y != Tag<2, kFixed64>::kFirst ||
        *z != Tag<3, kFixed64>::kFirst) {
      return false;
    }
    get(x + 1, value.x());
    get(y + 1, value.y());
    get(z + 1, value.z());
    at_ += kSize;
    return true;
  }
  template <unsigned kField, unsigned kType>
  [[gnu::always_inline]] bool take() noexcept {
    if (!next_is<kField, kType>()) return false;
    at_ += Tag<kField, kType>::kSize;
    return true;
  }
  [[gnu::always_inline]] void varint(std::uint64_t& value) noexcept {
    std::uint64_t sum = 0;
    for (unsigned shift = 0; at_ != end_ && shift < 64; shift += 7) {
      const Byte byte = *at_++;
      sum |= std::uint64_t{byte & 0x7FU} << shift;
      if (byte >= 0x80) continue;
      // Overlong, or more than 64 bits.
      if ((byte == 0 && shift > 0) || (shift == 63 && byte > 1)) break;
      value = sum;
      return;
    }
    stop();
  }
  template <unsigned kField>
  [[gnu::always_inline]] std::uint64_t count_up_to(Field<kField> /*unused*/, std::uint64_t most) noexcept {
    std::uint64_t value = 0;
    if (take<kField, kVarint>()) varint(value);
    if (value <= most) return value;
    stop();
    return 0;
  }
  template <unsigned kField, unsigned kType, class Value>
  [[gnu::always_inline]] void fixed(Value& value) noexcept {
    if (!take<kField, kType>()) return;
    if (static_cast<std::size_t>(end_ - at_) < sizeof value) return stop();
    Value taken;
    get(at_, taken);
    at_ += sizeof taken;
    value = taken;
  }
  /// Returns the length. Lists that are longer than `to` are refused.
  template <unsigned kField>
  [[gnu::always_inline]] std::size_t entries_of(Field<kField> /*unused*/, Name name, std::span<double> to) noexcept {
    std::size_t size = 0;
    inside<kField>([&]() TENDON_INLINE {
      const auto left = static_cast<std::size_t>(end_ - at_);
      if (left % sizeof(double) != 0) return stop();
      require(name, left <= to.size_bytes());
      if (left <= to.size_bytes()) size = left / sizeof(double);
      copy(to.first(size));
      at_ = end_;
    });
    return size;
  }
  template <unsigned kField>
  void entry(Name name, std::string& value, std::size_t most) {
    inside<kField>([&]() TENDON_INLINE {
      const std::string_view text(reinterpret_cast<const char*>(at_), static_cast<std::size_t>(end_ - at_));
      if (clipped(text, text.size()).size() != text.size()) return stop();  // not UTF-8
      require(name, text.size() <= most);
      if (text.size() <= most) value = text;
      at_ = end_;
    });
  }
  [[gnu::always_inline]] static void get(const Byte* from, double& value) noexcept {
    value = std::bit_cast<double>(bytes<std::uint64_t>(from));
  }
  [[gnu::always_inline]] static void get(const Byte* from, float& value) noexcept {
    value = std::bit_cast<float>(bytes<std::uint32_t>(from));
  }
  template <std::unsigned_integral Value>
  [[gnu::always_inline]] static void get(const Byte* from, Value& value) noexcept {
    value = bytes<Value>(from);
  }
  template <std::unsigned_integral Value>
  [[gnu::always_inline]] static Value bytes(const Byte* from) noexcept {
    return get_little_endian<Value>(reinterpret_cast<const std::byte*>(from));
  }
  template <class Number>
  [[gnu::always_inline]] void copy(std::span<Number> to) noexcept {
    if constexpr (std::endian::native == std::endian::little) {
      if (!to.empty()) std::memcpy(to.data(), at_, to.size_bytes());
    } else {
      for (std::size_t i = 0; i < to.size(); ++i) get(at_ + i * sizeof(Number), to[i]);
    }
  }

  const Byte* at_;
  const Byte* end_;
  bool good_ = true;
  Name refused_ = nullptr;
};

}  // namespace tendon::wire
