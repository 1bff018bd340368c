// SPDX-License-Identifier: Apache-2.0
// Generated from tendon.proto by protocol/generate.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

#include "core/base/mode.h"
#include "core/base/motion.h"
#include "core/base/output.h"
#include "core/base/time.h"
#include "core/remote/channel_rule.h"
#include "core/remote/remote_force.h"
#include "core/teleoperation/methods/coupling_method.h"
#include "core/teleoperation/port_state.h"
#include "protocol/limits.h"

// The messages of tendon.proto as plain values. An empty member stands for an absent field.

namespace tendon {

/// The shape of a fixture. Part of the wire: never renumber.
enum class FieldFixtureKind : std::uint8_t {
  kPoint = 1,
  kLine = 2,
  kPlane = 3,
};

/// The hand that is used for holding a device. Part of the wire: never renumber.
enum class Hand : std::uint8_t {
  kAny = 0,
  kLeft = 1,
  kRight = 2,
};

/// The state of a device and its safety layer. Part of the wire: never renumber.
enum class Safety : std::uint8_t {
  kAbsent = 1,     ///< not plugged in
  kOpening = 2,    ///< being opened
  kFirmware = 3,   ///< has no firmware yet, or is receiving it
  kUnhomed = 4,    ///< does not know its position yet
  kHomed = 5,      ///< ready, but must be armed first
  kArmed = 6,      ///< exerts forces
  kFault = 7,      ///< disarmed because of a fault, and must be armed again
  kUnguarded = 8,  ///< ready, and there is no safety layer that can be armed
};

/// Explains why a request was refused or a session was closed. Part of the wire: never renumber.
enum class Code : std::uint8_t {
  kOk = 1,
  kInvalid = 2,      ///< a value is out of bounds or does not make sense
  kUnsupported = 3,  ///< the request is not known or there is no common version
  kBusy = 4,         ///< used by another client, such as another controller
  kDenied = 5,       ///< not with this role
  kShutdown = 6,     ///< the server is shutting down
  kTimedOut = 7,     ///< nothing was received until the timeout
  kExpired = 8,      ///< the session of suite 1 or 2 is too old, and the handshake must be repeated
  kReplaced = 9,     ///< replaced by another program with the same key; the client must not reconnect automatically
};

/// The role of a client. Observers receive states, and controllers also send forces. Part of the wire: never renumber.
enum class Role : std::uint8_t {
  kObserver = 1,    ///< receives device states
  kController = 2,  ///< also sends forces; one per channel
};

/// The field that is rendered.
struct FieldState {
  /// The generation of the rendered field (UseField::generation). If several channels use fields, this is the first one
  /// with contact, or else the first one.
  std::uint32_t generation = 0;
  double depth = 0;           ///< m, ≥ 0: the distance from the proxy to the hand, or 0 if there is no contact
  Vec3 proxy = Vec3::Zero();  ///< m, the position of the proxy, which is ignored if there is no field
};

/// The state of a device at one haptic step. Server → client, unreliable; for each device the highest tick wins.
struct DeviceState {
  std::uint64_t tick = 0;             ///< number of the haptic step
  PeerTime sampled{};                 ///< the time at which the position was sampled, on the clock of the server
  Vec3 position = Vec3::Zero();       ///< m
  Vec3 velocity = Vec3::Zero();       ///< m/s
  Vec3 force_applied = Vec3::Zero();  ///< N, the actual force on the hand from this step on
  double energy = 0;  ///< J, the energy that the device may still output, according to the energy ledger
  /// N, ≥ 0 or +infinity. The limiter's bound on the norm of the force, or +infinity if there is none
  double permitted_force = 0;
  /// the reasons why the actual force differs from the requested one (bits of core/base/reason.h)
  std::uint32_t reasons = 0;
  std::uint64_t force_sequence = 0;  ///< the sequence of the ForceCommand that is rendered, or 0
  Duration force_age{};              ///< the time since this ForceCommand has arrived
  Mode mode = Mode::kIdle;
  std::uint32_t device = 0;  ///< 0 … 15
  /// 0 … 7. The channel of the force that is described by force_sequence, force_age and mode. This is the freshest one.
  /// If several are equally fresh, it is the one with the lowest number
  std::uint32_t channel = 0;
  // With the feature "diagnostics" only:
  /// N. The force on the hand that is requested by the engines at this step, before it is limited. It may be held,
  /// faded, or extrapolated using their models. Empty if it is not reported
  std::optional<Vec3> force_wanted{};
  /// N/m, −∂force_wanted/∂position according to the models of the engines at this step, with the entries of
  /// LocalModel::stiffness. Empty if there is no model
  std::optional<Mat3> stiffness_wanted{};
  // With the feature "handle" only:
  std::uint32_t buttons = 0;  ///< bit i is set if button i is pressed, or if it was pressed since the previous state
  std::optional<Turning> turning{};  ///< how the handle is turned; empty if it is not measured
  /// N·m. The actual torque on the hand about position from this step on, in the axes of the base frame. Empty if the
  /// device cannot exert torques
  std::optional<Vec3> torque_applied{};
  std::optional<Grip> grip{};  ///< how far the gripper of the handle is open; empty if there is no gripper
  /// N. The actual force on the fingers from this step on. Positive values open them. Empty if the gripper has no motor
  std::optional<double> grip_applied{};
  /// N. The force of the hand ON THE HANDLE, as measured by a force sensor. Empty if there is no force sensor
  std::optional<Vec3> hand_force{};
  // With the feature "joints" only:
  /// the joints that carry the handle, in the order of HandleDescription::joints; empty if the device does not report
  /// joints
  std::optional<Joints> joints{};
  // With the feature "fields" only:
  std::optional<FieldState> field{};  ///< the field that is rendered; empty if no field is rendered
};

/// The force that is requested by a physics engine in response to a state. Client → server, unreliable; for each device
/// and channel the highest sequence wins.
struct ForceCommand {
  std::uint64_t sequence = 0;         ///< 1, 2, 3 … per session, device and channel
  std::uint64_t based_on_tick = 0;    ///< the DeviceState::tick of the state that was used for computing the force
  Vec3 force = Vec3::Zero();          ///< N. The force on the hand. A wall that resists motion along +x sends −x
  std::optional<LocalModel> model{};  ///< The change of the force when the hand moves. Empty if the force is constant
  Duration valid_for{};               ///< 1 µs … 10 s: the time after its arrival during which the force is fresh
  std::uint32_t device = 0;           ///< 0 … 15
  std::uint32_t channel = 0;          ///< 0 … 7
  /// If true, the body was cut or torn since the previous answer, so neither this model nor the previous one is used
  bool topology_changed = false;
  std::optional<double> error{};  ///< N, ≥ 0. The error of force, as estimated by the engine. Empty if it is unknown
  // With the feature "handle" only:
  /// on the hand, base frame axes, about the handle's position; empty if no torque is requested
  std::optional<RemoteTorque> torque{};
  /// N. The force on the fingers. Positive values open them. Empty if no force is requested
  std::optional<double> grip_force{};
  // With the feature "ways" only:
  /// 0 … 8. The way in which the engine has computed this force, as an index in Hello::ways that starts at 1, or 0 if
  /// it is unknown. Servers treat an index that is larger than the number of ways as 0
  std::uint32_t way = 0;
  // With the feature "fields" only:
  /// If it is not 0, force is not rendered. It is the true force for the state `based_on_tick`, which is used for
  /// correcting the field with this generation (UseField::generation). The model is ignored
  std::uint32_t field = 0;
};

/// A part of the manifest of a field, which contains its primitives and a list of its bricks. Parts are sent in order.
struct OfferField {
  /// 32 bytes: the BLAKE2b-256 hash of the manifest, which is used as the name of the field
  std::array<std::byte, 32> field{};
  std::uint32_t size = 0;         ///< 1 … 65 535: the size of the whole manifest in bytes
  std::uint32_t offset = 0;       ///< 0 … 65 535: the offset of this part in the manifest in bytes
  std::vector<std::byte> part{};  ///< 1 … 1000 bytes
};

/// A viscoelastic material: a spring in parallel with a Maxwell element, which is a spring in series with a damper, and
/// Coulomb friction (core/field/material.h).
struct FieldMaterial {
  double stiffness = 0;  ///< N/m, > 0
  /// N/m, ≥ 0. The stiffness of the spring in series with the damper, or 0 if there is no damper
  double branch_stiffness = 0;
  double relaxation = 0;  ///< s, 0.01 … 10 or 0. The time constant of the damper. It is ignored if there is no damper
  double friction = 0;    ///< 0 … 2: the coefficient of friction
};

/// A spring that pulls the hand to a point, a line or a plane, in the frame of the object (core/field/fixture.h).
struct FieldFixture {
  FieldFixtureKind kind = FieldFixtureKind::kPoint;
  Vec3 at = Vec3::Zero();  ///< m, the position of the point, or of any point on the line or plane
  /// unit vector. The direction of the line or the normal of the plane. It is ignored if the fixture is a point
  Vec3 normal = Vec3::UnitZ();
  double stiffness = 0;                ///< N/m, > 0
  std::optional<double> most_force{};  ///< N, > 0: the maximum force. Empty if the force is not limited
};

/// This table is added to the force of the springs of a material. The correction is zero at the surface, and is
/// interpolated linearly between the entries. The last entry is also used for all greater depths. The slope of the
/// table must be at least −0.9 times the stiffness of the material. The sum of the slope and the stiffnesses must not
/// exceed the maximum stiffness of the server.
struct FieldDepthTable {
  std::uint32_t material = 0;      ///< 0 … 7: the number of the material
  double step = 0;                 ///< m, 0.0001 … 0.1: the spacing of the entries
  std::uint32_t size = 0;          ///< number of entries of `force`
  std::array<double, 16> force{};  ///< N, entry i is for the depth (i + 1) · step
};

/// Uses a field in a channel instead of the previous one. The field must be complete on the server (FieldStatus), and
/// the client must have the lease of the channel, as for a ForceCommand.
struct UseField {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
  /// ≥ 1. A number that is increased with each UseField of a session, device and channel
  std::uint32_t generation = 0;
  std::array<std::byte, 32> field{};       ///< 32 bytes: the hash of the manifest
  std::vector<FieldMaterial> materials{};  ///< 1 … 8: the materials, which are numbered from 0 in the manifest
  std::vector<FieldFixture> fixtures{};    ///< at most 4
  std::vector<FieldDepthTable> tables{};   ///< at most 3: the tables of the materials that have one
};

/// Removes a field from the server. If the field is used in a channel, it is no longer rendered. The bricks are kept in
/// the cache of the server.
struct DropField {
  std::array<std::byte, 32> field{};  ///< 32 bytes: the hash of the manifest
};

/// The weights of a brick (core/field/brick_field.h). Client → server, unreliable.
struct FieldBrick {
  std::array<std::byte, 16> hash{};  ///< 16 bytes: the BLAKE2b-128 hash of the weights
  /// 1024 bytes: 8³ numbers (int16, little-endian), where x is the fastest index
  std::span<const std::byte> weights{};
};

/// Reports which bricks of a field are missing on the server. Bit i % 8 of byte i / 8 is set if brick i of the manifest
/// is missing. The last one of the 1024 bits is set if the manifest is incomplete, and the bits of unknown bricks are
/// 0. Server → client, unreliable; for each field the newest one wins.
struct FieldStatus {
  std::array<std::byte, 32> field{};     ///< 32 bytes: the hash of the manifest
  std::array<std::byte, 128> missing{};  ///< 0 … 128 bytes: the bits, where zeros at the end may be omitted
};

/// The pose of the object of a channel in the base frame of the device. The engine should send the pose that it expects
/// at the time when the message arrives. The server uses the velocities to extrapolate the pose by at most 50 ms.
/// Client → server, unreliable; for each device and channel the highest sequence wins.
struct FieldPose {
  std::uint32_t device = 0;      ///< 0 … 15
  std::uint32_t channel = 0;     ///< 0 … 7
  std::uint64_t sequence = 0;    ///< 1, 2, 3 … per session, device and channel
  PeerTime time{};               ///< The time of the pose, on the clock of the SERVER as in DeviceState::sampled
  Vec3 position = Vec3::Zero();  ///< m, the position of the origin of the object, which must be within 10 m
  Quat orientation{};            ///< the rotation from the frame of the object to the base frame
  Vec3 velocity = Vec3::Zero();  ///< m/s, the velocity of the origin of the object
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, the angular velocity in the axes of the base frame
};

/// Sets the number of states of a device that are sent to the client per second. Before the first request of this type,
/// all loop_hz states per second are sent. After it, every k-th state is sent, where k = loop_hz / hz is rounded and at
/// least 1. For example, if loop_hz is 1000, 300 Hz becomes 333 Hz and 2000 Hz becomes 1000 Hz.
struct SetStateRate {
  std::uint32_t hz = 0;      ///< if it is 0, the answer is Code::kInvalid
  std::uint32_t device = 0;  ///< 0 … 15
};

/// Suppresses states that can be predicted by the client. After a state with velocity v, the server sends the first
/// state whose velocity differs from v by more than max(share · ‖v‖, floor), whose mode or buttons differ, or that is
/// max_silence newer. Between two states the client extrapolates: x + v · (t − sampled).
struct SetStateDeadband {
  /// The fraction of the speed (Weber fraction). If it is not in 0 … 0.5, the answer is Code::kInvalid
  double share = 0;
  /// m/s. The smallest difference of the velocity. If it is not in 0 … 0.1, the answer is Code::kInvalid
  double floor = 0;
  /// The maximum time without a state. If it is 0, every state is sent again. If it is not 0 or in 1000 … 20 000, the
  /// answer is Code::kInvalid
  Duration max_silence{};
};

/// Clears a latched fault and revokes a Disarm. Can only be used by controllers of the device. If the device has a
/// safety layer, this is a request of the operator to arm it.
struct Rearm {
  std::uint32_t device = 0;  ///< 0 … 15
};

/// Sets the force to zero without a ramp, from the next haptic step until a Rearm. Can be used by any controller of the
/// device, even if it does not hold the channel. This state does not end if there is a new force or a new session, or
/// if only the dead man's button is pressed. The Safety of the device changes from armed to homed, and pending requests
/// to arm it are withdrawn. A Disarm is not a fault and does not clear faults. If it is repeated, it has no effect. If
/// the answer is Code::kOk, the loop of the device will receive the order before its next step.
struct Disarm {
  std::uint32_t device = 0;  ///< 0 … 15
};

/// Offers the sender's device as the other end of a coupling with this device, and describes that end. Can only be used
/// by a client that has claimed the channel as a controller, and requires the feature "teleoperation". If the two ends
/// match, the answer is Code::kOk. After that, both peers send PortState frames, and the server does not send states.
/// Code::kInvalid is returned if the ends do not match, and the detail contains the first difference.
/// Code::kUnsupported is returned if this device cannot be coupled. Code::kBusy is returned if the channel is coupled
/// with another client. A follower has one channel for each of its leaders.
struct Couple {
  std::uint32_t device = 0;           ///< 0 … 15: the device of the server
  std::uint32_t channel = 0;          ///< 0 … 7: the channel of the server
  PortRole role = PortRole::kLeader;  ///< The role of the sender. The device of the server has the other role
  CouplingMethod method = CouplingMethod::kPositionPosition;
  double position_scale = 1;    ///< 0.01 … 100: the follower's motion divided by the leader's
  double force_scale = 1;       ///< 0.01 … 100: the leader's force divided by the follower's
  Quat rotation{};              ///< the rotation from the base frame of the leader to that of the follower
  std::uint32_t axes = 7;       ///< 1 … 7: bits 1, 2 and 4 are set if x, y and z of the leader's frame are coupled
  double stiffness = 0;         ///< N/m, ≥ 0: the stiffness between the handles, as felt by the leader
  double mutual_damping = 0;    ///< N·s/m, ≥ 0: the damping between the handles, as felt by the leader
  double damping = 0;           ///< N·s/m, ≥ 0: the damping of each handle, as felt by the leader
  bool adapt_to_delay = false;  ///< if true, the stiffness decreases when the round trip increases
  bool purse = false;           ///< if true, the ends exchange energy (core/teleoperation/energy_tank.h)
  Duration period{};            ///< 1 µs … 10 s: the period in which the sender sends PortState frames
  /// If true, positions map to positions. The offsets are zero, and the ends are aligned before they are engaged
  bool absolute = false;
  // As felt by the leader. With a stiffness of 0 the part is not coupled:
  double turn_stiffness = 0;  ///< N·m/rad, ≥ 0: the stiffness between the orientations
  double turn_damping = 0;    ///< N·m·s/rad, ≥ 0: the damping between the orientations
  double grip_stiffness = 0;  ///< N/m, ≥ 0: the stiffness between the grippers at the fingers of the leader
  double grip_damping = 0;    ///< N·s/m, ≥ 0: the damping between the grippers
  // For one method only:
  /// 1/s, ≥ 0. The rate at which the follower corrects its drift, for CouplingMethod::kPassivity
  double drift_rate = 0;
  std::optional<RateControl> rate{};  ///< the parameters of CouplingMethod::kRate, which are absent for other methods

