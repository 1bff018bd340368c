// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "core/base/mode.h"
#include "core/base/motion.h"
#include "core/base/output.h"
#include "core/base/reason.h"
#include "core/base/time.h"
#include "core/remote/channel_rule.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/port_state.h"
#include "protocol/limits.h"

// The messages of the protocol as plain values. See tendon.proto and WIRE.md for their encoding. SI units are used,
// forces act on the hand, and vectors are in the base frame of the device.

namespace tendon {

inline constexpr std::uint32_t kProtocolVersion = 1;

enum class Role : std::uint8_t {
  kObserver = 1,
  kController = 2,  ///< also sends forces; one per channel
};

/// Part of the wire: never renumber.
enum class Code : std::uint8_t {
  kOk = 1,
  kInvalid = 2,
  kUnsupported = 3,  ///< unknown request or version
  kBusy = 4,         ///< used by another controller
  kDenied = 5,
  kShutdown = 6,
  kTimedOut = 7,
  kExpired = 8,   ///< the session is too old; repeat the handshake
  kReplaced = 9,  ///< another program uses the same key; do not reconnect automatically
};

// Devices and channels are numbered from 0, below limits::kMaxDevices and limits::kMaxChannels. Each channel takes the
// forces of one engine. The device renders the combination of all channels.

/// Server → client, unreliable, newest wins for each device: the device at one haptic step.
struct DeviceState {
  std::uint64_t tick = 0;
  PeerTime sampled{};                 ///< time of the position, on the server's clock
  Vec3 position = Vec3::Zero();       ///< m
  Vec3 velocity = Vec3::Zero();       ///< m/s
  Vec3 force_applied = Vec3::Zero();  ///< N, actually rendered from this step on
  double energy = 0;                  ///< J, of the energy ledger
  double permitted_force = 0;         ///< N, bound of the limiter; may be +infinity
  std::uint32_t reasons = 0;          ///< bits of Reason for changing the force
  std::uint64_t force_sequence = 0;   ///< of the rendered ForceCommand, or 0
  Duration force_age{};               ///< since the arrival of that force
  Mode mode = Mode::kIdle;
  std::uint32_t device = 0;
  std::uint32_t channel = 0;  ///< for `force_sequence`, `force_age` and `mode`
  /// N, requested by the engines, after hold or local model, before all limits. For observers with kFeatureDiagnostics.
  std::optional<Vec3> force_wanted{};
  /// N/m, −∂force_wanted/∂position, using the engines' models. Empty if there is no model.
  std::optional<Mat3> stiffness_wanted{};
  /// Bit i is set if button i is held or was pressed since the last state that was sent. Requires kFeatureHandle.
  std::uint32_t buttons = 0;
  // Only for clients with kFeatureHandle, and only if the device has such a sensor or motor:
  std::optional<Turning> turning{};
  std::optional<Vec3> torque_applied{};  ///< N·m, on the hand, from this step on
  std::optional<Grip> grip{};
  std::optional<double> grip_applied{};  ///< N, on the fingers, > 0 opens them
  std::optional<Vec3> hand_force{};      ///< N, of the hand on the handle
  std::optional<Joints> joints{};        ///< in the order of HandleDescription::joints; requires kFeatureJoints
};

/// Client → server, unreliable, newest wins for each device and channel: the force from the physics engine.
struct ForceCommand {
  std::uint64_t sequence = 0;       ///< 1, 2, 3 … per session, device and channel
  std::uint64_t based_on_tick = 0;  ///< DeviceState::tick used for computing it
  Vec3 force = Vec3::Zero();        ///< N, on the hand
  std::optional<LocalModel> model{};
  Duration valid_for{};  ///< since arrival; > 0, at most 10 s; whole µs, rounded up
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  bool topology_changed = false;         ///< the body was cut or torn: models are not used
  std::optional<double> error{};         ///< N, estimated by the engine
  std::optional<RemoteTorque> torque{};  ///< requires kFeatureHandle, like `grip_force`
  std::optional<double> grip_force{};    ///< N, on the fingers; > 0 opens them
  std::uint32_t way = 0;                 ///< entry of Hello::ways that was used, from 1, or 0; requires kFeatureWays
};

/// Quantiles of a delay. They can be negative if two clocks were compared.
struct Delays {
  Duration median{};
  Duration p99{};
};

/// Forces that were refused because of an error in the engine.
struct RefusedForces {
  std::uint64_t not_finite = 0;     ///< of the force, its model or its error
  std::uint64_t out_of_bounds = 0;  ///< see WIRE.md; includes `valid_for` 0 and `sequence` 0
  std::uint64_t unknown_tick = 0;   ///< unknown, or more than 4096 ticks old
  std::uint64_t old_sequence = 0;   ///< not increased, although the datagram is the newest
  bool operator==(const RefusedForces&) const = default;
};

/// Server → client, unreliable, newest wins: statistics of the client's forces and datagrams. Sent once per `span`
/// while forces arrive, are missing or are refused. Unmeasured delays are empty. One-way delays: ± `clock_error`.
struct LinkReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … per session
  PeerTime until{};          ///< end of the span, on the server's clock
  Duration span{};
  // During the span:
  std::uint64_t forces = 0;
  std::uint64_t late_server = 0;   ///< late because a state was late
  std::uint64_t late_network = 0;  ///< in either direction
  std::uint64_t late_engine = 0;   ///< late because the engine was slow
  Duration worst_late{};           ///< maximum time without a valid force
  Duration longest_gap{};          ///< maximum silence of the client
  std::optional<Delays> round_trip;
  std::optional<Delays> to_server;
  std::optional<Delays> to_client;
  Duration clock_offset{};  ///< client's clock − server's clock
  double clock_drift_ppm = 0;
  Duration clock_error{};  ///< bound of |true offset − clock_offset|
  // Since the session was opened:
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t reordered = 0;
  std::uint64_t duplicated = 0;
  std::string words;  ///< reasons, for people; at most 128 bytes
  // During the span:
  std::uint64_t late_unknown = 0;  ///< not yet known, because the client is silent
  RefusedForces refused{};         ///< of all channels, because some refused forces do not have a readable channel
};

