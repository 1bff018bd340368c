// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/models/stiffening.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <stdexcept>
#include <utility>

namespace tendon::softbody {

double StiffnessOverTime::factor_at(double time) const {
  const auto next = static_cast<std::size_t>(std::ranges::upper_bound(at, time) - at.begin());
  if (next == 0) return factor.front();
  if (next == at.size()) return factor.back();
  const double share = (time - at[next - 1]) / (at[next] - at[next - 1]);
  return factor[next - 1] + share * (factor[next] - factor[next - 1]);
}

void check(const StiffnessOverTime& law) {
  if (law.at.empty() || !std::ranges::is_sorted(law.at, std::less_equal<>()) ||
      !std::ranges::all_of(law.at, [](double time) { return std::isfinite(time); })) {
    throw std::invalid_argument("stiffening.at: expected ascending times, one or more");
  }
  if (law.factor.size() != law.at.size() ||
      !std::ranges::all_of(law.factor, [](double factor) { return factor > 0 && std::isfinite(factor); })) {
    throw std::invalid_argument("stiffening.factor: expected a number above 0 for each time");
  }
}

StiffeningModel::StiffeningModel(Model& model, StiffnessOverTime law)
    : model_(model), law_(std::move(law)), factor_(1) {
  check(law_);
  tick(0);
}

std::size_t StiffeningModel::bytes() const noexcept {
  return sizeof *this + (law_.at.size() + law_.factor.size()) * sizeof(double) + model_.bytes();
}

void StiffeningModel::go_on_from(const Model& before, std::span<const int> node_before) {
  const auto& same = static_cast<const StiffeningModel&>(before);  // same kind by contract
  factor_ = same.factor_;
  model_.go_on_from(same.model_, node_before);
}

Reaction StiffeningModel::press(const Patch& patch, Prescribed given, double value) {
  Reaction reaction = model_.press(patch, given, given == Prescribed::kForce ? value / factor_ : value);
  reaction.force *= factor_;
  reaction.stiffness *= factor_;
  reaction.error *= factor_;
  reaction.glide.giving /= factor_;
  return reaction;
}

}  // namespace tendon::softbody
