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

struct Pose {
  Vec3 position = Vec3::Zero();  ///< m
  Mat3 turn = Mat3::Identity();  ///< from the handle frame
};

struct FeltTorque {
  Vec3 torque = Vec3::Zero();     ///< N·m
  Mat3 stiffness = Mat3::Zero();  ///< N·m/rad, −∂torque/∂θ, positive semidefinite
};

Mat3 not_negative(const Mat3& stiffness);  ///< nearest positive semidefinite matrix

struct Feel {
  Vec3 force = Vec3::Zero();      ///< N, on the hand
  Mat3 stiffness = Mat3::Zero();  ///< N/m, −∂force/∂position, symmetric; can be indefinite
  double gap = 0;           ///< m, from the tool to the surface at rest along the normal; negative: the tool is inside
  double valid_radius = 0;  ///< m, motion until `force` and `stiffness` are invalid; does not consider `gap`
  double error = 0;         ///< N, estimated by the solver
  SolverPath way = SolverPath::kOnly;
  bool touching = false;
  std::optional<Vec3> normal{};        ///< unit vector; empty: the scene's direction to the tool
  bool topology_changed = false;       ///< true after a cut
  std::optional<FeltTorque> torque{};  ///< empty if the force cannot turn the handle
};

/// A tool on a patch of a body. Without friction the force is the gradient of an energy E(q), the minimum of the
/// elastic energy for the tool at q. If the body is at rest, it never gives out energy. c is the tangential position of
/// the patch, h(c) the mean height of the surface at rest, δ = h(c) − q·n the depth, and F(δ, c) the force of the body:
///
///     force = F·n + F·(∂depth/∂c − ∂h/∂c)
///
/// The second part is tangential, from the slope of the surface. The stiffness is the second derivative of E. P is the
/// tangential projection, k = ∂F/∂δ, g = ∂depth/∂c − ∂h/∂c, and t = tilting, M = curving and D = giving are from
/// Reaction::Glide:
///
///     K = k v vᵀ + F (v (Pᵀt)ᵀ + Pᵀt vᵀ) + F Pᵀ (∂²h/∂c² − M − F D) P,   v = n + Pᵀg
///
/// If the model has no Glide, K is k v vᵀ with v = n + Pᵀ(2 ∂depth/∂c − ∂h/∂c), as for a linear body. If the body has
/// time, each answer is one Model::step(). Friction adds a tangential force and stiffness.
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
