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

// What peers say to each other, as plain values. tendon.proto holds the same nouns as bytes, WIRE.md
// the bytes around them; codec.h turns one into the other and is the only place that knows protobuf.
// SI units; forces are on the hand; vectors are in the device base frame.

namespace tendon {

/// The version of the wire that this build speaks.
inline constexpr std::uint32_t kProtocolVersion = 1;

enum class Role : std::uint8_t {
  kObserver = 1,    ///< sees device states
  kController = 2,  ///< sees device states and sends forces; one per channel
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

// Devices of a session and channels of a device are numbered from 0: below limits::kMaxDevices and kMaxChannels. A
// channel is where one engine's forces come in; the device renders what its channels make together.

/// Server → client, unreliable, newest wins for each device: the device at one haptic step.
struct DeviceState {
  std::uint64_t tick = 0;             ///< number of the haptic step
  PeerTime sampled{};                 ///< when the position was sampled, server clock
  Vec3 position = Vec3::Zero();       ///< m
  Vec3 velocity = Vec3::Zero();       ///< m/s
  Vec3 force_applied = Vec3::Zero();  ///< N, what the device really gives out from this step on
  double energy = 0;                  ///< J, the energy ledger at this step
  double permitted_force = 0;         ///< N, the limiter's bound at this step; +infinity when there is none
  std::uint32_t reasons = 0;          ///< why the force is not what was asked for: bits of Reason
  std::uint64_t force_sequence = 0;   ///< ForceCommand rendered now; 0 = none
  Duration force_age{};               ///< its age since it arrived; 0 when none
  Mode mode = Mode::kIdle;
  std::uint32_t device = 0;
  std::uint32_t channel = 0;  ///< of the force that `force_sequence`, `force_age` and `mode` are about
  /// N, what the engines ask for at this step, after hold or local model and before any limit. Only to an observer that
  /// named kFeatureDiagnostics; empty: not told.
  std::optional<Vec3> force_wanted{};
  /// N/m, −∂force_wanted/∂position as the engines' models say it at this step, and to whom force_wanted is told; empty:
  /// no model.
  std::optional<Mat3> stiffness_wanted{};
  /// Bit i is set while button i is held. Only to a client that named kFeatureHandle, else 0. A press that fell between
  /// two states of a client is in the next state that it is sent.
  std::uint32_t buttons = 0;
  // The rest of the handle, only to a client that named kFeatureHandle:
  std::optional<Turning> turning{};      ///< empty: the device does not measure its orientation
  std::optional<Vec3> torque_applied{};  ///< N·m, on the hand, from this step on; empty: it has no motors that turn
  std::optional<Grip> grip{};            ///< empty: it has no gripper
  std::optional<double> grip_applied{};  ///< N, on the fingers, > 0 opens them; empty: the gripper has no motor
  std::optional<Vec3> hand_force{};      ///< N, of the hand on the handle; empty: it has no force sensor
  /// In the order of HandleDescription::joints. Only to a client that named kFeatureJoints; empty: it tells none.
  std::optional<Joints> joints{};
};

/// Client → server, unreliable, newest wins for each device and channel: the force that the physics engine wants.
struct ForceCommand {
  std::uint64_t sequence = 0;       ///< 1, 2, 3 … per session, device and channel
  std::uint64_t based_on_tick = 0;  ///< DeviceState::tick of that device that it was computed from
  Vec3 force = Vec3::Zero();        ///< N, on the hand
  std::optional<LocalModel> model{};
  Duration valid_for{};  ///< counted from arrival; > 0, at most 10 s; travels in whole µs, rounded up
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  bool topology_changed = false;  ///< the body has been cut or torn since the answer before: no model is relied on
  std::optional<double> error{};  ///< N, what the engine thinks that `force` may be wrong by
  std::optional<RemoteTorque> torque{};  ///< only to a server that has agreed to kFeatureHandle; so is the next
  std::optional<double> grip_force{};    ///< N, on the fingers; > 0 opens them
  /// Which of Hello::ways has answered, from 1 on, at most limits::kMaxWays; 0: not said. Only to a server that has
  /// agreed to kFeatureWays.
  std::uint32_t way = 0;
};

/// Two quantiles of a delay; below zero only where two clocks had to be compared.
struct Delays {
  Duration median{};
  Duration p99{};
};

/// Forces that a receiver cannot use: the mistakes of an engine's author, by kind.
struct RefusedForces {
  std::uint64_t not_finite = 0;     ///< a number of the force, its model or its error is NaN or infinite
  std::uint64_t out_of_bounds = 0;  ///< … or beyond its bound (WIRE.md); so are `valid_for` 0 and `sequence` 0
  std::uint64_t unknown_tick = 0;   ///< `based_on_tick` never was, or was more than 4096 ticks ago
  std::uint64_t old_sequence = 0;   ///< `sequence` has not grown, though the datagram is the newest
  bool operator==(const RefusedForces&) const = default;
};

/// Server → client, unreliable, newest wins: what became of the client's forces and datagrams. Once in `span` while its
/// forces come, or are missing, or are refused. Delays are absent where nothing was measured; those of one way are
/// known ± `clock_error`.
struct LinkReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … per session
  PeerTime until{};          ///< end of the time it tells of, server clock
  Duration span{};           ///< … and its length
  // In that time:
  std::uint64_t forces = 0;        ///< that came
  std::uint64_t late_server = 0;   ///< late ones, because the server sent a state late
  std::uint64_t late_network = 0;  ///< … because of the way there and back
  std::uint64_t late_engine = 0;   ///< … because the engine took longer than usual
  Duration worst_late{};           ///< longest time that the device was without a valid force
  Duration longest_gap{};          ///< longest time that nothing was heard of the client
  std::optional<Delays> round_trip;
  std::optional<Delays> to_server;
  std::optional<Delays> to_client;
  Duration clock_offset{};     ///< the client's clock less the server's
  double clock_drift_ppm = 0;  ///< how fast that grows
  Duration clock_error{};      ///< |true offset − clock_offset| is at most this
  // Datagrams of the client since the session opened:
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t reordered = 0;
  std::uint64_t duplicated = 0;
  std::string words;  ///< why forces were late or refused, for people; empty when none was. At most 128 bytes
  // In the time that it tells of:
  std::uint64_t late_unknown = 0;  ///< late forces whose cause is not known yet: nothing is heard of the client
  RefusedForces refused{};         ///< of all the client's channels together: some name none that can be read
};

/// Where a device stands between the plug and the force. Part of the wire: never renumber.
enum class Safety : std::uint8_t {
  kAbsent = 1,     ///< not plugged in
  kOpening = 2,    ///< being opened
  kFirmware = 3,   ///< has, or is being given, no firmware yet
  kUnhomed = 4,    ///< does not know where it is yet
  kHomed = 5,      ///< ready, and waiting to be armed
  kArmed = 6,      ///< gives forces
  kFault = 7,      ///< was armed, and something happened: no force until it is armed again
  kUnguarded = 8,  ///< ready; its scene lists no safety layer, so that there is nothing to arm
};

/// How late a loop woke, in steps: [0] at most 1 µs after they were due, [i] later than 2^(i−1) µs and at most 2^i µs,
/// the last all that were later still.
using LatenessHistogram = std::array<std::uint64_t, limits::kLatenessBuckets>;

/// The bucket that counts a step `late` after it was due.
constexpr std::size_t lateness_bucket(Duration late) noexcept {
  const std::int64_t us = late.count() <= 0 ? 0 : (late.count() - 1) / 1000;  // whole ones below it: 2 µs is not later
  const auto bucket = static_cast<std::size_t>(std::bit_width(static_cast<std::uint64_t>(us)));
  return std::min(bucket, limits::kLatenessBuckets - 1);
}

/// Either way, unreliable: one end of a coupling of two devices, told to the other; and both ends to an observer. For
/// each device, channel and end the highest sequence of the highest epoch wins. Only between peers that both named
/// kFeatureTeleoperation.
struct PortFrame : PortState {
  std::uint32_t device = 0;  ///< of the server of the session, whichever way this goes
  std::uint32_t channel = 0;
  bool of_peer = false;  ///< to an observer: of the other end of the device's coupling
};

/// Server → client, unreliable, newest wins for each device: how its loop does. Once a second, to an observer of it
/// that named kFeatureDiagnostics. Numbers of things are of the time that it tells of.
struct DeviceReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … of the device
  PeerTime until{};          ///< end of the time it tells of, server clock
  Duration span{};           ///< … and its length
  std::uint32_t device = 0;
  std::uint64_t steps = 0;     ///< haptic steps
  std::uint64_t missed = 0;    ///< periods without a step, because the one before came so late
  std::uint64_t overruns = 0;  ///< steps so long after the one before that it is a reason (Reason::kOverrun)
  std::uint64_t unseen = 0;    ///< steps in which the device gave no position
  /// Together at most `steps`, and fewer only where the server lost count of some.
  LatenessHistogram lateness{};
  Safety safety = Safety::kAbsent;
  std::string fault{};     ///< why it gives no force until it is armed or rearmed; empty: no fault. At most 128 bytes
  std::string degraded{};  ///< what the server does less of at present; empty: nothing. At most 128 bytes
};

