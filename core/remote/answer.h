// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

// How the device loop uses one answer of a remote engine until the next one comes: which part of it is believed, and
// which force it means where the hand is by then.

namespace tendon {

/// Whether every number is finite and in its range, and every orientation a rotation (remote_force.h).
bool is_sound(const RemoteForce& answer) noexcept;

/// The part of a sound answer that is followed:
///
///     topology_changed   nothing but the force: its model is dropped
///     stiffness          the nearest one that stores energy and loses none, no stiffer than max_stiffness:
///                        (K + Kᵀ)/2 with its eigenvalues clamped to [0, max_stiffness]
///     table              of adjacent entries, from the one nearest to the answered depth on, none differs by more than
///                        max_stiffness · step
///     normal             of unit length
///
/// The antisymmetric part of K is dropped because following it round a circle makes energy; negative stiffness is
/// dropped because it can only come from an environment that is not passive. A table may fall: any force along one line
/// has a potential. `max_stiffness` in N/m.
///
/// Realtime-safe: yes.
RemoteForce believed(const RemoteForce& answer, double max_stiffness) noexcept;

/// The part of a sound torque that is followed: its stiffness as above, with `max_angular_stiffness` in N·m/rad.
RemoteTorque believed(const RemoteTorque& torque, double max_angular_stiffness) noexcept;

/// The torque (N·m) that an answer means at the orientation `q`: by its model (RotationModel), but zero where the
/// handle has turned by more than 150° since; the torque alone when it has none.
Vec3 reconstruct(const RemoteTorque& torque, const Quat& q) noexcept;

/// The position nearest to `position` for which a model is valid. Beyond the model's radius the force stays what it is
/// at the edge; a jump back to the answered force would be felt as a kick.
Vec3 within(const LocalModel& model, const Vec3& position) noexcept;

/// The force that an answer means at `position`. With x′ = within(model, x), the depth d = −n·(x − at) since the
/// answer, and the linear model L(x) = force − K (x′ − at):
///
///     no model    F = force
///     no contact  F = L
///     contact     F = N n + s (I − n nᵀ) L,    N = max(0, n·L), but 0 where the gap, gap + n·(x − at), is above
///                                              max(0, gap): a surface does not pull, and is not felt beyond itself
///     table       the same with N = table(d), which holds beyond the radius too
///
/// s = N / (n·force), clamped to [0, 1]: the tangential force fades with the normal force. The stiffness is −∂F/∂x with
/// s held; it is zero beyond the radius and at the ends of the table, and where a table falls it counts as zero.
///
/// Source: measured against hold, extrapolation in time and secants, the table is the best below 50 answers per second
/// and the stiffness above (tests/tools/lab/experiments/reconstruction_test.cc). The idea that engines send the model
/// they have: James and Pai, "A unified treatment of elastostatic contact simulation for real-time
/// haptics", Haptics-e 2(1), 2001; Mahvash and Hayward, IEEE CG&A 24(2), 2004 (curves of force against depth).
///
/// Realtime-safe: yes.
Prediction reconstruct(const RemoteForce& answer, const Vec3& position) noexcept;

}  // namespace tendon
