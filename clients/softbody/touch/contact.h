// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <utility>

#include "clients/softbody/models/model.h"
#include "clients/softbody/touch/friction.h"

namespace tendon::softbody {

/// Position and orientation of a handle.
struct Pose {
  Vec3 position = Vec3::Zero();  ///< m
  Mat3 turn = Mat3::Identity();  ///< from the handle frame
};

struct FeltTorque {
  Vec3 torque = Vec3::Zero();     ///< N·m, about the handle's position
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂torque/∂θ, positive semidefinite
};

/// Returns the nearest positive semidefinite matrix.
Mat3 not_negative(const Mat3& stiffness);

/// The answer to one position of the tool.
struct Feel {
  Vec3 force = Vec3::Zero();  ///< N, on the hand
  /// N/m, −∂force/∂position. It is symmetric and can be indefinite.
  Mat3 stiffness = Mat3::Zero();
  /// The distance from the tool to the surface at rest along the normal (m). Negative if the tool is inside.
  double gap = 0;
  /// The tool may move by this distance (m) before `force` and `stiffness` are invalid. It does not consider `gap`.
  double valid_radius = 0;
  double error = 0;  ///< N, estimated by the solver
  Way way = Way::kOnly;
  bool touching = false;
  std::optional<Vec3> normal{};        ///< unit vector; empty: the scene's direction to the tool
  bool topology_changed = false;       ///< true for the first answer after a cut
  std::optional<FeltTorque> torque{};  ///< empty if the force cannot turn the handle
};

/// A tool that presses a patch of a body.
///
/// Without friction the force is the gradient of one energy, E(q) = minimum elastic energy with the tool at q, so a
/// body at rest never generates energy on any path. With the tangential patch center c, the rest height h(c) of the
/// surface (mean over the patch), the depth δ = h(c) − q·n and the body's reaction F(δ, c):
///
///     force = F·n + F·(∂depth/∂c − ∂h/∂c)
///
/// The tangential part is the effect of the deformed surface's slope on a sliding tool. With k = ∂F/∂δ, P the
/// tangential projection, g = ∂depth/∂c − ∂h/∂c, and t = tilting, M = curving, D = giving of Reaction::Glide:
///
///     K = k v vᵀ + F (v (Pᵀt)ᵀ + Pᵀt vᵀ) + F Pᵀ (∂²h/∂c² − M − F D) P,   v = n + Pᵀg
///
/// the second derivative of E. If the model does not provide its Glide, the stiffness is k v vᵀ with v = n + Pᵀ(2
/// ∂depth/∂c − ∂h/∂c), that of a linear body without second derivatives. For a body with time each answer simulates one
/// Model::step(). Friction adds its tangential force and stiffness.
///
/// Thread-safe: no. Realtime-safe: no.
class PatchContact {
 public:
  enum class Side : std::uint8_t {
    kUnilateral,  ///< the tool cannot pull
    kBilateral,   ///< after the first contact the tool sticks and can pull
  };

  /// A tool with a `tool_radius` (m) above 0 touches earlier. `model` and `surface` must outlive this object.
  PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side,
               std::unique_ptr<Friction> friction = {});

  /// Returns the answer for a tool at `tool` (m, body frame). There is no force if the patch is not on the body.
  Feel at(const Vec3& tool);

  /// Continues from `before` and takes its friction.
  void go_on_from(PatchContact& before) {
    stuck_ = before.stuck_;
    friction_ = std::move(before.friction_);
  }

  std::size_t bytes() const noexcept { return friction_ ? friction_->bytes() : 0; }

 private:
  void rub(const Vec2& place, double normal_force, Feel& feel);

  Model& model_;
  const TouchSurface& surface_;
  double tool_radius_;
  Side side_;
  bool stuck_ = false;
  std::unique_ptr<Friction> friction_;
};

}  // namespace tendon::softbody
