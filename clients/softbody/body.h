// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "clients/softbody/background.h"
#include "clients/softbody/config.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/surface_table.h"
#include "clients/softbody/near/fallback_model.h"
#include "clients/softbody/near/near_model.h"
#include "clients/softbody/surface/triangles.h"

namespace tendon::softbody {

/// Computes the table of a kCondensed body. `solver` uses this machine (with_factor) or MPI (mpi/spread_solver.h).
/// Throws the errors of Body and of the solver.
SurfaceTable condense(const BodyConfig& config, const SolverOf& solver = with_factor);

/// Computes NearConfig::learned, or reads it from its folder. This can take minutes; `tell` receives the progress.
/// Throws the errors of Body, and std::runtime_error if a result cannot be stored.
Learned learn(const BodyConfig& config, const Tell& tell);

/// A body with its mesh, model and contact. Thread-safe: no. Realtime-safe: no.
class Body {
 public:
  explicit Body(const BodyConfig& config);  ///< throws std::invalid_argument if the values describe no valid body
  /// Uses `solver`. The body must be kLinear, with no effects other than contact and friction.
  Body(const BodyConfig& config, const SolverOf& solver);
  ~Body();
  Body(Body&&) noexcept;
  Body& operator=(Body&&) noexcept;

  /// Returns the force on a tool with its center at `tool` (m, body frame) if the handle is not rotated. If the body
  /// has time, this is one step. If the force triggers a cut, the next answer is that of the cut body.
  Feel touch(const Vec3& tool);

  /// The handle is in the body frame. If turns_the_hand() is true, the answer contains the torque about the handle.
  Feel touch(const Pose& handle);

  std::vector<Feel> touch(std::span<const std::optional<Pose>> handles);  ///< an empty pose: the hand is absent

  /// `background` prepares cuts and near fields, so that no answer waits for them; without this call, answers wait for
  /// cuts and build fields in pieces. Until a cut is ready, the uncut body answers, and the error is at least the
  /// force, because the cut body may push much less. The next touch() rethrows an exception of this work.
  void prepare_by(Background background);

  void tick(double time);           ///< sets the time (s): updates Young's modulus, and makes the cuts that are due
  bool has_clock() const noexcept;  ///< true if tick() has an effect

  /// Presses the model with a patch at `middle`. If the body has time, this is one step. settle() repeats this until
  /// the body is at rest or until the model has converged.
  Reaction press(Prescribed given, double value);
  Reaction settle(Prescribed given, double value);

  /// Depth (m) at which the material rotates somewhere by kLargestTurn. Deeper, a model without geometric nonlinearity
  /// is wrong: it treats rotation as strain. Infinite for other models. Computes a factor unless a table file has it.
  double linear_up_to() const;
  static constexpr double kLargestTurn = 0.1;  ///< rad; the force on B1 is then too large by 5 to 7 %

  double step() const noexcept;  ///< s; 0: the body is always at rest

  Vec3 touch_point() const;      ///< the surface point at `middle`, body frame
  const Vec3& normal() const;    ///< unit vector towards the tool, body frame
  Triangles rest_shape() const;  ///< in m, in the body frame; see outside()

  struct Size {
    std::size_t nodes;
    std::size_t elements;
    std::size_t free;
    std::size_t touchable;
    std::size_t bytes;
  };
  Size size() const;
  std::optional<NearModel::Size> near_field() const;   ///< empty if the model is not kNear
  std::vector<FallbackModel::Step> fallbacks() const;  ///< likewise
  /// `under_patch` is the number of nodes below the patch at `middle`. Throws the errors of the constructor.
  static Size size_of(const BodyConfig& config, int& under_patch);

 private:
  struct Parts;
  void take_prepared();
  std::unique_ptr<Parts> parts_;
};

}  // namespace tendon::softbody
