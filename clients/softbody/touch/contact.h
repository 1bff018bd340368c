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

/// Where a handle is and how it is turned.
struct Pose {
  Vec3 position = Vec3::Zero();  ///< m
  Mat3 turn = Mat3::Identity();  ///< a rotation: handle frame into the frame of `position`
};

/// What a tool that is longer than a point feels beside the force.
struct FeltTorque {
  Vec3 torque = Vec3::Zero();     ///< N·m, on the hand, about the handle's position
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂torque/∂θ of a small turn θ, symmetric, not negative
};

/// The nearest symmetric matrix that is not negative: what a stiffness may be.
Mat3 not_negative(const Mat3& stiffness);

/// The answer to one position of the tool.
struct Feel {
  Vec3 force = Vec3::Zero();  ///< N, on the hand
  /// N/m, −∂force/∂position, symmetric. It may have negative directions, in which the tool would rather slip away.
  Mat3 stiffness = Mat3::Zero();
  /// m, the distance from the tool to the body along the normal; below 0: inside. While the tool touches, the distance
  /// is to the body's surface at rest.
  double gap = 0;
  /// m, how far the tool may move before `force` and `stiffness` no longer hold. It ignores that the tool may leave the
  /// surface on the way: see `gap`.
  double valid_radius = 0;
  double error = 0;  ///< N, the solver's estimate of its own error
  Way way = Way::kOnly;
  bool touching = false;
  std::optional<Vec3> normal{};   ///< where the tool is from the body, a unit vector; empty: towards the scene's tool
  bool topology_changed = false;  ///< this is the first answer since the body was cut; earlier ones no longer hold
  std::optional<FeltTorque> torque{};  ///< empty: the tool is where the handle is, and no force turns it
};

/// A tool that presses a patch of a body.
///
/// Without friction the force is the slope of one energy, E(q) = least elastic energy with the tool at q. So a body at
/// rest never gives out more energy than was put in, on any path of the tool. With the middle c of the patch across,
/// the height h(c) of the surface at rest (its mean over the patch), the depth δ = h(c) − q·n and the body's reaction
/// F(δ, c):
///
///     force = F·n + F·(∂depth/∂c − ∂h/∂c)
///
/// The part across is the effect of the deformed surface's slope on a gliding tool. With k = ∂F/∂δ, P the projection
/// across, g = ∂depth/∂c − ∂h/∂c, and of the body's Reaction::Glide t = tilting, M = curving and D = giving, each where
/// the body is:
///
///     K = k v vᵀ + F (v (Pᵀt)ᵀ + Pᵀt vᵀ) + F Pᵀ (∂²h/∂c² − M − F D) P,   v = n + Pᵀg
///
/// the second derivative of E. Of a model that knows no Glide, or is not asked for it, `Feel` has k v vᵀ with
/// v = n + Pᵀ(2 ∂depth/∂c − ∂h/∂c), which is what a linear body has without second derivatives. For a body with time
/// each answer simulates one Model::step(). Friction adds its force and stiffness across.
///
/// Thread-safe: no. Realtime-safe: no.
class PatchContact {
 public:
  enum class Side : std::uint8_t {
    kUnilateral,  ///< the tool leaves the body as soon as it would have to pull
    kBilateral,   ///< after the first touch the tool sticks to the patch along the normal, and pulls
  };

  /// `tool_radius` (m): 0 is a point; a sphere touches earlier by its radius. Model and surface must outlive this.
  PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side,
               std::unique_ptr<Friction> friction = {});

  /// The answer with the tool's middle at `tool` (m, body frame). There is no force when the patch is not on the body,
  /// or when `tool` is not finite.
  Feel at(const Vec3& tool);

  /// Goes on as `before` did, which gives its friction away.
  void go_on_from(PatchContact& before) {
    stuck_ = before.stuck_;
    friction_ = std::move(before.friction_);
  }

  std::size_t bytes() const noexcept { return friction_ ? friction_->bytes() : 0; }  ///< bytes of its effects

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
