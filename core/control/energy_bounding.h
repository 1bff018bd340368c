// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// The energy-bounding algorithm, which bounds a force by the previous force and the last motion. f = −F is the
/// reflective force, f_e the wanted one, and Δx the last displacement. f(n) is the nearest force to f_e with
///     (i)   f(n)·Δx ≤ f(n−1)·Δx + c₁ ‖Δx‖²              the slope is at most c₁
///     (ii)  ‖f(n)‖² ≤ ‖f(n−1)‖² + 2 c₂ f(n)·Δx           it stores no more than was put in
/// with c₂ ≤ c₁ ≤ b/T in N/m. If c₂ > c₁, the conditions can contradict each other. The law can display a stiffness of
/// at most about c₁, which is half of what force bounding and the AOL can display with the same friction.
///
/// The port is passive because E(n) ≥ ‖f(n)‖²/(2c₂), even if the device reduces the force. The proof assumes that holds
/// are not longer than `longest_hold`. If an interval is not finite or not measured, the law restarts from zero force.
///
/// Source: Kim & Ryu, IROS 2004; Int. J. Robotics Research 29(6), 2010 (recalled; the exact published form of (ii) is
/// unchecked). Proof: core/PROOFS.md, "Comparison laws". The vector form is ours. It uses the intersection of a ball
/// and a half-space, in which the nearest force has a closed form. For N = 1 these are the two intervals of the paper,
/// except that the paper keeps f(n−1) for Δx = 0. Here only (ii) applies, so an unwanted force can vanish while the
/// hand is at rest. For N = 6 the same b must be valid for every component (similar joints).
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class EnergyBounding {
 public:
  struct Config {
    Friction friction;           ///< f_c is only for the ledger; b > 0
    Duration longest_hold{};     ///< T, > 0
    std::optional<double> c1{};  ///< N/m, in (0, b/T], or b/T if empty
    std::optional<double> c2{};  ///< N/m, in (0, c1], or c1 if empty
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit EnergyBounding(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

 private:
  double c1_;
  double c2_;
  EnergyLedger port_;
  Vec<N> before_ = Vec<N>::Zero();  ///< f(n−1), N, reflective, as applied
  Vec<N> dx_ = Vec<N>::Zero();
};

}  // namespace tendon
