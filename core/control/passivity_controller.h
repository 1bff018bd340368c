// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// How the energy E that has gone into the environment is observed. f = −F is the reflective force.
enum class PassivityObserver : std::uint8_t {
  /// As published in 2002: Σ f(n)·Δx(n) of the force of the environment, plus the energy that the controller has
  /// dissipated. It combines the motion of an interval with the force that **follows** it, so it cannot observe the
  /// energy that a sampled spring generates: Σ K x(n) Δx(n) = K x²/2 + K/2 Σ Δx² ≥ 0 for every motion.
  kSameSample,
  /// Σ f(n−1)·Δx(n) of the applied force, which is exact for a zero-order hold: a spring gives K x²/2 − K/2 Σ Δx². The
  /// controller uses the prediction E + f_e(n)·Δx(n), which assumes that the next motion is equal to the last one.
  kZohExact,
};

/// Returns α = min( missing · T/‖Δx‖², max_damping ) in N·s/m, the damper that dissipates `missing` J in another
/// interval like this one (T = `held`). Returns 0 if `missing` is not positive or if the speed is at most `min_speed`.
double series_damping(double missing, double squared_motion, Duration held, double min_speed,
                      double max_damping) noexcept;

/// The time-domain passivity observer and controller in series (impedance causality). It adds damping when the observer
/// finds that the environment generates energy.
///     α(n) = −E(n) / (T ‖v(n)‖²)  when E(n) < 0, within [0, max_damping]       v = Δx/T, m/s
///     F(n) = F_wanted(n) − α(n) v(n)
/// The port is not guaranteed to be passive, because the correction acts one interval late and assumes that the motion
/// continues. The controller does not need a model or friction. It chatters in stiff contact. A digital damper is
/// unstable above 2m/T (m is the mass of the device), so max_damping must be far smaller. All components share α.
///
/// Source: Hannaford & Ryu, IEEE Trans. Robotics & Automation 18(1), 2002 (recalled); kZohExact: Ryu, Kim, Hannaford,
/// IEEE Trans. Robotics 20(2), 2004 (recalled). The vector form uses scalar products. core/PROOFS.md, "Comparison
/// laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class PassivityController {
 public:
  struct Config {
    Friction friction;  ///< only for the ledger
    PassivityObserver observer = PassivityObserver::kZohExact;
    double max_damping = 0;   ///< N·s/m, > 0; can be infinite, as published
    double min_speed = 1e-4;  ///< m/s, ≥ 0: α is 0 for slower motion
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit PassivityController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double observed() const noexcept { return observed_; }  ///< E of the observer, J, without the friction of the device

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  double dissipated_ = 0;  ///< J, dissipated by the damper in the previous interval (only for kSameSample)
  Interval<N> last_{Vec<N>::Zero(), Vec<N>::Zero(), Duration::zero()};
};

/// The passivity observer and controller in parallel (admittance causality). It reduces the motion of the environment
/// when the observer finds that the environment generates energy.
///     1/α(n) = −E(n) / (T ‖f(n)‖²)  when E(n) < 0, within [0, max_mobility]
///     v₁ = v₂ + f/α           hand v₁, environment v₂ (m/s), f = −F (N)
/// The environment is then at x − δ with δ = Σ T f/α. The force at this position is computed with the stiffness of the
/// demand: F = F_wanted + K δ. The controller has no effect if the demand has no stiffness. Hand and environment drift
/// apart by δ, which is a known weakness. δ is reset when both the force and the stiffness of the demand are zero. The
/// linear model can pull the hand, even if the true environment would release it. The port is not guaranteed to be
/// passive. See PassivityController, also for the observers and sources.
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class ParallelPassivityController {
 public:
  struct Config {
    Friction friction;  ///< only for the ledger
    PassivityObserver observer = PassivityObserver::kZohExact;
    double max_mobility = 0;  ///< 1/α, m/(N·s), > 0; can be infinite, as published
    double min_force = 1e-3;  ///< N, ≥ 0: 1/α is 0 for smaller forces
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit ParallelPassivityController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  double observed() const noexcept { return observed_; }  ///< E of the observer, J, without the friction of the device
  const Vec<N>& offset() const noexcept { return offset_; }  ///< δ, m

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  double dissipated_ = 0;            ///< J, dissipated in the previous interval (only for kSameSample)
  Vec<N> slipped_ = Vec<N>::Zero();  ///< m, T f/α of the previous interval
  Vec<N> offset_ = Vec<N>::Zero();   ///< m
  Interval<N> last_{Vec<N>::Zero(), Vec<N>::Zero(), Duration::zero()};
};

}  // namespace tendon
