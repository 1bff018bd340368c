// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocol/messages.h"

namespace tendon::dash {

/// Nanoseconds since 1970, as Foxglove counts them.
using UnixTime = std::int64_t;

/// What a channel of /foxglove holds. Every payload is one protobuf message.
enum class FoxgloveKind : std::uint8_t {
  kStep,        ///< tendon.recording.v1.Step, as in recordings
  kDevice,      ///< tendon.v1.DeviceReport, as on the wire
  kPeer,        ///< tendon.v1.PeerReport, as on the wire
  kTransforms,  ///< foxglove.FrameTransforms
  kScene,       ///< foxglove.SceneUpdate
};

/// The full name of the message type.
std::string foxglove_schema_name(FoxgloveKind kind);
/// A serialized google.protobuf.FileDescriptorSet: the file of the type, and before it all that it imports.
std::string foxglove_schema(FoxgloveKind kind);

/// A state as a step of a recording. A state knows less than a recording: the fields that it does not know are absent
/// (late, interval, held and commanded forces, loop age, error, longest hold, the gripper's bound and account), and so
/// are the wanted force and the stiffness where the server does not tell them.
std::string step_payload(const DeviceState& state);
std::string report_payload(const DeviceReport& report);
std::string report_payload(const PeerReport& report);

/// A device at one time, to be drawn.
struct Drawn {
  std::string name;
  std::uint32_t place = 0;  ///< beside the others: devices stand kPlaceWidth apart
  std::optional<Quat> operator_from_device{};
  DeviceState state{};
  UnixTime at = 0;
};

/// m. The server does not know how devices are placed relative to each other. Device 1 is drawn to the right of device 0.
inline constexpr double kPlaceWidth = 0.5;
/// m for each newton of an arrow.
inline constexpr double kArrowLength = 0.01;

/// Two transforms for each device: NAME_base in `world`, and NAME_handle in NAME_base, which is the measured position
/// and, where the device measures it, orientation.
///
/// `world` is as robots have it, x forward, y left, z up, for the person at the device. Its rotation to the base frame
/// comes from `operator_from_device`; where that is not known, the axes of the base frame are those of the world.
std::string transforms_payload(std::span<const Drawn> devices);

/// One entity, NAME, in the frame NAME_base. It holds the handle, and arrows for the wanted force (where it is told)
/// and the applied one, both on the hand, which begin at the handle: kArrowLength for each newton. A force below 0.01 N
/// has no arrow. A device that measures its orientation is a stylus, which points along −z of its handle frame, with a
/// ball for its tip; another one is a ball.
///
/// The entity lives for one second, so nothing is drawn of a server that is gone.
std::string scene_payload(const Drawn& device);

}  // namespace tendon::dash
