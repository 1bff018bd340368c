// SPDX-License-Identifier: Apache-2.0
#include "core/control/limiter.h"

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <string>
#include <variant>

namespace tendon {

Limiter::Limiter(const LimiterConfig& config) : law_(make_law(config)), longest_hold_(config.longest_hold) {
  if (config.shared_account && !std::visit([]<class L>(const L&) { return SharesAccount<L, 3>; }, law_)) {
    throw std::invalid_argument(
        "law \"" + std::string(info(config.law).name) +
        "\" has no energy account that an energy tank can share: expected aol, aol-box or aol+");
  }
  if (!info(config.law).passive) return;
  if (config.follow_holds) holds_.emplace(config.longest_hold, *config.follow_holds);
  bound_ = OutputBound::of(config.friction, config.longest_hold);
  viscous_ = config.friction.viscous;
}

void Limiter::follow(Duration held) noexcept {
  if (!holds_) return;
  const Duration before = holds_->in_force();
  holds_->observe(held);
  const Duration now = holds_->in_force();
  if (now == before) return;
  bound_.viscous_per_hold = viscous_ / seconds(now);
  std::visit(
      [&]<class L>(L& law) {
        if constexpr (FollowsHolds<L>) {
          law.hold_at_most(now);
        } else {
          bounded_from_here_ = true;
        }
      },
      law_);
}

// The laws do not throw, so the variant is never valueless.
void Limiter::observe(const Interval<3>& interval) noexcept {
  std::visit([&](auto& law) { law.observe(interval); }, law_);
  follow(interval.held);
}

void Limiter::observe_unseen(const Vec<3>& applied, Duration at_most) noexcept {
  std::visit([&](auto& law) { law.observe_unseen(applied, at_most); }, law_);
  follow(at_most);
}

LimitedForce<3> Limiter::limit(const Demand<3>& wanted) noexcept {
  LimitedForce<3> limited = std::visit([&](auto& law) { return law.limit(wanted); }, law_);
  if (!bounded_from_here_) return limited;
  const LimitedForce<3> bounded = bound_.limit<3>(limited.force, energy());
  return {bounded.force, std::min(limited.permitted, bounded.permitted), limited.reasons |= bounded.reasons};
}

double Limiter::energy() const noexcept {
  return std::visit([](const auto& law) { return law.energy(); }, law_);
}

void Limiter::credit(double energy) noexcept {
  std::visit(
      [energy]<class L>(L& law) {
        if constexpr (SharesAccount<L, 3>) law.credit(energy);
      },
      law_);
}

void Limiter::withdraw(double energy) noexcept {
  std::visit(
      [energy]<class L>(L& law) {
        if constexpr (SharesAccount<L, 3>) law.withdraw(energy);
      },
      law_);
}

double Limiter::payable() const noexcept {
  return std::visit(
      []<class L>(const L& law) {
        if constexpr (SharesAccount<L, 3>) {
          return law.payable();
        } else {
          return 0.0;
        }
      },
      law_);
}

double Limiter::worst_loss(const Vec<3>& force) const noexcept {
  return std::visit(
      [&force]<class L>(const L& law) {
        if constexpr (SharesAccount<L, 3>) {
          return law.worst_loss(force);
        } else {
          return std::numeric_limits<double>::infinity();
        }
      },
      law_);
}

void Limiter::adapt(const Friction& friction) noexcept {
  if (auto* const plus = std::get_if<AolPlus<1, 3>>(&law_)) plus->adapt({friction});
}

std::uint64_t Limiter::broken_assumptions() const noexcept {
  const auto* const plus = std::get_if<AolPlus<1, 3>>(&law_);
  return plus != nullptr ? plus->broken_assumptions() : 0;
}

}  // namespace tendon
