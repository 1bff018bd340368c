// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
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
#include "core/ledger/output_bound.h"

namespace tendon {

/// The stability controllers that a scene can choose; each has its file in core/control.
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
  kAolPlus,
};

/// The name of a law, and what a person needs to know to choose it.
struct LawInfo {
  Law law;
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  /// Its own theory promises that the ledger is never negative, **whatever** the remote environment asks for. The others
  /// are passive in some environments, or take back what they gave out.
  bool passive;
  bool needs_stiffness;  ///< of an environment that does not send its own
};

/// Every law, in the order in which tables list them.
std::span<const LawInfo> laws() noexcept;
const LawInfo& info(Law law) noexcept;
std::optional<Law> law_named(std::string_view name) noexcept;

/// Which law stands between the remote environment and the hand, and its parameters.
struct LimiterConfig {
  Law law = Law::kAolPlus;
  Friction friction{};      ///< lower bounds of the device's friction (kAolPerAxis, kAolBox: of each axis by itself)
  Duration longest_hold{};  ///< T_max; > 0
  /// How the laws that are `passive` follow holds longer than T_max. Empty: they do not.
  std::optional<HoldBound::Follow> follow_holds = HoldBound::Follow{};
  AolPlus<1, 3>::Parts parts{};                   ///< of kAolPlus
  double max_force = 0;                           ///< N, of kClamp
  std::optional<double> environment_stiffness{};  ///< N/m, of an environment that does not send its own
  Duration environment_delay{};  ///< t_d of kPassiveSynthesis: from a position to the force answering it
  /// N·s/m, what the passivity controllers and kReferenceEnergy may inject at most; far below 2m/T, where a digital
  /// damper is unstable. 20 is an eighth of that at 75 g and 1 kHz.
  double max_damping = 20;
};

using AnyLaw = std::variant<Unlimited<3>, HardClamp<3>, PassivityController<3>, ParallelPassivityController<3>,
                            ReferenceEnergyController<3>, VirtualCoupling<3>, NonlinearCoupling<3>, PassiveSynthesis<3>,
                            PortHamiltonian<3>, EnergyBounding<3>, ForceBounding<3>, MemorylessForceBounding<3>,
                            PerAxisAol<3>, Aol<1, 3>, Aol<3>, AolPlus<1, 3>>;

/// The law of a scene, for a point in space: one of the catalogue, chosen when it is built.
///
/// It keeps the promise of a law that is `passive` through overruns. T is how long a hold may be (HoldBound): T_max, or
/// longer after a hold that was longer. The laws with a bound like equation (8) then bound by T (FollowsHolds). The
/// proofs of the other passive laws end with the first hold beyond T_max; from then on equation (8) with T and the port's
/// ledger bounds their force as well (OutputBound, Theorem 1). As long as no hold is longer than T_max, none of this
/// changes a bit.
///
/// Satisfies StabilityController<Limiter, 3>. Thread-safe: no. Realtime-safe: all but the constructor.
class Limiter {
 public:
  /// Throws what the law's constructor throws.
  explicit Limiter(const LimiterConfig& config);

  void observe(const Interval<3>& interval) noexcept;
  void observe_unseen(const Vec<3>& applied, Duration at_most) noexcept;
  LimitedForce<3> limit(const Demand<3>& wanted) noexcept;
  double energy() const noexcept;

  /// Forwards to AolPlus::adapt. Other laws ignore it.
  void adapt(const Friction& friction) noexcept;

  /// T: the next force may be held for so long.
  Duration longest_hold() const noexcept { return holds_ ? holds_->in_force() : longest_hold_; }
  /// Forwards to AolPlus::broken_assumptions. Other laws have none: 0.
  std::uint64_t broken_assumptions() const noexcept;

 private:
  void follow(Duration held) noexcept;

  AnyLaw law_;
  Duration longest_hold_;           ///< T_max
  std::optional<HoldBound> holds_;  ///< empty: T stays T_max
  double viscous_ = 0;              ///< b, N·s/m
  OutputBound bound_;               ///< equation (8) with T
  bool bounded_from_here_ = false;  ///< the law's own proof has ended: `bound_` applies, too
};

}  // namespace tendon
