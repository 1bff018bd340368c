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
#include <string_view>
#include <vector>

#include "core/base/bytes.h"
#include "protocol/messages.h"
#include "protocol/wire/fields/field.h"
#include "protocol/wire/text.h"

namespace tendon::wire {

/// Returns the number of entries of the shortest form (tendon.proto).
inline std::size_t entries_of(const Mat3& k, std::array<double, 9>& entries) noexcept {
  const bool diagonal = k(0, 1) == 0 && k(0, 2) == 0 && k(1, 0) == 0 && k(1, 2) == 0 && k(2, 0) == 0 && k(2, 1) == 0;
  if (!diagonal) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data()) = k;
    return 9;
  }
  entries = {k(0, 0), k(1, 1), k(2, 2)};
  return k(0, 0) == k(1, 1) && k(0, 0) == k(2, 2) ? 1 : 3;
}

/// Encodes fields in the order of the calls. Omits zero numbers and empty texts, as proto3 requires, but writes all
/// optional values that are present. Truncates texts and lists, and does not check anything else. There must be enough
/// memory for the largest message. Realtime-safe.
class Writer {
 public:
  explicit Writer(Byte* at) noexcept : at_(at) {}
  Byte* at() const noexcept { return at_; }

  template <unsigned kField>
  [[gnu::always_inline]] void count(Field<kField> /*unused*/, Name /*name*/, std::uint64_t value,
                                    Counts /*bound*/ = {}) noexcept {
    if (value == 0) return;
    tag<kField, kVarint>();
    varint(value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void flag(Field<kField> f, Name name, bool value) noexcept {
    count(f, name, value ? 1 : 0);
  }
  template <unsigned kField, class Enum>
  [[gnu::always_inline]] void choice(Field<kField> f, Name name, Enum value, Enum /*first*/, Enum /*last*/,
                                     unsigned first = 0) noexcept {
    count(f, name, static_cast<unsigned>(value) + first);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void duration(Field<kField> f, Name name, Duration value, Duration /*most*/ = {}) noexcept {
    count(f, name, static_cast<std::uint64_t>(value.count()));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void period(Field<kField> f, Name name, Duration value, const Period& bound) noexcept {
    count(f, name, bound.units(value));
  }
  template <unsigned kField>
  void difference(Field<kField> f, Name name, Duration value) noexcept {
    const std::int64_t ns = value.count();
    count(f, name, static_cast<std::uint64_t>(ns) << 1U ^ static_cast<std::uint64_t>(ns >> 63U));
  }
  template <unsigned kField, class Clock>
  [[gnu::always_inline]] void time(Field<kField> f, Name name,
                                   std::chrono::time_point<Clock, Duration> value) noexcept {
    time(f, name, value.time_since_epoch());
  }
  template <unsigned kField>
  [[gnu::always_inline]] void time(Field<kField> /*unused*/, Name /*name*/, Duration value) noexcept {
    if (value.count() != 0) fixed<kField, kFixed64>(static_cast<std::uint64_t>(value.count()));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void bits(Field<kField> /*unused*/, Name /*name*/, std::uint32_t value) noexcept {
    if (value != 0) fixed<kField, kFixed32>(value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void number(Field<kField> /*unused*/, Name /*name*/, double value,
                                     const Within& /*bound*/ = {}) noexcept {
    const auto bits = std::bit_cast<std::uint64_t>(value);
    if (bits != 0) fixed<kField, kFixed64>(bits);  // does not omit −0
  }
  // These are written even if they are 0.
  template <unsigned kField>
  [[gnu::always_inline]] void present(Field<kField> /*unused*/, Name /*name*/, double value,
                                      const Within& /*bound*/ = {}) noexcept {
    fixed<kField, kFixed64>(std::bit_cast<std::uint64_t>(value));
  }
  template <unsigned kField>
  [[gnu::always_inline]] void present(Field<kField> /*unused*/, Name /*name*/, std::uint32_t bits,
                                      Counts /*bound*/) noexcept {
    fixed<kField, kFixed32>(bits);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void radius(Field<kField> f, Name name, double value) noexcept {
    if (value != std::numeric_limits<double>::infinity()) present(f, name, value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void vector(Field<kField> /*unused*/, Name /*name*/, const Vec3& value) noexcept {
    small<kField>([&]() TENDON_INLINE {
      number(field<1>, "x", value.x());
      number(field<2>, "y", value.y());
      number(field<3>, "z", value.z());
    });
  }
  template <unsigned kField>
  void normal(Field<kField> f, Name name, const Vec3& value) noexcept {
    vector(f, name, value);
  }
  template <unsigned kField>
  void vector_unless_zero(Field<kField> f, Name name, const Vec3& value) noexcept {
    if (!value.isZero(0)) vector(f, name, value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void rotation(Field<kField> /*unused*/, Name /*name*/, const Quat& value) noexcept {
    small<kField>([&]() TENDON_INLINE {
      number(field<1>, "w", value.w);
      number(field<2>, "x", value.x);
      number(field<3>, "y", value.y);
      number(field<4>, "z", value.z);
    });
  }
  template <unsigned kField>
  [[gnu::always_inline]] void matrix(Field<kField> /*unused*/, Name /*name*/, const Mat3& value) noexcept {
    small<kField>([&]() TENDON_INLINE {
      std::array<double, 9> entries;
      const std::size_t size = entries_of(value, entries);
      numbers(std::span<const double>(entries).first(size));
    });
  }
  template <unsigned kField>
  [[gnu::always_inline]] void matrix(Field<kField> f, Name name, const std::optional<Mat3>& value) noexcept {
    if (value) matrix(f, name, *value);
  }
  template <unsigned kField, class Array>
  [[gnu::always_inline]] void numbers(Field<kField> /*unused*/, Name /*name*/, const Array& value, std::size_t size,
                                      std::size_t /*least*/ = 0, const Within& /*bound*/ = {}) noexcept {
    const auto all = std::span<const double>(value).first(std::min(size, value.size()));
    if (all.empty()) return;
    tag<kField, kLength>();
    varint(all.size_bytes());
    numbers(all);
  }
  template <unsigned kAngles, unsigned kVelocities>
  void joints(Field<kAngles> angles, Field<kVelocities> velocities, Name name,
              const std::optional<Joints>& value) noexcept {
    if (!value) return;
    numbers(angles, name, value->angle, value->count);
    numbers(velocities, name, value->velocity, value->count);
  }
  /// Omits trailing zeros.
  template <unsigned kField, std::size_t kSize>
  void counts(Field<kField> /*unused*/, Name /*name*/, const std::array<std::uint64_t, kSize>& value) noexcept {
    const auto last = std::find_if(value.rbegin(), value.rend(), [](std::uint64_t count) { return count > 0; });
    if (last == value.rend()) return;
    inside<kField>([&]() TENDON_INLINE {
      std::for_each(value.begin(), last.base(), [&](std::uint64_t count) { varint(count); });
    });
  }
  template <unsigned kField>
  void text(Field<kField> f, Name /*name*/, const std::string& value, std::size_t most) noexcept {
    if (const std::string_view front = clipped(value, most); !front.empty()) entry(f, front);
  }
  template <unsigned kField>
  void texts(Field<kField> f, Name /*name*/, const std::vector<std::string>& value, Entries bound,
             std::size_t most) noexcept {
    for (std::size_t i = 0; i < std::min(value.size(), bound.most); ++i) entry(f, clipped(value[i], most));
  }
  /// Omits trailing zeros if any number of bytes is allowed.
  template <unsigned kField>
  void bytes(Field<kField> f, Name /*name*/, std::span<const std::byte> value, Entries bound) noexcept {
    std::size_t size = std::min(value.size(), bound.most);
    while (bound.least == 0 && size > 0 && value[size - 1] == std::byte{0}) --size;
    if (size > 0) entry(f, {reinterpret_cast<const char*>(value.data()), size});
  }
  template <unsigned kField, class Value, class List>
  void messages(Field<kField> f, Name name, const std::vector<Value>& value, Entries bound, List list) noexcept {
    for (std::size_t i = 0; i < std::min(value.size(), bound.most); ++i) message(f, name, value[i], list);
  }
  template <unsigned kField, class Value, class List>
  [[gnu::always_inline]] void message(Field<kField> /*unused*/, Name /*name*/, const Value& value, List list) noexcept {
    inside<kField>([&]() TENDON_INLINE { list(*this, value); });
  }
  template <unsigned kField, class Value, class List>
  [[gnu::always_inline]] void message(Field<kField> f, Name name, const std::optional<Value>& value,
                                      List list) noexcept {
    if (value) message(f, name, *value, list);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, const std::optional<Vec3>& value) noexcept {
    if (value) vector(f, name, *value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, const std::optional<Quat>& value) noexcept {
    if (value) rotation(f, name, *value);
  }
  template <unsigned kField>
  [[gnu::always_inline]] void maybe(Field<kField> f, Name name, const std::optional<double>& value,
                                    const Within& /*bound*/ = {}) noexcept {
    if (value) present(f, name, *value);
  }
  template <unsigned kField, unsigned kType, class Value, class Fields>
  [[gnu::always_inline]] void part(Field<kField, kType> /*unused*/, const std::optional<Value>& value,
                                   Fields fields) noexcept {
    if (value) fields(*value);
  }
  template <unsigned kField, unsigned kType, class Value, class Fields>
  [[gnu::always_inline]] void rest(Field<kField, kType> /*unused*/, const std::optional<Value>& value,
                                   Fields fields) noexcept {
    if (value) fields(*value);
  }
  template <unsigned kLeast, unsigned kMost, class Box>
  void box(Field<kLeast> least, Field<kMost> most, Name name, const std::optional<Box>& value) noexcept {
    if (!value) return;
    vector(least, name, value->min);
    vector(most, name, value->max);
  }
  template <unsigned kField, class Value, class OneOf, class List>
  bool arm(Field<kField, kLength> /*unused*/, Name name, Kind<Value> /*unused*/, const OneOf& one, List list) noexcept {
    const Value* const value = arm_of<Value>(one);
    if (value) message(field<kField>, name, *value, list);
    return value != nullptr;
  }
  template <unsigned kField, class Value, class OneOf, class Fields>
  bool arm(Field<kField, kFixed32> /*unused*/, Name /*name*/, Kind<Value> /*unused*/, const OneOf& one,
           Fields fields) noexcept {
    const Value* const value = arm_of<Value>(one);
    if (value) fields(*this, *value);
    return value != nullptr;
  }
  template <class... Fields>
  void one_of(Name /*name*/, Fields... /*arms*/) noexcept {}
  void require(Name /*name*/, std::invocable auto /*holds*/) noexcept {}

  /// value(state, i) returns the i-th of `kWidth` numbers.
  template <unsigned kField, class Number, int kWidth, class Value>
  void column(std::span<const DeviceState* const> states, Value value) noexcept {
    tag<kField, kLength>();
    varint(states.size() * kWidth * sizeof(Number));
    for (const DeviceState* state : states) {
      for (int i = 0; i < kWidth; ++i) put(static_cast<Number>(value(*state, i)));
    }
  }
  [[gnu::always_inline]] void varint(std::uint64_t value) noexcept {
    for (; value >= 0x80; value >>= 7U) *at_++ = static_cast<Byte>(value | 0x80U);
    *at_++ = static_cast<Byte>(value);
  }
  template <unsigned kField, unsigned kType>
  [[gnu::always_inline]] void tag() noexcept {
    using T = Tag<kField, kType>;
    *at_++ = T::kFirst;
    if constexpr (T::kSize == 2) *at_++ = T::kSecond;
  }
  /// For messages of less than 128 bytes, whose length takes one byte.
  template <unsigned kField, class Fields>
  [[gnu::always_inline]] void small(Fields fields) noexcept {
    tag<kField, kLength>();
    Byte* const length = at_++;
    fields();
    *length = static_cast<Byte>(at_ - length - 1);
  }

 private:
  /// For messages of any length. The content is moved by one byte if the length takes two bytes.
  template <unsigned kField, class Fields>
  [[gnu::always_inline]] void inside(Fields fields) noexcept {
    tag<kField, kLength>();
    Byte* const begin = ++at_;
    fields();
    const auto size = static_cast<std::size_t>(at_ - begin);
    if (size >= 0x80) {
      std::memmove(begin + 1, begin, size);
      begin[0] = static_cast<Byte>(size >> 7U);
      ++at_;
    }
    begin[-1] = static_cast<Byte>(size < 0x80 ? size : (size & 0x7FU) | 0x80U);
  }
  template <unsigned kField>
  void entry(Field<kField> /*unused*/, std::string_view text) noexcept {
    tag<kField, kLength>();
    varint(text.size());
    at_ = std::copy(text.begin(), text.end(), at_);
  }
  [[gnu::always_inline]] void numbers(std::span<const double> all) noexcept {
    if constexpr (std::endian::native == std::endian::little) {
      std::memcpy(at_, all.data(), all.size_bytes());
      at_ += all.size_bytes();
    } else {
      for (const double number : all) put(number);
    }
  }
  template <unsigned kField, unsigned kType, std::unsigned_integral Value>
  [[gnu::always_inline]] void fixed(Value value) noexcept {
    tag<kField, kType>();
    put(value);
  }
  template <std::unsigned_integral Value>
  [[gnu::always_inline]] void put(Value value) noexcept {
    put_little_endian(value, reinterpret_cast<std::byte*>(at_));
    at_ += sizeof value;
  }
  [[gnu::always_inline]] void put(double value) noexcept { put(std::bit_cast<std::uint64_t>(value)); }
  [[gnu::always_inline]] void put(float value) noexcept { put(std::bit_cast<std::uint32_t>(value)); }

  Byte* at_;
};

}  // namespace tendon::wire
