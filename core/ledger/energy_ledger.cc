// SPDX-License-Identifier: Apache-2.0
#include "core/ledger/energy_ledger.h"

#include <algorithm>
#include <cmath>

#include "core/base/expect.h"

namespace tendon {

namespace {

bool possible(double friction) noexcept { return std::isfinite(friction) && friction >= 0; }

}  // namespace

EnergyLedger::EnergyLedger(const Friction& friction) : friction_(friction) {
  expect_not_negative(friction.coulomb, "friction.coulomb");
  expect_not_negative(friction.viscous, "friction.viscous");
}

void EnergyLedger::adapt(const Friction& friction) noexcept {
  if (possible(friction.coulomb) && possible(friction.viscous)) friction_ = friction;
}

void EnergyLedger::transfer(double energy) noexcept {
  if (std::isfinite(energy)) energy_ += energy;
}

double EnergyLedger::book(double work, double squared_displacement, Duration held) noexcept {
  const double viscous = held > Duration::zero() ? friction_.viscous * squared_displacement / seconds(held) : 0.0;
  const double income = work + friction_.coulomb * std::sqrt(squared_displacement) + viscous;
  if (std::isfinite(income)) energy_ += income;
  return energy_.value();
}

double EnergyLedger::observe_unseen(double applied, Duration at_most) noexcept {
  const double excess = std::max(applied - friction_.coulomb, 0.0);
  if (friction_.viscous > 0 && std::isfinite(excess)) {
    energy_ -= seconds(at_most) * excess * excess / (4 * friction_.viscous);
  }
  return energy_.value();
}

}  // namespace tendon
