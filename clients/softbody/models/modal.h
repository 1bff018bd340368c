// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Linear elasticity within a few shapes (Pentland & Williams 1989): the slowest swings of the body, of which local
/// contact needs far too many, and if wanted what a force on the patch does at rest (static modes). At rest at every
/// instant: an answer is |Bᵀw|², B the shapes on the surface, scaled so that each has the stiffness 1. For comparison.
class ModalModel : public Model {
 public:
  struct Config {
    int swings = 30;
    /// Middles of patches, across, whose static displacements are shapes too.
    std::vector<Vec2> patches;
  };
  /// The density is the same everywhere, so that its value changes nothing. Throws std::invalid_argument when the
  /// solid's law is not linear or it has not so many swings. Neither solid nor surface is kept.
  ModalModel(const Solid& solid, const TouchSurface& surface, const Config& config);

  Reaction press(const Patch& patch, Given given, double value) override;
  std::size_t bytes() const noexcept override;

 private:
  std::vector<int> row_of_;  ///< by node; −1: not on the surface
  MatrixXd surface_;         ///< B: depth of each touchable node (rows) in each shape, m/√J
};

}  // namespace tendon::softbody
