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

// The messages of the protocol as plain values. tendon.proto defines their encoding and WIRE.md the bytes around them.
// All quantities are in SI units, forces act on the hand, and vectors are expressed in the base frame of the device.

namespace tendon {

/// The version of the wire that this build implements.
inline constexpr std::uint32_t kProtocolVersion = 1;

enum class Role : std::uint8_t {
  kObserver = 1,    ///< sees device states
  kController = 2,  ///< sees device states and sends forces; one per channel
};

/// The reason for which something was refused or ended. The numbers are part of the wire and must not change.
enum class Code : std::uint8_t {
  kOk = 1,
  kInvalid = 2,      ///< the value is not acceptable
  kUnsupported = 3,  ///< this peer does not support the request or the version
  kBusy = 4,         ///< in use, for example by another controller
  kDenied = 5,       ///< not allowed for this role
  kShutdown = 6,     ///< the server is shutting down
  kTimedOut = 7,     ///< the peer was silent for too long
  kExpired = 8,      ///< a session of suite 1 has reached its maximum age; repeat the handshake
  kReplaced = 9,     ///< another program with the same key has taken this place; do not reconnect unasked
};

// The devices of a session and the channels of a device are numbered from 0, below limits::kMaxDevices and
// limits::kMaxChannels. Each channel takes the forces of one engine, and the device renders the combination of its
// channels.

/// Server → client, unreliable, newest wins for each device: the state of the device at one haptic step.
struct DeviceState {
  std::uint64_t tick = 0;             ///< number of the haptic step
  PeerTime sampled{};                 ///< time at which the position was sampled, server clock
  Vec3 position = Vec3::Zero();       ///< m
  Vec3 velocity = Vec3::Zero();       ///< m/s
  Vec3 force_applied = Vec3::Zero();  ///< N, the force that the device actually renders from this step on
  double energy = 0;                  ///< J, the value of the energy ledger at this step
  double permitted_force = 0;         ///< N, the limit of the limiter at this step; +infinity if there is none
  std::uint32_t reasons = 0;          ///< why the force differs from the wanted one: bits of Reason
  std::uint64_t force_sequence = 0;   ///< sequence of the ForceCommand being rendered; 0 = none
  Duration force_age{};               ///< time since that force arrived; 0 if there is none
  Mode mode = Mode::kIdle;
  std::uint32_t device = 0;
  std::uint32_t channel = 0;  ///< the channel that `force_sequence`, `force_age` and `mode` describe
  /// N, the force that the engines ask for at this step, after hold or local model and before any limit. Sent only to
  /// an observer that named kFeatureDiagnostics.
  std::optional<Vec3> force_wanted{};
  /// N/m, −∂force_wanted/∂position of the engines' models at this step. Sent to the same observers as force_wanted;
  /// empty if there is no model.
  std::optional<Mat3> stiffness_wanted{};
  /// Bit i is set while button i is held. Sent only to a client that named kFeatureHandle, otherwise 0. A press between
  /// two states of a client is reported in the next state that it is sent.
  std::uint32_t buttons = 0;
  // The rest of the handle is sent only to a client that named kFeatureHandle.
  std::optional<Turning> turning{};      ///< empty if the device does not measure its orientation
  std::optional<Vec3> torque_applied{};  ///< N·m, on the hand, from this step on; empty if no motor turns the handle
  std::optional<Grip> grip{};            ///< empty if there is no gripper
  std::optional<double> grip_applied{};  ///< N, on the fingers, > 0 opens them; empty if the gripper has no motor
  std::optional<Vec3> hand_force{};      ///< N, of the hand on the handle; empty if there is no force sensor
  /// In the order of HandleDescription::joints. Sent only to a client that named kFeatureJoints; empty if the device
  /// does not report them.
  std::optional<Joints> joints{};
};

/// Client → server, unreliable, newest wins for each device and channel: the force computed by the physics engine.
struct ForceCommand {
  std::uint64_t sequence = 0;       ///< 1, 2, 3 … per session, device and channel
  std::uint64_t based_on_tick = 0;  ///< DeviceState::tick from which the force was computed
  Vec3 force = Vec3::Zero();        ///< N, on the hand
  std::optional<LocalModel> model{};
  Duration valid_for{};  ///< counted from arrival; > 0, at most 10 s; travels in whole µs, rounded up
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  bool topology_changed = false;         ///< the body was cut or torn since the last answer: no model is used
  std::optional<double> error{};         ///< N, the engine's estimate of the error of `force`
  std::optional<RemoteTorque> torque{};  ///< only to a server that agreed to kFeatureHandle, like `grip_force`
  std::optional<double> grip_force{};    ///< N, on the fingers; > 0 opens them
  /// The index, from 1 on, of the entry of Hello::ways that produced the force, at most limits::kMaxWays; 0 if it is
  /// not specified. Only to a server that agreed to kFeatureWays.
  std::uint32_t way = 0;
};

/// Two quantiles of a delay. They can be negative only where two clocks had to be compared.
struct Delays {
  Duration median{};
  Duration p99{};
};

/// Forces that a receiver cannot use because of an error in the engine, by kind.
struct RefusedForces {
  std::uint64_t not_finite = 0;     ///< the force, its model or its error contains NaN or infinity
  std::uint64_t out_of_bounds = 0;  ///< a value exceeds its bound (WIRE.md), or `valid_for` or `sequence` is 0
  std::uint64_t unknown_tick = 0;   ///< `based_on_tick` never existed or is more than 4096 ticks old
  std::uint64_t old_sequence = 0;   ///< `sequence` has not increased although the datagram is the newest
  bool operator==(const RefusedForces&) const = default;
};

/// Server → client, unreliable, newest wins: a report on the client's forces and datagrams. It is sent once per `span`
/// while forces arrive, are missing or are refused. Delays are absent if nothing was measured; one-way delays have an
/// error of at most `clock_error`.
struct LinkReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … per session
  PeerTime until{};          ///< end of the reported time, server clock
  Duration span{};           ///< length of the reported time
  // In that time:
  std::uint64_t forces = 0;        ///< forces received
  std::uint64_t late_server = 0;   ///< late because the server sent a state late
  std::uint64_t late_network = 0;  ///< late because of the network in either direction
  std::uint64_t late_engine = 0;   ///< late because the engine took longer than usual
  Duration worst_late{};           ///< longest time that the device had no valid force
  Duration longest_gap{};          ///< longest silence of the client
  std::optional<Delays> round_trip;
  std::optional<Delays> to_server;
  std::optional<Delays> to_client;
  Duration clock_offset{};     ///< the client's clock minus the server's clock
  double clock_drift_ppm = 0;  ///< rate at which clock_offset grows
  Duration clock_error{};      ///< |true offset − clock_offset| is at most this
  // Datagrams of the client since the session opened:
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t reordered = 0;
  std::uint64_t duplicated = 0;
  std::string words;  ///< why forces were late or refused, for people; empty if none was. At most 128 bytes
  // In the reported time:
  std::uint64_t late_unknown = 0;  ///< late forces whose cause is unknown because the client is silent
  /// sum over all channels of the client, since some of these forces have no readable channel
  RefusedForces refused{};
};

