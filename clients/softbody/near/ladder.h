// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/softbody/near/near_model.h"
#include "clients/softbody/near/rung.h"

namespace tendon::softbody {

/// A body that answers from the most accurate precomputed rung that is valid for a press, and falls back to NearModel.
/// Where a rung's share falls from 1 to 0, its answer is blended with the next one (blended()). Presses with a given
/// force are answered by NearModel.
///
/// While rungs answer, NearModel tracks the hand (NearModel::follow), so that its field is ready to take over. Without
/// a background thread this slows answers only where Rung::room() is below 1.
class Ladder : public Model {
 public:
  /// In order of preference.
  Ladder(std::vector<std::unique_ptr<Rung>> rungs, std::unique_ptr<NearModel> near);

  Reaction press(const Patch& patch, Given given, double value) override;
  /// Drops the rungs, which describe the uncut body only.
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// Continues with the rungs of this object, if it has any for the cut body.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override;

  struct Step {
    Rung::Size size;
    int answers = 0;  ///< presses that the rung answered, alone or blended
  };
  std::vector<Step> steps() const;  ///< in order of preference, without NearModel
  const NearModel& near() const noexcept { return *near_; }

 private:
  double room(const Patch& patch, double depth) const;

  std::vector<std::unique_ptr<Rung>> rungs_;
  std::vector<int> answers_;
  std::unique_ptr<NearModel> near_;
};

/// Interpolates force and stiffness between two reactions with the weight `share` (0 … 1) of `from`, whatever the tilt
/// of the surface. The difference is added to `error`.
Reaction blended(const Reaction& from, const Reaction& to, double share);

}  // namespace tendon::softbody
