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

/// Learns how the remote force changes with the hand's place, from the answers alone, and moves the newest answer to
/// where the hand is now: over the delay, and between two answers.
///
/// x_a is where the hand was when the motion was sampled that answer F_a belongs to. At a new answer, with (F_p, x_p)
/// the last one that taught something, p = x_a − x_p, and if ‖p‖ ≥ ℓ (`least_travel`):
///
///     q = K p                                                              N, what the model says
///     N ← λ N − (F_a − F_p)·q,   D ← λ D + ‖q‖²,   θ = clamp(N/D, 0, 1)    trust; 0 before two lessons
///     K ← K + g (−(F_a − F_p) − q) pᵀ / (‖p‖² + ℓ²/10)                     N/m, 3 × 3
///     (F_p, x_p) ← (F_a, x_a)
///
/// and at every haptic step, with d = x − x_a:
///
///     F = F_a − θ K d + r,   ‖θ K d‖ ≤ max_stiffness ‖d‖,   ‖F − r‖ ≤ 1.5 F_late;   r ← r τ_r/(τ_r + T)
///
/// where r is set at an answer so that F does not jump, and τ_r is the least of `blend` and `blend_share` of the mean
/// time between answers: always `blend` would lag where answers are fresh. F_late is the largest of the answers, forgotten
/// within 1 s: a force that friction or a yielding object limits is not led far beyond that limit.
///
/// Trust is the least-squares share of the predicted change that really came, so a force that changes in time makes its
/// own model fade. There is no covariance, hence none to wind up: a hand that travels less than ℓ teaches nothing.
///
/// One-sided contact: after an answer of exactly zero, 0.3 mm or more from where a force was felt last, the object counts
/// as one that only pushes. Then F fades to zero along F_a but does not turn round, F_a = 0 predicts zero, and pairs with
/// a zero in them teach nothing. A force that turns round within 3 mm ends that.
///
/// It decides which force is *wanted*; a limiter comes after it. An answer with a model of its own is for `reconstruct`.
///
/// Source: derived for Tendon (feel.md 3.1). The update is the normalised least-mean-squares step (Nagumo and Noda, IEEE
/// Trans. Automatic Control 12(3), 1967).
///
/// Thread-safe: no. Realtime-safe: yes; observe and predict O(1), correct O(log kSlots).
class LearnedModel {
 public:
  /// Steps remembered: an answer that comes more than this many steps late is held as it is.
  static constexpr std::size_t kSlots = 1024;

  struct Config {
    double least_travel = 2e-4;                     ///< ℓ, m, > 0: about seven encoder counts
    double gain = 0.5;                              ///< g, in (0, 1]
    double forgetting = 0.9;                        ///< λ, per lesson, in (0, 1)
    double max_stiffness = 10000;                   ///< N/m, > 0
    Duration blend = std::chrono::milliseconds(8);  ///< ≥ 0
    double blend_share = 0.3;                       ///< ≥ 0
  };

  /// Throws std::invalid_argument naming the field when it is out of range.
  explicit LearnedModel(const Config& config);

  /// Remembers the motion of this haptic step. One that is not finite or not newer changes nothing.
  void observe(const Motion& hand) noexcept;

  /// Takes a newer answer. Only `force` and `answers` are read.
  void correct(const RemoteForce& answer) noexcept;

  /// What the environment would answer at the newest motion observed; empty before the first answer. Call it once in each
  /// haptic step: r fades by it.
  std::optional<Prediction> predict() noexcept;

  /// Forgets everything but the motion: the next answer is of another environment.
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
  std::uint64_t next_ = 0;  ///< number of the step that comes next

  Mat3 stiffness_ = Mat3::Zero();
  double came_ = 0;       ///< N, of the trust
  double predicted_ = 0;  ///< D
  double trust_ = 0;
  int lessons_ = 0;  ///< 0, 1, or 2 for more
  std::optional<Answered> teacher_;
  std::optional<Answered> pushed_;  ///< the last answer that was not zero; until there is one, the first that was
  bool one_sided_ = false;

  std::optional<Answered> anchor_;
  bool known_place_ = false;     ///< of the anchor; without it the answer is held
  Vec3 rest_ = Vec3::Zero();     ///< r, N
  LocalTime answered_{};         ///< when the anchor came
  LocalTime faded_{};            ///< when `rest_` was looked at last
  double largest_ = 0;           ///< F_late, N
  std::optional<double> gap_{};  ///< s, mean time between answers
};

}  // namespace tendon