  bool operator==(const Couple&) const = default;
};

/// Engages the coupling on the command of the operator. Can only be used by controllers of the leader's device, at its
/// server. If the answer is Code::kOk, the loop of the device has received the order. Code::kUnsupported is returned if
/// the device is not coupled, or if it is the follower.
struct Engage {
  std::uint32_t device = 0;  ///< 0 … 15
};

/// Ends the engagement. Can be used at the server of either end, but only by controllers of its device.
struct Disengage {
  std::uint32_t device = 0;  ///< 0 … 15
};

/// Sets the scales of the coupling. Can only be used by controllers of the leader's device, at its server. If the
/// answer is Code::kOk, the loop of the device has received the order. Code::kBusy is returned if the leader is engaged
/// and its clutch is not held. Code::kUnsupported is returned if the device is not coupled, or if it is the follower.
struct SetScale {
  std::uint32_t device = 0;   ///< 0 … 15
  double position_scale = 1;  ///< 0.01 … 100: as in Couple
  double force_scale = 1;     ///< 0.01 … 100: as in Couple
};

/// Sets the weight of the leader of one channel if a follower has several leaders. Can only be used by controllers of
/// the follower's device, at its server. The weight reaches the value within 0.5 s, and the ratios of the other weights
/// do not change. Code::kUnsupported is returned if the device is not coupled, if it only has one leader, or if it is a
/// leader.
struct SetShare {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
  double share = 0;           ///< 0 … 1
};

/// Sets a lamp of the device or starts a vibration pulse. Can only be used by a controller that holds one of the
/// channels of the device, and requires the feature "outputs". An output is turned off if the client that has set it
/// gives up or loses a channel of the device, or if the device is disarmed. Code::kInvalid is returned if the device
/// does not have this output, if the output is of the other kind, or if both `rgb` and `vibration` are missing.
struct SetOutput {
  std::uint32_t device = 0;  ///< 0 … 15
  /// 0 … 7. The index in HandleDescription::outputs. If the device does not have this output, the answer is
  /// Code::kInvalid
  std::uint32_t output = 0;
  std::variant<LampColour, Vibration> setting{};
};

/// Requests the DeviceDescription of a device, which does not need to be claimed.
struct Describe {
  std::uint32_t device = 0;  ///< 0 … 15: if the server does not have this device, the answer is Code::kInvalid
  bool handle = false;  ///< If true, the HandleDescription is requested instead. This requires the feature "handle"
};

/// Requests the lease of a channel. Can only be used by a client that has claimed the channel as a controller. If the
/// answer is Code::kOk, the client holds the lease and its forces are used. If another client holds the lease, the
/// answer is Code::kBusy, and wait is the time until the lease ends if it is not renewed.
struct TakeLease {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
};

/// Releases the lease of a channel.
struct GiveLease {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
};

/// Notifies a client with the feature "channels" that the lease of the channel was taken by another client.
struct LeaseLost {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
  std::string to{};           ///< at most 64 bytes: the name of the new holder
};

/// The properties of a channel.
struct ChannelDescription {
  std::string name{};  ///< at most 24 bytes: the name that is used in a claim
  ChannelRule rule = ChannelRule::kSum;
  /// at most 3600 s. If the holder does not send a force for this time, another client can take the lease. It is 0 if
  /// the lease does not expire
  Duration lease{};
  /// at most 24 bytes. The first 24 bytes of the name of the holder. It is empty if there is no holder
  std::string holder{};
};

/// The properties of a device.
struct DeviceDescription {
  struct Box {
    Vec3 min = Vec3::Zero();  ///< m
    Vec3 max = Vec3::Zero();  ///< m
  };
  std::uint32_t device = 0;        ///< 0 … 15
  std::string name{};              ///< at most 24 bytes: the name of the device, which can be used in a claim
  std::string model{};             ///< at most 64 bytes: the kind of device, as in Welcome::device_name
  std::uint32_t position_dof = 3;  ///< 1 … 6: the number of axes that are measured
  std::uint32_t force_dof = 3;     ///< 1 … 6: the number of axes that have a motor
  std::optional<Box> workspace{};  ///< the box that the handle stays in, min ≤ max; empty if the workspace is unknown
  double max_force = 0;            ///< N, ≥ 0: the maximum norm of the force, or 0 if it is unknown
  double continuous_force = 0;  ///< N, ≥ 0. The maximum norm of the force that has no time limit, or 0 if it is unknown
  double max_stiffness = 0;     ///< N/m, ≥ 0: the maximum stiffness that is rendered stably, or 0 if it is unknown
  /// m, ≥ 0. The size of an encoder count at the handle, or 0 if the position is exact
  double position_resolution = 0;
  std::uint32_t loop_hz = 0;                   ///< 1 … 1 000 000: haptic steps per second
  std::vector<ChannelDescription> channels{};  ///< 1 … 8. The channels of the device, in the order of their numbers
};

/// The properties of the handle of a device. Requires the feature "handle".
struct HandleDescription {
  std::uint32_t device = 0;  ///< 0 … 15
  /// The rotation from the base frame of the device to the frame of the operator, where x is to the right, y is up, and
  /// z is towards the user. Empty if it is unknown
  std::optional<Quat> operator_from_device{};
  /// at most 16 of at most 24 bytes. The name for each bit of DeviceState::buttons. Names can be empty
  std::vector<std::string> buttons{};
  bool orientation_measured = false;  ///< If true, all states contain an orientation. Otherwise, none of them do
  double max_torque = 0;  ///< N·m, ≥ 0: the maximum norm of the torque, or 0 if the device cannot exert torques
  /// rad, ≥ 0. The opening of the gripper if it is open. Empty if there is no gripper
  std::optional<double> gripper_open{};
  double max_gripper_force = 0;  ///< N, ≥ 0: the maximum force on the fingers, or 0 if the gripper has no motor
  /// at most 24 bytes. The name of a group of devices that belong together, such as two arms or five fingers. It is
  /// empty if the device is not part of a group
  std::string group{};
  Hand hand = Hand::kAny;
  // With the feature "joints" only:
  /// at most 8 of at most 24 bytes. The names of the joints, in the order of DeviceState::joints.angle
  std::vector<std::string> joints{};
  // With the feature "outputs" only:
  /// at most 8. The outputs that can be set using SetOutput, in the order of their numbers
  std::vector<OutputDescription> outputs{};
};

/// The answer to a Control.
struct ControlAck {
  std::uint32_t id = 0;  ///< ≥ 1: the id of the Control that is answered
  Code code = Code::kOk;
  std::string detail{};  ///< at most 128 bytes: explanation for people
  /// at most 3600 s. If the answer to TakeLease is Code::kBusy, this is the time until the lease ends if it is not
  /// renewed, or 0 if it is unknown
  Duration wait{};
  std::optional<DeviceDescription> device{};  ///< the answer to a Describe with Code::kOk
  std::optional<HandleDescription> handle{};  ///< the answer to a Describe with Code::kOk if `handle` was set
};

/// The end of the session. Either way, sent three times.
struct Bye {
  Code code = Code::kOk;  ///< reason for the end
  std::string reason{};   ///< at most 128 bytes: explanation for people
};

/// Two quantiles of a delay. The delay can be negative if two clocks are compared.
struct Delays {
  Duration median{};
  Duration p99{};
};

/// Forces that could not be used, on all channels.
struct RefusedForces {
  std::uint64_t not_finite = 0;     ///< a number is NaN or infinite
  std::uint64_t out_of_bounds = 0;  ///< a number is beyond its bound
  std::uint64_t unknown_tick = 0;   ///< based_on_tick was unknown or more than 4096 ticks ago
  std::uint64_t old_sequence = 0;   ///< the sequence was not increased even though the datagram is the newest

