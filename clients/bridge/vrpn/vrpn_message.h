// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "protocol/messages.h"

// Encoding of VRPN messages. VRPN.md specifies each layout, and GOLDEN.md contains golden messages, which a test
// compares with these functions. All numbers are big-endian. The input is untrusted: read functions return nothing if
// bytes are missing, left over, or contain numbers that are not finite.
// Thread-safe, realtime-safe: yes, except functions that append to a vector.

namespace tendon::bridge::vrpn {

using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

inline constexpr std::size_t kCookieSize = 24;
inline constexpr std::size_t kHeaderSize = 24;
inline constexpr std::size_t kLongestPayload = 64000;  ///< the size of VRPN's TCP buffer, including the padding
inline constexpr std::size_t kLongestDatagram = 1472;  ///< VRPN's UDP buffer: an Ethernet frame without headers
inline constexpr std::size_t kLongestName = 99;        ///< maximum length of a name without the terminating zero
inline constexpr std::int32_t kMostNumbers = 2000;     ///< limit of sender and type numbers, assigned by each side

inline constexpr int kLowestPort = 1024;  ///< lower ports are reserved for the system
inline constexpr int kHighestPort = 0xffff;

// Predefined types. Other numbers sent by this server are those of `Type`.
inline constexpr std::int32_t kSenderDescription = -1;  ///< the sender field contains the number
inline constexpr std::int32_t kTypeDescription = -2;    ///< likewise
inline constexpr std::int32_t kUdpDescription = -3;     ///< the sender field contains the port

enum class Type : std::int32_t {
  kPosQuat,
  kVelocity,
  kWorkspace,
  kRequestWorkspace,
  kToRoom,
  kRequestToRoom,
  kUnitToSensor,
  kRequestUnitToSensor,
  kUpdateRate,
  kButtonChange,
  kButtonStates,
  kChannel,
  kForce,
  kForceField,
  kPlane,
  kPlaneEffects,
  kForceError,
  kText,
  kPing,
  kPong,
};
inline constexpr std::array<std::string_view, 20> kTypeNames = {
    "vrpn_Tracker Pos_Quat",        "vrpn_Tracker Velocity",
    "vrpn_Tracker Workspace",       "vrpn_Tracker Request_Tracker_Workspace",
    "vrpn_Tracker To_Room",         "vrpn_Tracker Request_Tracker_To_Room",
    "vrpn_Tracker Unit_To_Sensor",  "vrpn_Tracker Request_Unit_To_Sensor",
    "vrpn_Tracker set_update_rate", "vrpn_Button Change",
    "vrpn_Button States",           "vrpn_Analog Channel",
    "vrpn_ForceDevice Force",       "vrpn_ForceDevice Force_Field",
    "vrpn_ForceDevice Plane",       "vrpn_ForceDevice Plane2",
    "vrpn_ForceDevice Force_Error", "vrpn_Base text_message",
    "vrpn_Base ping_message",       "vrpn_Base pong_message",
};
std::optional<Type> type_of(std::string_view name);

struct Stamp {  // Unix time
  std::uint32_t seconds = 0;
  std::uint32_t us = 0;
  bool operator==(const Stamp&) const = default;
};
Stamp stamp_of(Duration since_1970);

struct Message {
  Stamp stamp;
  std::int32_t sender = 0;
  std::int32_t type = 0;
  Bytes payload;
};

std::array<std::byte, kCookieSize> cookie();  ///< first bytes sent by either side
enum class Kinship : std::uint8_t {
  kSame = 1,
  kOtherMinor = 2,  ///< compatible
  kOtherMajor = 3,  ///< another protocol or version; the connection must be closed
};
Kinship kinship(Bytes cookie);

/// Parses the TCP port in a datagram "HOST PORT" with an optional trailing zero. HOST is ignored, because it is not
/// trustworthy. Returns nullopt for other datagrams and for ports below 1024.
std::optional<std::uint16_t> port_in_hello(Bytes datagram);

struct First {
  std::optional<Message> message;  ///< its payload points into the buffer; empty: incomplete or broken
  std::size_t size = 0;            ///< including padding
  bool broken = false;             ///< invalid length; the rest of the stream cannot be parsed
};
First first_message(Bytes bytes);

void append(Buffer& out, const Message& message, std::uint32_t sequence);  ///< adds the padding

void append_description(Buffer& out, std::string_view name);
std::optional<std::string_view> read_description(Bytes payload);  ///< name, which points into `payload`

/// For sensor 0. The velocity also contains the time (s) in which the handle rotates by `rotation`.
void append_pose(Buffer& out, const Vec3& position, const Quat& rotation);
void append_velocity(Buffer& out, const Vec3& velocity, const Quat& rotation, double time);
void append_workspace(Buffer& out, const Vec3& min, const Vec3& max);
void append_identity_to_room(Buffer& out);
std::optional<double> read_update_rate(Bytes payload);  ///< Hz, > 0

void append_button(Buffer& out, std::int32_t button, bool held);
void append_buttons(Buffer& out, std::uint32_t held, int count);
void append_channels(Buffer& out, std::span<const double> channels);
void append_force(Buffer& out, const Vec3& force);
void append_error(Buffer& out, std::int32_t code);

enum class Severity : std::uint32_t { kNormal = 0, kWarning = 1, kError = 2 };
void append_text(Buffer& out, Severity severity, std::string_view text);

/// F(x) = force + jacobian (x − origin) if |x − origin| ≤ radius, else 0; N, acting on the hand.
struct ForceField {
  Vec3 origin = Vec3::Zero();    ///< m
  Vec3 force = Vec3::Zero();     ///< N
  Mat3 jacobian = Mat3::Zero();  ///< N/m, ∂Fᵢ/∂xⱼ
  double radius = 0;             ///< m, ≥ 0
  bool operator==(const ForceField&) const = default;
};
std::optional<ForceField> read_field(Bytes payload);

/// The plane a x + b y + c z + d = 0. The hand is outside where the left side is positive.
struct Plane {
  Vec3 normal = Vec3::Zero();  ///< (a, b, c), any length; 0 removes the plane
  double offset = 0;           ///< d
  double spring = 0;           ///< fraction of the maximum stiffness of the device
  double damping = 0;
  double dynamic_friction = 0;
  double static_friction = 0;
  std::int32_t index = 0;
};
std::optional<Plane> read_plane(Bytes payload);

std::optional<bool> read_effects(Bytes payload);  ///< whether adhesion, texture or buzz is nonzero; empty if invalid

}  // namespace tendon::bridge::vrpn
