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

/// Learns the remote environment from its infrequent and late forces, and predicts the answer in every haptic step.
/// Each axis has a separate model with two parameters θ in N/m, of the displacement x = position − origin along that
/// axis. A spring that pushes the hand back has θ₁ > 0 and F = −θ₁ x. Forces are on the hand. With ℓ = `scale`:
///     kPolynomial     F = −(θ₁ x + θ₂ x|x|/ℓ) − off           −∂F/∂x = θ₁ + 2 θ₂ |x|/ℓ
///     kSpringAndBias  F = −(θ₁ x + θ₂ ℓ) − off                −∂F/∂x = θ₁
///     kOutputError    F(k) = a F(k−1) − θ₂ x(k)               −∂F/∂x = θ₂, of this step
/// A force that answers the motion at time t is compared with the force of the model for that motion. The time and the
/// order of arrival therefore have no effect. Then:
///     e = −F − φᵀθ
///     if |e| > reset_error, and reset_cooldown answers since the last one:  P ← p0 I  (θ stays)
///     θ, P ← least squares with forgetting, capped, outside the dead zone
///     θ ← into its bounds: stiffness 0 … max_stiffness (other parameters either sign), |a| ≤ 0.9
///     re-anchor on the newest motion that was answered: off = −F − φᵀθ, or F(k) computed again since
/// An axis does not learn while the hand has moved by less than three encoder counts since the last update. Until the
/// first update, the held force is used as the prediction. The pole is bounded, because a pole that was fitted to 25 Hz
/// data is often unstable at 1 kHz. The prediction is also bounded, because its error can be some newtons if the
/// environment changes. The result must be bounded by a limiter. The axes are independent: a wall at an angle to the
/// axes is modelled by three springs that are only correct along the last press. Engines can send a LocalModel instead.
///
/// Source: Lee and Lee, "Multirate output estimation for real-time haptic rendering". Only the abstract is available,
/// so the condition for resetting P is a guess. Cap, cooldown, bounds, freeze and re-anchoring are ours:
/// core/PROOFS.md, "Local models".
/// Thread-safe: no. Realtime-safe: yes; observe and predict O(1), correct at most kSlots steps.
class OutputEstimator {
 public:
  static constexpr std::size_t kSlots = 1024;  ///< stored steps; older answers are ignored
  static constexpr double kMaxPole = 0.9;
  static constexpr double kFreezeCounts = 3;

  enum class Model : std::uint8_t { kPolynomial, kSpringAndBias, kOutputError };

  struct Config {
    Model model = Model::kPolynomial;
    Vec3 origin = Vec3::Zero();   ///< m, the rest position of the environment
    double scale = 0.01;          ///< ℓ, m; should be similar to the travel, so that both parameters are similar
    double forgetting = 0.95;     ///< per answer; 0.95 forgets half in 0.5 s at 25 Hz
    double prior_variance = 1e8;  ///< (N/m)²/N², for errors of 500 N/m for a parameter and 0.05 N for a force
    double dead_zone = 0;         ///< N; should be about the noise of the engine's force
    double reset_error = 0.3;     ///< N; if the error is larger, the environment has changed
    int reset_cooldown = 3;       ///< answers between two resets; should exceed the number of parameters
    double max_stiffness = 5000;  ///< N/m
    double max_force = 30;        ///< N, per axis
    double resolution = 0;        ///< m; one encoder count at the handle, 0 = exact
  };

  struct Counts {
    std::uint64_t corrections = 0;  ///< answers used
    std::uint64_t ignored = 0;      ///< answers that are not finite, or whose motion is unknown, too old or answered
    std::uint64_t resets = 0;       ///< of P, over all axes
    std::uint64_t frozen = 0;       ///< axes without enough motion to learn from an answer
  };

  /// Throws std::invalid_argument with the name of the field if it is out of range.
  explicit OutputEstimator(const Config& config);

  /// Stores the motion of this haptic step. Does nothing if the motion is not finite or is not newer.
  void observe(const Motion& hand) noexcept;

  /// Learns from a remote force. Returns false if it was ignored. Uses only `force` and `answers`.
  bool correct(const RemoteForce& force) noexcept;

  /// Returns the predicted answer at `hand.position`, in the step of `hand.at` or, if that was not observed, in the
  /// step after the newest. Returns nothing before the first correction and if the position is not finite. The
  /// stiffness of an axis at ±max_force is zero.
  std::optional<Prediction> predict(const Motion& hand) const noexcept;

  /// Returns θ of an axis in N/m, for kOutputError (a, θ₂) with the dimensionless a.
  Eigen::Vector2d parameters(int axis) const noexcept;

  const Counts& counts() const noexcept { return counts_; }

 private:
  struct Step {
    LocalTime at{};
    Vec3 position = Vec3::Zero();
    Vec3 before = Vec3::Zero();  ///< −F in the previous step, only for kOutputError
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
  std::uint64_t next_ = 0;  ///< number of the next step, so that the newest step has the number next_ − 1
  std::array<Axis, 3> axes_;
  std::optional<Anchor> anchor_;
  Counts counts_;
};

}  // namespace tendon
