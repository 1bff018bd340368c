// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// Young's modulus over time, relative to the material's value: piecewise linear, constant before the first and after
/// the last point.
struct StiffnessOverTime {
  std::vector<double> at;      ///< s, ascending
  std::vector<double> factor;  ///< one per time, positive

  double factor_at(double time) const;
};

/// Throws std::invalid_argument that names the field.
void check(const StiffnessOverTime& law);

/// A body whose Young's modulus changes while it is touched: a muscle that tenses, a graft that cures. Wraps models
/// whose only load is the tool and whose energy is proportional to the modulus: the shape at a given depth is
/// unchanged, and forces scale with `factor`, so nothing is solved again.
///
/// At constant tool position the stored energy changes from E to E·factor, and the hand does not supply the difference.
/// The body is therefore not passive; the server's limiter protects the hand.
class StiffeningModel : public Model {
 public:
  /// Starts with the modulus at time 0. Throws the errors of check().
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
