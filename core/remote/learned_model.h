// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// Learns from the answers how the remote force depends on the position of the hand, and extrapolates the newest answer
/// to the current position. This compensates for the delay and interpolates between answers. Answer F_a belongs to the
/// position x_a. (F_p, x_p) is the last pair that was used. At a new answer, if p = x_a − x_p and ‖p‖ ≥ ℓ:
///     q = K p                                                              N, prediction of the model
///     N ← λ N − (F_a − F_p)·q,   D ← λ D + ‖q‖²,   θ = clamp(N/D, 0, 1)    trust; 0 before two lessons
///     K ← K + g (−(F_a − F_p) − q) pᵀ / (‖p‖² + ℓ²/10)                     N/m, 3 × 3
///     (F_p, x_p) ← (F_a, x_a)
/// and in every haptic step, with d = x − x_a:
///     F = F_a − θ K d + r,   ‖θ K d‖ ≤ max_stiffness ‖d‖,   ‖F − r‖ ≤ 1.5 F_late;   r ← r τ_r/(τ_r + T)
/// r is chosen so that F does not jump at an answer. τ_r is `blend` or `blend_share` times the mean time between
/// answers, whichever is smaller. F_late is the largest recent answer (within 1 s). θ decreases if the force varies
/// over time.
///
/// One-sided contact: if an answer is exactly zero and at least 0.3 mm away from the last force, it is assumed that the
/// object can only push. F then fades to zero along F_a without reversing, F_a = 0 predicts zero, and pairs with a zero
/// are not used. This is no longer assumed if a force is reversed within 3 mm.
///
/// The result must be bounded by a limiter. Use `reconstruct` for answers that have a model.
///
/// Source: core/PROOFS.md, "Local models". The update is the normalized least-mean-squares step (Nagumo and Noda, IEEE
/// Trans. Automatic Control 12(3), 1967).
/// Thread-safe: no. Realtime-safe: yes; observe and predict O(1), correct O(log kSlots).
class LearnedModel {
 public:
  static constexpr std::size_t kSlots = 1024;  ///< number of stored steps; older answers have no model

  struct Config {
    double least_travel = 2e-4;                     ///< ℓ, m, > 0: about seven encoder counts
    double gain = 0.5;                              ///< g, in (0, 1]
    double forgetting = 0.9;                        ///< λ, per lesson, in (0, 1)
    double max_stiffness = 10000;                   ///< N/m, > 0
    Duration blend = std::chrono::milliseconds(8);  ///< ≥ 0
    double blend_share = 0.3;                       ///< ≥ 0
  };

  /// Throws std::invalid_argument with the name of the field if it is out of range.
  explicit LearnedModel(const Config& config);

  /// Stores the motion of this haptic step. Does nothing if the motion is not finite or is not newer.
  void observe(const Motion& hand) noexcept;

  /// Takes a newer answer. Uses only `force` and `answers`.
  void correct(const RemoteForce& answer) noexcept;

  /// Returns the predicted answer to the newest motion, or nothing before the first answer. Must be called once per
  /// haptic step, because each call reduces r.
  std::optional<Prediction> predict() noexcept;

  /// Resets everything except the stored motion. Must be called if the environment changes.
  void forget() noexcept;

  double trust() const noexcept { return trust_; }               ///< θ
  const Mat3& stiffness() const noexcept { return stiffness_; }  ///< K, N/m

 private:
  struct Place {
    LocalTime at{};
    Vec3 position = Vec3::Zero();
  };
  struct Answered {
    Vec3 force = Vec3::Zero();
    Vec3 place = Vec3::Zero();
  };

  const Place& newest() const noexcept { return places_[(next_ - 1) % kSlots]; }
  std::optional<Vec3> place_at(LocalTime at) const noexcept;
  void judge_sides(const Answered& answer) noexcept;
  void learn(const Answered& answer) noexcept;
  Prediction led() const noexcept;

  Config config_;
  std::array<Place, kSlots> places_{};
  std::uint64_t next_ = 0;  ///< the number of the next step

  Mat3 stiffness_ = Mat3::Zero();
  double came_ = 0;       ///< N of the trust θ
  double predicted_ = 0;  ///< D of the trust θ
  double trust_ = 0;
  int lessons_ = 0;  ///< 0, 1, or 2 (which means 2 or more)
  std::optional<Answered> teacher_;
  std::optional<Answered> pushed_;  ///< last nonzero answer, or the first zero one
  bool one_sided_ = false;

  std::optional<Answered> anchor_;
  bool known_place_ = false;     ///< of the anchor; if false, the answer is held
  Vec3 rest_ = Vec3::Zero();     ///< r, N
  LocalTime answered_{};         ///< arrival of the anchor
  LocalTime faded_{};            ///< last update of `rest_`
  double largest_ = 0;           ///< F_late, N
  std::optional<double> gap_{};  ///< s, mean time between answers
};

}  // namespace tendon
