// SPDX-License-Identifier: Apache-2.0
#include "core/control/aol.h"

#include <algorithm>
#include <cmath>

#include "core/control/law_support.h"

namespace tendon {

template <int Blocks, int Size>
Aol<Blocks, Size>::Aol(const Config& config)
    : friction_(config.friction),
      ledgers_(law_support::each<EnergyLedger, Blocks>([&](std::size_t i) { return config.friction[i]; })) {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    bounds_[i] = OutputBound::of(config.friction[i], config.longest_hold);
  }
}

template <int Blocks, int Size>
void Aol<Blocks, Size>::hold_at_most(Duration longest_hold) noexcept {
  for (std::size_t i = 0; i < bounds_.size(); ++i) {
    bounds_[i].viscous_per_hold = friction_[i].viscous / seconds(longest_hold);
  }
}

template <int Blocks, int Size>
void Aol<Blocks, Size>::observe(const Interval<kSize>& interval) noexcept {
  if (!interval.applied.allFinite() || !interval.dx.allFinite()) return;
  for (int i = 0; i < Blocks; ++i) {
    ledgers_[static_cast<std::size_t>(i)].observe(Vec<Size>(interval.applied.template segment<Size>(i * Size)),
                                                  Vec<Size>(interval.dx.template segment<Size>(i * Size)),
                                                  interval.held);
  }
}

template <int Blocks, int Size>
void Aol<Blocks, Size>::observe_unseen(const Vec<kSize>& applied, Duration at_most) noexcept {
  for (int i = 0; i < Blocks; ++i) {
    ledgers_[static_cast<std::size_t>(i)].observe_unseen(applied.template segment<Size>(i * Size).norm(), at_most);
  }
}

template <int Blocks, int Size>
auto Aol<Blocks, Size>::limit(const Demand<kSize>& wanted) noexcept -> LimitedForce<kSize> {
  if constexpr (Blocks == 1) {
    return bounds_[0].template limit<kSize>(wanted.force, energy());
  } else {
    if (!wanted.force.allFinite()) return {Vec<kSize>::Zero(), 0, Reason::kNotFinite};
    const double size = wanted.force.norm();
    std::array<double, Blocks> sizes{};
    for (int i = 0; i < Blocks; ++i) {
      sizes[static_cast<std::size_t>(i)] = wanted.force.template segment<Size>(i * Size).norm();
    }
    const double scale = largest_scale(bounds_, sizes, energy());
    const double permitted = size > 0 ? scale * size : 0;
    if (scale >= 1) return {wanted.force, permitted, {}};
    return {wanted.force * scale, permitted, Reason::kEnergy};
  }
}

template <int Blocks, int Size>
double Aol<Blocks, Size>::energy() const noexcept {
  double sum = ledgers_[0].energy();
  for (std::size_t i = 1; i < ledgers_.size(); ++i) sum += ledgers_[i].energy();
  return sum;
}

template <int Blocks, int Size>
void Aol<Blocks, Size>::credit(double energy) noexcept {
  if (energy > 0) ledgers_[0].transfer(energy);
}

template <int Blocks, int Size>
void Aol<Blocks, Size>::withdraw(double energy) noexcept {
  if (energy > 0) ledgers_[0].transfer(-energy);
}

template <int Blocks, int Size>
double Aol<Blocks, Size>::worst_loss(const Vec<kSize>& force) const noexcept {
  double sum = 0;
  for (int i = 0; i < Blocks; ++i) {
    sum += bounds_[static_cast<std::size_t>(i)].at(force.template segment<Size>(i * Size).norm());
  }
  return sum;
}

template class Aol<1>;
template class Aol<1, 3>;
template class Aol<3>;
template class Aol<6>;
template class Aol<2, 3>;

template <int N>
PerAxisAol<N>::PerAxisAol(const Config& config)
    : friction_(config.friction),
      ledgers_(law_support::each<EnergyLedger, N>([&](std::size_t) { return config.friction; })),
      bound_(OutputBound::of(config.friction, config.longest_hold)) {}

template <int N>
void PerAxisAol<N>::hold_at_most(Duration longest_hold) noexcept {
  bound_.viscous_per_hold = friction_.viscous / seconds(longest_hold);
}

template <int N>
void PerAxisAol<N>::observe(const Interval<N>& interval) noexcept {
  if (!interval.applied.allFinite() || !interval.dx.allFinite()) return;
  for (int i = 0; i < N; ++i) {
    ledgers_[static_cast<std::size_t>(i)].observe(Vec<1>(interval.applied[i]), Vec<1>(interval.dx[i]), interval.held);
  }
}

template <int N>
void PerAxisAol<N>::observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
  for (int i = 0; i < N; ++i) {
    ledgers_[static_cast<std::size_t>(i)].observe_unseen(std::abs(applied[i]), at_most);
  }
}

template <int N>
LimitedForce<N> PerAxisAol<N>::limit(const Demand<N>& wanted) noexcept {
  LimitedForce<N> result{wanted.force, 0, {}};
  for (int i = 0; i < N; ++i) {
    const auto axis = bound_.limit<1>(Vec<1>(wanted.force[i]), ledgers_[static_cast<std::size_t>(i)].energy());
    result.force[i] = axis.force[0];
    result.permitted = std::max(result.permitted, axis.permitted);
    result.reasons |= axis.reasons;
  }
  return result;
}

template <int N>
double PerAxisAol<N>::energy() const noexcept {
  double least = ledgers_[0].energy();
  for (const EnergyLedger& ledger : ledgers_) least = std::min(least, ledger.energy());
  return least;
}

template class PerAxisAol<1>;
template class PerAxisAol<3>;
template class PerAxisAol<6>;

}  // namespace tendon