/// The state of a device between connection and force output. The numbers are part of the wire and must not change.
enum class Safety : std::uint8_t {
  kAbsent = 1,     ///< not connected
  kOpening = 2,    ///< being opened
  kFirmware = 3,   ///< has no firmware yet, or is receiving it
  kUnhomed = 4,    ///< not homed yet: its position is unknown
  kHomed = 5,      ///< ready and waiting to be armed
  kArmed = 6,      ///< renders forces
  kFault = 7,      ///< a fault occurred while armed; no force until it is armed again
  kUnguarded = 8,  ///< ready; the scene has no safety layer, so there is nothing to arm
};

/// Histogram of the wake-up delays of a loop. Bucket [0] counts steps at most 1 µs after they were due, bucket [i]
/// those later than 2^(i−1) µs and at most 2^i µs, and the last bucket all later ones.
using LatenessHistogram = std::array<std::uint64_t, limits::kLatenessBuckets>;

/// Returns the bucket for a step that ran `late` after it was due.
constexpr std::size_t lateness_bucket(Duration late) noexcept {
  // rounded down just below whole µs: exactly 2 µs belongs to the lower bucket
  const std::int64_t us = late.count() <= 0 ? 0 : (late.count() - 1) / 1000;
  const auto bucket = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us)));
  return std::min(bucket, limits::kLatenessBuckets - 1);
}

