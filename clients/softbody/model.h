// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>

#include "clients/softbody/patch.h"

namespace tendon::softbody {

/// What is given, and what is asked for.
enum class Given : std::uint8_t {
  kDepth,  ///< m, how deep the mean of the patch is pressed; the force is asked for
  kForce,  ///< N, on the body; the depth is asked for
};

/// What a body does under a patch that presses into it, against the surface's normal.
struct Reaction {
  double force = 0;           ///< N, of the body on the tool, along the normal
  double depth = 0;           ///< m, mean over the patch
  double stiffness = 0;       ///< N/m, ∂force/∂depth
  Vec2 slope = Vec2::Zero();  ///< ∂depth/∂(place of the patch) with the body held as it is: the mean tilt below it
  double error = 0;           ///< N, how far the solver may still be from its own mesh's answer; not the mesh's error
};

/// A body that can be pressed. Each model is a file of this folder.
///
/// Thread-safe: no. Realtime-safe: no.
class Model {
 public:
  Model() = default;
  virtual ~Model() = default;
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  /// The body's answer to one patch; a model with a state goes on from where the last call left it.
  virtual Reaction press(const Patch& patch, Given given, double value) = 0;

  /// What it keeps, matrices and state.
  virtual std::size_t bytes() const noexcept = 0;
};

}  // namespace tendon::softbody
