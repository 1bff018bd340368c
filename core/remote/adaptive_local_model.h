// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>

#include "core/base/motion.h"
#include "core/remote/prediction.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// Follows the hand between two remote forces with the stiffness that the engine sent along, and changes from one model
/// to the next without a kick.
///
/// The model of answer j, and the prediction at time t after the next answer was received at t_r:
///
///     F_j(x) = f_j − share · K_j (x′ − x_j),   x′ the position nearest to x in the model's valid radius of x_j
///     F(x, t) = (1 − s) F_{j−1}(x) + s F_j(x),   s = clamp((t − t_r)/slow period, 0, 1)
///
/// so a new answer that differs by ΔF at the same x adds ΔF · dt/period per step instead of ΔF at once;
/// a sudden change would give out |ΔF · dx| on the next motion. (Blending spreads that energy, and the limiter
/// downstream accounts for the rest.) When the environment has not changed, old and new model are the same line and
/// nothing lags. The slow period is the time between the motions that two answers belong to, at most `max_blend`.
///
/// A force without a model is the model with K = 0: it is held, and blended in like any other. Contact and table of an
/// answer are not read: they cannot be blended.
///
/// Source: Barbagli et al., IJRR 24(9), 2005 (recalled): stable when share · K ≤ the true stiffness. K must be one
/// that can be believed (answer.h).
///
/// Thread-safe: no. Realtime-safe: yes.
class AdaptiveLocalModel {
 public:
  struct Config {
    /// Share of the stiffness sent that is used, (0, 1]; below 1 when the engine's stiffness is itself an estimate.
    double share = 1;
    /// The longest blend; the model of a slower engine is in full use after this time.
    Duration max_blend = std::chrono::milliseconds(100);
  };

  /// Throws std::invalid_argument naming the field when it is out of range.
  explicit AdaptiveLocalModel(const Config& config);

  /// Takes an answer to a newer motion than before. Returns false, and changes nothing, when it is older
  /// or equal, or not finite. The first one is not blended: there is nothing to blend it with.
  bool observe(const RemoteForce& force) noexcept;

  /// The environment's force at `hand.position` at `hand.at`; empty before the first answer, or for a
  /// position that is not finite.
  std::optional<Prediction> predict(const Motion& hand) const noexcept;

 private:
  /// F(x) = at_origin − model.stiffness · x′: a blend of two is one of the same kind where they are valid.
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
