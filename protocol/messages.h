// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/mode.h"
#include "core/motion.h"
#include "core/remote_force.h"

// What peers say to each other, as plain values. tendon.proto holds the same nouns as bytes, WIRE.md
// the bytes around them; codec.h turns one into the other and is the only place that knows protobuf.
// SI units; forces are on the hand; vectors are in the device base frame.

namespace tendon {

/// The version of the wire that this build speaks.
inline constexpr std::uint32_t kProtocolVersion = 1;

enum class Role : std::uint8_t {
  kObserver = 1,    ///< sees device states
  kController = 2,  ///< sees device states and sends forces; one per device
};

/// Why something was refused or ended. Part of the wire: never renumber.
enum class Code : std::uint8_t {
  kOk = 1,
  kInvalid = 2,      ///< the value makes no sense
  kUnsupported = 3,  ///< this peer does not know that request or version
  kBusy = 4,         ///< somebody else has it: a second controller
  kDenied = 5,       ///< not with this role
  kShutdown = 6,     ///< the server is going down
  kTimedOut = 7,     ///< nothing was heard for too long
  kExpired = 8,      ///< a session of suite 1 has reached its age: shake hands again
  kReplaced = 9,     ///< another program with the same key has taken this place: do not come back unasked
};

/// Server → client, unreliable, newest wins: the device at one haptic step.
struct DeviceState {
  std::uint64_t tick = 0;             ///< number of the haptic step
  PeerTime sampled{};                 ///< when the position was sampled, server clock
  Vec3 position = Vec3::Zero();       ///< m
  Vec3 velocity = Vec3::Zero();       ///< m/s
  Vec3 force_applied = Vec3::Zero();  ///< N, what the device really gives out from this step on
  double energy = 0;                  ///< J, the energy ledger at this step
  double permitted_force = 0;         ///< N, the limiter's bound at this step; +infinity when there is none
  std::uint32_t reasons = 0;          ///< why the force is not what was asked for: core/reason.h
  std::uint64_t force_sequence = 0;   ///< ForceCommand rendered now; 0 = none
  Duration force_age{};               ///< its age since it arrived; 0 when none
  Mode mode = Mode::kIdle;
};

/// Client → server, unreliable, newest wins: the force that the physics engine wants.
struct ForceCommand {
  std::uint64_t sequence = 0;       ///< 1, 2, 3 … per session
  std::uint64_t based_on_tick = 0;  ///< DeviceState::tick it was computed from
  Vec3 force = Vec3::Zero();        ///< N, on the hand
  std::optional<LocalModel> model;
  Duration valid_for{};  ///< counted from arrival; > 0, at most 10 s; travels in whole µs, rounded up
};

/// Client → server, reliable: how many device states per second this client wants. The server sends
/// the nearest rate that divides its own, and never more.
struct SetStateRate {
  std::uint32_t hz = 0;
};

/// Client → server, reliable: clears a latched fault. Only from the controller.
struct Rearm {};

using Request = std::variant<SetStateRate, Rearm>;

/// A feature: the client may send a local model with its forces, and the server follows the hand with it.
inline constexpr std::string_view kFeatureLocalModel = "local-model";

/// The first words of a client. Sent again with the server's cookie once it has been received.
struct Hello {
  std::uint32_t version_min = kProtocolVersion;
  std::uint32_t version_max = kProtocolVersion;
  Role role = Role::kObserver;
  std::string name;                   ///< for logs; at most 64 bytes
  std::vector<std::string> features;  ///< offered; the intersection is used. At most 16 of at most 32 bytes
};

/// The server's yes.
struct Welcome {
  std::uint32_t version = 0;
  std::vector<std::string> features;  ///< those both ends know
  Role role = Role::kObserver;
  std::string device_name;
  double max_force = 0;            ///< N
  double position_resolution = 0;  ///< m
  std::uint32_t loop_hz = 0;       ///< haptic steps per second
  Duration timeout{};              ///< silence after which the server forgets this client
  std::string server;              ///< name and version of the server
};

/// The server's no, with the reason.
struct Refused {
  Code code = Code::kInvalid;
  std::string detail;
  std::uint32_t version_min = 0;
  std::uint32_t version_max = 0;
};

}  // namespace tendon
