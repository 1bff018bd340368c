// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "core/control/stability_controller.h"

namespace tendon {

/// A flat elastic surface, which the follower sends instead of forces.
///     F(x) = K (d − n·x)₊ n       N, on a hand at x
template <int N>
struct SurfaceModel {
  std::uint64_t sequence = 0;       ///< 1, 2, …, used to ignore older messages and duplicates
  Vec<N> normal = Vec<N>::Unit(0);  ///< n, the unit normal vector of the surface
  double offset = 0;                ///< d, m; the surface is at n·x = d
  double stiffness = 0;             ///< K, N/m, or 0 if there is no surface

  double depth(const Vec<N>& x) const noexcept;   ///< m, or 0 if x is outside of the surface
  double energy(const Vec<N>& x) const noexcept;  ///< ½ K depth², J
};

/// The follower's end of model-mediated teleoperation: estimates a surface from the position and force of the tool.
///     n:       the mean force and the previous normal, without the directions in which x + f/K spreads
///     K and d: least squares of n·f = K d − K (n·x) over the contact, with fading weights
/// f is the force on the tool (N) at the position x (m). There is contact if ‖f‖ ≥ contact_force. Each contact starts
/// new moments about its first point, so the position of the origin does not matter. On an elastic surface with
/// friction, x + f/K is a point in the plane n·x = d, displaced along this plane. Principal axes with a spread of at
/// least `least_spread` are therefore in the surface, and the force along them is friction. Without such a spread (a
/// push without sliding), the mean force is the normal, tilted by friction; n is limited to the tilt of a friction
/// coefficient of 0.75. Until the tool has moved enough to determine a slope, K is `first_stiffness`, or the previous K
/// if the contact starts at the last surface. After that it is limited to first_stiffness/10 … `max_stiffness`. d is
/// chosen such that the force of the model at the newest sample is n·f.
///
/// If there is no contact, the last surface is used to predict the next contact. If the tool is more than 2
/// contact_force/K + position_noise deep in it without a force, K becomes 0 until the next contact. This removes energy
/// from the model, so a SurfaceRenderer uses it immediately. (Moving d to the tool would not be enough: the hand is
/// ahead of the tool by a round trip and would only be released gradually.) Samples are ignored if they are not finite.
///
/// Source: the idea of Mitra and Niemeyer, IJRR 27(2), 2008 (recalled, not re-read); the estimator is ours
/// (core/PROOFS.md, "Surfaces").
/// Thread-safe: no. Realtime-safe: yes, except the constructor.
template <int N>
class SurfaceEstimator {
 public:
  struct Config {
    double contact_force = 0;    ///< N; > 0
    double first_stiffness = 0;  ///< N/m; > 0
    double max_stiffness = 0;    ///< N/m; ≥ first_stiffness
    double least_travel = 0;     ///< m, standard deviation of n·x above which a slope is used; > 0
    double memory = 0;           ///< > 0; the weight of a sample decreases to 1/e after this number of samples
    double least_spread = 1e-3;  ///< m, standard deviation above which a direction is in the surface; > 0
    double position_noise = 0;   ///< m, ≥ 0; if the depth is smaller than this, the tool may be outside
  };

  /// Throws std::invalid_argument with the name of the field, its value and the expected value.
  explicit SurfaceEstimator(const Config& config);

  SurfaceModel<N> observe(const Vec<N>& position, const Vec<N>& force) noexcept;  ///< adds one sample

  /// Returns the ratio of the RMS forces along and across the surface (while sliding: μ plus noise), initially 0.
  double friction() const noexcept;

 private:
  /// Means and second moments with fading weights.
  struct Moments {
    Vec<N> place = Vec<N>::Zero();   ///< m, relative to the start of the contact
    Vec<N> force = Vec<N>::Zero();   ///< N
    Mat<N> places = Mat<N>::Zero();  ///< m²
    Mat<N> forces = Mat<N>::Zero();  ///< N²
    Mat<N> both = Mat<N>::Zero();    ///< N·m; rows: positions, columns: forces

    void add(double share, const Vec<N>& y, const Vec<N>& f) noexcept;
  };

  Vec<N> find_normal() const noexcept;
  double unseen() const noexcept;
  double least_stiffness() const noexcept { return config_.first_stiffness / 10; }

  Config config_;
  SurfaceModel<N> model_;
  bool touching_ = false;
  bool known_ = false;              ///< there was a contact
  double weight_ = 0;               ///< sum of the weights
  Vec<N> origin_ = Vec<N>::Zero();  ///< m, start of the contact
  double samples_ = 0;              ///< of this contact
  Moments moments_;
};

/// The leader's end, which renders a surface at the full rate. Energy from a change of the model must be paid for.
///     F_wanted = K (d' − n·x)₊ n,     ½ K (d' − n·x)₊² ≤ ½ K_old (d'_old − n_old·x)₊² + budget
/// In each period, the newest received surface is used. It is placed deeper (d' ≤ d) if its energy at the hand would
/// exceed the energy of the previous one plus the budget. It then rises to its position as the hand retracts or as
/// budget becomes available. The energy from the model therefore never exceeds the energy from the hand and the budget.
/// A suitable budget is the part of the port's account beyond the energy of the surface,
///     budget = max(E − rendered energy, 0)
/// With this budget a limiter with K ≤ 2b/T_max does not reduce the force. A budget of 0 is passive for every E.
///
/// A message is ignored if a number is not finite, the stiffness is negative, or the normal is not a unit vector
/// (1e-6). If `position` is not finite, the demand is not finite. If the budget is not positive, it is treated as 0.
///
/// Source: as above. For the budget, see core/PROOFS.md, "Surfaces".
/// Thread-safe: no. Realtime-safe: yes.
template <int N>
class SurfaceRenderer {
 public:
  struct Rendered {
    Demand<N> demand;  ///< the force, and the stiffness K n nᵀ during contact
    double paid;       ///< J, part of the budget; ≥ 0
  };

  void receive(const SurfaceModel<N>& message) noexcept;

  /// Returns the requested force for this period, with the hand at `position` (m).
  Rendered command(const Vec<N>& position, double budget) noexcept;

  /// ½ K depth² of the current surface, J. This part of the port's account is not available.
  double energy(const Vec<N>& position) const noexcept { return used_.energy(position); }

 private:
  SurfaceModel<N> newest_;
  SurfaceModel<N> used_;
};

}  // namespace tendon
