// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "clients/softbody/fem/solid.h"
#include "clients/softbody/models/model.h"

namespace tendon::softbody::compared {

/// Linear elasticity within a few shapes (Pentland & Williams 1989): the slowest vibration modes of the body, and on
/// request the static displacements under a force on a patch (static modes). Local contact needs far too many vibration
/// modes. At rest at every instant: an answer is |Bᵀw|², with B the shapes on the surface, each scaled to the stiffness
/// 1. It is here for comparison.
class ModalModel : public Model {
 public:
  struct Config {
    int swings = 30;
    /// The static displacements of patches around these middles (m, across) become shapes too.
    std::vector<Vec2> patches;
    bool glides = false;  ///< an answer has its Glide
  };
  /// The density is the same everywhere, so its value does not matter. Throws std::invalid_argument when the law of the
  /// solid is not linear, or the solid has fewer modes than `swings`. Keeps neither the solid nor the surface.
  ModalModel(const Solid& solid, const TouchSurface& surface, const Config& config);

  Reaction press(const Patch& patch, Given given, double value) override;
  bool glides() const noexcept override { return glides_; }
  std::size_t bytes() const noexcept override;

 private:
  std::vector<int> row_of_;  ///< by node; −1: not on the surface
  MatrixXd surface_;         ///< B: depth of each touchable node (rows) in each shape, m/√J
  bool glides_;
};

}  // namespace tendon::softbody::compared
