// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Linear elasticity in a reduced basis (Pentland & Williams 1989): the slowest vibration modes and, optionally, static
/// modes, which are the displacements under a force on a patch. Local contact requires far too many vibration modes.
/// Quasi-static: the compliance is |Bᵀw|², with B the shapes at the surface, each scaled to unit stiffness.
class ModalModel : public Model {
 public:
  struct Config {
    int swings = 30;
    /// Centers (m, horizontal) of patches with static modes.
    std::vector<Vec2> patches;
    bool glides = false;  ///< answers contain a Glide
  };
  /// The density has no effect. Throws std::invalid_argument unless the material is linear and the solid has at least
  /// `swings` modes. Keeps no reference to solid or surface.
  ModalModel(const Solid& solid, const TouchSurface& surface, const Config& config);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  bool glides() const noexcept override { return glides_; }
  std::size_t bytes() const noexcept override;

 private:
  std::vector<int> row_of_;  ///< by node; −1: not on the surface
  MatrixXd surface_;         ///< B: depth of each touchable node (rows) in each shape, m/√J
  bool glides_;
};

}  // namespace tendon::softbody::compared
