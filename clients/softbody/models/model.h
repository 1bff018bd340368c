// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "clients/softbody/fem/patch.h"

namespace tendon::softbody {

struct Division;
struct EffectsConfig;

/// Whether the depth or the force is given; the answer has the other one.
enum class Given : std::uint8_t {
  kDepth,       ///< m, the mean depth at which the patch is held; the force may pull
  kLeastDepth,  ///< m, the least mean depth: the tool pushes but does not pull
  kForce,       ///< N, on the body
};

/// How a body of the model "near" has answered (near/). What it tells the server is these numbers, and kWayNames.
enum class Way : std::uint8_t {
  kOnly = 0,   ///< the model has one way, or nothing was asked of it
  kTabulated,  ///< by the table of answers
  kLearned,    ///< by learned shapes
  kNear,       ///< by a near field
  kWhole,      ///< likewise, of a body all of which is near
  kLinear,     ///< by the linear body, where no near field is ready
};

/// By Way, from 1 on.
inline constexpr std::array<std::string_view, 5> kWayNames = {"tabulated", "learned", "near", "whole", "linear"};
constexpr std::string_view name_of(Way way) {
  return way == Way::kOnly ? "" : kWayNames.at(static_cast<std::size_t>(way) - 1);
}

/// A body's answer to a patch that presses into it, against the surface's normal.
struct Reaction {
  double force = 0;  ///< N, of the body on the tool, along the normal
  double depth = 0;  ///< m, mean over the patch, below the surface of the mesh
  /// N/m, ∂force/∂depth. For a body with time it is the force for each metre from the shape at rest: a hand that moves
  /// evenly does not feel the stiffness that inertia adds within one step.
  double stiffness = 0;
  Vec2 slope = Vec2::Zero();  ///< ∂depth/∂(place of the patch) with the body held as it is: the mean tilt below it
  /// How force and slope change as the patch glides by c: what PatchContact needs for the whole stiffness. With w the
  /// patch's weights as a load, W = ∂w/∂c and A the body's stiffness.
  struct Glide {
    Vec2 tilting = Vec2::Zero();  ///< 1/m, ∂slope/∂depth as the patch is pressed on
    Mat2 curving = Mat2::Zero();  ///< 1/m, ∂slope/∂c with the body held as it is
    Mat2 giving = Mat2::Zero();   ///< 1/(N m), Wᵀ A⁻¹ W at a held depth
  };
  Glide glide;
  bool knows_glide = false;  ///< else `glide` is zero; see Model::glides()
  double error = 0;          ///< N, the distance that may remain to the mesh's exact answer; not the mesh's own error
  Way way = Way::kOnly;      ///< of two that are mixed, the one that has the greater share
};

/// The force (N) with which a tool reaches the given depth or force, when the depth without it is `untouched` (m) and
/// each newton adds `compliance` (m/N).
double constrained_force(Given given, double value, double untouched, double compliance);

/// Reaction::stiffness of a body with time whose depth is `rest` (m) when it is at rest and untouched.
double secant(const Reaction& reaction, double rest);

/// A body that can be pressed. Each model is a file of this folder.
///
/// Thread-safe: no. Realtime-safe: no.
class Model {
 public:
  Model() = default;
  virtual ~Model() = default;
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  /// The body's answer to one patch. A model with a state continues from the state of the last call; a model with time
  /// advances by one step. A patch without nodes means that the tool is elsewhere.
  virtual Reaction press(const Patch& patch, Given given, double value) = 0;

  /// Call it after the solid has been cut in place. Continues from the current displacements, and reuses the factor of
  /// the system where it can. Throws std::logic_error when the model's ModelInfo::may lacks kCutting.
  virtual void cut(const Division& division, const EffectsConfig& effects);

  /// Goes on from the shape of `before`, a model of the same kind and effects of the body before it was cut. Node i of
  /// this one was node_before[i] there. Throws as cut() does.
  virtual void go_on_from(const Model& before, std::span<const int> node_before);

  /// The time that one press simulates, s. 0: the body is at rest at every instant.
  virtual double step() const noexcept { return 0; }

  /// True when the body always has the shape of its mesh while nothing touches it: then it need not be asked.
  virtual bool still() const noexcept { return true; }

  /// True when Reaction::glide is wanted, and given for a patch that has its curvatures.
  virtual bool glides() const noexcept { return false; }

  /// Bytes of the model's matrices and state.
  virtual std::size_t bytes() const noexcept = 0;
};

/// Presses until two answers differ by less than `tolerance` (relative, in force and depth), or `most` seconds have
/// passed. For a body with time the two answers are a hundredth of a second apart. Returns the last answer; its error
/// includes the change that may still come.
Reaction settle(Model& model, const Patch& patch, Given given, double value, double tolerance = 1e-4, double most = 5);

}  // namespace tendon::softbody
