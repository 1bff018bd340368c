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

// VRPN's bytes ⇄ values. VRPN.md is the page: each layout, and golden messages that a test compares with
// these functions. Everything is big-endian. No socket, no clock; what a stranger sends is never believed: a function
// that reads returns nothing when the bytes are too few, too many, or not finite.
//
// Thread-safe, realtime-safe: yes, but for those that append to a vector.

namespace tendon::plug::vrpn {

using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

inline constexpr std::size_t kCookieSize = 24;
inline constexpr std::size_t kHeaderSize = 24;
/// Longest payload with its padding: VRPN's own buffer for TCP. A longer one ends the connection, as there.
inline constexpr std::size_t kLongestPayload = 64000;
/// Longest datagram: VRPN's buffer for UDP, an Ethernet frame without its headers.
inline constexpr std::size_t kLongestDatagram = 1472;
/// Longest name of a sender or a type, without its zero.
inline constexpr std::size_t kLongestName = 99;
/// Senders and types are numbered below this, each end for itself.
inline constexpr std::int32_t kMostNumbers = 2000;

/// Ports below this one are the system's: no program is expected there.
inline constexpr int kLowestPort = 1024;
inline constexpr int kHighestPort = 0xffff;

// Types that every VRPN knows. Ours are the numbers of `Type`.
inline constexpr std::int32_t kSenderDescription = -1;  ///< the sender field is the number
inline constexpr std::int32_t kTypeDescription = -2;    ///< likewise
inline constexpr std::int32_t kUdpDescription = -3;     ///< the sender field is the port

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

/// Unix time in VRPN's two numbers.
struct Stamp {
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

/// The first bytes of either end.
std::array<std::byte, kCookieSize> cookie();
enum class Kinship : std::uint8_t {
  kSame = 1,
  kOtherMinor = 2,  ///< they talk all the same
  kOtherMajor = 3,  ///< another protocol, or none: the connection ends
};
Kinship kinship(Bytes cookie);

/// The TCP port in a datagram "HOST PORT" with or without a zero at its end. HOST is read over: it could be anyone's.
/// Empty: the datagram is something else, or the port is below 1024.
std::optional<std::uint16_t> port_in_hello(Bytes datagram);

/// The message at the beginning of `bytes`.
struct First {
  std::optional<Message> message;  ///< its payload lies in `bytes`; empty: more bytes are needed, or it is broken
  std::size_t size = 0;            ///< of the message with its padding
  bool broken = false;             ///< its length is impossible: nothing after it can be read
};
First first_message(Bytes bytes);

/// Appends a message with its padding.
void append(Buffer& out, const Message& message, std::uint32_t sequence);

// ---- Payloads. append_… append one, read_… read one. ----------------------------------------------------------------

void append_description(Buffer& out, std::string_view name);
/// The name, which lies in `payload`.
std::optional<std::string_view> read_description(Bytes payload);

/// Of sensor 0; velocities have one more number, the time (s) in which the handle turns by `rotation`.
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

/// F(x) = force + jacobian (x − origin) where |x − origin| ≤ radius, else 0; N on the hand.
struct ForceField {
  Vec3 origin = Vec3::Zero();    ///< m
  Vec3 force = Vec3::Zero();     ///< N
  Mat3 jacobian = Mat3::Zero();  ///< N/m, ∂Fᵢ/∂xⱼ
  double radius = 0;             ///< m, ≥ 0
  bool operator==(const ForceField&) const = default;
};
std::optional<ForceField> read_field(Bytes payload);

/// a x + b y + c z + d = 0; the hand is outside where that is above 0.
struct Plane {
  Vec3 normal = Vec3::Zero();  ///< (a, b, c), of any length; 0 ends the plane
  double offset = 0;           ///< d
  double spring = 0;           ///< no unit: a share of the stiffest that the device can do
  double damping = 0;
  double dynamic_friction = 0;
  double static_friction = 0;
  std::int32_t index = 0;
};
std::optional<Plane> read_plane(Bytes payload);

/// Adhesion, texture, buzz: whether any of them is not 0. Empty: no such payload.
std::optional<bool> read_effects(Bytes payload);

}  // namespace tendon::plug::vrpn
