// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Young's modulus over time, as a factor of the material's value: linear between the points, constant before the first
/// and after the last one.
struct StiffnessOverTime {
  std::vector<double> at;      ///< s, ascending
  std::vector<double> factor;  ///< one for each time, above 0

  double factor_at(double time) const;
};

/// Throws std::invalid_argument that names the field.
void check(const StiffnessOverTime& law);

/// A body whose Young's modulus changes while it is touched: a muscle that tenses, a graft that cures. It wraps models
/// whose only load is the tool and whose energy is proportional to the modulus: with `factor` times the modulus every
/// force in the same shape is `factor` times as large, so a given depth has the same shape. The factor of the system,
/// or the table, stays valid: forces are scaled, and nothing is solved again.
///
/// Energy: under a tool that is held still, the stored energy changes from E to E·factor, and the hand does not supply
/// the difference. Such a body is not passive; the server's limiter keeps the hand safe from it.
class StiffeningModel : public Model {
 public:
  /// Begins with the modulus of time 0. Throws whatever check() throws.
  StiffeningModel(std::unique_ptr<Model> model, StiffnessOverTime law);

  void tick(double time) { factor_ = law_.factor_at(time); }  ///< s

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override { model_->cut(division, effects); }
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  double step() const noexcept override { return model_->step(); }
  bool still() const noexcept override { return model_->still(); }
  bool glides() const noexcept override { return model_->glides(); }
  std::size_t bytes() const noexcept override;

 private:
  std::unique_ptr<Model> model_;
  StiffnessOverTime law_;
  double factor_;
};

}  // namespace tendon::softbody
