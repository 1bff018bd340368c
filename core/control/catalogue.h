// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <variant>

#include "core/control/aol.h"
#include "core/control/aol_plus.h"
#include "core/control/energy_bounding.h"
#include "core/control/force_bounding.h"
#include "core/control/hard_clamp.h"
#include "core/control/nonlinear_coupling.h"
#include "core/control/passive_synthesis.h"
#include "core/control/passivity_controller.h"
#include "core/control/port_hamiltonian.h"
#include "core/control/reference_energy.h"
#include "core/control/unlimited.h"
#include "core/control/virtual_coupling.h"
#include "core/ledger/hold_bound.h"

namespace tendon {

// The catalogue of the laws. To add a law, add an enumerator and a row here. Scenes, `tendon-lab`, the property tests
// and the golden numbers find it through laws().

enum class Law : std::uint8_t {
  kNone,
  kClamp,
  kPassivityControllerPublished,
  kPassivityController,
  kParallelPassivityController,
  kReferenceEnergy,
  kVirtualCoupling,
  kTwoPortCoupling,
  kNonlinearCoupling,
  kPassiveSynthesis,
  kPortHamiltonian,
  kEnergyBounding,
  kForceBounding,
  kMemorylessForceBounding,
  kAolPerAxis,
  kAol,
  kAolBox,
  kAolPlus,  ///< must be the last enumerator
};

struct LawInfo {
  Law law;
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  /// The ledger is provably never negative, **whatever** the remote environment requests. The other laws are only
  /// passive in some environments, or correct a deficit afterwards.
  bool passive;
  bool needs_stiffness;  ///< for demands without a stiffness
};

std::span<const LawInfo> laws() noexcept;
const LawInfo& info(Law law) noexcept;
std::optional<Law> law_named(std::string_view name) noexcept;

/// The law between the remote environment and the hand, and its parameters.
struct LimiterConfig {
  Law law = Law::kAolPlus;
  Friction friction{};      ///< lower bounds of the friction (per axis for kAolPerAxis and kAolBox)
  Duration longest_hold{};  ///< T_max; > 0
  /// Used by the `passive` laws if a force is held longer than T_max. If this is empty, T stays T_max.
  std::optional<HoldBound::Follow> follow_holds = HoldBound::Follow{};
  AolPlus<1, 3>::Parts parts{};                   ///< of kAolPlus
  double max_force = 0;                           ///< N, of kClamp
  std::optional<double> environment_stiffness{};  ///< N/m, used if a demand has no stiffness
  Duration environment_delay{};                   ///< the delay t_d of the environment, for kPassiveSynthesis
  /// N·s/m, the largest damping of the passivity controllers and kReferenceEnergy. It must be much smaller than 2m/T,
  /// because a digital damper becomes unstable at this value. For 75 g and 1 kHz, 20 is an eighth of this limit.
  double max_damping = 20;
  /// Other ports can credit the account and draw on it (EnergyTank). Refused for laws that cannot share.
  bool shared_account = false;
};

namespace catalogue {

inline constexpr double kMostMobility = 1;  ///< m/(N·s), which allows 1 mm per period for a force of 1 N at 1 kHz

template <class Make>
struct LawRow {
  LawInfo info;
  Make make;  ///< creates the law from a LimiterConfig; throws the same exceptions as its constructor
};
template <class Make>
LawRow(LawInfo, Make) -> LawRow<Make>;

inline constexpr std::tuple kRows{
    LawRow{{Law::kNone, "none", "no limiter, for comparison", false, false},
           [](const LimiterConfig& c) { return Unlimited<3>({c.friction}); }},
    LawRow{{Law::kClamp, "clamp", "limits the length of the force vector", false, false},
           [](const LimiterConfig& c) { return HardClamp<3>({.friction = c.friction, .max_force = c.max_force}); }},
    LawRow{{Law::kPassivityControllerPublished, "tdpa-2002",
            "passivity observer and controller as published: ignores the energy that sampling generates", false, false},
           [](const LimiterConfig& c) {
             return PassivityController<3>(
                 {.friction = c.friction, .observer = PassivityObserver::kSameSample, .max_damping = c.max_damping});
           }},
    LawRow{{Law::kPassivityController, "tdpa",
            "passivity observer that accounts for the held force, and a damper that dissipates the observed energy",
            false, false},
           [](const LimiterConfig& c) {
             return PassivityController<3>({.friction = c.friction, .max_damping = c.max_damping});
           }},
    LawRow{{Law::kParallelPassivityController, "tdpa-parallel",
            "the same, but reduces the motion of the environment instead of increasing the force on the hand", false,
            false},
           [](const LimiterConfig& c) {
             return ParallelPassivityController<3>({.friction = c.friction, .max_mobility = kMostMobility});
           }},
    LawRow{{Law::kReferenceEnergy, "reference-energy",
            "passivity controller that follows the energy stored by the true environment", false, true},
           [](const LimiterConfig& c) {
             return ReferenceEnergyController<3>({.friction = c.friction,
                                                  .stiffness = c.environment_stiffness.value_or(0),
                                                  .max_damping = c.max_damping});
           }},
    LawRow{
        {Law::kVirtualCoupling, "virtual-coupling", "spring between hand and tool, with Colgate's rule", false, false},
        [](const LimiterConfig& c) {
          return VirtualCoupling<3>({.friction = c.friction,
                                     .longest_hold = c.longest_hold,
                                     .stiffness = colgate_coupling(c.friction.viscous, c.longest_hold, 0)});
        }},
    LawRow{{Law::kTwoPortCoupling, "virtual-coupling-two-port",
            "spring and damper between hand and tool, with the rule of Adams and Hannaford", false, false},
           [](const LimiterConfig& c) {
             const double viscous = c.friction.viscous;
             return VirtualCoupling<3>({.friction = c.friction,
                                        .longest_hold = c.longest_hold,
                                        .stiffness = two_port_coupling(viscous, c.longest_hold, viscous),
                                        .damping = viscous});
           }},
    LawRow{{Law::kNonlinearCoupling, "nonlinear-coupling",
            "passes static laws with a slope up to 2b/T, couples all others through a spring of this stiffness", true,
            false},
           [](const LimiterConfig& c) {
             return NonlinearCoupling<3>({.friction = c.friction, .longest_hold = c.longest_hold});
           }},
    LawRow{{Law::kPassiveSynthesis, "passive-synthesis",
            "softens the whole field until friction dissipates the energy of sampling and delay", false, false},
           [](const LimiterConfig& c) {
             return PassiveSynthesis<3>({.friction = c.friction,
                                         .longest_hold = c.longest_hold,
                                         .delay = c.environment_delay,
                                         .stiffness = c.environment_stiffness});
           }},
    LawRow{{Law::kPortHamiltonian, "port-hamiltonian", "a spring whose state is the energy that the hand has put in",
            false, true},
           [](const LimiterConfig& c) {
             return PortHamiltonian<3>({.friction = c.friction, .stiffness = c.environment_stiffness.value_or(0)});
           }},
    LawRow{{Law::kEnergyBounding, "energy-bounding", "bounds the change of the force with position", true, false},
           [](const LimiterConfig& c) {
             return EnergyBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
           }},
    LawRow{{Law::kForceBounding, "force-bounding", "bounds the force by a ledger of viscous friction", true, false},
           [](const LimiterConfig& c) {
             return ForceBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
           }},
    LawRow{{Law::kMemorylessForceBounding, "force-bounding-memoryless",
            "bounds the force by the last force and the last motion", true, false},
           [](const LimiterConfig& c) {
             return MemorylessForceBounding<3>({.friction = c.friction, .longest_hold = c.longest_hold});
           }},
    LawRow{
        {Law::kAolPerAxis, "aol-per-axis", "Adjusting Output-Limiter as in the paper, separately for each axis", true,
         false},
        [](const LimiterConfig& c) { return PerAxisAol<3>({.friction = c.friction, .longest_hold = c.longest_hold}); }},
    LawRow{
        {Law::kAol, "aol", "Adjusting Output-Limiter with one ledger; keeps the direction of the force", true, false},
        [](const LimiterConfig& c) { return Aol<1, 3>({.friction = {c.friction}, .longest_hold = c.longest_hold}); }},
    LawRow{{Law::kAolBox, "aol-box", "Adjusting Output-Limiter with one ledger and the friction of each axis", true,
            false},
           [](const LimiterConfig& c) {
             return Aol<3>({.friction = {c.friction, c.friction, c.friction}, .longest_hold = c.longest_hold});
           }},
    LawRow{{Law::kAolPlus, "aol+", "Adjusting Output-Limiter with the listed parts", true, false},
           [](const LimiterConfig& c) {
             return AolPlus<1, 3>({.friction = {c.friction},
                                   .longest_hold = c.longest_hold,
                                   .parts = c.parts,
                                   .shared_account = c.shared_account});
           }},
};

template <class Variant, class L>
struct With;
template <class... Known, class L>
struct With<std::variant<Known...>, L>
    : std::conditional<(std::is_same_v<Known, L> || ...), std::variant<Known...>, std::variant<Known..., L>> {};

template <class Variant, class... Rows>
struct Union {
  using Type = Variant;
};
template <class Variant, class Make, class... Rows>
struct Union<Variant, LawRow<Make>, Rows...>
    : Union<typename With<Variant, std::invoke_result_t<Make, const LimiterConfig&>>::type, Rows...> {};

template <class Rows>
struct Laws;
template <class... Rows>
struct Laws<const std::tuple<Rows...>> : Union<std::variant<>, Rows...> {};

}  // namespace catalogue

/// Laws of the same class share one alternative.
using AnyLaw = catalogue::Laws<decltype(catalogue::kRows)>::Type;

/// Throws std::invalid_argument if a value is out of range.
AnyLaw make_law(const LimiterConfig& config);

}  // namespace tendon
