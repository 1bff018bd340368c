// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>

#include "core/base/motion.h"
#include "core/estimation/recursive_least_squares.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// Learns the remote environment from its rare and late forces, and predicts at every haptic step what it would answer
/// to the present position.
///
/// Each axis is a model of its own with two parameters θ in N/m, of the displacement x = position −
/// origin along that axis. Parameters are physical: a spring that pushes the hand back has θ₁ > 0 and
/// F = −θ₁ x; forces in and out have Tendon's sign, on the hand. With ℓ = `scale`:
///
///     kPolynomial     F = −(θ₁ x + θ₂ x|x|/ℓ) − off           −∂F/∂x = θ₁ + 2 θ₂ |x|/ℓ
///     kSpringAndBias  F = −(θ₁ x + θ₂ ℓ) − off                −∂F/∂x = θ₁
///     kOutputError    F(k) = a F(k−1) − θ₂ x(k)               −∂F/∂x = θ₂, of this step
///
/// A force that answers the motion at time t is compared with the model's force for that motion, which is kept in a
/// ring. **The time and the order in which answers arrive do not matter.** Then:
///
///     e = −F − φᵀθ
///     if |e| > reset_error, and reset_cooldown answers since the last one:  P ← p0 I  (θ stays)
///     θ, P ← least squares with forgetting, capped, outside the dead zone
///     θ ← into its bounds: stiffness 0 … max_stiffness (other parameters either sign), |a| ≤ 0.9
///     re-anchor on the newest motion that was answered: off = −F − φᵀθ, or F(k) computed again since
///
/// An axis on which the hand has moved less than three encoder counts since it last learned is frozen:
/// it is re-anchored but learns nothing from quantisation. Before it has learned, the prediction is the
/// force held. The pole is bounded because a pole fitted to 25 Hz data and run at 1 kHz is unstable as
/// often as not; a prediction is bounded because even so it can be wrong by newtons for a round trip
/// after the environment changes. The estimator decides which force is *wanted*; a limiter always comes after it.
///
/// Coupling between axes is not modelled: a wall at an angle to the axes is seen as three springs, which are right
/// only along the direction in which it was pressed last. An engine that knows better sends a LocalModel
/// (see AdaptiveLocalModel).
///
/// Source: Lee and Lee, "Multirate output estimation for real-time haptic rendering" (abstract only: the
/// structure; the condition of the P reset is lost and ours is a guess). Cap, cooldown, bounds, freeze
/// and re-anchoring are ours.
///
/// Thread-safe: no. Realtime-safe: yes; observe and predict O(1), correct at most kSlots steps.
class OutputEstimator {
 public:
  /// Steps remembered: an answer that comes more than this many steps late is ignored.
  static constexpr std::size_t kSlots = 1024;
  static constexpr double kMaxPole = 0.9;
  static constexpr double kFreezeCounts = 3;

  enum class Model : std::uint8_t { kPolynomial, kSpringAndBias, kOutputError };

  struct Config {
    Model model = Model::kPolynomial;
    /// m; the position at which the environment is at rest.
    Vec3 origin = Vec3::Zero();
    /// ℓ, m; about the travel, so that both parameters are of one size.
    double scale = 0.01;
    /// Per answer: with 0.95 at 25 Hz, half is forgotten in 0.5 s.
    double forgetting = 0.95;
    /// (N/m)²/N²: a parameter may be wrong by 500 N/m, a force by 0.05 N.
    double prior_variance = 1e8;
    /// N; about the noise of the engine's force.
    double dead_zone = 0;
    /// N; a larger error is another environment.
    double reset_error = 0.3;
    /// Answers; one more than there are parameters, or a reset would undo what the last one began.
    int reset_cooldown = 3;
    /// N/m
    double max_stiffness = 5000;
    /// N, per axis
    double max_force = 30;
    /// m; one encoder count at the handle, 0 = exact.
    double resolution = 0;
  };

  struct Counts {
    std::uint64_t corrections = 0;  ///< answers used
    std::uint64_t ignored = 0;      ///< answers to motions unknown, too old or answered already, or not finite
    std::uint64_t resets = 0;       ///< of P, over all axes
    std::uint64_t frozen = 0;       ///< axes that did not learn from an answer, for lack of motion
  };

  /// Throws std::invalid_argument naming the field when it is out of range.
  explicit OutputEstimator(const Config& config);

  /// Remembers the motion of this haptic step. One that is not finite or not newer changes nothing.
  void observe(const Motion& hand) noexcept;

  /// Learns from a remote force; false when it was ignored. Only `force` and `answers` are read.
  bool correct(const RemoteForce& force) noexcept;

  /// What the environment would answer at `hand.position`, in the step of `hand.at` or, when that was
  /// not observed, the one after the newest. Empty before the first correction, or for a position that
  /// is not finite. On an axis at ±max_force the stiffness is zero.
  std::optional<Prediction> predict(const Motion& hand) const noexcept;

  /// θ of an axis, N/m; for kOutputError (a, θ₂) with a as a number.
  Eigen::Vector2d parameters(int axis) const noexcept;

  const Counts& counts() const noexcept { return counts_; }

 private:
  struct Step {
    LocalTime at{};
    Vec3 position = Vec3::Zero();
    Vec3 before = Vec3::Zero();  ///< −F of the step before; kOutputError only
    Vec3 output = Vec3::Zero();  ///< −F
    bool answered = false;
  };
  struct Axis {
    UdLeastSquares<2> fit;
    double offset = 0;  ///< N
    double learned_at = 0;
    bool has_learned = false;
    int since_reset = 0;
  };
  struct Anchor {
    std::uint64_t step = 0;
    Vec3 output = Vec3::Zero();
  };

  Step& step(std::uint64_t number) noexcept { return steps_[number % kSlots]; }
  const Step& step(std::uint64_t number) const noexcept { return steps_[number % kSlots]; }
  std::optional<std::uint64_t> find(LocalTime at) const noexcept;
  Eigen::Vector2d regressor(double displacement, double before) const noexcept;
  void learn(Axis& axis, double displacement, double before, double output) noexcept;
  Eigen::Vector2d bounded(const Eigen::Vector2d& estimate) const noexcept;
  double output(int axis, double position, double before) const noexcept;
  void anchor() noexcept;

  Config config_;
  std::array<Step, kSlots> steps_{};
  std::uint64_t next_ = 0;  ///< number of the step that comes next; the newest has next_ − 1
  std::array<Axis, 3> axes_;
  std::optional<Anchor> anchor_;
  Counts counts_;
};

}  // namespace tendon