/// Server → client, unreliable, newest wins for each device and channel: how the engine does whose forces a channel
/// takes. Once a second, to an observer of the device that named kFeatureDiagnostics.
struct PeerReport {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string name{};              ///< of the engine; at most 64 bytes
  std::uint32_t state_one_in = 1;  ///< of the states that it wants, it is sent one in so many: its way is full
  bool forces_refused = false;     ///< its forces are not taken: its way loses too much
  LinkReport link{};               ///< `number`: 1, 2, 3 … of the channel; the forces are the channel's
  // Of the force of that time that is least sure, by its ForceCommand::error; the newest where none says an error.
  std::optional<double> error{};  ///< N; empty: none says it
  std::string way{};  ///< of Hello::ways, the one by which it was answered; empty: not said. At most 24 bytes
};

/// Client → server, reliable: how many states of a device per second this client wants. The server sends
/// the nearest rate that divides its own, and never more.
struct SetStateRate {
  std::uint32_t hz = 0;
  std::uint32_t device = 0;
};

/// Client → server, reliable: leave out the states that I can foretell. See StateDeadband; the bounds are in limits.h.
struct SetStateDeadband {
  double share = 0;        ///< of the speed
  double floor = 0;        ///< m/s
  Duration max_silence{};  ///< 0: every state is sent, as before this was asked; travels in whole µs
};

