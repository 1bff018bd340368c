// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// How the energy E that has gone into the environment is observed; f = −F is the reflective force.
enum class PassivityObserver : std::uint8_t {
  /// As published in 2002: Σ f(n)·Δx(n) of the environment's own force, plus the energy that the controller has
  /// dissipated. It pairs the motion of an interval with the force that **follows** it, so it never sees the leak of a
  /// sampled spring:
  ///     Σ K x(n) Δx(n) = K x²/2 + K/2 Σ Δx² ≥ 0 for every motion
  kSameSample,
  /// Σ f(n−1)·Δx(n) of the force really held, exact for a zero-order hold: a spring gives K x²/2 − K/2 Σ Δx². The
  /// controller acts on the prediction E + f_e(n)·Δx(n), that is on the next motion being like the last.
  kZohExact,
};

/// α = min( missing · T/‖Δx‖², max_damping ), N·s/m: the damper that dissipates `missing` J in one more interval like
/// this one (T = `held`); 0 when nothing is missing or the speed is not above `min_speed`.
double series_damping(double missing, double squared_motion, Duration held, double min_speed,
                      double max_damping) noexcept;

/// Adds damping when, and as much as, the environment is observed to give out energy: the time-domain passivity
/// observer and controller, in series (impedance causality).
///
///     α(n) = −E(n) / (T ‖v(n)‖²)  when E(n) < 0, within [0, max_damping]       v = Δx/T, m/s
///     F(n) = F_wanted(n) − α(n) v(n)
///
/// It promises nothing about the hand's port: the correction acts one interval late, and on a motion that may not come
/// (see the tests). It needs no model and no friction; it chatters in stiff contact. A digital damper is itself
/// unstable above 2m/T (m: the device's mass), so max_damping must stay well below.
///
/// An interval that was not seen is not observed. N = 6 takes quantities that one α makes sense for.
///
/// Source: Hannaford & Ryu, IEEE Trans. Robotics & Automation 18(1), 2002 (recalled); kZohExact: Ryu, Kim, Hannaford,
/// IEEE Trans. Robotics 20(2), 2004 (recalled). Vector form: scalar products. control.md 5.1.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class PassivityController {
 public:
  struct Config {
    Friction friction;  ///< for the ledger alone
    PassivityObserver observer = PassivityObserver::kZohExact;
    double max_damping = 0;   ///< N·s/m, > 0; infinite: not limited, as published
    double min_speed = 1e-4;  ///< m/s, ≥ 0: slower motion is not divided by
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit PassivityController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// E of the observer, J: without the device's friction.
  double observed() const noexcept { return observed_; }

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  double dissipated_ = 0;  ///< J, by the damper in the interval before: kSameSample
  Interval<N> last_{Vec<N>::Zero(), Vec<N>::Zero(), Duration::zero()};
};

/// Lets the environment move less than the hand when it is observed to give out energy: passivity observer and
/// controller in parallel (admittance causality).
///
///     1/α(n) = −E(n) / (T ‖f(n)‖²)  when E(n) < 0, within [0, max_mobility]
///     v₁ = v₂ + f/α           hand v₁, environment v₂ (m/s), f = −F (N)
///
/// The controller modifies the velocity, so the environment is at x − δ, δ = Σ T f/α; the demand's stiffness gives its
/// force there: F = F_wanted + K δ. Without a stiffness in the demand it changes nothing. δ is the known weakness:
/// environment and hand drift apart. δ is reset out of contact, when both force and stiffness of the demand are zero.
/// Where the true environment would let go at x − δ, this affine one pulls.
///
/// It promises nothing about the hand's port (see PassivityController); observers and sources as there.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class ParallelPassivityController {
 public:
  struct Config {
    Friction friction;  ///< for the ledger alone
    PassivityObserver observer = PassivityObserver::kZohExact;
    double max_mobility = 0;  ///< 1/α, m/(N·s), > 0; infinite: not limited, as published
    double min_force = 1e-3;  ///< N, ≥ 0: smaller forces are not divided by
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit ParallelPassivityController(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// E of the observer, J: without the device's friction.
  double observed() const noexcept { return observed_; }
  /// δ, m: how far the environment is behind the hand.
  const Vec<N>& offset() const noexcept { return offset_; }

 private:
  Config config_;
  EnergyLedger port_;
  double observed_ = 0;
  double dissipated_ = 0;            ///< J, in the interval before: kSameSample
  Vec<N> slipped_ = Vec<N>::Zero();  ///< m, T f/α of the interval before
  Vec<N> offset_ = Vec<N>::Zero();   ///< m
  Interval<N> last_{Vec<N>::Zero(), Vec<N>::Zero(), Duration::zero()};
};

}  // namespace tendon
