// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <utility>
#include <vector>

#include "clients/softbody/models/model.h"

namespace tendon::softbody {

/// How Young's modulus goes over time: times its value in the material, straight from each point to the next; before
/// the first and after the last as there.
struct StiffnessOverTime {
  std::vector<double> at;      ///< s, ascending
  std::vector<double> factor;  ///< above 0, as many

  double factor_at(double time) const;
};

/// Throws std::invalid_argument that names the field.
void check(const StiffnessOverTime& law);

/// A body whose Young's modulus changes while it is touched: muscle that is tensed, a graft that cures. For models that
/// have no other load than the tool and whose energy is proportional to the modulus: with `factor` times the modulus
/// every force is `factor` times what it was in the same shape, so the shape under a given depth is the same. The kept
/// factor of the system, or the table, goes on to serve: a force is scaled, nothing is solved again.
///
/// Energy: at rest under a tool held still the stored energy goes from E to E·factor, and what raises it is not the
/// hand. Such a body is not passive; the server's limiter is what keeps the hand safe from it.
class StiffeningModel : public Model {
 public:
  /// Throws what check() does. It begins with the modulus of time 0.
  StiffeningModel(std::unique_ptr<Model> model, StiffnessOverTime law);

  void tick(double time) { factor_ = law_.factor_at(time); }  ///< s

  Reaction press(const Patch& patch, Given given, double value) override;
  void cut(const Division& division, const EffectsConfig& effects) override { model_->cut(division, effects); }
  double step() const noexcept override { return model_->step(); }
  bool still() const noexcept override { return model_->still(); }
  std::size_t bytes() const noexcept override;

 private:
  std::unique_ptr<Model> model_;
  StiffnessOverTime law_;
  double factor_;
};

}  // namespace tendon::softbody
