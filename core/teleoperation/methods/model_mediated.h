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
///     n:       the mean force and the normal until now, less what lies along where x + f/K spreads
///     K and d: least squares of n·f = K d − K (n·x) over the contact, older samples fading out
///
/// with f the force of the surroundings on the tool (N), at position x (m). Contact is ‖f‖ ≥ contact_force; a new
/// contact starts afresh, and its moments are about its first point, so it does not matter how far the origin is. On a
/// springy surface with friction x + f/K is a point of the plane n·x = d, moved along it; so from a spread of
/// `least_spread` on its principal axes say what lies in the surface, and friction is what is left of f. Where it does
/// not spread (a press without sliding) the mean force is the normal, tilted by friction; n is never farther from it
/// than a friction of 0.75 can tilt it. Until the tool has moved enough within the contact for a slope to be seen, K is
/// `first_stiffness`, or what it was when this contact begins where the last surface was; after that it is kept between
/// a tenth of first_stiffness and `max_stiffness`. d is such that the model's force at the newest sample is n·f.
///
/// Out of contact the last surface stays: it is where the next contact is expected. But when the tool is deeper in it
/// than 2 contact_force/K + position_noise and feels nothing, it is gone: K is 0 until the next contact. That takes
/// energy out of the model, so a SurfaceRenderer follows it at once. (To move d to the tool is not enough: the hand is
/// ahead of the tool by a round trip, and would be let go by a share of its depth in each of them.)
///
/// Source: the idea of Mitra and Niemeyer, IJRR 27(2), 2008 (recalled, not re-read); the estimator is ours.
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
    double memory = 0;           ///< samples after which one has faded to 1/e; > 0
    double least_spread = 1e-3;  ///< m, standard deviation along a direction from which on it lies in the surface; > 0
    double position_noise = 0;   ///< m, ≥ 0: a tool that is no deeper than this inside a surface may be outside it
  };

  /// Throws std::invalid_argument naming the field, its value and what was expected.
  explicit SurfaceEstimator(const Config& config);

  /// One sample; returns the surface as it is known now, to be sent when it seems worth it.
  SurfaceModel<N> observe(const Vec<N>& position, const Vec<N>& force) noexcept;

  /// Root mean square of what of f is along the surface, over that of what is across it: μ while the tool slides, and
  /// with what noise adds. 0 before the first contact.
  double friction() const noexcept;

 private:
  /// Fading means, and moments about them.
  struct Moments {
    Vec<N> place = Vec<N>::Zero();   ///< m, from where the contact began
    Vec<N> force = Vec<N>::Zero();   ///< N
    Mat<N> places = Mat<N>::Zero();  ///< m²
    Mat<N> forces = Mat<N>::Zero();  ///< N²
    Mat<N> both = Mat<N>::Zero();    ///< N·m: places by rows, forces by columns

    void add(double share, const Vec<N>& y, const Vec<N>& f) noexcept;
  };

  Vec<N> find_normal() const noexcept;
  double unseen() const noexcept;
  double least_stiffness() const noexcept { return config_.first_stiffness / 10; }

  Config config_;
  SurfaceModel<N> model_;
  bool touching_ = false;
  bool known_ = false;              ///< there was a contact
  double weight_ = 0;               ///< Σ of fading weights
  Vec<N> origin_ = Vec<N>::Zero();  ///< m, where the contact began
  double samples_ = 0;              ///< of this contact
  Moments moments_;
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
