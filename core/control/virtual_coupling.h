// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "core/control/stability_controller.h"
#include "core/ledger/energy_ledger.h"

namespace tendon {

/// A virtual coupling: a spring and a damper between the hand and a massless tool that touches the environment.
///     f(n) = K_c s(n) + B_c (s(n) − s(n−1))/T,     s = x − x_tool                   (f = −F, N;  s in m)
///     f(n) = f_e(n) − K s(n)                       the tool is in equilibrium: backward Euler, implicit
/// f_e and K are the demand, linear about the hand (symmetric part of K; negative eigenvalues count as 0). If the
/// environment is a spring K, the hand feels K_c K/(K_c + K). If the demand has no stiffness, it is a constant force on
/// the tool, which is returned unchanged without a guarantee.
///
/// The port is passive if the returned force is applied, if the environment is static, convex, fresh in every period,
/// and equally stiff at the tool and at the hand (a linear environment, or one wall at a time), and if
///     b ≥ K_c T/2 + B_c            (T: the longest hold time)
/// This is the rule of Colgate (see colgate_coupling). This is not checked by the constructor.
///
/// Source: Colgate, Stanley, Brown, IROS 1995 (recalled). Proof for vectors and convex environments: core/PROOFS.md,
/// "Comparison laws".
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class VirtualCoupling {
 public:
  struct Config {
    Friction friction;        ///< only for the ledger
    Duration longest_hold{};  ///< T, > 0
    double stiffness = 0;     ///< K_c, N/m, > 0
    double damping = 0;       ///< B_c, N·s/m, ≥ 0
  };

  /// Throws std::invalid_argument if a field is out of range.
  explicit VirtualCoupling(const Config& config);

  void observe(const Interval<N>& interval) noexcept { port_.observe(interval.applied, interval.dx, interval.held); }
  void observe_unseen(const Vec<N>& applied, Duration at_most) noexcept {
    port_.observe_unseen(applied.norm(), at_most);
  }
  LimitedForce<N> limit(const Demand<N>& demand) noexcept;
  double energy() const noexcept { return port_.energy(); }

  const Vec<N>& stretch() const noexcept { return stretch_; }  ///< s, m

 private:
  double stiffness_;
  double damping_per_hold_;  ///< B_c/T, N/m
  EnergyLedger port_;
  Vec<N> stretch_ = Vec<N>::Zero();
};

/// Returns the stiffest coupling (K_c, N/m; 0 if there is none) that is passive on a device with viscous friction b
/// (N·s/m), a hold T, and the damping B_c (N·s/m):
///     K_c = 2 (b − |B_c|)/T
/// This is sufficient and necessary for device and coupling alone, with any passive environment of the tool. Throws
/// std::invalid_argument if b is negative, longest_hold is not positive, or a value is not finite. Source: Colgate &
/// Schenkel, J. Robotic Systems 14(1), 1997; core/PROOFS.md, "Stability boundaries".
double colgate_coupling(double viscous, Duration longest_hold, double damping);

/// Returns the stiffest coupling (K_c, N/m; 0 if there is none) for which device and coupling are an absolutely stable
/// two-port (Llewellyn), for an impedance display:
///     2 Re Z_d · Re(1/Z_c) / |ZOH| + cos(arg ZOH) ≥ 1   on the unit circle,   Z_c = B_c + K_c T z/(z − 1)
/// With the Tustin model of the device Re Z_d = b for any mass. With ZOH = (1 + z⁻¹)/2, c = cos(ωT/2), κ = K_c T/2:
///     2b (B_c + κ) ≥ c (1 − c)(B_c + κ)² + κ² c³/(1 + c)   for 0 ≤ c ≤ 1
/// This is only for design. About four times larger than colgate_coupling, as it assumes a device and a passive hand in
/// discrete time. Real devices can be unstable below it. Throws as colgate_coupling, and if B_c < 0. Source: Adams &
/// Hannaford, IEEE Trans. Robotics & Automation 15(3), 1999 (recalled; algebra ours).
double two_port_coupling(double viscous, Duration longest_hold, double damping);

}  // namespace tendon
