// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <optional>

#include "core/base/mode.h"
#include "core/base/motion.h"
#include "core/base/reason.h"
#include "core/remote/adaptive_local_model.h"
#include "core/remote/learned_model.h"
#include "core/remote/output_estimator.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// What is wanted of a handle beside its force.
struct HandleWanted {
  Vec3 torque = Vec3::Zero();  ///< N·m, on the hand
  double grip = 0;             ///< N, on the fingers, > 0 opens them
};

/// Holds the newest remote force between arrivals, and decides what to render when they stop coming.
///
/// With age = now − received and v = valid_for (clipped to max_valid_for):
///
///     age ≤ v                        Active     F(x)                    as it was sent
///     age ≤ v + hold                 Holding    F(x)
///     age < v + safe_stop            Decaying   F(x) · e^(−(age − v − hold)/decay)
///     otherwise                      SafeStop   0, until a fresh force comes
///
/// F(x) follows the hand between two arrivals:
///
///     without a part         as the remote environment's local model says, with its contact and its table, or the
///                            force alone when it sent none                      (reconstruct, estimation/answer.h)
///     adaptive_local_model   its stiffness, but a new one is blended in          (AdaptiveLocalModel)
///     output_estimator       a model of the environment, learned on the way      (OutputEstimator)
///     learned_model          … of how its force changes with the place; an answer that brings its own model is
///                            reconstructed from that instead                     (LearnedModel)
///
/// A torque is led on by its own model of rotation (answer.h), a grip force stays as it was sent. Both are held, faded
/// and ramped in together with the force that they came with. The three parts above know forces only.
///
/// Only the trustworthy part of an answer is used (answer.h): stiffness is capped at `max_stiffness`, and the model is
/// dropped when the answer says that the topology of the body has changed.
///
/// The first force ever, the first one after a safe stop, and the first one from another source are ramped in linearly
/// over `ramp_in`, from the force rendered at that moment. A fresh force that arrives while the one before decays is
/// ramped in over the share of `ramp_in` that the decay has taken: (1 − gain) · ramp_in. So an engine that comes back,
/// stutters or takes over never kicks the hand. An answer that is not sound (answer.h) is refused, and the one before
/// it ages on.
///
/// HeldForce decides which force is *wanted*. The limiter after it keeps that force from doing harm.
///
/// Thread-safe: no. Realtime-safe: yes.
class HeldForce {
 public:
  struct Config {
    /// Bridges two lost datagrams of a 100 Hz engine.
    Duration hold = std::chrono::milliseconds(20);
    /// Time constant: 90 % gone after 115 ms, too slow to be felt as a kick, too fast to be leant on.
    Duration decay = std::chrono::milliseconds(50);
    /// Counted from the end of validity; the force has faded to 1 % by then.
    Duration safe_stop = std::chrono::milliseconds(250);
    Duration ramp_in = std::chrono::milliseconds(100);
    /// No engine can ask to be believed for longer.
    Duration max_valid_for = std::chrono::milliseconds(500);
    /// N/m, > 0: the stiffest model that is followed between two forces. Grounded devices render less stably at 1 kHz.
    double max_stiffness = 5000;
    /// N·m/rad, > 0: the same for rotation.
    double max_angular_stiffness = 5;
    /// At most one of these three. Empty: not used, costs nothing.
    std::optional<AdaptiveLocalModel::Config> adaptive_local_model{};
    std::optional<OutputEstimator::Config> output_estimator{};
    std::optional<LearnedModel::Config> learned_model{};
  };

  struct Wanted {
    Vec3 force = Vec3::Zero();      ///< N, on the hand
    Mat3 stiffness = Mat3::Zero();  ///< −∂F/∂x, N/m; zero without a local model
    Mode mode = Mode::kIdle;
    Reasons reasons;
    Duration age{};                        ///< since it was received; 0 when idle
    Duration loop_age{};                   ///< since the motion that it answers was sampled; 0 when idle
    std::optional<HandleWanted> handle{};  ///< empty: nothing is asked of torque and grip
  };

  /// Throws std::invalid_argument naming the field when a duration is negative, decay is not positive, safe_stop is
  /// shorter than hold, max_stiffness is not above zero, a part refuses its configuration, or several parts are listed.
  explicit HeldForce(const Config& config);

  /// Takes a newer force. Returns false, and changes nothing, when it is not sound.
  bool observe(const RemoteForce& force) noexcept;

  /// The remote environment `source` has left: if its force is the one held, that force is no longer fresh from `now`
  /// on.
  void release(std::uint32_t source, LocalTime now) noexcept;

  /// Forgets the force: idle, until a fresh one comes and is ramped in.
  void disengage() noexcept {
    newest_.reset();
    mode_ = Mode::kIdle;
    rendered_.setZero();
    handle_rendered_.reset();
  }

  /// The force wanted at `hand.position` at `hand.at`, and the torque wanted at `orientation`. Call it once in each
  /// haptic step: an estimator learns from it. Without an orientation no model of rotation is followed.
  Wanted wanted(const Motion& hand, const Quat* orientation = nullptr) noexcept;

  /// The force that is held, as it is believed; empty when idle.
  const std::optional<RemoteForce>& newest() const noexcept { return newest_; }

 private:
  Prediction follow(const Motion& hand) noexcept;
  Duration validity() const noexcept;
  std::optional<HandleWanted> handle_wanted(const Quat* orientation, double gain, double rest) const noexcept;

  Config config_;
  std::optional<RemoteForce> newest_;
  Mode mode_ = Mode::kIdle;
  LocalTime engaged_{};       ///< start of the ramp
  Duration ramp_{};           ///< its length
  Vec3 from_ = Vec3::Zero();  ///< N, the force it starts from
  double presence_ = 0;       ///< the share of the environment's force in `rendered_`, 0 to 1
  Vec3 rendered_ = Vec3::Zero();
  std::optional<HandleWanted> handle_from_;
  std::optional<HandleWanted> handle_rendered_;
  std::optional<AdaptiveLocalModel> local_model_;
  std::unique_ptr<OutputEstimator> estimator_;  ///< 100 kB, only when listed
  std::unique_ptr<LearnedModel> learned_;       ///< 32 kB, only when listed
};

}  // namespace tendon
