// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <span>
#include <vector>

#include "clients/softbody/near/near_model.h"
#include "clients/softbody/near/rung.h"

namespace tendon::softbody {

/// A body that answers from the highest rung that is good enough for a press, and by NearModel where none is. Where the
/// share of a rung falls from 1 to 0 with the place of the hand, the next one takes over, see blended(). Given forces are
/// answered by NearModel.
///
/// While rungs answer alone, NearModel follows the hand (NearModel::follow), so that its field is there where it takes
/// over. Without another thread that makes an answer slower only where Rung::room() is below 1.
class Ladder : public Model {
 public:
  /// The highest rung first.
  Ladder(std::vector<std::unique_ptr<Rung>> rungs, std::unique_ptr<NearModel> near);

  Reaction press(const Patch& patch, Given given, double value) override;
  /// Rungs know the whole body alone: they are dropped.
  void cut(const Division& division, const EffectsConfig& effects) override;
  /// With the rungs that this one has of the cut body.
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  bool glides() const noexcept override { return true; }
  std::size_t bytes() const noexcept override;

  struct Step {
    Rung::Size size;
    int answers = 0;  ///< to which it had something to say
  };
  std::vector<Step> steps() const;  ///< the highest first, without NearModel
  const NearModel& near() const noexcept { return *near_; }

 private:
  double room(const Patch& patch, double depth) const;

  std::vector<std::unique_ptr<Rung>> rungs_;
  std::vector<int> answers_;
  std::unique_ptr<NearModel> near_;
};

/// The reaction whose force, and whose stiffness however a surface lies, are so far between those of two as `share`
/// (0 … 1) says. `error` adds how far they are apart.
Reaction blended(const Reaction& from, const Reaction& to, double share);

}  // namespace tendon::softbody
