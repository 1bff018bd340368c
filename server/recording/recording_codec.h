// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "server/recording/records.h"
#include "server/recording/solver_paths.h"

// Converts records to messages of recording.proto, and back. The server must not use protobuf anywhere else.

namespace tendon {

struct SceneRecord {
  std::string text;
  std::uint64_t seed = 0;
  std::string version;
  std::string commit;
  Duration unix_offset{};  ///< log_time − local time
  std::uint32_t part = 0;  ///< starting at 1; 0 if there are no other parts
  /// The recording may be deleted to limit the total size of all parts to this value; 0: it is kept.
  std::uint64_t budget_bytes = 0;
  /// The file name of part 1, if `budget_bytes` is set, because `subject-2.mcap` can also be the first part.
  std::string first_part = {};

  bool operator==(const SceneRecord&) const = default;
};

struct LossRecord {
  enum class Cause : std::uint8_t {
    kLogThread = 0,  ///< log thread too slow
    kDisk = 1,
    kByteBudget = 2,  ///< exceeded the bytes per second, see DatagramFilter
    kSample = 3,
  };
  LocalTime at{};
  std::uint64_t steps = 0;
  std::uint64_t datagrams = 0;
  Cause cause = Cause::kLogThread;
  std::uint64_t unauthenticated = 0;  ///< from and to unauthenticated senders; only for kSample

  bool operator==(const LossRecord&) const = default;
};

namespace recording {

struct Channel {
  std::string_view topic;
  std::string_view schema;  ///< full name of the protobuf message
};
inline constexpr Channel kScene = {"/scene", "tendon.recording.v1.Scene"};
inline constexpr Channel kStep = {"/haptic/step", "tendon.recording.v1.Step"};
inline constexpr Channel kPort = {"/haptic/port", "tendon.recording.v1.Port"};
inline constexpr Channel kFieldInput = {"/haptic/field", "tendon.recording.v1.FieldInput"};
inline constexpr Channel kFieldData = {"/field/data", "tendon.recording.v1.FieldData"};
inline constexpr Channel kDatagram = {"/net/datagram", "tendon.recording.v1.Datagram"};
inline constexpr Channel kClock = {"/merge/clock", "tendon.recording.v1.Clock"};
inline constexpr Channel kLoss = {"/recording/lost", "tendon.recording.v1.Lost"};

inline constexpr std::string_view kEncoding = "protobuf";

std::string schema_data();

std::string encode(const SceneRecord& scene);
/// `force_way` is the name of Step::force_way. The number is only valid in this run.
std::string encode(const StepRecord& step, std::string_view force_way = {});
std::string encode(const PortRecord& port);
std::string encode(const FieldInput& input);
std::string encode(const FieldData& data);
std::string encode(const ClockRecord& clock);
std::string encode(const DatagramRecord& datagram);
std::string encode(const LossRecord& loss);

// Floating-point values are preserved exactly, including NaN. Throws std::invalid_argument if a message is not valid.
SceneRecord decode_scene(std::string_view message);
StepRecord decode_step(std::string_view message, LocalTime at, SolverPaths& ways);
PortRecord decode_port(std::string_view message, LocalTime at);
FieldInput decode_field_input(std::string_view message, LocalTime at);
FieldData decode_field_data(std::string_view message, LocalTime at);
DatagramRecord decode_datagram(std::string_view message, LocalTime at);
LossRecord decode_loss(std::string_view message, LocalTime at);

/// The log time is unix_offset + local time, in ns modulo 2⁶⁴. The second function is the inverse.
constexpr std::uint64_t log_time(LocalTime at, Duration unix_offset) noexcept {
  return static_cast<std::uint64_t>(at.time_since_epoch().count()) + static_cast<std::uint64_t>(unix_offset.count());
}
constexpr LocalTime local_time(std::uint64_t log_time, Duration unix_offset) noexcept {
  return LocalTime(Duration(static_cast<Duration::rep>(log_time - static_cast<std::uint64_t>(unix_offset.count()))));
}

}  // namespace recording
}  // namespace tendon
