// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <variant>

#include "core/base/motion.h"
#include "core/base/time.h"
#include "core/remote/remote_force.h"
#include "protocol/limits.h"

// Building blocks of field lists. Each message of tendon.proto has a list (wire/generated/), which is sorted by field
// number. An entry contains the number, the name, the member and the bound of a field. Lists are used with a visitor:
// the Writer encodes a value, and the Reader decodes a value and checks its bounds.

/// For lists and visitors. Visitors are only kept in registers if everything is inlined.
#define TENDON_INLINE __attribute__((always_inline))

namespace tendon::wire {

using Byte = std::uint8_t;

inline constexpr unsigned kVarint = 0;
inline constexpr unsigned kFixed64 = 1;
inline constexpr unsigned kLength = 2;
inline constexpr unsigned kFixed32 = 5;

/// A field number. The wire type is only used for checking whether the field is present.
template <unsigned kNumber, unsigned kType = 0>
struct Field {};
template <unsigned kNumber, unsigned kType = 0>
inline constexpr Field<kNumber, kType> field{};

/// Selects an arm of a oneof.
template <class Value>
struct Kind {};
template <class Value>
inline constexpr Kind<Value> kind{};

/// The name in tendon.proto, used for reporting refused requests. Static storage.
using Name = const char*;

/// NaN is always out of bounds.
struct Within {
  double least = -limits::kMaxValue;
  double most = limits::kMaxValue;
  bool beyond = false;    ///< `least` is not allowed
  bool infinity = false;  ///< +infinity is also allowed
  bool zero = false;      ///< 0 is also allowed
  constexpr bool holds(double value) const noexcept {
    if (infinity && value == std::numeric_limits<double>::infinity()) return true;
    if (zero && value == 0) return true;
    return (beyond ? value > least : value >= least) && value <= most;
  }
};

struct Counts {
  std::uint64_t least = 0;
  std::uint64_t most = std::numeric_limits<std::uint64_t>::max();
};

/// A duration sent as a 32-bit number of units, rounded up.
struct Period {
  /// Used by the Writer if the duration is out of bounds, because a cast could produce a valid value.
  enum class Else { kZero, kMost, kNearest };
  Duration unit;
  Duration least;
  Duration most;
  Else otherwise;
  bool any = false;  ///< not checked by the Reader

  constexpr bool holds(Duration length) const noexcept { return any || (length >= least && length <= most); }
  constexpr std::uint32_t units(Duration length) const noexcept {
    const bool possible = length >= least && length <= most;
    if (!possible && otherwise == Else::kZero) return 0;
    if (!possible && otherwise == Else::kMost) return std::numeric_limits<std::uint32_t>::max();
    const Duration nearest = length < least ? least : length > most ? most : length;
    return static_cast<std::uint32_t>((nearest.count() + unit.count() - 1) / unit.count());
  }
};

/// Used for the validity of forces and the period of PortStates. Receivers refuse 0.
inline constexpr Period kValidity{std::chrono::microseconds(1), Duration(1), limits::kMaxValidFor, Period::Else::kZero};
/// The largest number marks an invalid value, which is never granted.
inline constexpr Period kMaxSilence{
    std::chrono::microseconds(1), {}, limits::kMaxStateSilence, Period::Else::kMost, true};
inline constexpr Period kPulse{std::chrono::milliseconds(1), {}, limits::kMaxVibration, Period::Else::kMost};
inline constexpr Period kWait{std::chrono::milliseconds(1), {}, limits::kMaxTimeout, Period::Else::kNearest};
inline constexpr Period kTimeout{std::chrono::milliseconds(1), std::chrono::milliseconds(1), limits::kMaxTimeout,
                                 Period::Else::kZero};

struct Entries {
  std::size_t least = 0;
  std::size_t most = 0;
};

inline bool is_unit(const Vec3& normal) noexcept { return std::abs(normal.norm() - 1) <= Contact::kUnitTolerance; }
constexpr bool in_time(Duration d) noexcept { return d >= -limits::kMaxTime && d <= limits::kMaxTime; }

/// Returns true if the sum is at most `all`, without overflow.
template <class Counts>
constexpr bool is_part(const Counts& counts, std::uint64_t all) noexcept {
  for (const std::uint64_t count : counts) {
    if (count > all) return false;
    all -= count;
  }
  return true;
}

/// The field number (below 2048) and the wire type.
template <unsigned kField, unsigned kType>
struct Tag {
  static constexpr unsigned kValue = kField << 3U | kType;
  static_assert(kValue < 1U << 14U);
  static constexpr std::size_t kSize = kValue < 0x80 ? 1 : 2;
  static constexpr Byte kFirst = static_cast<Byte>(kSize == 1 ? kValue : (kValue & 0x7FU) | 0x80U);
  static constexpr Byte kSecond = static_cast<Byte>(kValue >> 7U);
};

template <class Value, class... Values>
const Value* arm_of(const std::variant<Values...>& one) noexcept {
  return std::get_if<Value>(&one);
}
template <class Value, class... Values>
const Value* arm_of(const std::optional<std::variant<Values...>>& one) noexcept {
  return one ? std::get_if<Value>(&*one) : nullptr;
}
template <class Value, class... Values>
Value& make_arm(std::variant<Values...>& one) {
  return one.template emplace<Value>();
}
template <class Value, class... Values>
Value& make_arm(std::optional<std::variant<Values...>>& one) {
  return std::get<Value>(one.emplace(std::in_place_type<Value>));
}

}  // namespace tendon::wire
