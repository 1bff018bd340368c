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

namespace tendon {

/// The stability controllers that a scene can choose, each a file of core/control.
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

/// What people call a law, and what they want to know before they choose it.
struct LawInfo {
  Law law;
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  /// Its own theory promises that the ledger never is negative, **whatever** is upstream. Others are passive for some
  /// environments, or make up for what they gave out.
  bool passive;
  bool needs_stiffness;  ///< of an environment that does not send its own
};

/// Every law, in the order in which tables list them.
std::span<const LawInfo> laws() noexcept;
const LawInfo& info(Law law) noexcept;
std::optional<Law> law_named(std::string_view name) noexcept;

/// Which law stands between the remote environment and the hand, and what it is to know.
struct LimiterConfig {
  Law law = Law::kAolPlus;
  Friction friction{};      ///< lower bounds of the device's friction (kAolPerAxis, kAolBox: of each axis by itself)
  Duration longest_hold{};  ///< T_max; > 0
  AolPlus<1, 3>::Parts parts{};                   ///< of kAolPlus
  double max_force = 0;                           ///< N, of kClamp
  std::optional<double> environment_stiffness{};  ///< N/m, of an environment that does not send its own
  Duration environment_delay{};  ///< t_d of kPassiveSynthesis: from a position to the force answering it
  /// N·s/m, what the passivity controllers and kReferenceEnergy may inject at most; far below 2m/T, where a digital
  /// damper is unstable. 20 is an eighth of that at 75 g and 1 kHz.
  double max_damping = 20;
};

/// The law of a scene, for a point in space: one of them, chosen when it is built.
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

  /// As AolPlus::adapt; other laws know but what they were built with.
  void adapt(const Friction& friction) noexcept;

 private:
  using Any = std::variant<Unlimited<3>, HardClamp<3>, PassivityController<3>, ParallelPassivityController<3>,
                           ReferenceEnergyController<3>, VirtualCoupling<3>, NonlinearCoupling<3>, PassiveSynthesis<3>,
                           PortHamiltonian<3>, EnergyBounding<3>, ForceBounding<3>, MemorylessForceBounding<3>,
                           PerAxisAol<3>, Aol<1, 3>, Aol<3>, AolPlus<1, 3>>;
  static Any make(const LimiterConfig& config);

  Any law_;
};

}  // namespace tendon
