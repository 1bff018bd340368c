// SPDX-License-Identifier: Apache-2.0
#include "core/control/limiter.h"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace tendon {

namespace {

/// m/(N·s): 1 N gives way by 1 mm in each period at 1 kHz, and no more.
constexpr double kMostMobility = 1;

constexpr std::array kLaws{
    LawInfo{Law::kNone, "none", "no law: shows what happens without one", false, false},
    LawInfo{Law::kClamp, "clamp", "no force is longer than max_force", false, false},
    LawInfo{Law::kPassivityControllerPublished, "tdpa-2002",
            "passivity observer and controller as published: blind to what sampling itself gives out", false, false},
    LawInfo{Law::kPassivityController, "tdpa",
            "passivity observer that counts the held force, and a damper for what it finds", false, false},
    LawInfo{Law::kParallelPassivityController, "tdpa-parallel",
            "the same, but the environment is shown less motion instead of the hand more force", false, false},
    LawInfo{Law::kReferenceEnergy, "reference-energy",
            "passivity controller that follows the energy the true environment would store", false, true},
    LawInfo{Law::kVirtualCoupling, "virtual-coupling", "spring between hand and tool, Colgate's rule", false, false},
    LawInfo{Law::kTwoPortCoupling, "virtual-coupling-two-port",
            "spring and damper between hand and tool, Adams and Hannaford's rule", false, false},
    LawInfo{Law::kNonlinearCoupling, "nonlinear-coupling",
            "passes static laws no steeper than 2b/T, ties all others to such a spring", true, false},
    LawInfo{Law::kPassiveSynthesis, "passive-synthesis",
            "softens the whole field until friction pays for sampling and delay", false, false},
    LawInfo{Law::kPortHamiltonian, "port-hamiltonian", "a spring whose state is the energy that really went in", false,
            true},
    LawInfo{Law::kEnergyBounding, "energy-bounding", "bounds how fast the force may change with position", true, false},
    LawInfo{Law::kForceBounding, "force-bounding", "a ledger of viscous friction bounds the force", true, false},
    LawInfo{Law::kMemorylessForceBounding, "force-bounding-memoryless",
            "the last force and the last motion bound the next force", true, false},
    LawInfo{Law::kAolPerAxis, "aol-per-axis", "Adjusting Output-Limiter as in the paper, each axis by itself", true,
            false},
    LawInfo{Law::kAol, "aol", "Adjusting Output-Limiter on one ledger; keeps the direction", true, false},
    LawInfo{Law::kAolBox, "aol-box", "Adjusting Output-Limiter on one ledger, friction of each axis by itself", true,
            false},
    LawInfo{Law::kAolPlus, "aol+", "Adjusting Output-Limiter with the parts that are listed", true, false},
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
    case Law::kClamp:
      return HardClamp<3>({.friction = friction, .max_force = config.max_force});
    case Law::kPassivityControllerPublished:
      return PassivityController<3>(
          {.friction = friction, .observer = PassivityObserver::kSameSample, .max_damping = config.max_damping});
    case Law::kPassivityController:
      return PassivityController<3>({.friction = friction, .max_damping = config.max_damping});
    case Law::kParallelPassivityController:
      return ParallelPassivityController<3>({.friction = friction, .max_mobility = kMostMobility});
    case Law::kReferenceEnergy:
      return ReferenceEnergyController<3>({.friction = friction,
                                           .stiffness = config.environment_stiffness.value_or(0),
                                           .max_damping = config.max_damping});
    case Law::kVirtualCoupling:
      return VirtualCoupling<3>(
          {.friction = friction, .longest_hold = hold, .stiffness = colgate_coupling(friction.viscous, hold, 0)});
    case Law::kTwoPortCoupling:
      return VirtualCoupling<3>({.friction = friction,
                                 .longest_hold = hold,
                                 .stiffness = two_port_coupling(friction.viscous, hold, friction.viscous),
                                 .damping = friction.viscous});
    case Law::kNonlinearCoupling:
      return NonlinearCoupling<3>({.friction = friction, .longest_hold = hold});
    case Law::kPassiveSynthesis:
      return PassiveSynthesis<3>({.friction = friction,
                                  .longest_hold = hold,
                                  .delay = config.environment_delay,
                                  .stiffness = config.environment_stiffness});
    case Law::kPortHamiltonian:
      return PortHamiltonian<3>({.friction = friction, .stiffness = config.environment_stiffness.value_or(0)});
    case Law::kEnergyBounding:
      return EnergyBounding<3>({.friction = friction, .longest_hold = hold});
    case Law::kForceBounding:
      return ForceBounding<3>({.friction = friction, .longest_hold = hold});
    case Law::kMemorylessForceBounding:
      return MemorylessForceBounding<3>({.friction = friction, .longest_hold = hold});
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
