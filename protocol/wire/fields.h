// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "protocol/messages.h"
#include "tendon.pb.h"

// Single fields of protobuf messages and back. Each `read` gives false when the value is out of bounds. For the codecs
// of this folder only: other code sees no protobuf.

namespace tendon::wire {

namespace pb = tendon::v1;

bool read(const pb::Vec3& from, Vec3& to) noexcept;
void write(const Vec3& from, pb::Vec3& to);
/// False unless is_rotation().
bool read(const pb::Quat& from, Quat& to) noexcept;
void write(const Quat& from, pb::Quat& to);

/// A field that may be absent.
bool read(bool there, double from, std::optional<double>& to) noexcept;
bool read(bool there, const pb::Vec3& from, std::optional<Vec3>& to) noexcept;

/// A stiffness of 1, 3 or 9 entries: k·I, its diagonal, or all of it row by row. False for any other number of them;
/// the entries are for in_bounds.
bool matrix_of(std::span<const double> entries, Mat3& to) noexcept;
/// The shortest of the three forms that says the same: how many of `entries` it takes.
std::size_t entries_of(const Mat3& from, std::array<double, 9>& entries) noexcept;
using Entries = google::protobuf::RepeatedField<double>;
bool read(const Entries& from, Mat3& to) noexcept;
void write(const Mat3& from, Entries& to);

/// The angles and velocities of joints. Missing velocities are 0, those without an angle are left out; no angle: empty.
bool read(const Entries& angles, const Entries& velocities, std::optional<Joints>& to) noexcept;
void write(const std::optional<Joints>& from, Entries& angles, Entries& velocities);

/// A clock reading.
bool read(std::int64_t ns, LocalTime& to) noexcept;
bool read(std::int64_t ns, PeerTime& to) noexcept;
/// A length of time, which is never below zero.
bool read(std::uint64_t ns, Duration& to) noexcept;
std::uint64_t unsigned_ns(Duration d) noexcept;
bool in_time(Duration d) noexcept;
/// How long a force is valid, in µs, rounded up. One out of range becomes 0, which the receiver refuses; a cast would
/// make it look valid.
std::uint32_t validity_us(Duration valid_for) noexcept;
bool read_ms(std::uint32_t from, Duration& to) noexcept;
/// Rounded up: who waits for so long has waited long enough.
std::uint32_t in_ms(Duration from) noexcept;

bool read(pb::Mode from, Mode& to) noexcept;
bool read(pb::Role from, Role& to) noexcept;
bool read(pb::Code from, Code& to) noexcept;
bool read(pb::Safety from, Safety& to) noexcept;
bool read(pb::ChannelRule from, ChannelRule& to) noexcept;
bool read(pb::Hand from, Hand& to) noexcept;
bool read(pb::OutputKind from, OutputKind& to) noexcept;

bool read_device(std::uint32_t from, std::uint32_t& to) noexcept;
bool read_channel(std::uint32_t from, std::uint32_t& to) noexcept;

/// A quantity that is not negative; 0 when it is not known.
bool read_size(double from, double& to) noexcept;

/// A text of at most `limit` bytes.
bool read(const std::string& from, std::size_t limit, std::string& to);

using Texts = google::protobuf::RepeatedPtrField<std::string>;
bool read_features(const Texts& from, std::vector<std::string>& to);
/// Cut to the bounds of the wire.
void write_features(const std::vector<std::string>& from, Texts& to);

/// At most `most` names.
bool read_labels(const Texts& from, std::size_t most, std::vector<std::string>& to);
void write_labels(const std::vector<std::string>& from, std::size_t most, Texts& to);

/// Parses without printing: protobuf prints a line for every text that is not UTF-8, and a stranger must not be able to
/// fill our log.
bool parse(std::span<const std::byte> from, google::protobuf::MessageLite& to);

inline std::uint8_t* as_bytes(std::byte* p) noexcept { return reinterpret_cast<std::uint8_t*>(p); }

}  // namespace tendon::wire