/// Either direction, unreliable: the state of one end of a coupling of two devices, sent to the other end. Observers
/// are sent both ends. For each device, channel and end, the highest sequence of the highest epoch wins. Only between
/// peers that both named kFeatureTeleoperation.
struct PortFrame : PortState {
  std::uint32_t device = 0;  ///< device of the session's server, in both directions
  std::uint32_t channel = 0;
  bool of_peer = false;  ///< to an observer: this is the remote end of the coupling
};

/// Server → client, unreliable, newest wins for each device: statistics of its haptic loop. Sent once a second to an
/// observer of the device that named kFeatureDiagnostics. All counts refer to the reported time.
struct DeviceReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … per device
  PeerTime until{};          ///< end of the reported time, server clock
  Duration span{};           ///< length of the reported time
  std::uint32_t device = 0;
  std::uint64_t steps = 0;     ///< haptic steps
  std::uint64_t missed = 0;    ///< periods without a step because the previous step ran late
  std::uint64_t overruns = 0;  ///< steps so late that they set Reason::kOverrun
  std::uint64_t unseen = 0;    ///< steps in which the device returned no position
  /// The sum is at most `steps`. It is smaller only if the server lost count of some steps.
  LatenessHistogram lateness{};
  Safety safety = Safety::kAbsent;
  std::string fault{};     ///< why there is no force until it is armed or rearmed; empty: no fault. At most 128 bytes
  std::string degraded{};  ///< what the server has reduced at present; empty: nothing. At most 128 bytes
};

/// Server → client, unreliable, newest wins for each device and channel: statistics of the engine that sends the forces
/// of the channel. Sent once a second to an observer of the device that named kFeatureDiagnostics.
struct PeerReport {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string name{};  ///< of the engine; at most 64 bytes
  /// the server sends it one of every `state_one_in` states that it asked for, because its link is congested
  std::uint32_t state_one_in = 1;
  bool forces_refused = false;  ///< its forces are ignored because its link loses too many datagrams
  LinkReport link{};            ///< `number`: 1, 2, 3 … of the channel; the forces are the channel's
  // The least certain force of that time by ForceCommand::error, or the newest one if no force carries an error.
  std::optional<double> error{};  ///< N; empty if no force carries an error
  std::string way{};  ///< the entry of Hello::ways that produced it; empty if not specified. At most 24 bytes
};

/// Client → server, reliable: the number of states per second that this client wants of a device. The server uses the
/// nearest rate that divides its own rate, and never a higher one.
struct SetStateRate {
  std::uint32_t hz = 0;
  std::uint32_t device = 0;
};

/// Client → server, reliable: omit the states that the client can predict. See StateDeadband; limits.h has the bounds.
struct SetStateDeadband {
  double share = 0;        ///< fraction of the speed
  double floor = 0;        ///< m/s
  Duration max_silence{};  ///< 0: every state is sent, as without this request; travels in whole µs
};

/// Client → server, reliable: clears a latched fault and revokes a Disarm. Only from a controller of the device.
struct Rearm {
  std::uint32_t device = 0;
};

/// Client → server, reliable: no force from the next haptic step on, until a Rearm. Only from a controller of the
/// device.
struct Disarm {
  std::uint32_t device = 0;
};

/// Client → server, reliable: sets a lamp or starts a vibration pulse. Only from a controller that holds a channel of
/// the device, and only to a server that agreed to kFeatureOutputs.
struct SetOutput {
  std::uint32_t device = 0;
  std::uint32_t output = 0;  ///< index in HandleDescription::outputs
  OutputSetting setting{};   ///< a pulse's duration travels in whole ms, rounded up
};

/// Client → server, reliable: asks for the DeviceDescription, or, if `handle` is set, for the HandleDescription. Set
/// `handle` only if the server agreed to kFeatureHandle: an older server ignores it.
struct Describe {
  std::uint32_t device = 0;
  bool handle = false;
};

/// Client → server, reliable: requests the lease of a channel, whose holder's forces the channel takes. Only from a
/// client that claimed the channel.
struct TakeLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

/// Client → server, reliable: gives up the lease of a channel.
struct GiveLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

/// Server → client, reliable: the client has lost the lease of a channel.
struct LeaseLost {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string to;  ///< name of the new holder; at most 64 bytes
};