/// Client → server, reliable: clears a latched fault, and takes a Disarm back. Only from a controller of the device.
struct Rearm {
  std::uint32_t device = 0;
};

/// Client → server, reliable: no force from the next haptic step on, until a Rearm. Only from a controller of the
/// device.
struct Disarm {
  std::uint32_t device = 0;
};

/// Client → server, reliable: sets a lamp, or starts a pulse. Only from a controller of the device that holds a channel
/// of it, to a server that has agreed to kFeatureOutputs.
struct SetOutput {
  std::uint32_t device = 0;
  std::uint32_t output = 0;  ///< its number in HandleDescription::outputs
  OutputSetting setting{};   ///< a pulse's duration travels in whole ms, rounded up
};

/// Client → server, reliable: what a device is and can do; answered with a DeviceDescription, or, when `handle` is
/// asked for, with a HandleDescription. The latter only of a server that has agreed to kFeatureHandle: an older one
/// does not know the difference.
struct Describe {
  std::uint32_t device = 0;
  bool handle = false;
};

/// Client → server, reliable: I want to be the one whose forces this channel takes. Only from one that claimed it.
struct TakeLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

/// Client → server, reliable: I do not want to be it any more.
struct GiveLease {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
};

/// Server → client, reliable: you are not it any more.
struct LeaseLost {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  std::string to;  ///< name of the one that is; at most 64 bytes
};

