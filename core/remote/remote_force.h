// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/motion.h"

namespace tendon {

/// The force along the normal of a contact, at a few depths. force[i] is along +normal, with the tool `depth_i = first
/// + i · step` deeper than where it was answered, that is at `at − depth_i · normal`; in between it is a line, beyond
/// its ends it stays what it is there.
struct ForceTable {
  static constexpr std::size_t kMinEntries = 2;
  static constexpr std::size_t kMaxEntries = 16;  ///< 0.3 mm apart over 5 mm; 128 bytes of a datagram
  double first = 0;                               ///< m; below zero: nearer to the hand
  double step = 0;                                ///< m, > 0
  std::uint32_t size = 0;                         ///< entries, kMinEntries … kMaxEntries
  std::array<double, kMaxEntries> force{};        ///< N
};

/// A surface that the tool touches, or is about to. Unless a table says otherwise it only pushes.
struct Contact {
  static constexpr double kUnitTolerance = 1e-3;  ///< of its normal's length: in single precision it is within 1e-7
  Vec3 normal = Vec3::UnitX();                    ///< unit vector, out of the body, to the hand
  double gap = 0;  ///< m, from the surface to the tool along the normal; below 0: so deep is it pressed in
  std::optional<ForceTable> table{};
};

/// The remote environment near one position, linearised, so that the device loop can follow the hand between two remote
/// forces:
///
///     F(x) = force − stiffness · (x − at)          N, with stiffness = −∂F/∂x in N/m
///
/// A spring has a positive stiffness; a wall with normal n has k·n·nᵀ. core/remote/answer.h says how the loop uses the
/// rest.
struct LocalModel {
  Vec3 at = Vec3::Zero();         ///< m, the position the force was computed for
  Mat3 stiffness = Mat3::Zero();  ///< N/m
  /// m, ≥ 0: how far from `at` the stiffness can be trusted; +infinity when nobody says.
  double valid_radius = std::numeric_limits<double>::infinity();
  std::optional<Contact> contact{};
};

/// How a torque changes while the handle turns, near one orientation. With K = `stiffness` and p = (w, v) the rotation
/// from `at` to the handle's orientation, p = q · at⁻¹:
///
///     τ(q) = torque − 2 (w K v + v × K v)          N·m
///
/// which is −K θ for a small turn θ, and the gradient of the energy 2 vᵀ K v (J), so that no way round makes energy; p
/// and −p give the same torque.
struct RotationModel {
  Quat at;                        ///< the orientation that the torque was computed for
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂τ/∂θ, base frame axes
};

/// The torque that a remote physics engine wants the hand to feel: on the hand, base frame axes, about the handle's
/// position.
struct RemoteTorque {
  Vec3 torque = Vec3::Zero();  ///< N·m
  std::optional<RotationModel> model{};
};

/// The force that a remote physics engine wants the hand to feel.
///
/// **Sign, everywhere in Tendon:** a force is what the device exerts *on the hand*, so a wall that
/// resists motion along +x sends −x. (The reflective force f of Lee & Lee 2009 is its negative.)
struct RemoteForce {
  std::uint64_t sequence = 0;      ///< strictly increasing per session; 0 means "none yet"
  std::uint64_t answers_tick = 0;  ///< the haptic step whose motion this force answers
  LocalTime answers{};             ///< when that motion was sampled; now − answers = the loop's age
  LocalTime received{};            ///< when it reached us
  Vec3 force = Vec3::Zero();       ///< N, on the hand
  std::optional<LocalModel> model{};
  Duration valid_for{};      ///< counted from `received`; older than this it is no longer fresh
  std::uint32_t source = 0;  ///< who sent it: the forces of another engine are ramped in
  /// The body has been cut or torn since the answer before this one: neither answer's model can be relied on.
  bool topology_changed = false;
  std::uint8_t way = 0;           ///< number of the way by which the engine made it; 0: not said. No law looks at it
  std::optional<double> error{};  ///< N, ≥ 0: what the engine itself thinks `force` may be wrong by
  std::optional<RemoteTorque> torque{};
  std::optional<double> grip_force{};  ///< N, on the fingers of the gripper; > 0 opens them
};

}  // namespace tendon