/// The state of a device and its safety layer. Part of the wire: never renumber.
enum class Safety : std::uint8_t {
  kAbsent = 1,
  kOpening = 2,
  kFirmware = 3,  ///< has no firmware yet
  kUnhomed = 4,   ///< position not known yet
  kHomed = 5,     ///< waiting to be armed
  kArmed = 6,
  kFault = 7,      ///< must be armed again
  kUnguarded = 8,  ///< ready, without a safety layer
};

/// Steps by wake-up delay: [0] at most 1 µs, [i] above 2^(i−1) µs and at most 2^i µs, and all others in the last one.
using LatenessHistogram = std::array<std::uint64_t, limits::kLatenessBuckets>;

constexpr std::size_t lateness_bucket(Duration late) noexcept {
  // Rounds down, but 2 µs, for example, belongs to the lower bucket.
  const std::int64_t us = late.count() <= 0 ? 0 : (late.count() - 1) / 1000;
  const auto bucket = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us)));
  return std::min(bucket, limits::kLatenessBuckets - 1);
}

/// Both directions, unreliable: one end of a coupling, sent to the other end and to observers. For each device, channel
/// and end, the highest sequence of the highest epoch wins. Requires kFeatureTeleoperation.
struct PortFrame : PortState {
  std::uint32_t device = 0;  ///< always of the session's server
  std::uint32_t channel = 0;
  bool of_peer = false;  ///< for observers: the remote end
};

/// Server → client, unreliable, newest wins for each device: statistics of its loop over `span`, sent every second to
/// observers with kFeatureDiagnostics.
struct DeviceReport {
  std::uint64_t number = 0;
  PeerTime until{};
  Duration span{};
  std::uint32_t device = 0;
  std::uint64_t steps = 0;
  std::uint64_t missed = 0;      ///< periods skipped because of a late step
  std::uint64_t overruns = 0;    ///< late enough for Reason::kOverrun
  std::uint64_t unseen = 0;      ///< steps without a position
  LatenessHistogram lateness{};  ///< the sum can be below `steps` if the server lost count
  Safety safety = Safety::kAbsent;
  std::string fault{};     ///< why there is no force; at most 128 bytes
  std::string degraded{};  ///< services reduced by the server; at most 128 bytes
};

/// Server → client, unreliable, newest wins for each device and channel: statistics of the engine that uses a channel,
/// sent every second to observers with kFeatureDiagnostics.
struct PeerReport {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string name{};              ///< at most 64 bytes
  std::uint32_t state_one_in = 1;  ///< due to congestion, one of this many requested states is sent
  bool forces_refused = false;     ///< due to excessive loss
  LinkReport link{};               ///< for this channel only
  // Of the force with the largest ForceCommand::error, or of the newest force if errors are not reported.
  std::optional<double> error{};  ///< N
  std::string way{};              ///< from Hello::ways; at most 24 bytes
};

// ---- Requests: reliable, client → server unless stated otherwise ----

