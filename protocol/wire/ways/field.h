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

// The building blocks of field lists. Each message of tendon.proto has one list (wire/generated/), ordered by field
// number. Each entry of a list gives a field with its number, its name, the member of the value and its bound. Lists
// are applied to a visitor: the Writer encodes a value, the Reader decodes one and checks the bounds. The Writer
// ignores names and bounds.

/// For lists and visitors. A visitor is kept in registers only if the compiler inlines every function that uses it.
#define TENDON_INLINE __attribute__((always_inline))

namespace tendon::wire {

using Byte = std::uint8_t;

// The wire types of protobuf.
inline constexpr unsigned kVarint = 0;
inline constexpr unsigned kFixed64 = 1;
inline constexpr unsigned kLength = 2;
inline constexpr unsigned kFixed32 = 5;

/// A field number as an argument. The wire type is needed only where the Reader asks whether the field is present.
template <unsigned kNumber, unsigned kType = 0>
struct Field {};
template <unsigned kNumber, unsigned kType = 0>
inline constexpr Field<kNumber, kType> field{};

/// Selects the type of an arm of a oneof.
template <class Value>
struct Kind {};
template <class Value>
inline constexpr Kind<Value> kind{};

/// The name of a field in tendon.proto, used in the answer to a refused request. It has static storage.
using Name = const char*;

/// The bound of a number. NaN is always out of bounds.
struct Within {
  double least = -limits::kMaxValue;
  double most = limits::kMaxValue;
  bool beyond = false;    ///< `least` itself is not allowed
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

/// A duration that is sent as a 32-bit number of units, rounded up.
struct Period {
  /// What the Writer sends if the duration is out of bounds. A plain cast could make it look valid.
  enum class Else { kZero, kMost, kNearest };
  Duration unit;
  Duration least;
  Duration most;
  Else otherwise;
  bool any = false;  ///< the Reader accepts any value

  constexpr bool holds(Duration length) const noexcept { return any || (length >= least && length <= most); }
  constexpr std::uint32_t units(Duration length) const noexcept {
    const bool possible = length >= least && length <= most;
    if (!possible && otherwise == Else::kZero) return 0;
    if (!possible && otherwise == Else::kMost) return std::numeric_limits<std::uint32_t>::max();
    const Duration nearest = length < least ? least : length > most ? most : length;
    return static_cast<std::uint32_t>((nearest.count() + unit.count() - 1) / unit.count());
  }
};

/// The validity of a force, and the time between two PortStates. A receiver refuses 0.
inline constexpr Period kValidity{std::chrono::microseconds(1), Duration(1), limits::kMaxValidFor, Period::Else::kZero};
/// The longest silence between states. The largest number, which no server grants, marks an invalid value.
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

/// Returns true if the sum of the counts is at most `all`, without overflow.
template <class Counts>
constexpr bool is_part(const Counts& counts, std::uint64_t all) noexcept {
  for (const std::uint64_t count : counts) {
    if (count > all) return false;
    all -= count;
  }
  return true;
}

/// The one or two bytes before each field, with its number (below 2048) and its wire type.
template <unsigned kField, unsigned kType>
struct Tag {
  static constexpr unsigned kValue = kField << 3U | kType;
  static_assert(kValue < 1U << 14U);
  static constexpr std::size_t kSize = kValue < 0x80 ? 1 : 2;
  static constexpr Byte kFirst = static_cast<Byte>(kSize == 1 ? kValue : (kValue & 0x7FU) | 0x80U);
  static constexpr Byte kSecond = static_cast<Byte>(kValue >> 7U);
};

/// Returns the value of this arm, or null if another arm is set.
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
