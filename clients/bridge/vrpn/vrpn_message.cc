// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_message.h"

#include <algorithm>
#include <bit>
#include <charconv>
#include <chrono>
#include <cmath>

#include "protocol/limits.h"

namespace tendon::bridge::vrpn {
namespace {

constexpr std::string_view kMagic = "vrpn: ver. 07.38";
constexpr std::size_t kMajor = 14;  ///< number of bytes up to and including the last point
constexpr std::size_t kLogMode = 18;
constexpr std::size_t kAlignment = 8;

constexpr std::size_t padded(std::size_t size) { return (size + kAlignment - 1) / kAlignment * kAlignment; }

template <class Whole>
void append_whole(Buffer& out, Whole value) {
  for (std::size_t i = sizeof(Whole); i-- > 0;) out.push_back(static_cast<std::byte>((value >> (8 * i)) & 0xffU));
}
void append_i32(Buffer& out, std::int32_t value) { append_whole(out, static_cast<std::uint32_t>(value)); }
void append_f64(Buffer& out, double value) { append_whole(out, std::bit_cast<std::uint64_t>(value)); }
void append_f64(Buffer& out, const Vec3& v) {
  for (const double one : {v.x(), v.y(), v.z()}) append_f64(out, one);
}
void append_f64(Buffer& out, const Quat& q) {
  for (const double one : {q.x, q.y, q.z, q.w}) append_f64(out, one);
}
void append_characters(Buffer& out, std::string_view text) {
  for (const char one : text) out.push_back(static_cast<std::byte>(one));
}

std::string_view text_of(Bytes bytes) { return {reinterpret_cast<const char*>(bytes.data()), bytes.size()}; }

class Reader {
 public:
  explicit Reader(Bytes bytes) : left_(bytes) {}

  std::uint32_t u32() { return whole<std::uint32_t>(); }
  std::int32_t i32() { return static_cast<std::int32_t>(u32()); }
  double f32() { return checked(static_cast<double>(std::bit_cast<float>(u32()))); }
  double f64() { return checked(std::bit_cast<double>(whole<std::uint64_t>())); }
  Vec3 three_f32() {
    const double x = f32(), y = f32(), z = f32();
    return {x, y, z};
  }
  bool sound() const { return sound_; }

 private:
  template <class Whole>
  Whole whole() {
    Whole value = 0;
    for (const std::byte one : left_.first(sizeof(Whole))) value = value << 8U | std::to_integer<Whole>(one);
    left_ = left_.subspan(sizeof(Whole));
    return value;
  }
  double checked(double value) {
    sound_ = sound_ && std::abs(value) <= limits::kMaxValue;  // false for NaN
    return value;
  }