/// Sets the state rate of a device. The server uses the nearest rate that divides its own rate, and never a higher one.
struct SetStateRate {
  std::uint32_t hz = 0;
  std::uint32_t device = 0;
};

/// Omits states that the client can predict (see StateDeadband). The bounds are in limits.h.
struct SetStateDeadband {
  double share = 0;        ///< of the speed
  double floor = 0;        ///< m/s
  Duration max_silence{};  ///< 0 disables the deadband; whole µs
};

/// Clears a latched fault or a Disarm. Can only be used by controllers of the device.
struct Rearm {
  std::uint32_t device = 0;
};

/// Disables all forces from the next step until a Rearm. Can only be used by controllers of the device.
struct Disarm {
  std::uint32_t device = 0;
};

/// Sets a lamp or starts a vibration pulse. The client must hold a channel of the device. Requires kFeatureOutputs.
struct SetOutput {
  std::uint32_t device = 0;
  std::uint32_t output = 0;  ///< index in HandleDescription::outputs
  OutputSetting setting{};   ///< duration of a pulse: whole ms, rounded up
};

/// Asks for the DeviceDescription, or for the HandleDescription if `handle` is set, which requires kFeatureHandle
/// because older servers ignore it.
struct Describe {
  std::uint32_t device = 0;
  bool handle = false;
};

/// Requests the lease of a channel that this client has claimed. Its holder's forces are used.
struct TakeLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

struct GiveLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

/// Server → client: notifies a client that another one has taken the lease.
struct LeaseLost {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string to;  ///< name of the holder; at most 64 bytes
};

/// Couples the client's device to this one. The client must have claimed the channel.
struct Couple {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  PortRole role = PortRole::kLeader;  ///< of the sender
  CouplingMethod method = CouplingMethod::kPositionPosition;
  double position_scale = 1;  ///< follower / leader
  double force_scale = 1;     ///< leader / follower
  Quat rotation{};            ///< leader's base frame → follower's
  std::uint32_t axes = 7;     ///< coupled axes of the leader: 1 x, 2 y, 4 z
  double stiffness = 0;       ///< N/m, felt by the leader, like the dampings
  double mutual_damping = 0;  ///< N·s/m
  double damping = 0;         ///< N·s/m
  bool adapt_to_delay = false;
  bool purse = false;
  Duration period{};          ///< between PortStates; whole µs; > 0, at most 10 s
  bool absolute = false;      ///< without offsets; both ends align first
  double turn_stiffness = 0;  ///< N·m/rad; 0: not coupled
  double turn_damping = 0;    ///< N·m·s/rad
  double grip_stiffness = 0;  ///< N/m at the fingers; 0: not coupled
  double grip_damping = 0;    ///< N·s/m
  double drift_rate = 0;      ///< 1/s, for passivity control
  std::optional<RateControl> rate{};

  bool operator==(const Couple&) const = default;
};

/// Changes the scales while the leader is not engaged or uses its clutch. The client must control the leader's device.
struct SetScale {
  std::uint32_t device = 0;
  double position_scale = 1;  ///< follower / leader; 0.01 … 100
  double force_scale = 1;     ///< leader / follower; 0.01 … 100
};

/// Sets the weight of the leader of that channel. The client must control the follower's device.
struct SetShare {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  double share = 0;  ///< 0 … 1
};

/// Engages the coupling. Can only be used by controllers of the device.
struct Engage {
  std::uint32_t device = 0;
};

/// Disengages the coupling. Can only be used by controllers of the device.
struct Disengage {
  std::uint32_t device = 0;
};

using Request = std::variant<SetStateRate, Rearm, Disarm, Describe, TakeLease, GiveLease, LeaseLost, SetStateDeadband,
                             Couple, Engage, Disengage, SetOutput, SetScale, SetShare>;

struct ChannelDescription {
  std::string name;  ///< at most 24 bytes
  ChannelRule rule = ChannelRule::kSum;
  Duration lease{};      ///< if a holder sends no usable forces for this long, it can be replaced; 0: never
  std::string holder{};  ///< empty if the channel is free; cut to 24 bytes
};

/// Describes a device. Unknown values are 0, unless 0 is a possible value.
struct DeviceDescription {
  struct Box {
    Vec3 min = Vec3::Zero();  ///< m
    Vec3 max = Vec3::Zero();
  };
  std::uint32_t device = 0;
  std::string name{};              ///< at most 24 bytes
  std::string model{};             ///< at most 64 bytes
  std::uint32_t position_dof = 3;  ///< measured axes, 1 … 6
  std::uint32_t force_dof = 3;     ///< actuated axes, 1 … 6
  std::optional<Box> workspace{};
  double max_force = 0;            ///< N, maximum norm
  double continuous_force = 0;     ///< N, without a time limit
  double max_stiffness = 0;        ///< N/m, rendered stably
  double position_resolution = 0;  ///< m, encoder count at the handle; 0 = exact
  std::uint32_t loop_hz = 0;
  std::vector<ChannelDescription> channels{};
};

