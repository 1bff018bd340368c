// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/igtl/igtl_message.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>

#include "protocol/limits.h"

namespace tendon::bridge::igtl {
namespace {

constexpr std::size_t kTypeSize = 12;
constexpr std::uint16_t kNewestVersion = 3;
constexpr std::size_t kTransformSize = 12 * sizeof(float);
constexpr std::size_t kForceSize = 2 + sizeof(std::uint64_t) + 3 * sizeof(double);
constexpr std::uint16_t kAscii = 3;  ///< MIBenum
constexpr double kPerSecond = 0x1p32;

// The prefix of a unit has 4 bits. It is followed by six pairs of a unit (6 bits) and an exponent (4 bits).
constexpr unsigned kPrefixAt = 60;
constexpr std::uint64_t kNewton = std::uint64_t{0x0b} << 54U | std::uint64_t{1} << 50U;
constexpr std::uint64_t kNewtonWithoutExponent = std::uint64_t{0x0b} << 54U;
/// The exponents of ten for each prefix. The prefix 8 is not defined.
constexpr std::array<int, 16> kPrefixes = {0, 1, 2, 3, 6, 9, 12, 15, 0, -1, -2, -3, -6, -9, -12, -15};

constexpr std::array<std::uint64_t, 256> crc_table() {
  constexpr std::uint64_t kPolynomial = 0x42F0E1EBA9EA3693;
  std::array<std::uint64_t, 256> table{};
  for (std::size_t i = 0; i < table.size(); ++i) {
    std::uint64_t crc = std::uint64_t{i} << 56U;
    for (int bit = 0; bit < 8; ++bit) crc = crc << 1U ^ (crc >> 63U != 0 ? kPolynomial : 0);
    table[i] = crc;
  }
  return table;
}

template <class Whole>
Whole whole_at(Bytes bytes, std::size_t at) {
  Whole value = 0;
  for (const std::byte one : bytes.subspan(at, sizeof(Whole))) {
    value = static_cast<Whole>(std::uint64_t{value} << 8U | std::to_integer<std::uint64_t>(one));
  }
  return value;
}

template <class Whole>
void append_whole(Buffer& out, Whole value) {
  for (std::size_t i = sizeof(Whole); i-- > 0;) {
    out.push_back(static_cast<std::byte>(std::uint64_t{value} >> (8 * i) & 0xffU));
  }
}
void append_f32(Buffer& out, double value) {
  append_whole(out, std::bit_cast<std::uint32_t>(static_cast<float>(value)));
}
void append_f64(Buffer& out, double value) { append_whole(out, std::bit_cast<std::uint64_t>(value)); }
void append_text(Buffer& out, std::string_view text, std::size_t size) {
  for (std::size_t i = 0; i < size; ++i) out.push_back(static_cast<std::byte>(i < text.size() ? text[i] : '\0'));
}

std::optional<std::string_view> text_of(Bytes field) {
  const std::string_view all(reinterpret_cast<const char*>(field.data()), field.size());
  const std::string_view text = all.substr(0, all.find('\0'));
  if (!std::ranges::all_of(text, [](char one) { return one >= ' ' && one <= '~'; })) return {};
  return text;
}

std::uint64_t time_of(Duration since_1970) {
  const auto whole = std::chrono::floor<std::chrono::seconds>(since_1970);
  return static_cast<std::uint64_t>(whole.count()) << 32U |
         static_cast<std::uint64_t>(seconds(since_1970 - whole) * kPerSecond);
}

void append(Buffer& out, std::string_view type, const Label& label, Bytes body) {
  append_whole(out, std::uint16_t{1});
  append_text(out, type, kTypeSize);
  append_text(out, label.name, kLongestName);
  append_whole(out, time_of(label.since_1970));
  append_whole(out, std::uint64_t{body.size()});
  append_whole(out, crc64(body));
  out.insert(out.end(), body.begin(), body.end());
}

}  // namespace

std::uint64_t crc64(Bytes bytes) {
  static constexpr std::array<std::uint64_t, 256> kTable = crc_table();
  std::uint64_t crc = 0;
  for (const std::byte one : bytes) crc = crc << 8U ^ kTable[crc >> 56U ^ std::to_integer<std::uint64_t>(one)];
  return crc;
}

std::optional<Header> read_header(Bytes bytes) {
  const auto type = text_of(bytes.subspan(2, kTypeSize));
  const auto name = text_of(bytes.subspan(2 + kTypeSize, kLongestName));
  const auto version = whole_at<std::uint16_t>(bytes, 0);
  if (version < 1 || version > kNewestVersion || !type || type->empty()) return {};
  return Header{.version = version,
                .type = *type,
                .name = name.value_or(std::string_view()),
                .body_size = whole_at<std::uint64_t>(bytes, kHeaderSize - 16),
                .crc = whole_at<std::uint64_t>(bytes, kHeaderSize - 8)};
}

std::optional<Vec3> read_position(Bytes body) {
  if (body.size() != kTransformSize) return {};
  std::array<double, 12> values{};
  for (std::size_t i = 0; i < values.size(); ++i) {
    values[i] = static_cast<double>(std::bit_cast<float>(whole_at<std::uint32_t>(body, sizeof(float) * i)));
    if (!(std::abs(values[i]) <= kFarthest)) return {};  // not a number either
  }
  return Vec3(values[9], values[10], values[11]);
}

std::optional<Vec3> read_force(Bytes body) {
  if (body.size() != kForceSize || whole_at<std::uint8_t>(body, 0) != 3) return {};
  const auto unit = whole_at<std::uint64_t>(body, 2);
  const std::uint64_t without_prefix = unit & ((std::uint64_t{1} << kPrefixAt) - 1);
  if (unit != 0 && without_prefix != kNewton && without_prefix != kNewtonWithoutExponent) return {};
  Vec3 force;
  for (Eigen::Index i = 0; i < 3; ++i) {
    const std::size_t at = kForceSize - sizeof(double) * static_cast<std::size_t>(3 - i);
    force[i] = std::bit_cast<double>(whole_at<std::uint64_t>(body, at)) * std::pow(10, kPrefixes[unit >> kPrefixAt]);
    if (!(std::abs(force[i]) <= limits::kMaxValue)) return {};
  }
  return force;
}

void append_transform(Buffer& out, const Label& label, const Mat3& rotation, const Vec3& position_mm) {
  Buffer body;
  for (Eigen::Index column = 0; column < 3; ++column) {
    for (Eigen::Index row = 0; row < 3; ++row) append_f32(body, rotation(row, column));
  }
  for (const double one : position_mm) append_f32(body, one);
  append(out, kTransform, label, body);
}

void append_force(Buffer& out, const Label& label, const Vec3& force) {
  Buffer body;
  append_whole(body, std::uint8_t{3});
  append_whole(body, std::uint8_t{0});
  append_whole(body, kNewton);
  for (const double one : force) append_f64(body, one);
  append(out, kSensor, label, body);
}

void append_status(Buffer& out, const Label& label, Status status, std::string_view text) {
  Buffer body;
  append_whole(body, static_cast<std::uint16_t>(status));
  append_whole(body, std::uint64_t{0});
  append_text(body, "", kLongestName);
  append_text(body, text, text.size() + 1);
  append(out, kStatus, label, body);
}

void append_string(Buffer& out, const Label& label, std::string_view text) {
  Buffer body;
  append_whole(body, kAscii);
  append_whole(body, static_cast<std::uint16_t>(text.size()));
  append_text(body, text, text.size());
  append(out, kString, label, body);
}

}  // namespace tendon::bridge::igtl
