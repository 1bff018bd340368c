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
  Mat3 turn = Mat3::Identity();  ///< rotation from the handle frame to the frame of `position`
};

/// The torque on the hand.
struct FeltTorque {
  Vec3 torque = Vec3::Zero();  ///< N·m, about the handle's position
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂torque/∂θ for a small rotation θ; symmetric positive semidefinite
};

/// The nearest symmetric positive semidefinite matrix.
Mat3 not_negative(const Mat3& stiffness);

/// The answer to one tool position.
struct Feel {
  Vec3 force = Vec3::Zero();  ///< N, on the hand
  /// N/m, −∂force/∂position, symmetric. Can be indefinite, in directions in which the tool would slip off.
  Mat3 stiffness = Mat3::Zero();
  /// m, distance from the tool to the body along the normal; negative inside. During contact it is measured to the
  /// surface at rest.
  double gap = 0;
  /// m, tool motion within which `force` and `stiffness` hold. Does not account for leaving the surface: see `gap`.
  double valid_radius = 0;
  double error = 0;  ///< N, estimated error of the solver
  Way way = Way::kOnly;
  bool touching = false;
  std::optional<Vec3> normal{};   ///< unit vector from the body to the tool; empty: the scene's direction to the tool
  bool topology_changed = false;  ///< first answer after a cut; earlier answers no longer hold
  std::optional<FeltTorque> torque{};  ///< empty: the tool is at the handle, and no force rotates it
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
    kUnilateral,  ///< the tool separates instead of pulling
    kBilateral,   ///< after first contact the tool sticks to the patch along the normal, and can pull
  };

  /// `tool_radius` (m): 0 for a point; a sphere makes contact earlier by its radius. Model and surface must outlive
  /// this.
  PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side,
               std::unique_ptr<Friction> friction = {});

  /// The answer with the tool's center at `tool` (m, body frame). No force if the patch is not on the body or `tool` is
  /// not finite.
  Feel at(const Vec3& tool);

  /// Continues from `before`, and takes over its friction.
  void go_on_from(PatchContact& before) {
    stuck_ = before.stuck_;
    friction_ = std::move(before.friction_);
  }

  std::size_t bytes() const noexcept { return friction_ ? friction_->bytes() : 0; }  ///< of the effects

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