/// Client → server, reliable: my device is the other end of this one, and my end is like this. Only from one that
/// claimed the channel.
struct Couple {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  PortRole role = PortRole::kLeader;  ///< of the sender
  CouplingMethod method = CouplingMethod::kPositionPosition;
  double position_scale = 1;  ///< follower over leader
  double force_scale = 1;     ///< leader over follower
  Quat rotation{};            ///< turns the leader's base frame into the follower's
  std::uint32_t axes = 7;     ///< bits 1, 2, 4: x, y, z of the leader's frame are coupled
  double stiffness = 0;       ///< N/m; these as the leader feels them
  double mutual_damping = 0;  ///< N·s/m
  double damping = 0;         ///< N·s/m
  bool adapt_to_delay = false;
  bool purse = false;
  Duration period{};          ///< between two PortStates; travels in whole µs; > 0, at most 10 s
  bool absolute = false;      ///< offsets are zero, and the two align first
  double turn_stiffness = 0;  ///< N·m/rad; 0: the orientations are not coupled
  double turn_damping = 0;    ///< N·m·s/rad
  double grip_stiffness = 0;  ///< N/m at the fingers; 0: the grippers are not coupled
  double grip_damping = 0;    ///< N·s/m
  double drift_rate = 0;      ///< 1/s, of passivity
  std::optional<RateControl> rate{};

  bool operator==(const Couple&) const = default;
};

/// Client → server, reliable: the scales of a coupling from now on, while the leader is not engaged or holds its
/// clutch. Only from a controller of the leader's device.
struct SetScale {
  std::uint32_t device = 0;
  double position_scale = 1;  ///< follower over leader; 0.01 … 100
  double force_scale = 1;     ///< leader over follower; 0.01 … 100
};

/// Client → server, reliable: how much the leader of that channel counts among several. Only from a controller of the
/// follower's device.
struct SetShare {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  double share = 0;  ///< 0 … 1
};

/// Client → server, reliable: the operator's act, which couples the handles. Only from a controller of the device.
struct Engage {
  std::uint32_t device = 0;
};

/// Client → server, reliable: the end of that. Only from a controller of the device.
struct Disengage {
  std::uint32_t device = 0;
};

using Request = std::variant<SetStateRate, Rearm, Disarm, Describe, TakeLease, GiveLease, LeaseLost, SetStateDeadband,
                             Couple, Engage, Disengage, SetOutput, SetScale, SetShare>;

struct ChannelDescription {
  std::string name;  ///< at most 24 bytes
  ChannelRule rule = ChannelRule::kSum;
  /// A holder that sends no usable force for so long may be followed by another; 0 = it stays until it leaves.
  Duration lease{};
  std::string holder{};  ///< whose forces it takes; empty = nobody's; cut to 24 bytes
};

/// What a device is and can do. 0 = not known, where a value cannot be 0.
struct DeviceDescription {
  struct Box {
    Vec3 min = Vec3::Zero();  ///< m
    Vec3 max = Vec3::Zero();
  };
  std::uint32_t device = 0;
  std::string name{};              ///< as the server calls it; at most 24 bytes
  std::string model{};             ///< what it is; at most 64 bytes
  std::uint32_t position_dof = 3;  ///< axes that are measured, 1 … 6
  std::uint32_t force_dof = 3;     ///< axes with a motor, 1 … 6
  std::optional<Box> workspace{};  ///< the handle stays within
  double max_force = 0;            ///< N, norm of the force the device can give out
  double continuous_force = 0;     ///< N, … for ever
  double max_stiffness = 0;        ///< N/m, what it can render stably
  double position_resolution = 0;  ///< m, one encoder count at the handle; 0 = exact
  std::uint32_t loop_hz = 0;       ///< haptic steps per second
  std::vector<ChannelDescription> channels{};
};

/// Which hand holds a device.
enum class Hand : std::uint8_t { kAny = 0, kLeft = 1, kRight = 2 };

