// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// Follows the hand between two remote forces with the stiffness from the engine, and blends from one model to the
/// next. The model of answer j, and the prediction at time t after the next answer was received at t_r:
///     F_j(x) = f_j − share · K_j (x′ − x_j),   x′ the position nearest to x in the model's valid radius of x_j
///     F(x, t) = (1 − s) F_{j−1}(x) + s F_j(x),   s = clamp((t − t_r)/slow period, 0, 1)
/// A new answer that differs by ΔF at the same x therefore adds ΔF · dt/period per step. A sudden change would generate
/// |ΔF · dx| at the next motion. Blending spreads this energy over time, and the limiter accounts for it. If the
/// environment has not changed, the old and the new model are the same line, and the prediction does not lag. The slow
/// period is the time between the motions of the two answers, and is limited to `max_blend`. A force without a model is
/// treated as a model with K = 0. The contact and the table of an answer are ignored, because they cannot be blended.
///
/// Source: Barbagli et al., IJRR 24(9), 2005 (recalled). The loop is stable if share · K does not exceed the true
/// stiffness. K must be the result of `believed` (answer.h). See core/PROOFS.md, "Local models".
/// Thread-safe: no. Realtime-safe: yes.
class AdaptiveLocalModel {
 public:
  struct Config {
    /// The share of the stiffness that is used, (0, 1]. Use less than 1 if the engine estimates its stiffness.
    double share = 1;
    /// Maximum duration of a blend. If the engine is slower, only the new model is used after this time.
    Duration max_blend = std::chrono::milliseconds(100);
  };

  /// Throws std::invalid_argument with the name of the field if it is out of range.
  explicit AdaptiveLocalModel(const Config& config);

  /// Returns false and does nothing if its motion is not newer or if it is not finite. The first answer is not blended.
  bool observe(const RemoteForce& force) noexcept;

  /// Returns the force for `hand.position` and `hand.at`, or nothing before the first answer or if it is not finite.
  std::optional<Prediction> predict(const Motion& hand) const noexcept;

 private:
  /// F(x) = at_origin − model.stiffness · x′. The result of blending two lines is also a line if both are valid.
  struct Line {
    Vec3 at_origin = Vec3::Zero();
    LocalModel model{};
  };
  static Prediction at(const Line& line, const Vec3& position) noexcept;
  double share_of_new(LocalTime now) const noexcept;

  Config config_;
  Line old_;
  Line new_;
  bool has_answer_ = false;
  LocalTime answers_{};
  LocalTime received_{};
  Duration blend_{};
};

}  // namespace tendon
