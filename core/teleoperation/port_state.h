// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string_view>

#include "core/base/motion.h"
#include "core/base/time.h"

namespace tendon {

/// Where a port of a coupling stands. Only `kEngaged` has a force of the coupling, apart from the fade out of it and
/// from a robot that holds its place.
enum class PortPhase : std::uint8_t {
  kAlone = 1,  ///< has no peer
  kCoupled,    ///< hears its peer; no force; waits for the operator's act
  kAligning,   ///< absolute maps: the leader is led to where the follower is
  kEngaged,    ///< the law
  kClutched,   ///< the leader is free; the follower stays where it is
  kLost,       ///< was engaged, and its peer fell silent; never engaged again without an act
  kFault,      ///< its device is not armed, disarmed or has a fault: no force
};

/// For people: "engaged"; with what is waited for.
std::string_view to_string(PortPhase phase) noexcept;

enum class PortRole : std::uint8_t { kLeader, kFollower };

enum class CouplingMethod : std::uint8_t {
  kPositionPosition = 1,  ///< a spring and a damper at both ends (PositionPosition), with a purse
  kPositionForce,         ///< the follower's spring; the leader feels the contact that the follower measures
  kWaves,                 ///< wave variables, played out (WavePort)
  kSurface,               ///< position-force, but the leader touches a model of the surface that the follower found
  kPassivity,             ///< velocity there, force back, each paid from what the other took in (PassivityLeader)
  kSetPosition,           ///< springs to late positions, stretched only as far as the account pays
  kRate,                  ///< the leader's place says how fast the follower moves
};
inline constexpr std::array kCouplingMethods = {
    CouplingMethod::kPositionPosition, CouplingMethod::kPositionForce, CouplingMethod::kWaves, CouplingMethod::kSurface,
    CouplingMethod::kPassivity,        CouplingMethod::kSetPosition,   CouplingMethod::kRate};

/// As scenes and refusals call it: "position-position".
std::string_view to_string(CouplingMethod method) noexcept;

/// Method rate: the leader's handle, pulled back to its centre, says how fast the follower moves. In the leader's
/// scale.
struct RateControl {
  double dead_zone = 0;  ///< m, ≥ 0: nearer to its centre the follower stands
  double gain = 0;       ///< 1/s, > 0: speed for each metre beyond that
  double max_speed = 0;  ///< m/s, > 0

  bool operator==(const RateControl&) const = default;
};

/// A flat, springy surface as the sender's tool has found it: SurfaceModel in the sender's displacements u.
struct PortSurface {
  Vec3 normal = Vec3::UnitX();  ///< of length 1 ± 0.001, out of the surface
  double offset = 0;            ///< m: the surface is at normal·u = offset
  double stiffness = 0;         ///< N/m, ≥ 0; 0: there is none
};

/// Whether a place of the leader can stand for one of the follower (Coupling::Absolute): the others go by velocities.
constexpr bool has_places(CouplingMethod method) noexcept {
  return method == CouplingMethod::kPositionPosition || method == CouplingMethod::kPositionForce ||
         method == CouplingMethod::kSurface || method == CouplingMethod::kSetPosition;
}

/// Returns true if the scales cannot be changed, because the totals of the method depend on them.
constexpr bool keeps_scales(CouplingMethod method) noexcept {
  return method == CouplingMethod::kWaves || method == CouplingMethod::kPassivity;
}

/// Returns true if a follower can have several leaders.
constexpr bool can_be_shared(CouplingMethod method) noexcept {
  return method == CouplingMethod::kPositionPosition || method == CouplingMethod::kPositionForce;
}

/// Returns true if a follower with a limiter can only move when the leader pays for it (Purse).
constexpr bool needs_purse(CouplingMethod method) noexcept {
  return method == CouplingMethod::kPositionPosition || method == CouplingMethod::kPassivity ||
         method == CouplingMethod::kSetPosition;
}

/// How a handle has turned since its offset was taken.
struct PortTurn {
  Quat turn{};                           ///< in the axes of the sender's base frame; of length 1 ± 0.001
  Vec3 angular_velocity = Vec3::Zero();  ///< rad/s, zero while `turn` is frozen
  Vec3 torque = Vec3::Zero();            ///< N·m, on whoever holds the handle, really applied
};

/// A gripper, measured at its fingers. It is a port of its own, with an account of its own.
struct PortGrip {
  double opening = 0;   ///< m; of a leader, what it asks for (GripCoupling)
  double velocity = 0;  ///< m/s
  double force = 0;     ///< N, on the fingers, > 0 opens them; really applied
  double account = 0;   ///< J, these four as in PortState
  double need = 0;
  double given = 0;
  double taken = 0;
};

/// What one port of a coupling tells the other, once a period. It may be sent as seldom as one likes, late, twice, in
/// any order: the highest `sequence` of the highest `epoch` counts. Vectors are in the SENDER's base frame and scale;
/// the receiver maps them (PoseMap).
struct PortState {
  static constexpr Duration kMostRoundTrip = std::chrono::seconds(10);

