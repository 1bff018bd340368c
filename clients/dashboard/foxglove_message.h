// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>

#include "protocol/messages.h"

namespace tendon::dash {

using UnixTime = std::int64_t;  ///< nanoseconds since 1970-01-01

/// Content of a channel. Every payload is one protobuf message.
enum class FoxgloveKind : std::uint8_t {
  kStep,        ///< tendon.recording.v1.Step, as in recordings
  kDevice,      ///< tendon.v1.DeviceReport (the wire format)
  kPeer,        ///< tendon.v1.PeerReport (the wire format)
  kTransforms,  ///< foxglove.FrameTransforms
  kScene,       ///< foxglove.SceneUpdate
};

std::string foxglove_schema_name(FoxgloveKind kind);
/// Returns a serialized google.protobuf.FileDescriptorSet with the file of the type after its imports.
std::string foxglove_schema(FoxgloveKind kind);

/// Converts a state to a step of a recording. Fields that a state does not contain are absent: lateness, interval,
/// held and commanded force, loop age, error, longest hold, limit and account of the gripper; the wanted force and
/// the stiffness are absent if the server does not send them.
std::string step_payload(const DeviceState& state);
std::string report_payload(const DeviceReport& report);
std::string report_payload(const PeerReport& report);

struct Drawn {  // a device at one time
  std::string name;
  std::uint32_t place = 0;  ///< index; devices are drawn kPlaceWidth apart
  std::optional<Quat> operator_from_device{};
  DeviceState state{};
  UnixTime at = 0;
};

inline constexpr double kPlaceWidth = 0.5;    ///< m, device 1 right of device 0, since their placement is unknown
inline constexpr double kArrowLength = 0.01;  ///< m/N, length of arrows

/// Two transforms for each device: NAME_base in `world`, and NAME_handle in NAME_base with the measured position and,
/// if available, orientation. `world` has x forward, y left, z up for the operator. Its rotation to the base frame is
/// `operator_from_device`, or the identity if that is unknown.
std::string transforms_payload(std::span<const Drawn> devices);

/// One entity NAME in the frame NAME_base: the handle, and arrows for the wanted force (if known) and the applied force
/// on the hand. Forces below 0.01 N have no arrow. A device with measured orientation is drawn as a stylus along −z of
/// its handle frame with a ball at the tip, otherwise as a ball. The lifetime of the entity is one second, so that it
/// disappears when the server stops.
std::string scene_payload(const Drawn& device);

}  // namespace tendon::dash
