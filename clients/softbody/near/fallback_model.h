// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/softbody/near/fallback_level.h"
#include "clients/softbody/near/near_model.h"

namespace tendon::softbody {

/// Uses the first precomputed level that is valid for a press, and NearModel otherwise. Answers are blended at the
/// border of a level. NearModel answers all presses with a given force, and follows the hand while a level answers, so
/// that a field is ready when it takes over (NearModel::follow).
class FallbackModel : public Model {
 public:
  FallbackModel(std::vector<std::unique_ptr<FallbackLevel>> levels, std::unique_ptr<NearModel> near);

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override;  ///< removes the levels of the uncut body
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override;

  struct Step {
    FallbackLevel::Size size;
    int answers = 0;  ///< presses that this level has answered
  };
  std::vector<Step> steps() const;  ///< without NearModel
  NearModel& near() noexcept { return *near_; }

 private:
  double room(const Patch& patch, double depth) const;

  std::vector<std::unique_ptr<FallbackLevel>> levels_;
  std::vector<int> answers_;
  std::unique_ptr<NearModel> near_;
};

/// Interpolates force and stiffness. `share` (0 … 1) is the weight of `to`. Adds the difference of the forces to
/// `error`, with a weight that decreases to 0 where only one of the two answers counts.
Reaction blended(const Reaction& from, const Reaction& to, double share);

}  // namespace tendon::softbody
