// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/softbody/near/near_model.h"
#include "clients/softbody/near/rung.h"

namespace tendon::softbody {

/// Uses the first precomputed rung that is valid for a press, and NearModel otherwise. Answers are blended at the
/// border of a rung. NearModel answers all presses with a given force.
///
/// While a rung answers, NearModel follows the hand, so that a field is ready when it takes over (NearModel::follow).
class Ladder : public Model {
 public:
  /// The first rung is preferred.
  Ladder(std::vector<std::unique_ptr<Rung>> rungs, std::unique_ptr<NearModel> near);

  Reaction press(const Patch& patch, Given given, double value) override;
  /// Removes the rungs, which are valid for the uncut body only.
  void cut(const Division& division, const EffectsConfig& effects) override;
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override;

  struct Step {
    Rung::Size size;
    int answers = 0;  ///< presses that this rung has answered
  };
  std::vector<Step> steps() const;  ///< without NearModel
  const NearModel& near() const noexcept { return *near_; }

 private:
  double room(const Patch& patch, double depth) const;

  std::vector<std::unique_ptr<Rung>> rungs_;
  std::vector<int> answers_;
  std::unique_ptr<NearModel> near_;
};

/// Interpolates the force and the stiffness. `share` (0 … 1) is the weight of `from`. The difference is added to
/// `error`.
Reaction blended(const Reaction& from, const Reaction& to, double share);

}  // namespace tendon::softbody
