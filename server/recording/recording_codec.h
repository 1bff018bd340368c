// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "core/base/time.h"
#include "server/recording/records.h"
#include "server/recording/ways.h"

// Records as the messages of recording.proto, and back. The only place in the server that knows protobuf.

namespace tendon {

/// The scene of a run: enough to run it again.
struct SceneRecord {
  std::string text;  ///< the scene file, whole; UTF-8
  std::uint64_t seed = 0;
  std::string version;     ///< of the program that recorded
  std::string commit;      ///< it was built from
  Duration unix_offset{};  ///< log_time − local time; 0 in simulations
  std::uint32_t part = 0;  ///< of its run, from 1; 0: a recording that has only this one
  /// The recording may be deleted to keep all that have its name within so many bytes; 0: it is kept.
  std::uint64_t budget_bytes = 0;
  /// The file name of part 1. This is only set if `budget_bytes` is set. It is needed because `subject-2.mcap` can also
  /// be the first part of a different recording.
  std::string first_part = {};

  bool operator==(const SceneRecord&) const = default;
};

/// Records that are missing in the file, counted since the previous Lost record.
struct LossRecord {
  enum class Cause : std::uint8_t {
    kLogThread = 0,   ///< it could not follow
    kDisk = 1,        ///< it was full, or an error occurred, or the file is damaged
    kByteBudget = 2,  ///< guests' datagrams beyond the bytes of a second, see DatagramSieve
    kSample = 3,      ///< strangers' datagrams beyond the sample of a second, likewise
  };
  LocalTime at{};  ///< when it was noticed
  std::uint64_t steps = 0;
  std::uint64_t datagrams = 0;  ///< from and to guests
  Cause cause = Cause::kLogThread;
  std::uint64_t strangers = 0;  ///< datagrams from and to strangers; only with kSample

  bool operator==(const LossRecord&) const = default;
};

namespace recording {

/// The channel of one kind of record in the MCAP file.
struct Channel {
  std::string_view topic;
  std::string_view schema;  ///< full name of its protobuf message
};
inline constexpr Channel kScene = {"/scene", "tendon.recording.v1.Scene"};
inline constexpr Channel kStep = {"/haptic/step", "tendon.recording.v1.Step"};
inline constexpr Channel kPort = {"/haptic/port", "tendon.recording.v1.Port"};
inline constexpr Channel kDatagram = {"/net/datagram", "tendon.recording.v1.Datagram"};
inline constexpr Channel kClock = {"/merge/clock", "tendon.recording.v1.Clock"};
inline constexpr Channel kLoss = {"/recording/lost", "tendon.recording.v1.Lost"};

/// The MCAP name of both our schemas' and our messages' encoding.
inline constexpr std::string_view kEncoding = "protobuf";

/// A serialized FileDescriptorSet that holds every message of recording.proto.
std::string schema_data();

/// The same record gives the same bytes.
std::string encode(const SceneRecord& scene);
/// `force_way`: the name of Step::force_way, which is a number of this run only.
std::string encode(const StepRecord& step, std::string_view force_way = {});
std::string encode(const PortRecord& port);
std::string encode(const ClockRecord& clock);
std::string encode(const DatagramRecord& datagram);
std::string encode(const LossRecord& loss);

// A message back as a record; `at` is the message's time on the local clock. Every double comes back with all its
// bits, NaN included. Throws std::invalid_argument with what is wrong when the bytes are not such a message.
SceneRecord decode_scene(std::string_view message);
/// Numbers the name of Step::force_way in `ways`.
StepRecord decode_step(std::string_view message, LocalTime at, Ways& ways);
PortRecord decode_port(std::string_view message, LocalTime at);
DatagramRecord decode_datagram(std::string_view message, LocalTime at);
LossRecord decode_loss(std::string_view message, LocalTime at);

/// log_time = unix_offset + local time, in ns modulo 2⁶⁴; and its inverse.
constexpr std::uint64_t log_time(LocalTime at, Duration unix_offset) noexcept {
  return static_cast<std::uint64_t>(at.time_since_epoch().count()) + static_cast<std::uint64_t>(unix_offset.count());
}
constexpr LocalTime local_time(std::uint64_t log_time, Duration unix_offset) noexcept {
  return LocalTime(Duration(static_cast<Duration::rep>(log_time - static_cast<std::uint64_t>(unix_offset.count()))));
}

}  // namespace recording
}  // namespace tendon