  std::uint64_t epoch = 0;          ///< of the sender, > 0: above every one before when it starts anew (Purse)
  std::uint64_t sequence = 0;       ///< the sender's period in it: 1, 2, …
  std::uint64_t answers_epoch = 0;  ///< the receiver's epoch that `answers`, `given` and `taken` belong to; 0: none yet
  std::uint64_t answers = 0;        ///< sequence of the receiver's newest state in use; 0: none yet
  Duration time{};                  ///< the sender's own: only differences are used; ± 2⁶⁰ ns
  Duration round_trip{};            ///< that the sender has measured; 0: not yet; ≤ kMostRoundTrip
  PortPhase phase = PortPhase::kAlone;
  std::uint64_t engagement = 0;  ///< number of the leader's act that the phase belongs to: 1, 2, …; 0: none yet
  std::uint32_t buttons = 0;     ///< bit i: button i is held
  Vec3 position = Vec3::Zero();  ///< m, u: from the sender's offset, so that the peer needs to know no offset of it
  Vec3 velocity = Vec3::Zero();  ///< m/s, of u: zero while it is frozen
  Vec3 force = Vec3::Zero();     ///< N, that its device exerts on whoever holds it, really applied
  std::optional<Vec3> contact_force{};   ///< N, of the surroundings on its tool, as measured; empty: not measured
  double account = 0;                    ///< J, PurseMessage::account
  double need = 0;                       ///< J, PurseMessage::need; 0: it has no purse
  double given = 0;                      ///< J, PurseMessage::given
  double taken = 0;                      ///< J, PurseMessage::taken
  std::optional<PortSurface> surface{};  ///< what its tool touches, or touched last; empty: nothing yet
  Vec3 wave_integral = Vec3::Zero();     ///< √W·s, WaveMessage::integral
  double wave_energy = 0;                ///< J, WaveMessage::energy; 0 … kMostTotal of PurseMessage
  std::optional<PortTurn> turn{};        ///< empty: the orientations are not coupled
  std::optional<PortGrip> grip{};        ///< empty: the grippers are not coupled
  double energy_in = 0;           ///< J, of passivity: total that its port took in, in this epoch; as wave_energy
  std::optional<double> share{};  ///< 0 … 1, of a follower: how much this leader counts; empty: it is the only one
  double position_scale = 0;      ///< of a leader, in use from this state on: 0.01 … 100; 0: as both scenes say
  double force_scale = 0;
};

/// Whether each value is finite and within the bounds that it has above and on the wire (tendon.proto).
bool is_sound(const PortState& state) noexcept;
bool is_sound(const PortSurface& surface) noexcept;
bool is_sound(const PortTurn& turn) noexcept;
bool is_sound(const PortGrip& grip) noexcept;

}  // namespace tendon
