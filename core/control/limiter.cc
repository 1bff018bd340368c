// SPDX-License-Identifier: Apache-2.0
#include "core/control/limiter.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace tendon {

namespace {

constexpr std::array kLaws{
    LawInfo{Law::kNone, "none", "no law: shows what happens without one", false},
    LawInfo{Law::kAolPerAxis, "aol-per-axis", "Adjusting Output-Limiter as in the paper, each axis by itself", true},
    LawInfo{Law::kAol, "aol", "Adjusting Output-Limiter on one ledger; keeps the direction", true},
    LawInfo{Law::kAolBox, "aol-box", "Adjusting Output-Limiter on one ledger, friction of each axis by itself", true},
    LawInfo{Law::kAolPlus, "aol+", "Adjusting Output-Limiter with the parts that are listed", true},
};

}  // namespace

std::span<const LawInfo> laws() noexcept { return kLaws; }

const LawInfo& info(Law law) noexcept { return kLaws[static_cast<std::size_t>(law)]; }

std::optional<Law> law_named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kLaws, name, &LawInfo::name);
  if (found == kLaws.end()) return std::nullopt;
  return found->law;
}

Limiter::Any Limiter::make(const LimiterConfig& config) {
  const Friction& friction = config.friction;
  const Duration hold = config.longest_hold;
  switch (config.law) {
    case Law::kNone:
      return Unlimited<3>({friction});
    case Law::kAolPerAxis:
      return PerAxisAol<3>({.friction = friction, .longest_hold = hold});
    case Law::kAol:
      return Aol<1, 3>({.friction = {friction}, .longest_hold = hold});
    case Law::kAolBox:
      return Aol<3>({.friction = {friction, friction, friction}, .longest_hold = hold});
    case Law::kAolPlus:
      return AolPlus<1, 3>({.friction = {friction}, .longest_hold = hold, .parts = config.parts});
  }
  throw std::invalid_argument("unknown law");
}

Limiter::Limiter(const LimiterConfig& config) : law_(make(config)) {}

// Each law is noexcept, so the variant never is without one.
void Limiter::observe(const Interval<3>& interval) noexcept {
  std::visit([&](auto& law) { law.observe(interval); }, law_);
}

void Limiter::observe_unseen(const Vec<3>& applied, Duration at_most) noexcept {
  std::visit([&](auto& law) { law.observe_unseen(applied, at_most); }, law_);
}

LimitedForce<3> Limiter::limit(const Demand<3>& wanted) noexcept {
  return std::visit([&](auto& law) { return law.limit(wanted); }, law_);
}

double Limiter::energy() const noexcept {
  return std::visit([](const auto& law) { return law.energy(); }, law_);
}

void Limiter::adapt(const Friction& friction) noexcept {
  if (auto* const plus = std::get_if<AolPlus<1, 3>>(&law_)) plus->adapt({friction});
}

}  // namespace tendon
