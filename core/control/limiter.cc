// SPDX-License-Identifier: Apache-2.0
#include "core/control/limiter.h"

#include <algorithm>
#include <array>
#include <stdexcept>
#include <string>

namespace tendon {

namespace {

/// m/(N·s): 1 N gives way by at most 1 mm in each period at 1 kHz.
constexpr double kMostMobility = 1;

/// A law: what people read about it, and how it is built.
struct Row {
  LawInfo info;
  AnyLaw (*make)(const LimiterConfig& config);
};

constexpr std::array kRows{
    Row{{Law::kNone, "none", "no law: shows what happens without one", false, false},
        [](const LimiterConfig& c) -> AnyLaw { return Unlimited<3>({c.friction}); }},
    Row{{Law::kClamp, "clamp", "no force is longer than max_force", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return HardClamp<3>({.friction = c.friction, .max_force = c.max_force});
        }},
    Row{{Law::kPassivityControllerPublished, "tdpa-2002",
         "passivity observer and controller as published: blind to the energy that sampling itself gives out", false,
         false},
        [](const LimiterConfig& c) -> AnyLaw {
          return PassivityController<3>(
              {.friction = c.friction, .observer = PassivityObserver::kSameSample, .max_damping = c.max_damping});
        }},
    Row{{Law::kPassivityController, "tdpa",
         "passivity observer that counts the held force, and a damper against what it finds", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return PassivityController<3>({.friction = c.friction, .max_damping = c.max_damping});
        }},
    Row{{Law::kParallelPassivityController, "tdpa-parallel",
         "the same, but shows the environment less motion instead of the hand more force", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return ParallelPassivityController<3>({.friction = c.friction, .max_mobility = kMostMobility});
        }},
    Row{{Law::kReferenceEnergy, "reference-energy",
         "passivity controller that follows the energy the true environment would store", false, true},
        [](const LimiterConfig& c) -> AnyLaw {
          return ReferenceEnergyController<3>(
              {.friction = c.friction, .stiffness = c.environment_stiffness.value_or(0), .max_damping = c.max_damping});
        }},
    Row{{Law::kVirtualCoupling, "virtual-coupling", "spring between hand and tool, Colgate's rule", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return VirtualCoupling<3>({.friction = c.friction,
                                     .longest_hold = c.longest_hold,
                                     .stiffness = colgate_coupling(c.friction.viscous, c.longest_hold, 0)});
        }},
    Row{{Law::kTwoPortCoupling, "virtual-coupling-two-port",
         "spring and damper between hand and tool, Adams and Hannaford's rule", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          const double viscous = c.friction.viscous;
          return VirtualCoupling<3>({.friction = c.friction,
                                     .longest_hold = c.longest_hold,
                                     .stiffness = two_port_coupling(viscous, c.longest_hold, viscous),
                                     .damping = viscous});
        }},
    Row{{Law::kNonlinearCoupling, "nonlinear-coupling",
         "passes static laws no steeper than 2b/T, ties all others to such a spring", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return NonlinearCoupling<3>({.friction = c.friction, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kPassiveSynthesis, "passive-synthesis",
         "softens the whole field until friction pays for sampling and delay", false, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return PassiveSynthesis<3>({.friction = c.friction,
                                      .longest_hold = c.longest_hold,
                                      .delay = c.environment_delay,
                                      .stiffness = c.environment_stiffness});
        }},
    Row{{Law::kPortHamiltonian, "port-hamiltonian", "a spring whose state is the energy that really went in", false,
         true},
        [](const LimiterConfig& c) -> AnyLaw {
          return PortHamiltonian<3>({.friction = c.friction, .stiffness = c.environment_stiffness.value_or(0)});
        }},
    Row{{Law::kEnergyBounding, "energy-bounding", "bounds how fast the force may change with position", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return EnergyBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kForceBounding, "force-bounding", "a ledger of viscous friction bounds the force", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return ForceBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kMemorylessForceBounding, "force-bounding-memoryless",
         "the last force and the last motion bound the next force", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return MemorylessForceBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kAolPerAxis, "aol-per-axis", "Adjusting Output-Limiter as in the paper, each axis by itself", true,
         false},
        [](const LimiterConfig& c) -> AnyLaw {
          return PerAxisAol<3>({.friction = c.friction, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kAol, "aol", "Adjusting Output-Limiter on one ledger; keeps the direction", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return Aol<1, 3>({.friction = {c.friction}, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kAolBox, "aol-box", "Adjusting Output-Limiter on one ledger, friction of each axis by itself", true,
         false},
        [](const LimiterConfig& c) -> AnyLaw {
          return Aol<3>({.friction = {c.friction, c.friction, c.friction}, .longest_hold = c.longest_hold});
        }},
    Row{{Law::kAolPlus, "aol+", "Adjusting Output-Limiter with the parts that are listed", true, false},
        [](const LimiterConfig& c) -> AnyLaw {
          return AolPlus<1, 3>({.friction = {c.friction}, .longest_hold = c.longest_hold, .parts = c.parts});
        }},
};

constexpr auto kLaws = [] {
  std::array<LawInfo, kRows.size()> infos{};
  for (std::size_t i = 0; i < infos.size(); ++i) infos[i] = kRows[i].info;
  return infos;
}();

static_assert(
    [] {
      for (std::size_t i = 0; i < kLaws.size(); ++i) {
        if (static_cast<std::size_t>(kLaws[i].law) != i) return false;
      }
      return kLaws.size() == static_cast<std::size_t>(Law::kAolPlus) + 1;
    }(),
    "row i of the catalogue is enumerator i of Law");

const Row& row(Law law) {
  const auto i = static_cast<std::size_t>(law);
  if (i >= kRows.size()) throw std::invalid_argument("law = " + std::to_string(i) + ": expected one of laws()");
  return kRows[i];
}

}  // namespace

std::span<const LawInfo> laws() noexcept { return kLaws; }

const LawInfo& info(Law law) noexcept { return kLaws[static_cast<std::size_t>(law)]; }

std::optional<Law> law_named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kLaws, name, &LawInfo::name);
  if (found == kLaws.end()) return std::nullopt;
  return found->law;
}

Limiter::Limiter(const LimiterConfig& config) : law_(row(config.law).make(config)), longest_hold_(config.longest_hold) {
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

void Limiter::adapt(const Friction& friction) noexcept {
  if (auto* const plus = std::get_if<AolPlus<1, 3>>(&law_)) plus->adapt({friction});
}

std::uint64_t Limiter::broken_assumptions() const noexcept {
  const auto* const plus = std::get_if<AolPlus<1, 3>>(&law_);
  return plus != nullptr ? plus->broken_assumptions() : 0;
}

}  // namespace tendon
