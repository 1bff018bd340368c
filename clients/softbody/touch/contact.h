// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>

#include "clients/softbody/models/model.h"
#include "clients/softbody/touch/friction.h"

namespace tendon::softbody {

/// The answer to one place of the tool.
struct Feel {
  Vec3 force = Vec3::Zero();      ///< N, on the hand
  Mat3 stiffness = Mat3::Zero();  ///< N/m, −∂force/∂position, symmetric, not negative
  /// m, from the tool to the body along the normal: as it lies, and where it touches as it would lie at rest; below 0:
  /// inside.
  double gap = 0;
  /// m, how far the tool may move before `force` and `stiffness` no longer hold. It does not count that the tool may
  /// leave the surface on the way: see `gap`.
  double valid_radius = 0;
  double error = 0;  ///< N, the solver's estimate of its own
  bool touching = false;
  bool topology_changed = false;  ///< the first answer since the body was cut: earlier ones were of another body
};

/// A tool that a patch of a body gives way to.
///
/// Without friction the force is the slope of one energy, E(q) = least elastic energy with the tool at q, so the body
/// at rest never gives out more than was put in, however the tool goes. With the middle c of the patch across, the
/// height h(c) of the surface at rest (its mean over the patch), the depth δ = h(c) − q·n and the body's reaction F(δ,
/// c):
///
///     force = F·n + F·(∂depth/∂c − ∂h/∂c)
///
/// The part across is what the slope of the deformed surface does to a tool that glides. Of a linear body's stiffness,
///
///     K = k·v·vᵀ + (second derivatives by c),   v = n + 2 ∂depth/∂c − ∂h/∂c,   k = ∂F/∂δ
///
/// the first term is given, which is never negative. Of a body with time each answer lasts one Model::step(); friction
/// adds its force and stiffness across.
///
/// Thread-safe: no. Realtime-safe: no.
class PatchContact {
 public:
  enum class Side : std::uint8_t {
    kUnilateral,  ///< the tool leaves the body when it would have to pull
    kBilateral,   ///< once it has touched, it sticks to the patch along the normal, and pulls
  };

  /// `tool_radius`: 0 is a point; a sphere touches so much earlier. Model and surface must outlive this.
  PatchContact(Model& model, const TouchSurface& surface, double tool_radius, Side side,
               std::unique_ptr<Friction> friction = {});

  /// The tool's middle at `tool`, m, in the body's frame. Where its patch is not on the body it feels nothing, and
  /// nor does it when `tool` is not finite.
  Feel at(const Vec3& tool);

  std::size_t bytes() const noexcept { return friction_ ? friction_->bytes() : 0; }  ///< of effects

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