/// What the handle of a device is and can do. It is a message of its own because it would not fit beside the longest
/// DeviceDescription into one datagram.
struct HandleDescription {
  std::uint32_t device = 0;
  /// Turns the base frame into the operator's, x right, y up, z to the user (core/base/frames.h); empty: not known.
  std::optional<Quat> operator_from_device{};
  std::vector<std::string> buttons{};    ///< names by bit of DeviceState::buttons; at most 16 of at most 24 bytes
  bool orientation_measured = false;     ///< else no state has `turning`
  double max_torque = 0;                 ///< N·m, norm of the torque that the device can give out; 0 = none
  std::optional<double> gripper_open{};  ///< rad, the opening of the open gripper; empty: no gripper
  double max_gripper_force = 0;          ///< N, on the fingers; 0 = it has no motor
  std::string group{};                   ///< devices of one body have the same; at most 24 bytes; empty: by itself
  Hand hand = Hand::kAny;
  /// Names of the joints, by their place in DeviceState::joints; at most 8 of at most 24 bytes. Only to a client that
  /// named kFeatureJoints; empty: the device tells none.
  std::vector<std::string> joints{};
  /// What SetOutput sets, by number; at most 8, with names of at most 24 bytes. Only to a client that named
  /// kFeatureOutputs; empty: there are none.
  std::vector<OutputDescription> outputs{};
};

/// A feature: the client may send a local model with its forces, and the server follows the hand with it.
inline constexpr std::string_view kFeatureLocalModel = "local-model";
/// A feature: the client claims devices and channels by name, and can be told that it has lost a lease.
inline constexpr std::string_view kFeatureChannels = "channels";

/// A feature: the client is told how the device lies before the operator, its buttons' names, and which are held.
inline constexpr std::string_view kFeatureHandle = "handle";

/// A feature: the client is told the angles of the device's joints in each state, and their names in HandleDescription.
inline constexpr std::string_view kFeatureJoints = "joints";

/// A feature: the client is told the outputs of the device (lamps, vibration), and may set them.
inline constexpr std::string_view kFeatureOutputs = "outputs";

/// A feature: the client may be the other end of a coupling: it says Couple, and PortStates go both ways. An observer
/// is sent those of both ends.
inline constexpr std::string_view kFeatureTeleoperation = "teleoperation";

/// A feature: states of several devices at one step come together in columns, where it takes half the bytes: all but
/// positions in single precision. For a client with more devices than seven, whose whole states fit one datagram.
inline constexpr std::string_view kFeatureStateColumns = "state-columns";

/// A feature: an engine names the ways in which it answers, and says of each force which one it was. A server that does
/// not know it is sent the forces without that.
inline constexpr std::string_view kFeatureWays = "ways";

/// A feature: an observer is told what the engines ask for, and how the loops and the engines do (DeviceReport,
/// PeerReport). A controller that names it is not granted it.
inline constexpr std::string_view kFeatureDiagnostics = "diagnostics";

/// What a client wants of a server: a device, and of a controller a channel of it, by their names.
struct Claim {
  std::string device;   ///< empty: device 0; at most 24 bytes
  std::string channel;  ///< empty: channel 0; at most 24 bytes
  Role role = Role::kObserver;
};

/// What it gets: the numbers that stand for the names from now on.
struct Grant {
  std::uint32_t device = 0;
  std::uint32_t channel = 0;
  Role role = Role::kObserver;  ///< kObserver to a controller's claim: another one holds the lease, see TakeLease
};

/// The first words of a client. Sent again with the server's cookie once it has been received.
struct Hello {
  std::uint32_t version_min = kProtocolVersion;
  std::uint32_t version_max = kProtocolVersion;
  Role role = Role::kObserver;
  std::string name;                   ///< for logs; at most 64 bytes
  std::vector<std::string> features;  ///< offered; the intersection is used. At most 16 of at most 32 bytes
  /// Each once; at most 16. Empty: device 0, its channel 0, and `role`. Otherwise `role` is the highest among them.
  std::vector<Claim> claims{};
  /// With kFeatureWays: how this engine may answer. At most limits::kMaxWays, each of at most 24 bytes.
  std::vector<std::string> ways{};
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
  /// One for each claim, in their order; device_name … loop_hz are of the first one's device. A server that knows no
  /// claims grants none: then it is as if there had been none.
  std::vector<Grant> grants{};
};

/// The server's no, with the reason.
struct Refused {
  Code code = Code::kInvalid;
  std::string detail;
  std::uint32_t version_min = 0;
  std::uint32_t version_max = 0;
};

}  // namespace tendon
