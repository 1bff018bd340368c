// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "core/base/mode.h"
#include "core/base/motion.h"
#include "core/base/reason.h"
#include "core/field/renderer.h"
#include "core/remote/adaptive_local_model.h"
#include "core/remote/field_use.h"
#include "core/remote/learned_model.h"
#include "core/remote/output_estimator.h"
#include "core/remote/remote_force.h"

namespace tendon {

/// All demands other than the force.
struct HandleWanted {
  Vec3 torque = Vec3::Zero();  ///< N·m, on the hand
  double grip = 0;             ///< N; opens the fingers if positive
};

/// Holds the newest remote force between arrivals, and fades it out if no more arrive. With age = now − received and v
/// = valid_for (clipped to max_valid_for):
///     age ≤ v                        Active     F(x)                    as it was sent
///     age ≤ v + hold                 Holding    F(x)
///     age < v + safe_stop            Decaying   F(x) · e^(−(age − v − hold)/decay)
///     otherwise                      SafeStop   0, until a fresh force arrives
/// F(x) follows the hand between two arrivals:
///     without a part         the local model of the remote environment, with its contact and table, or the constant
///                            force if there is no model                        (reconstruct, core/remote/answer.h)
///     adaptive_local_model   blends from one stiffness to the next              (AdaptiveLocalModel)
///     output_estimator       learns a model of the environment                  (OutputEstimator)
///     learned_model          learns how the force depends on the position, for answers without a model (LearnedModel)
///     field                  as without a part, until an engine uses a field    (field::Renderer)
/// A torque follows its own model of rotation, and a grip force is constant. Both are held, faded out and ramped in at
/// the same time as the force. Only the trusted part of an answer is used, and an answer that is not sound is refused
/// (answer.h). The result must be bounded by a limiter.
///
/// The first force, the first force after a safe stop, and the first force from another source are ramped in linearly
/// over `ramp_in`, starting from the current force. A fresh force that arrives during the decay is ramped in over (1 −
/// gain) · ramp_in. The force does not jump if an engine returns, stutters or takes over.
///
/// While the channel uses a field, its other forces are ignored. The mode is Active even if no messages are received. The
/// force of a new field starts at zero, and the previous force fades out over ramp_in. If the engine stops using the
/// field or disconnects, the last force is held and faded out like a force that has expired. The next force is then
/// ramped in.
/// Thread-safe: no. Realtime-safe: yes.
class HeldForce {
 public:
  struct Config {
    Duration hold = std::chrono::milliseconds(20);  ///< covers two lost datagrams of a 100 Hz engine
    /// Time constant. The force is reduced by 90 % in 115 ms. This does not feel like a kick, and a hand cannot lean on
    /// it.
    Duration decay = std::chrono::milliseconds(50);
    /// Time from the end of validity to the safe stop. The force is then below 1 %.
    Duration safe_stop = std::chrono::milliseconds(250);
    Duration ramp_in = std::chrono::milliseconds(100);
    Duration max_valid_for = std::chrono::milliseconds(500);  ///< upper limit of valid_for
    double max_stiffness = 5000;                              ///< N/m, > 0; limits the stiffness between two forces
    double max_angular_stiffness = 5;                         ///< N·m/rad, > 0; used for rotation
    std::optional<AdaptiveLocalModel::Config> adaptive_local_model{};  ///< at most one of these four
    std::optional<OutputEstimator::Config> output_estimator{};
    std::optional<LearnedModel::Config> learned_model{};
    std::optional<field::Renderer::Config> field{};
  };

  struct Wanted {
    Vec3 force = Vec3::Zero();      ///< N, on the hand
    Mat3 stiffness = Mat3::Zero();  ///< −∂F/∂x, N/m, or zero if there is no local model
    Mode mode = Mode::kIdle;
    Reasons reasons;
    Duration age{};                        ///< time since the force was received, or 0 if there is no force
    Duration loop_age{};                   ///< time since the answered motion was sampled, or 0 if there is no force
    std::optional<HandleWanted> handle{};  ///< empty if there is no torque or grip force
  };

  /// Throws std::invalid_argument with the name of the field if a duration is negative, decay or max_stiffness is not
  /// positive, safe_stop is shorter than hold, a part is not valid, or there are several parts.
  explicit HeldForce(const Config& config);

  /// Returns false and does nothing if the force is not sound. A true force (RemoteForce::field) is only accepted
  /// if the current field has the same generation and source, and if it is newer than the last one.
  bool observe(const RemoteForce& force) noexcept;

  /// Returns false and does nothing if the part `field` is not listed, or if the generation of a field is 0.
  bool use(const FieldUse& use, LocalTime now) noexcept;

  /// Updates the pose of the object. This is also possible before the field is used. Returns false if the part `field`
  /// is not listed, or if the pose is not valid (FieldPose::observe).
  bool observe(const field::TimedPose& pose) noexcept { return renderer_ && renderer_->observe(pose); }

  /// Must be called when the remote environment `source` has disconnected. Its force expires at `now`.
  void release(std::uint32_t source, LocalTime now) noexcept;

  /// The next fresh force is ramped in. The force of a field starts at zero.
  void disengage() noexcept;

  /// Returns the demand for `hand.position`, `hand.at` and `orientation`. It does not include the field. Must be called
  /// once per haptic step, because an estimator learns from it. If there is no orientation, the model of rotation is
  /// not used.
  Wanted wanted(const Motion& hand, const Quat* orientation = nullptr) noexcept;

  std::uint32_t field() const noexcept { return generation_; }  ///< generation of the current field, or 0

  /// Returns H₀ of the field in J if the hand is at `x`, or 0 if there is no field.
  double stored(const Vec3& x) const noexcept { return generation_ != 0 ? renderer_->stored(x) : 0; }

  /// Must be called after `wanted` in each step with a field in use. See Renderer::render.
  field::Renderer::Rendered render(const Motion& hand, double account, std::uint64_t tick) noexcept;

  /// Returns the part of the held force that is used, or nothing if there is no force.
  const std::optional<RemoteForce>& newest() const noexcept { return newest_; }

 private:
  Prediction follow(const Motion& hand) noexcept;
  Duration validity() const noexcept;
  std::optional<HandleWanted> handle_wanted(const Quat* orientation, double gain, double rest) const noexcept;
  Wanted beside_field(const Motion& hand) noexcept;
  void leave_field(LocalTime now) noexcept;

  Config config_;
  std::optional<RemoteForce> newest_;
  Mode mode_ = Mode::kIdle;
  LocalTime engaged_{};       ///< start of the ramp
  Duration ramp_{};           ///< its length
  Vec3 from_ = Vec3::Zero();  ///< N, the force at the start of the ramp
  double presence_ = 0;       ///< 0 to 1, share of the environment in `rendered_`
  Vec3 rendered_ = Vec3::Zero();
  std::optional<HandleWanted> handle_from_;
  std::optional<HandleWanted> handle_rendered_;
  std::optional<AdaptiveLocalModel> local_model_;
  std::unique_ptr<OutputEstimator> estimator_;  ///< 100 kB, only when listed
  std::unique_ptr<LearnedModel> learned_;       ///< 32 kB, only when listed
  std::unique_ptr<field::Renderer> renderer_;   ///< 100 kB, only when listed
  std::uint32_t generation_ = 0;  ///< generation of the current field, or 0. With a field, `newest_` is empty
  std::uint32_t source_ = 0;      ///< source of the current field
  bool left_field_ = false;       ///< `newest_` is the last force of a field
};

}  // namespace tendon
