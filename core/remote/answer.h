// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/base/motion.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

// The device loop uses these functions to compute the force at the current position from the newest answer.

namespace tendon {

/// Returns true if all numbers are finite and in range, and if all orientations are rotations (remote_force.h).
bool is_sound(const RemoteForce& answer) noexcept;

/// Returns the part of a sound answer that the loop uses (core/PROOFS.md, "Local models"):
///     topology_changed   only the force; the model is dropped
///     stiffness          (K + Kᵀ)/2 with its eigenvalues clamped to [0, max_stiffness], which cannot generate energy
///     table              adjacent entries from the one nearest to the answered depth, as long as neighbours differ by
///                        at most max_stiffness · step
///     normal             of unit length
/// `max_stiffness` is in N/m. Realtime-safe: yes.
RemoteForce believed(const RemoteForce& answer, double max_stiffness) noexcept;

/// Treats the stiffness of a sound torque as above, with `max_angular_stiffness` in N·m/rad.
RemoteTorque believed(const RemoteTorque& torque, double max_angular_stiffness) noexcept;

/// Returns the torque (N·m) of an answer at the orientation `q`, from its model (RotationModel). It is zero if the
/// handle has turned by more than 150° since, and constant without a model.
Vec3 reconstruct(const RemoteTorque& torque, const Quat& q) noexcept;

/// Returns the position nearest to `position` for which the model is valid. The force is constant outside the radius,
/// because a jump to the answered force would feel like a kick.
Vec3 within(const LocalModel& model, const Vec3& position) noexcept;

/// Returns the force of an answer at `position`. With x′ = within(model, x), the depth d = −n·(x − at) since the
/// answer, and the linear model L(x) = force − K (x′ − at):
///     no model    F = force
///     no contact  F = L
///     contact     F = N n + s (I − n nᵀ) L,    N = max(0, n·L), but 0 where the gap, gap + n·(x − at), is above
///                                              max(0, gap): a surface does not pull, and ends at its own position
///     table       the same with N = table(d), which is also valid beyond the radius
/// s = N / (n·force), clamped to [0, 1]: the tangential force fades with the normal force. The stiffness is −∂F/∂x for
/// constant s. The stiffness is zero outside the radius, outside the table, and in segments of the table that decrease.
///
/// Friction cone: if a contact has no radius, it is unknown when the tool starts to slide. The norm of the tangential
/// force is then limited to that of the answer, scaled by N₊/(n·force), because the friction coefficient is at least
/// that of the answer. If the limit is used, the tangential stiffness is zero. AdaptiveLocalModel ignores contacts, and
/// has no cone.
///
/// Source: this was compared with holding, with extrapolation in time and with secants. The table was best for less
/// than 50 answers per second, and otherwise the stiffness (tests/tools/lab/experiments/reconstruction_test.cc).
/// Engines that send their model: James and Pai, "A unified treatment of elastostatic contact simulation for real-time
/// haptics", Haptics-e 2(1), 2001; Mahvash and Hayward, IEEE CG&A 24(2), 2004 (curves of force against depth).
/// Realtime-safe: yes.
Prediction reconstruct(const RemoteForce& answer, const Vec3& position) noexcept;

}  // namespace tendon