  Bytes left_;
  bool sound_ = true;
};

}  // namespace

std::optional<Type> type_of(std::string_view name) {
  const auto found = std::ranges::find(kTypeNames, name);
  if (found == kTypeNames.end()) return {};
  return static_cast<Type>(found - kTypeNames.begin());
}

Stamp stamp_of(Duration since_1970) {
  const auto us = std::chrono::floor<std::chrono::microseconds>(since_1970).count();
  return {static_cast<std::uint32_t>(us / 1'000'000), static_cast<std::uint32_t>(us % 1'000'000)};
}

std::array<std::byte, kCookieSize> cookie() {
  std::array<std::byte, kCookieSize> bytes{};
  std::ranges::transform(kMagic, bytes.begin(), [](char one) { return static_cast<std::byte>(one); });
  bytes[kMagic.size()] = bytes[kMagic.size() + 1] = std::byte{' '};
  bytes[kLogMode] = std::byte{'0'};
  return bytes;
}

Kinship kinship(Bytes cookie) {
  const std::string_view text = text_of(cookie);
  if (text.substr(0, kMajor) != kMagic.substr(0, kMajor)) return Kinship::kOtherMajor;
  return text.substr(0, kMagic.size()) == kMagic ? Kinship::kSame : Kinship::kOtherMinor;
}

std::optional<std::uint16_t> port_in_hello(Bytes datagram) {
  std::string_view text = text_of(datagram);
  text = text.substr(0, text.find('\0'));
  const std::size_t space = text.find(' ');
  if (space == 0 || space == std::string_view::npos) return {};
  text.remove_prefix(space + 1);
  int port = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
  if (error != std::errc() || end != text.data() + text.size() || port < kLowestPort || port > kHighestPort) return {};
  return static_cast<std::uint16_t>(port);
}

First first_message(Bytes bytes) {
  if (bytes.size() < kHeaderSize) return {};
  Reader header(bytes);
  const std::uint32_t length = header.u32();
  if (length < kHeaderSize || length > kHeaderSize + kLongestPayload) return {.message = {}, .broken = true};
  Message message;
  message.stamp.seconds = header.u32();
  message.stamp.us = header.u32();
  message.sender = header.i32();
  message.type = header.i32();
  const std::size_t size = padded(length);
  if (bytes.size() < size) return {};
  message.payload = bytes.subspan(kHeaderSize, length - kHeaderSize);
  return {.message = message, .size = size};
}

void append(Buffer& out, const Message& message, std::uint32_t sequence) {
  const std::size_t begin = out.size();
  append_whole(out, static_cast<std::uint32_t>(kHeaderSize + message.payload.size()));
  append_whole(out, message.stamp.seconds);
  append_whole(out, message.stamp.us);
  append_i32(out, message.sender);
  append_i32(out, message.type);
  append_whole(out, sequence);
  out.insert(out.end(), message.payload.begin(), message.payload.end());
  out.resize(begin + padded(out.size() - begin));
}

void append_description(Buffer& out, std::string_view name) {
  append_whole(out, static_cast<std::uint32_t>(name.size() + 1));
  append_characters(out, name);
  out.push_back(std::byte{0});
}

std::optional<std::string_view> read_description(Bytes payload) {
  if (payload.size() < sizeof(std::uint32_t)) return {};
  const std::size_t length = Reader(payload).u32();
  std::string_view name = text_of(payload.subspan(sizeof(std::uint32_t)));
  if (length == 0 || length > name.size() || length > kLongestName + 1) return {};
  name = name.substr(0, length);
  return name.substr(0, name.find('\0'));
}

void append_pose(Buffer& out, const Vec3& position, const Quat& rotation) {
  append_whole(out, std::uint64_t{0});  // the sensor, and four bytes of padding
  append_f64(out, position);
  append_f64(out, rotation);
}

void append_velocity(Buffer& out, const Vec3& velocity, const Quat& rotation, double time) {
  append_pose(out, velocity, rotation);
  append_f64(out, time);
}

void append_workspace(Buffer& out, const Vec3& min, const Vec3& max) {
  append_f64(out, min);
  append_f64(out, max);
}

void append_identity_to_room(Buffer& out) {
  append_f64(out, Vec3(Vec3::Zero()));
  append_f64(out, Quat{});
}

std::optional<double> read_update_rate(Bytes payload) {
  if (payload.size() != sizeof(double)) return {};
  Reader reader(payload);
  const double hz = reader.f64();
  if (!reader.sound() || hz <= 0) return {};
  return hz;
}

void append_button(Buffer& out, std::int32_t button, bool held) {
  append_i32(out, button);
  append_i32(out, held ? 1 : 0);
}

void append_buttons(Buffer& out, std::uint32_t held, int count) {
  append_i32(out, count);
  for (int i = 0; i < count; ++i) append_i32(out, (held >> static_cast<unsigned>(i) & 1U) != 0 ? 1 : 0);
}

void append_channels(Buffer& out, std::span<const double> channels) {
  append_f64(out, static_cast<double>(channels.size()));
  for (const double one : channels) append_f64(out, one);
}

void append_force(Buffer& out, const Vec3& force) { append_f64(out, force); }

void append_error(Buffer& out, std::int32_t code) { append_i32(out, code); }

void append_text(Buffer& out, Severity severity, std::string_view text) {
  append_whole(out, static_cast<std::uint32_t>(severity));
  append_i32(out, 0);  // the level
  append_characters(out, text);
  out.push_back(std::byte{0});
}

std::optional<ForceField> read_field(Bytes payload) {
  if (payload.size() != 16 * sizeof(float)) return {};
  Reader reader(payload);
  ForceField field;
  field.origin = reader.three_f32();
  field.force = reader.three_f32();
  for (Eigen::Index i = 0; i < 3; ++i) field.jacobian.row(i) = reader.three_f32();
  // The radius may be infinite, because programs use the largest number for an unbounded field.
  const bool sound = reader.sound();
  field.radius = reader.f32();
  if (!sound || !(field.radius >= 0)) return {};
  return field;
}

std::optional<Plane> read_plane(Bytes payload) {
  if (payload.size() != 10 * sizeof(float)) return {};
  Reader reader(payload);
  Plane plane;
  plane.normal = reader.three_f32();
  plane.offset = reader.f32();
  plane.spring = reader.f32();
  plane.damping = reader.f32();
  plane.dynamic_friction = reader.f32();
  plane.static_friction = reader.f32();
  plane.index = reader.i32();
  if (!reader.sound()) return {};
  return plane;
}

std::optional<bool> read_effects(Bytes payload) {
  if (payload.size() != 6 * sizeof(float)) return {};
  Reader reader(payload);
  const Vec3 adhesion_and_texture = reader.three_f32();
  reader.f32();  // wavelength of the texture; ignored because programs leave it positive without a texture
  return !adhesion_and_texture.isZero(0) || reader.f32() != 0;
}

}  // namespace tendon::bridge::vrpn