enum class Hand : std::uint8_t { kAny = 0, kLeft = 1, kRight = 2 };

/// Describes the handle of a device. Together with the longest DeviceDescription, it would not fit into a datagram.
struct HandleDescription {
  std::uint32_t device = 0;
  /// Device base frame → operator's frame: x right, y up, z to the user (core/base/frames.h). Empty if unknown.
  std::optional<Quat> operator_from_device{};
  std::vector<std::string> buttons{};    ///< names by bit; at most 16 of at most 24 bytes
  bool orientation_measured = false;     ///< otherwise `turning` is always empty
  double max_torque = 0;                 ///< N·m, maximum norm; 0: none
  std::optional<double> gripper_open{};  ///< rad; empty: no gripper
  double max_gripper_force = 0;          ///< N, on the fingers; 0: no motor
  std::string group{};                   ///< same for devices of one body; at most 24 bytes
  Hand hand = Hand::kAny;
  /// At most 8 names of at most 24 bytes, in the order of DeviceState::joints. Requires kFeatureJoints.
  std::vector<std::string> joints{};
  /// The index is SetOutput::output. At most 8, with names of at most 24 bytes. Requires kFeatureOutputs.
  std::vector<OutputDescription> outputs{};
};

// Features are only used if both peers name them.

/// Forces can include a local model, which the server evaluates at the position of the hand.
inline constexpr std::string_view kFeatureLocalModel = "local-model";
/// Claims use the names of devices and channels, and the client is notified if it loses a lease.
inline constexpr std::string_view kFeatureChannels = "channels";

inline constexpr std::string_view kFeatureHandle = "handle";  ///< orientation, button names and button states

inline constexpr std::string_view kFeatureJoints = "joints";  ///< joint angles and their names

inline constexpr std::string_view kFeatureOutputs = "outputs";  ///< lamps and vibration, which the client can set

/// The client can be the remote end of a coupling (Couple, PortState). Observers receive the PortStates of both ends.
inline constexpr std::string_view kFeatureTeleoperation = "teleoperation";

/// States of several devices at the same step are sent in columns if this halves the size, using single precision
/// except for positions. For clients with more than seven devices, whose complete states do not fit into a datagram.
inline constexpr std::string_view kFeatureStateColumns = "state-columns";

/// An engine names its solver paths, and each force indicates which one was used.
inline constexpr std::string_view kFeatureWays = "ways";

/// For observers only: requested forces and statistics of loops and engines (DeviceReport, PeerReport).
inline constexpr std::string_view kFeatureDiagnostics = "diagnostics";

/// Claims a device, and a channel if the role is controller.
struct Claim {
  std::string device;   ///< empty: device 0; at most 24 bytes
  std::string channel;  ///< empty: channel 0; at most 24 bytes
  Role role = Role::kObserver;
};

/// The numbers that are used instead of names after the handshake.
struct Grant {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;  ///< observer if another client holds the lease
};

/// The first message of a client, sent again with the cookie of a Retry.
struct Hello {
  std::uint32_t version_min = kProtocolVersion;
  std::uint32_t version_max = kProtocolVersion;
  Role role = Role::kObserver;
  std::string name;                   ///< for logs; at most 64 bytes
  std::vector<std::string> features;  ///< at most 16 of at most 32 bytes
  /// At most 16, without duplicates; `role` is the highest of their roles. Default: device 0, channel 0, `role`.
  std::vector<Claim> claims{};
  std::vector<std::string> ways{};  ///< solver paths, with kFeatureWays; at most limits::kMaxWays of at most 24 bytes
};

struct Welcome {
  std::uint32_t version = 0;
  std::vector<std::string> features;
  Role role = Role::kObserver;
  std::string device_name;
  double max_force = 0;            ///< N
  double position_resolution = 0;  ///< m
  std::uint32_t loop_hz = 0;
  Duration timeout{};  ///< maximum silence of the client
  std::string server;
  /// In the order of the claims; empty if not supported. The fields device_name to loop_hz describe the first device.
  std::vector<Grant> grants{};
};

struct Refused {
  Code code = Code::kInvalid;
  std::string detail;
  std::uint32_t version_min = 0;
  std::uint32_t version_max = 0;
};

}  // namespace tendon
