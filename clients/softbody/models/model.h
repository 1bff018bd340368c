// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "clients/softbody/fem/patch.h"

namespace tendon::softbody {

struct Division;
struct EffectsConfig;

/// Which of depth and force is given; the other is asked for.
enum class Given : std::uint8_t {
  kDepth,       ///< m, how deep the mean of the patch is held; the force is asked for, and may pull
  kLeastDepth,  ///< m, how deep it is at least: the tool pushes, but does not pull
  kForce,       ///< N, on the body; the depth is asked for
};

/// A body's answer to a patch that presses into it, against the surface's normal.
struct Reaction {
  double force = 0;  ///< N, of the body on the tool, along the normal
  double depth = 0;  ///< m, mean over the patch, from where the mesh has its surface
  /// N/m, ∂force/∂depth. Of a body with time the force for each metre from its shape at rest: what inertia would add
  /// within one step is not felt by a hand that moves on evenly.
  double stiffness = 0;
  Vec2 slope = Vec2::Zero();  ///< ∂depth/∂(place of the patch) with the body held as it is: the mean tilt below it
  double error = 0;           ///< N, how far the solver may still be from its own mesh's answer; not the mesh's error
};

/// The force that a tool needs for what is given, when without it the depth were `untouched` and each newton adds
/// `compliance` (m/N).
double constrained_force(Given given, double value, double untouched, double compliance);

/// Reaction::stiffness of a body with time, which at rest and untouched would have the depth `rest`.
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

  /// The body's answer to one patch; a model with a state goes on from where the last call left it, by one step of
  /// time if it has time. A patch without nodes is a tool that is elsewhere.
  virtual Reaction press(const Patch& patch, Given given, double value) = 0;

  /// To be called after the solid has been cut in place. Continues from the current displacements, and reuses the
  /// factor of the system where it can. Throws std::logic_error where ModelInfo::may does not have
  /// kCutting.
  virtual void cut(const Division& division, const EffectsConfig& effects);

  /// s, how long a press lasts. 0: the body is at rest at every instant.
  virtual double step() const noexcept { return 0; }

  /// Whether the body has the shape of its mesh when nothing touches it; then it need not be asked.
  virtual bool still() const noexcept { return true; }

  /// Bytes of its matrices and its state.
  virtual std::size_t bytes() const noexcept = 0;
};

/// Presses until two answers, of bodies with time a hundredth of a second apart, differ by less than `tolerance`
/// (relative, in force and depth), or `most` seconds have gone by. The last answer; what it may still lack is added to
/// its error.
Reaction settle(Model& model, const Patch& patch, Given given, double value, double tolerance = 1e-4, double most = 5);

}  // namespace tendon::softbody