/// Client → server, reliable: couples the client's device to this one, with the settings of the client's end. Only from
/// a client that claimed the channel.
struct Couple {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  PortRole role = PortRole::kLeader;  ///< role of the sender
  CouplingMethod method = CouplingMethod::kPositionPosition;
  double position_scale = 1;  ///< follower / leader
  double force_scale = 1;     ///< leader / follower
  Quat rotation{};            ///< from the leader's base frame to the follower's
  std::uint32_t axes = 7;     ///< bits 1, 2, 4: the axes x, y, z of the leader's frame are coupled
  double stiffness = 0;       ///< N/m; this and the dampings as felt by the leader
  double mutual_damping = 0;  ///< N·s/m
  double damping = 0;         ///< N·s/m
  bool adapt_to_delay = false;
  bool purse = false;
  Duration period{};          ///< time between two PortStates; travels in whole µs; > 0, at most 10 s
  bool absolute = false;      ///< the offsets are zero, and both ends align first
  double turn_stiffness = 0;  ///< N·m/rad; 0: orientations are not coupled
  double turn_damping = 0;    ///< N·m·s/rad
  double grip_stiffness = 0;  ///< N/m at the fingers; 0: grippers are not coupled
  double grip_damping = 0;    ///< N·s/m
  double drift_rate = 0;      ///< 1/s, drift rate of the passivity control
  std::optional<RateControl> rate{};

  bool operator==(const Couple&) const = default;
};

/// Client → server, reliable: new scales of a coupling, while the leader is not engaged or holds its clutch. Only from
/// a controller of the leader's device.
struct SetScale {
  std::uint32_t device = 0;
  double position_scale = 1;  ///< follower / leader; 0.01 … 100
  double force_scale = 1;     ///< leader / follower; 0.01 … 100
};

/// Client → server, reliable: the weight of the leader of that channel among several leaders. Only from a controller of
/// the follower's device.
struct SetShare {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  double share = 0;  ///< 0 … 1
};

/// Client → server, reliable: the operator engages the coupling. Only from a controller of the device.
struct Engage {
  std::uint32_t device = 0;
};

/// Client → server, reliable: the operator disengages the coupling. Only from a controller of the device.
struct Disengage {
  std::uint32_t device = 0;
};

using Request = std::variant<SetStateRate, Rearm, Disarm, Describe, TakeLease, GiveLease, LeaseLost, SetStateDeadband,
                             Couple, Engage, Disengage, SetOutput, SetScale, SetShare>;

struct ChannelDescription {
  std::string name;  ///< at most 24 bytes
  ChannelRule rule = ChannelRule::kSum;
  /// Another controller may take over from a holder that sends no usable force for this long; 0 = the holder stays
  /// until it leaves.
  Duration lease{};
  std::string holder{};  ///< name of the client whose forces it takes; empty: none; cut to 24 bytes
};

/// Properties of a device. Where a value cannot be 0, 0 means that it is not known.
struct DeviceDescription {
  struct Box {
    Vec3 min = Vec3::Zero();  ///< m
    Vec3 max = Vec3::Zero();
  };
  std::uint32_t device = 0;
  std::string name{};              ///< name on the server; at most 24 bytes
  std::string model{};             ///< at most 64 bytes
  std::uint32_t position_dof = 3;  ///< measured axes, 1 … 6
  std::uint32_t force_dof = 3;     ///< actuated axes, 1 … 6
  std::optional<Box> workspace{};  ///< range of the handle position
  double max_force = 0;            ///< N, largest norm of the force
  double continuous_force = 0;     ///< N, largest norm that it can render without a time limit
  double max_stiffness = 0;        ///< N/m, largest stiffness that it renders stably
  double position_resolution = 0;  ///< m, one encoder count at the handle; 0 = exact
  std::uint32_t loop_hz = 0;       ///< haptic steps per second
  std::vector<ChannelDescription> channels{};
};

/// The hand for which a device is meant.
enum class Hand : std::uint8_t { kAny = 0, kLeft = 1, kRight = 2 };

