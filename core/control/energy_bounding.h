// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// The energy-bounding algorithm: bounds a force by the force before it and the motion since.
///
/// With f = −F the reflective force, f_e the wanted one and Δx the displacement in the interval that has ended,
/// f(n) is the force nearest to f_e that obeys
///
///     (i)   f(n)·Δx ≤ f(n−1)·Δx + c₁ ‖Δx‖²              no steeper than c₁
///     (ii)  ‖f(n)‖² ≤ ‖f(n−1)‖² + 2 c₂ f(n)·Δx           no more stored than was put in
///
/// c₂ ≤ c₁ ≤ b/T, in N/m. It displays at most about c₁: half of what force bounding and the AOL do from the same
/// friction.
///
/// Why it is passive: summed, (ii) says Σ f(n)·Δx(n) ≥ ‖f(n)‖²/(2c₂) ≥ 0; the port's ledger differs from that sum by
/// Σ (b/T) ‖Δx‖² − Σ (f(n) − f(n−1))·Δx(n), which (i) makes non-negative. A force that the device shortens (or that
/// is zero because the wanted one was not finite) breaks neither: (i) and (ii) together imply
/// E(n) ≥ ‖f(n)‖²/(2c₂), and that bound on its size is all that the next interval needs. When c₂ > c₁ the two
/// conditions can contradict each other, hence the check.
///
/// The proof ends with the first hold longer than `longest_hold` (what Limiter then does is written there). An interval
/// that was not seen, or is not finite, starts it again from zero force.
///
/// Source: Kim & Ryu, IROS 2004; Int. J. Robotics Research 29(6), 2010 (recalled: the exact published form of (ii) is
/// unchecked; proof and feasibility: control.md 5.3). The vector form is ours, with the proof above: a ball cut by a
/// half-space, in which the nearest force has a closed form; for N = 1 they are the paper's two intervals. One
/// departure: with Δx = 0 the paper keeps f(n−1); here (ii) alone holds then, so a force that nobody wants any more
/// can go while the hand is at rest.
///
/// N = 6 takes quantities in which one b is the friction of every component (alike joints).
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class EnergyBounding {
 public:
  struct Config {
    Friction friction;           ///< f_c serves the ledger alone; b > 0
    Duration longest_hold{};     ///< T, > 0
    std::optional<double> c1{};  ///< N/m, in (0, b/T]; left out: b/T
    std::optional<double> c2{};  ///< N/m, in (0, c1]; left out: c1
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit EnergyBounding(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double c1_;
  double c2_;
  EnergyLedger port_;
  Vec<N> before_ = Vec<N>::Zero();  ///< f(n−1), N, reflective, really held
  Vec<N> dx_ = Vec<N>::Zero();
};

}  // namespace tendon
