// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <vector>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// A piecewise linear factor of Young's modulus. It is constant before the first and after the last time.
struct StiffnessOverTime {
  std::vector<double> at;      ///< s, ascending
  std::vector<double> factor;  ///< positive

  double factor_at(double time) const;
};

void check(const StiffnessOverTime& law);  ///< throws std::invalid_argument with the name of an invalid field

/// A body with a variable Young's modulus, such as a muscle. The tool must be the only load, and the energy must be
/// proportional to the modulus: the shape at a given depth then does not depend on it, and only the forces are scaled.
/// The body is not passive, because a change of the modulus changes the stored energy without work of the hand. The
/// limiter of the server protects the hand.
class StiffeningModel : public Model {
 public:
  /// Starts with the factor at time 0. `model` must outlive this object. Throws the errors of check().
  StiffeningModel(Model& model, StiffnessOverTime law);

  void tick(double time) { factor_ = law_.factor_at(time); }  ///< s

  Reaction press(const Patch& patch, Prescribed given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override { model_.cut(division, effects); }
  void go_on_from(const Model& before, std::span<const int> node_before) override;
  double step() const noexcept override { return model_.step(); }
  bool still() const noexcept override { return model_.still(); }
  bool glides() const noexcept override { return model_.glides(); }
  std::size_t bytes() const noexcept override;

 private:
  Model& model_;
  StiffnessOverTime law_;
  double factor_;
};

}  // namespace tendon::softbody
