// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"

namespace tendon {

/// A flat, springy surface, which the follower sends instead of forces.
///
///     F(x) = K (d − n·x)₊ n       N, on whoever is at x
template <int N>
struct SurfaceModel {
  std::uint64_t sequence = 0;       ///< 1, 2, …; a message with one that is not above the newest is dropped
  Vec<N> normal = Vec<N>::Unit(0);  ///< n, unit vector, out of the surface
  double offset = 0;                ///< d, m: the surface is at n·x = d
  double stiffness = 0;             ///< K, N/m; 0: there is none

  /// How deep `x` is inside, m; 0 outside.
  double depth(const Vec<N>& x) const noexcept;
  /// ½ K depth², J.
  double energy(const Vec<N>& x) const noexcept;
};

/// Finds the surface that a tool touches, from where it is and what it feels: the follower's end of model-mediated
/// teleoperation.
///
///     n = f/‖f‖;   K and d: least squares of ‖f‖ = K d − K (n·x) over the contact, older samples fading out
///
/// with f the force of the surroundings on the tool (N), at position x (m). Contact is ‖f‖ ≥ contact_force; a new
/// contact starts afresh. Until the tool has moved enough within the contact for a slope to be seen, K is
/// `first_stiffness`; after that it is kept between zero and `max_stiffness`. Out of contact the last surface stays: it
/// is where the next contact is expected.
///
/// Source: the idea of Mitra and Niemeyer, IJRR 27(2), 2008 (recalled, not re-read); the estimator is ours, the
/// simplest that does.
///
/// Samples that are not finite are passed over. Thread-safe: no. Realtime-safe: all but the constructor.
template <int N>
class SurfaceEstimator {
 public:
  struct Config {
    double contact_force = 0;    ///< N; > 0
    double first_stiffness = 0;  ///< N/m; > 0
    double max_stiffness = 0;    ///< N/m; ≥ first_stiffness
    double least_travel = 0;     ///< m, standard deviation of n·x from which on a slope is believed; > 0
    double memory = 0;           ///< samples after which one has faded to 1/e; ≥ 1
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit SurfaceEstimator(const Config& config);

  /// One sample; returns the surface as it is known now, to be sent when it seems worth it.
  SurfaceModel<N> observe(const Vec<N>& position, const Vec<N>& force) noexcept;

 private:
  Config config_;
  SurfaceModel<N> model_;
  bool touching_ = false;
  double weight_ = 0;      ///< Σ of fading weights
  double mean_along_ = 0;  ///< of n·x, m
  double mean_force_ = 0;  ///< N
  double variance_ = 0;    ///< of n·x, m²
  double covariance_ = 0;  ///< of n·x and ‖f‖, N·m
};

/// Renders a surface at the leader at the full rate, whatever the network does: energy can only enter when the model
/// changes, and no change enters unless it is paid.
///
///     F_wanted = K (d' − n·x)₊ n,     ½ K (d' − n·x)₊² ≤ ½ K_old (d'_old − n_old·x)₊² + budget
///
/// In every period the surface in use becomes the newest one received, put deeper (d' ≤ d) where it would hold more
/// energy at the hand than the one before plus what the caller gives for it. It then rises to its place as the
/// hand withdraws or as budget comes. So what the model has given out is never more than what the hand and the
/// budget have put in. A good budget is what the port's account has beyond the energy of the surface,
///
///     budget = max(E − rendered energy, 0)
///
/// with which a limiter with K ≤ 2b/T_max has nothing left to clip; a budget of zero is passive whatever E is.
///
/// Source: as above; the gate: control.md 7.
///
/// A message whose numbers are not finite, whose stiffness is negative or whose normal is not a unit vector (1e-6) is
/// passed over; when `position` is not finite, neither is the demand. A budget that is not above zero is none.
///
/// Thread-safe: no. Realtime-safe: all of it.
template <int N>
class SurfaceRenderer {
 public:
  struct Rendered {
    Demand<N> demand;  ///< the force, and the stiffness K n nᵀ while the surface is touched
    double paid;       ///< J, of the budget; ≥ 0
  };

  void receive(const SurfaceModel<N>& message) noexcept;

  /// The force to want in the period that begins, with the hand at `position` (m).
  Rendered command(const Vec<N>& position, double budget) noexcept;

  /// ½ K depth² of the surface in use, J: part of the port's account that is not free.
  double energy(const Vec<N>& position) const noexcept { return used_.energy(position); }

 private:
  SurfaceModel<N> newest_;
  SurfaceModel<N> used_;
};

}  // namespace tendon
