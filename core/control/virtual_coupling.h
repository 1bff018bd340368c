// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// Ties the hand by a spring and a damper to a massless tool, which is what touches the environment.
///
///     f(n) = K_c s(n) + B_c (s(n) − s(n−1))/T,     s = x − x_tool                   (f = −F, N;  s in m)
///     f(n) = f_e(n) − K s(n)                       the tool is in equilibrium: backward Euler, implicit
///
/// f_e and K: the demand, affine about the hand (K's symmetric part; directions in which it is negative count as 0).
/// In a spring K the hand feels the series value K_c K/(K_c + K). A demand **without** a stiffness is a constant force
/// to the tool: it comes through unchanged, and nothing is promised.
///
/// Passive when the environment is static and convex, as stiff where the tool is as where the hand is (a linear one, or
/// one wall at a time: the demand says no more than that), fresh in every period, and what is returned is what is
/// held, if
///
///     b ≥ K_c T/2 + B_c            (T: the longest hold)
///
/// for all motions and any number of dimensions: Σ f(n)·Δx_tool ≥ 0 by convexity, and what remains,
/// Σ f(n)·Δs − (f(n) − f(n−1))·Δx + (b/T)‖Δx‖², is at least (b/T − K_c/2 − B_c/T) Σ‖Δx‖². The rule is Colgate's; it is
/// tight. The constructor does not ask for it (see colgate_coupling).
///
/// Source: Colgate, Stanley, Brown, IROS 1995 (recalled). Proof for vectors and convex environments: ours.
///
/// Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class VirtualCoupling {
 public:
  struct Config {
    Friction friction;        ///< for the ledger alone
    Duration longest_hold{};  ///< T, > 0
    double stiffness = 0;     ///< K_c, N/m, > 0
    double damping = 0;       ///< B_c, N·s/m, ≥ 0
  };

  /// Throws std::invalid_argument when a field is out of its range.
  explicit VirtualCoupling(const Config& config);

  void observe(const Interval<N>& interval) noexcept;
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept;
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  /// s, m: how far the hand is ahead of the tool.
  const Vec<N>& stretch() const noexcept { return stretch_; }

 private:
  double stiffness_;
  double damping_per_hold_;  ///< B_c/T, N/m
  EnergyLedger port_;
  Vec<N> stretch_ = Vec<N>::Zero();
};

/// The stiffest coupling (K_c, N/m; 0 if none) that is passive on a device with viscous friction b (N·s/m), held for T,
/// with `damping` B_c (N·s/m):
///
///     K_c = 2 (b − |B_c|)/T
///
/// Sufficient and necessary for the device and the coupling alone, whatever passive environment the tool is in.
/// Source: Colgate & Schenkel, J. Robotic Systems 14(1), 1997; control.md 6.1. Throws std::invalid_argument unless
/// b ≥ 0, longest_hold > 0 and all are finite.
double colgate_coupling(double viscous, Duration longest_hold, double damping);

/// The stiffest coupling (K_c, N/m; 0 if none) for which device and coupling are an absolutely stable two-port
/// (Llewellyn), for an impedance display:
///
///     2 Re Z_d · Re(1/Z_c) / |ZOH| + cos(arg ZOH) ≥ 1   on the unit circle,   Z_c = B_c + K_c T z/(z − 1)
///
/// With Tustin's device Re Z_d = b, whatever its mass; with ZOH = (1 + z⁻¹)/2, c = cos(ωT/2) and κ = K_c T/2 it reads
///
///     2b (B_c + κ) ≥ c (1 − c)(B_c + κ)² + κ² c³/(1 + c)   for 0 ≤ c ≤ 1
///
/// For design only: about four times what colgate_coupling allows, because it takes the device as discrete and the hand
/// as passive in discrete time. Real sampled devices can be unstable below it.
/// Source: Adams & Hannaford, IEEE Trans. Robotics & Automation 15(3), 1999 (recalled; algebra ours). Throws as
/// colgate_coupling does, and when `damping` is negative.
double two_port_coupling(double viscous, Duration longest_hold, double damping);

}  // namespace tendon