  bool operator==(const RefusedForces&) const = default;
};

/// Statistics of the forces and datagrams of a client, which show why forces were late and how the network performed.
/// One-way delays depend on the estimated offset of the clocks. They have an error of up to ± clock_error and can be
/// negative. Server → client, unreliable; the highest number wins.
struct LinkReport {
  std::uint64_t number = 0;  ///< 1, 2, 3 … per session
  PeerTime until{};          ///< end of the reported interval, server clock
  Duration span{};           ///< length of the interval
  // In the interval:
  std::uint64_t forces = 0;        ///< the number of forces that have arrived
  std::uint64_t late_server = 0;   ///< the number of forces that were late because a state was late
  std::uint64_t late_network = 0;  ///< the number of forces that were late because of the network, in either direction
  std::uint64_t late_engine = 0;   ///< the number of forces that were late because the engine was slower than usual
  Duration worst_late{};           ///< the maximum time for which the device did not have a valid force
  Duration longest_gap{};          ///< the maximum time without a datagram from the client
  std::optional<Delays> round_trip{};  ///< empty if it was not measured
  std::optional<Delays> to_server{};   ///< one way; empty if it was not measured
  std::optional<Delays> to_client{};   ///< one way; empty if it was not measured
  // Clocks:
  Duration clock_offset{};     ///< the clock of the client minus the clock of the server
  double clock_drift_ppm = 0;  ///< the rate at which the offset increases
  Duration clock_error{};      ///< an upper bound of |true offset − clock_offset|
  // Datagrams of the client since the session opened:
  std::uint64_t received = 0;
  std::uint64_t lost = 0;
  std::uint64_t reordered = 0;
  std::uint64_t duplicated = 0;
  // In the interval:
  /// at most 128 bytes. An explanation of late and refused forces that can be shown to the user. It is empty if there
  /// are none
  std::string words{};
  /// the number of forces that are late for an unknown reason, because the client is silent
  std::uint64_t late_unknown = 0;
  // Forces of the client, on all its channels, that could not be used in the interval:
  RefusedForces refused{};  ///< forces that could not be used, on all channels
};

/// Statistics of the loop of a device. All counts are for the reported interval. Server → client, unreliable, to an
/// observer with the feature "diagnostics" only; for each device the highest number wins.
struct DeviceReport {
  std::uint64_t number = 0;    ///< 1, 2, 3 … per device
  PeerTime until{};            ///< end of the reported interval, server clock
  Duration span{};             ///< length of the interval
  std::uint32_t device = 0;    ///< 0 … 15
  std::uint64_t steps = 0;     ///< haptic steps
  std::uint64_t missed = 0;    ///< the number of periods that were skipped because the previous step was late
  std::uint64_t overruns = 0;  ///< the number of steps that started too late (reason overrun)
  std::uint64_t unseen = 0;    ///< the number of steps without a position
  /// The number of steps by their delay. Entry 0 counts the steps that were at most 1 µs late, entry i the steps that
  /// were more than 2^(i−1) µs and at most 2^i µs late, and entry 23 all steps that were more than 2^22 µs late. Zeros
  /// at the end are omitted. If the server was not able to count all steps, the sum is smaller than `steps`
  std::array<std::uint64_t, 24> lateness{};
  Safety safety = Safety::kAbsent;
  /// at most 128 bytes. The reason why the device does not exert forces until it is armed or rearmed, as text for the
  /// user. It is empty if there is no fault
  std::string fault{};
  /// at most 128 bytes. The service that is currently reduced by the server, as text for the user. It is empty if there
  /// is none
  std::string degraded{};
};

/// Statistics of the engine that holds the lease of a channel. Server → client, unreliable, to an observer with the
/// feature "diagnostics" only; for each device and channel the highest number of its link wins.
struct PeerReport {
  std::uint32_t device = 0;   ///< 0 … 15
  std::uint32_t channel = 0;  ///< 0 … 7
  std::string name{};         ///< at most 64 bytes: the name of the engine in its Hello
  /// 1 … 1000. One of this many requested states is sent to the engine, because its link is congested
  std::uint32_t state_one_in = 1;
  /// If true, the forces of the engine are ignored because its link has lost too many datagrams
  bool forces_refused = false;
  LinkReport link{};  ///< The report about the link of the engine. The number and the counts of forces are per channel
  // Of the force in the interval with the largest ForceCommand::error; if none states an error, of the newest:
  std::optional<double> error{};  ///< N, ≥ 0. The estimated error of this force. Empty if errors are not estimated
  std::string way{};  ///< at most 24 bytes. The entry of Hello::ways for this force. It is empty if it is unknown
};

/// Claims a device or a channel.
struct Claim {
  std::string device{};  ///< at most 24 bytes: the name of the device, or empty for device 0
  /// at most 24 bytes: the name of the channel if the role is controller, or empty for channel 0
  std::string channel{};
  Role role = Role::kObserver;
};

/// The first message of a client.
struct Hello {
  /// ≥ 1. The lowest version that is supported by the client. The highest common version is used
  std::uint32_t version_min = kProtocolVersion;
  std::uint32_t version_max = kProtocolVersion;  ///< the highest version that is supported by the client
  Role role = Role::kObserver;                   ///< if there are claims, this is the highest role of them
  std::string name{};                            ///< at most 64 bytes: name for logs
  /// at most 16 of at most 32 bytes. The features that are offered. A feature is used if both peers name it
  std::vector<std::string> features{};
  /// at most 16. The devices and channels that are claimed, without duplicates. If this is empty, the client is granted
  /// device 0 and its channel 0 with `role`
  std::vector<Claim> claims{};
  // With the feature "ways" only:
  /// at most 8 of at most 24 bytes. The names of the ways in which this engine can compute forces, starting with the
  /// fastest. They are used by ForceCommand::way
  std::vector<std::string> ways{};
};

/// The numbers of a device and a channel that were claimed using their names.
struct Grant {
  std::uint32_t device = 0;   ///< 0 … 15: the number of the device in all later messages
  std::uint32_t channel = 0;  ///< 0 … 7: the number of the channel in all later messages
  /// The role that was granted. It is Role::kObserver if a controller was claimed, but another client holds the lease
  /// (TakeLease)
  Role role = Role::kObserver;
};

/// The server accepts the client.
struct Welcome {
  std::uint32_t version = 0;            ///< ≥ 1: the version of this session, which is in the range of the client
  std::vector<std::string> features{};  ///< at most 16 of at most 32 bytes: the features that were named by both peers
  Role role = Role::kObserver;          ///< granted role
  std::string device_name{};            ///< at most 64 bytes: the kind of device
  double max_force = 0;                 ///< N, ≥ 0: the maximum norm of the force
  /// m, ≥ 0. The size of an encoder count at the handle, or 0 if the position is exact
  double position_resolution = 0;
  std::uint32_t loop_hz = 0;  ///< 1 … 1 000 000: haptic steps per second
  Duration timeout{};         ///< 1 ms … 3600 s: the server forgets the client if it is silent for this time
  std::string server{};       ///< at most 64 bytes: the name and the version of the server
  /// at most 16. One for each claim, in the same order. The fields device_name … loop_hz describe the device of the
  /// first one. Servers that do not support claims do not send any, and ignore the claims of the Hello
  std::vector<Grant> grants{};
};

/// The server refuses the client.
struct Refused {
  Code code = Code::kInvalid;     ///< why
  std::string detail{};           ///< at most 128 bytes: a sentence for people
  std::uint32_t version_min = 0;  ///< the lowest version that is supported by the server
  std::uint32_t version_max = 0;  ///< the highest version that is supported by the server
};

/// Reliable: the content of a Control.
using Request = std::variant<SetStateRate, Rearm, Describe, TakeLease, GiveLease, LeaseLost, SetStateDeadband, Disarm,
                             SetOutput, Couple, Engage, Disengage, SetScale, SetShare, OfferField, UseField, DropField>;

/// To a Hello.
using Answer = std::variant<Welcome, Refused>;

/// Returns true if DeviceStates can carry the state, because all other members are empty or 0.
inline bool fits_columns(const DeviceState& state) noexcept {
  return !state.force_wanted && !state.stiffness_wanted && !state.turning && !state.torque_applied && !state.grip &&
         !state.grip_applied && !state.hand_force && !state.joints && !state.field;
}

}  // namespace tendon
