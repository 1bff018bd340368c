// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/fields.h"

#include <google/protobuf/stubs/common.h>

#include <algorithm>

#include "core/base/rotation.h"
#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/text.h"

// From protobuf 22 (4.22) on, a text that is not UTF-8 is logged through Abseil, once and without its content, and
// there is nothing to silence.
#if GOOGLE_PROTOBUF_VERSION < 4022000
#include <google/protobuf/stubs/logging.h>
#endif

namespace tendon::wire {
namespace {

template <class Time>
bool read_time(std::int64_t ns, Time& to) noexcept {
  to = Time{Duration{ns}};
  return in_time(to.time_since_epoch());
}

/// Our enums have the numbers of the wire: first is 1, all up to `last` are used.
template <class Enum>
bool read_enum(int from, Enum last, Enum& to) noexcept {
  if (from < 1 || from > static_cast<int>(last)) return false;
  to = static_cast<Enum>(from);
  return true;
}

}  // namespace

bool read(const pb::Vec3& from, Vec3& to) noexcept {
  to = {from.x(), from.y(), from.z()};
  return bounded(from.x()) && bounded(from.y()) && bounded(from.z());
}

void write(const Vec3& from, pb::Vec3& to) {
  to.set_x(from.x());
  to.set_y(from.y());
  to.set_z(from.z());
}

bool read(const pb::Quat& from, Quat& to) noexcept {
  to = {.w = from.w(), .x = from.x(), .y = from.y(), .z = from.z()};
  return is_rotation(to);
}

void write(const Quat& from, pb::Quat& to) {
  to.set_w(from.w);
  to.set_x(from.x);
  to.set_y(from.y);
  to.set_z(from.z);
}

bool read(bool there, double from, std::optional<double>& to) noexcept {
  to = there ? std::optional(from) : std::nullopt;
  return !there || bounded(from);
}

bool read(bool there, const pb::Vec3& from, std::optional<Vec3>& to) noexcept {
  to.reset();
  return !there || read(from, to.emplace());
}

bool matrix_of(std::span<const double> entries, Mat3& to) noexcept {
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

std::size_t entries_of(const Mat3& k, std::array<double, 9>& entries) noexcept {
  const bool diagonal = k(0, 1) == 0 && k(0, 2) == 0 && k(1, 0) == 0 && k(1, 2) == 0 && k(2, 0) == 0 && k(2, 1) == 0;
  if (!diagonal) {
    Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(entries.data()) = k;
    return 9;
  }
  entries = {k(0, 0), k(1, 1), k(2, 2)};
  return k(0, 0) == k(1, 1) && k(0, 0) == k(2, 2) ? 1 : 3;
}

bool read(const Entries& from, Mat3& to) noexcept {
  return matrix_of(std::span(from.data(), static_cast<std::size_t>(from.size())), to);
}

void write(const Mat3& from, Entries& to) {
  std::array<double, 9> entries{};
  const std::size_t size = entries_of(from, entries);
  to.Clear();
  to.Add(entries.begin(), entries.begin() + size);
}

static_assert(limits::kMaxJoints == Joints::kMost);

bool read(const Entries& angles, const Entries& velocities, std::optional<Joints>& to) noexcept {
  constexpr int kMost = static_cast<int>(Joints::kMost);
  const auto good = [](const Entries& entries) {
    return entries.size() <= kMost && std::all_of(entries.begin(), entries.end(), bounded);
  };
  to.reset();
  if (!good(angles) || !good(velocities)) return false;
  if (angles.empty()) return true;
  Joints& joints = to.emplace();
  joints.count = static_cast<std::size_t>(angles.size());
  std::copy(angles.begin(), angles.end(), joints.angle.begin());
  std::copy_n(velocities.begin(), std::min(angles.size(), velocities.size()), joints.velocity.begin());
  return true;
}

void write(const std::optional<Joints>& from, Entries& angles, Entries& velocities) {
  angles.Clear();
  velocities.Clear();
  for (std::size_t i = 0; from && i < from->count; ++i) {
    angles.Add(from->angle[i]);
    velocities.Add(from->velocity[i]);
  }
}

bool in_time(Duration d) noexcept { return d >= -limits::kMaxTime && d <= limits::kMaxTime; }

bool read(std::int64_t ns, LocalTime& to) noexcept { return read_time(ns, to); }
bool read(std::int64_t ns, PeerTime& to) noexcept { return read_time(ns, to); }

bool read(std::uint64_t ns, Duration& to) noexcept {
  to = Duration{static_cast<Duration::rep>(ns)};
  return ns <= static_cast<std::uint64_t>(limits::kMaxTime.count());
}
std::uint32_t validity_us(Duration valid_for) noexcept {
  const bool possible = valid_for > Duration::zero() && valid_for <= limits::kMaxValidFor;
  const auto us = std::chrono::ceil<std::chrono::microseconds>(possible ? valid_for : Duration::zero());
  return static_cast<std::uint32_t>(us.count());
}

std::uint64_t unsigned_ns(Duration d) noexcept { return static_cast<std::uint64_t>(d.count()); }

bool read(pb::Mode from, Mode& to) noexcept { return read_enum(from, Mode::kFault, to); }
bool read(pb::Role from, Role& to) noexcept { return read_enum(from, Role::kController, to); }
bool read(pb::Code from, Code& to) noexcept { return read_enum(from, Code::kReplaced, to); }
bool read(pb::Safety from, Safety& to) noexcept { return read_enum(from, Safety::kUnguarded, to); }
bool read(pb::ChannelRule from, ChannelRule& to) noexcept { return read_enum(from, ChannelRule::kPriority, to); }
bool read(pb::Hand from, Hand& to) noexcept {
  to = Hand::kAny;
  return from == pb::HAND_ANY || read_enum(from, Hand::kRight, to);
}

bool read(pb::OutputKind from, OutputKind& to) noexcept { return read_enum(from, OutputKind::kVibration, to); }

bool read_device(std::uint32_t from, std::uint32_t& to) noexcept { return (to = from) < limits::kMaxDevices; }
bool read_channel(std::uint32_t from, std::uint32_t& to) noexcept { return (to = from) < limits::kMaxChannels; }

bool read_ms(std::uint32_t from, Duration& to) noexcept {
  to = std::chrono::milliseconds(from);
  return to <= limits::kMaxTimeout;
}
std::uint32_t in_ms(Duration from) noexcept {
  const auto ms = std::chrono::ceil<std::chrono::milliseconds>(std::clamp(from, Duration::zero(), limits::kMaxTimeout));
  return static_cast<std::uint32_t>(ms.count());
}

bool read_size(double from, double& to) noexcept { return bounded(to = from) && from >= 0; }

bool read(const std::string& from, std::size_t limit, std::string& to) {
  if (from.size() > limit) return false;
  to = from;
  return true;
}

bool read_features(const Texts& from, std::vector<std::string>& to) {
  if (from.size() > limits::kMaxFeatures) return false;
  to.assign(from.begin(), from.end());
  return std::all_of(to.begin(), to.end(), [](const auto& text) { return text.size() <= limits::kMaxFeature; });
}

void write_features(const std::vector<std::string>& from, Texts& to) {
  for (const std::string& feature : from) {
    if (to.size() == limits::kMaxFeatures) break;
    *to.Add() = clip(feature, limits::kMaxFeature);
  }
}

bool read_labels(const Texts& from, std::size_t most, std::vector<std::string>& to) {
  to.assign(from.begin(), from.end());
  return to.size() <= most &&
         std::all_of(to.begin(), to.end(), [](const auto& text) { return text.size() <= limits::kMaxLabel; });
}

void write_labels(const std::vector<std::string>& from, std::size_t most, Texts& to) {
  for (std::size_t i = 0; i < std::min(from.size(), most); ++i) *to.Add() = clip(from[i], limits::kMaxLabel);
}

bool parse(std::span<const std::byte> from, google::protobuf::MessageLite& to) {
#if GOOGLE_PROTOBUF_VERSION < 4022000
  const google::protobuf::LogSilencer silence;
#endif
  return to.ParseFromArray(from.data(), static_cast<int>(from.size()));
}

}  // namespace tendon::wire
