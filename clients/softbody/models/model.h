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

/// Whether a press prescribes depth or force; the answer gives the other.
enum class Given : std::uint8_t {
  kDepth,       ///< m, mean depth of the patch; the force may pull
  kLeastDepth,  ///< m, lower bound of the mean depth: the tool pushes but does not pull
  kForce,       ///< N, on the body
};

/// How a kNear body has answered (near/). The values and kWayNames are sent to the server.
enum class Way : std::uint8_t {
  kOnly = 0,   ///< the model has only one way, or was not asked
  kTabulated,  ///< energy table
  kLearned,    ///< learned shapes
  kNear,       ///< near field
  kWhole,      ///< near field that covers the whole body
  kLinear,     ///< linear body, while no near field is ready
};

/// Indexed by Way − 1.
inline constexpr std::array<std::string_view, 5> kWayNames = {"tabulated", "learned", "near", "whole", "linear"};
constexpr std::string_view name_of(Way way) {
  return way == Way::kOnly ? "" : kWayNames.at(static_cast<std::size_t>(way) - 1);
}

/// A body's answer to a patch that presses into it, against the surface normal.
struct Reaction {
  double force = 0;  ///< N, of the body on the tool, along the normal
  double depth = 0;  ///< m, mean over the patch, below the mesh surface
  /// N/m, ∂force/∂depth. For a body with time: force over displacement from the rest shape, so a steadily moving hand
  /// does not feel the stiffness that inertia adds within one step.
  double stiffness = 0;
  Vec2 slope = Vec2::Zero();  ///< ∂depth/∂(patch position) with the body frozen: the mean tilt below the patch
  /// How force and slope change as the patch slides by c; PatchContact needs it for the full stiffness. With w the
  /// patch weights as a load, W = ∂w/∂c, and A the body's stiffness:
  struct Glide {
    Vec2 tilting = Vec2::Zero();  ///< 1/m, ∂slope/∂depth
    Mat2 curving = Mat2::Zero();  ///< 1/m, ∂slope/∂c with the body frozen
    Mat2 giving = Mat2::Zero();   ///< 1/(N m), Wᵀ A⁻¹ W at a held depth
  };
  Glide glide;
  bool knows_glide = false;  ///< otherwise `glide` is zero; see Model::glides()
  double error = 0;  ///< N, estimated distance to the exact solution on this mesh; excludes the discretization error
  Way way = Way::kOnly;  ///< of a blended answer, the way with the larger share
};

/// The tool force (N) for a prescribed depth or force, if the depth without the tool is `untouched` (m) and each newton
/// adds `compliance` (m/N).
double constrained_force(Given given, double value, double untouched, double compliance);

/// Reaction::stiffness of a body with time whose untouched depth at rest is `rest` (m).
double secant(const Reaction& reaction, double rest);

/// A body that can be pressed.
///
/// Thread-safe: no. Realtime-safe: no.
class Model {
 public:
  Model() = default;
  virtual ~Model() = default;
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  /// The answer to one patch. A model with state continues from the previous call; a model with time advances by one
  /// step. A patch without nodes means no contact.
  virtual Reaction press(const Patch& patch, Given given, double value) = 0;

  /// To be called after the solid was cut in place. Continues from the current displacements and reuses the factor if
  /// possible. Throws std::logic_error if the model does not support cutting (ModelInfo::may).
  virtual void cut(const Division& division, const EffectsConfig& effects);

  /// Continues from the shape of `before`, the same model and effects before a cut. Node i here was node_before[i]
  /// there. Throws the errors of cut().
  virtual void go_on_from(const Model& before, std::span<const int> node_before);

  /// Time simulated by one press, s. 0: the body is always at rest.
  virtual double step() const noexcept { return 0; }

  /// True if the untouched body always has its mesh shape, so that press() can be skipped.
  virtual bool still() const noexcept { return true; }

  /// True if press() computes Reaction::glide for a patch with curvatures.
  virtual bool glides() const noexcept { return false; }

  /// Memory of the model's matrices and state.
  virtual std::size_t bytes() const noexcept = 0;
};

/// Presses until two answers differ by less than `tolerance` (relative, in force and depth), or `most` seconds were
/// simulated. For a body with time the two answers are 0.01 s apart. Returns the last answer; its error includes the
/// remaining change.
Reaction settle(Model& model, const Patch& patch, Given given, double value, double tolerance = 1e-4, double most = 5);

}  // namespace tendon::softbody
