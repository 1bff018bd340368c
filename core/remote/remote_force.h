// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>

#include "core/base/motion.h"

namespace tendon {

/// The force along the normal of a contact at several depths. force[i] is along +normal, for a tool that is `depth_i =
/// first + i · step` deeper than at the answer, at `at − depth_i · normal`. Linear in between, constant beyond.
struct ForceTable {
  static constexpr std::size_t kMinEntries = 2;
  static constexpr std::size_t kMaxEntries = 16;  ///< 5 mm if the entries are spaced by 0.3 mm; uses 128 bytes
  double first = 0;                               ///< m; if negative, the table starts closer to the hand
  double step = 0;                                ///< m, > 0
  std::uint32_t size = 0;                         ///< entries, kMinEntries … kMaxEntries
  std::array<double, kMaxEntries> force{};        ///< N
};

/// A surface at or near the tool. It can only push if there is no table.
struct Contact {
  static constexpr double kUnitTolerance = 1e-3;  ///< for the length of the normal
  Vec3 normal = Vec3::UnitX();                    ///< unit vector from the body to the hand
  double gap = 0;  ///< m, distance from the surface to the tool along the normal, or negative if the tool is inside
  std::optional<ForceTable> table{};
};

/// The remote environment linearized near one position, so that the device loop can follow the hand between two forces:
///     F(x) = force − stiffness · (x − at)          N, with stiffness = −∂F/∂x in N/m
/// A spring has a positive stiffness; a wall with normal n has k·n·nᵀ. For the other members see core/remote/answer.h.
struct LocalModel {
  Vec3 at = Vec3::Zero();         ///< m, the position for which the force was computed
  Mat3 stiffness = Mat3::Zero();  ///< N/m
  /// m, ≥ 0: the distance from `at` up to which the stiffness is valid; +infinity if unknown.
  double valid_radius = std::numeric_limits<double>::infinity();
  std::optional<Contact> contact{};
};

/// The change of a torque with the orientation of the handle. With K = `stiffness` and p = (w, v) the rotation from
/// `at` to the orientation of the handle, p = q · at⁻¹:
///     τ(q) = torque − 2 (w K v + v × K v)          N·m
/// This is −K θ for a small rotation θ, and the gradient of the energy 2 vᵀ K v (J), so a closed path generates no
/// energy. p and −p give the same torque.
struct RotationModel {
  Quat at;                        ///< the orientation for which the torque was computed
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂τ/∂θ, base frame axes
};

/// The torque on the hand, requested by a remote physics engine, in base frame axes, about the position of the handle.
struct RemoteTorque {
  Vec3 torque = Vec3::Zero();  ///< N·m
  std::optional<RotationModel> model{};
};

/// The force on the hand that is requested by a remote physics engine. **Sign, everywhere in Tendon:** a force is
/// exerted by the device *on the hand*, so a wall that resists motion along +x sends −x. (Lee & Lee 2009 use f = −F.)
struct RemoteForce {
  std::uint64_t sequence = 0;      ///< increases strictly within a session; 0 if there is no force yet
  std::uint64_t answers_tick = 0;  ///< the haptic step with the answered motion; the first step has the number 1
  LocalTime answers{};             ///< time when this motion was sampled, used to compute `loop_age`
  LocalTime received{};            ///< arrival time
  Vec3 force = Vec3::Zero();       ///< N, on the hand
  std::optional<LocalModel> model{};
  Duration valid_for{};      ///< from `received`; an older force is not fresh
  std::uint32_t source = 0;  ///< identifies the sender, because the first force of another engine is ramped in
  /// If true, the body was cut or torn since the previous answer, and the models of both answers are not valid.
  bool topology_changed = false;
  /// Generation of a field (FieldUse). If it is not 0, `force` is not rendered: it is the true force of the object in
  /// the answered step, from which the field learns.
  std::uint32_t field = 0;
  std::uint8_t way = 0;           ///< number of the solver path in the engine, or 0 if unknown (for diagnostics)
  std::optional<double> error{};  ///< N, ≥ 0; error of `force`, as estimated by the engine
  std::optional<RemoteTorque> torque{};
  std::optional<double> grip_force{};  ///< N; opens the fingers of the gripper if positive
};

}  // namespace tendon