/// Properties of the handle of a device. This is a separate message because it does not fit into one datagram together
/// with the longest DeviceDescription.
struct HandleDescription {
  std::uint32_t device = 0;
  /// Rotates from the base frame to the operator's frame, x right, y up, z to the user (core/base/frames.h); empty:
  /// unknown.
  std::optional<Quat> operator_from_device{};
  std::vector<std::string> buttons{};    ///< names by bit of DeviceState::buttons; at most 16 of at most 24 bytes
  bool orientation_measured = false;     ///< if false, no state has `turning`
  double max_torque = 0;                 ///< N·m, largest norm of the torque; 0 = none
  std::optional<double> gripper_open{};  ///< rad, opening of the open gripper; empty: no gripper
  double max_gripper_force = 0;          ///< N, on the fingers; 0 = it has no motor
  std::string group{};                   ///< shared by the devices of one body; at most 24 bytes; empty: no group
  Hand hand = Hand::kAny;
  /// Names of the joints, in the order of DeviceState::joints; at most 8 of at most 24 bytes. Sent only to a client
  /// that named kFeatureJoints; empty if the device does not report joints.
  std::vector<std::string> joints{};
  /// The outputs, indexed by SetOutput::output; at most 8, with names of at most 24 bytes. Sent only to a client that
  /// named kFeatureOutputs.
  std::vector<OutputDescription> outputs{};
};

/// Feature: the client may send a local model with its forces, and the server evaluates it at the position of the hand.
inline constexpr std::string_view kFeatureLocalModel = "local-model";
/// Feature: the client claims devices and channels by name and is notified when it loses a lease.
inline constexpr std::string_view kFeatureChannels = "channels";

/// Feature: the client receives the orientation of the device relative to the operator, the names of its buttons, and
/// which are held.
inline constexpr std::string_view kFeatureHandle = "handle";

/// Feature: the client receives the joint angles in each state and the names of the joints in HandleDescription.
inline constexpr std::string_view kFeatureJoints = "joints";

/// Feature: the client receives the list of outputs of the device (lamps, vibration) and may set them.
inline constexpr std::string_view kFeatureOutputs = "outputs";

/// Feature: the client may be the remote end of a coupling. It sends Couple, and PortStates travel in both directions.
/// An observer receives those of both ends.
inline constexpr std::string_view kFeatureTeleoperation = "teleoperation";

/// Feature: the states of several devices at one step are sent in columns if that halves the bytes, with all values
/// except positions in single precision. For clients with more than seven devices, whose full states do not fit into
/// one datagram.
inline constexpr std::string_view kFeatureStateColumns = "state-columns";

/// Feature: an engine names its solver paths and each force says which one produced it. Other servers are sent the
/// forces without that index.
inline constexpr std::string_view kFeatureWays = "ways";

/// Feature: an observer receives the forces that the engines ask for and statistics of loops and engines (DeviceReport,
/// PeerReport). It is not granted to controllers.
inline constexpr std::string_view kFeatureDiagnostics = "diagnostics";

/// A client's claim of a device and, as a controller, of one of its channels, by name.
struct Claim {
  std::string device;   ///< empty: device 0; at most 24 bytes
  std::string channel;  ///< empty: channel 0; at most 24 bytes
  Role role = Role::kObserver;
};

/// The numbers that replace the names of a claim from now on.
struct Grant {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;  ///< kObserver for a controller's claim: another client holds the lease, see TakeLease
};

/// The first message of a client. It is repeated with the server's cookie after a Retry.
struct Hello {
  std::uint32_t version_min = kProtocolVersion;
  std::uint32_t version_max = kProtocolVersion;
  Role role = Role::kObserver;
  std::string name;                   ///< for logs; at most 64 bytes
  std::vector<std::string> features;  ///< offered features; the intersection is used. At most 16 of at most 32 bytes
  /// No duplicates; at most 16. If empty: device 0, its channel 0, and `role`. Otherwise `role` is the highest of their
  /// roles.
  std::vector<Claim> claims{};
  /// With kFeatureWays: the names of the engine's solver paths. At most limits::kMaxWays, each of at most 24 bytes.
  std::vector<std::string> ways{};
};

/// The answer that admits a client.
struct Welcome {
  std::uint32_t version = 0;
  std::vector<std::string> features;  ///< features that both peers support
  Role role = Role::kObserver;
  std::string device_name;
  double max_force = 0;            ///< N
  double position_resolution = 0;  ///< m
  std::uint32_t loop_hz = 0;       ///< haptic steps per second
  Duration timeout{};              ///< silence after which the server drops this client
  std::string server;              ///< name and version of the server
  /// One for each claim, in their order; device_name … loop_hz describe the device of the first one. A server without
  /// support for claims returns none, which is equivalent to a Hello without claims.
  std::vector<Grant> grants{};
};

/// The answer that refuses a client.
struct Refused {
  Code code = Code::kInvalid;
  std::string detail;
  std::uint32_t version_min = 0;
  std::uint32_t version_max = 0;
};

}  // namespace tendon
