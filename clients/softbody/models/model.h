// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "clients/softbody/fem/patch.h"

namespace tendon::softbody {

struct Division;
struct EffectsConfig;

enum class Prescribed : std::uint8_t {
  kDepth,       ///< mean depth of the patch, m; the force may pull
  kLeastDepth,  ///< minimum of the mean depth, m; the tool cannot pull
  kForce,       ///< force on the body, N
};

/// How a kNear body has answered. The server receives these values and kSolverPathNames.
enum class SolverPath : std::uint8_t {
  kOnly = 0,
  kTabulated,
  kLearned,
  kNear,
  kWhole,   ///< near field that covers the whole body
  kLinear,  ///< linear body, if there is no near field
};

inline constexpr std::array<std::string_view, 5> kSolverPathNames = {"tabulated", "learned", "near", "whole", "linear"};
constexpr std::string_view name_of(SolverPath path) {
  return path == SolverPath::kOnly ? "" : kSolverPathNames.at(static_cast<std::size_t>(path) - 1);
}

struct Reaction {
  double force = 0;  ///< N, along the normal
  double depth = 0;  ///< m, mean over the patch
  /// N/m, ∂force/∂depth. For a body with time it is the force divided by the displacement from the shape at rest,
  /// without the stiffness that inertia adds within one step.
  double stiffness = 0;
  Vec2 slope = Vec2::Zero();  ///< ∂depth/∂(patch position) for the present shape
  /// Derivatives with respect to the patch position c: W is ∂w/∂c for its weights w, and A the stiffness of the body.
  struct Glide {
    Vec2 tilting = Vec2::Zero();  ///< 1/m, ∂slope/∂depth
    Mat2 curving = Mat2::Zero();  ///< 1/m, ∂slope/∂c for the present shape
    Mat2 giving = Mat2::Zero();   ///< 1/(N m), Wᵀ A⁻¹ W at constant depth
  };
  Glide glide;
  bool knows_glide = false;            ///< see Model::glides()
  double error = 0;                    ///< N, estimated error of the solution; the error of the mesh is not included
  SolverPath way = SolverPath::kOnly;  ///< the one with the larger share if two are blended
};

/// Returns the force (N) of the tool. `untouched` is the depth without it (m), `compliance` the depth per force (m/N).
double constrained_force(Prescribed given, double value, double untouched, double compliance);

double secant(const Reaction& reaction, double rest);  ///< `rest` is the depth (m) at rest

/// Thread-safe: no. Realtime-safe: no.
class Model {
 public:
  Model() = default;
  virtual ~Model() = default;
  Model(const Model&) = delete;
  Model& operator=(const Model&) = delete;

  /// Returns the answer to one patch. If the model has a state, it continues from the last call. If the model has time,
  /// this is one step. If the patch has no nodes, there is no contact.
  virtual Reaction press(const Patch& patch, Prescribed given, double value) = 0;

  /// Must be called after the solid has been cut in place. Throws std::logic_error if the model cannot be cut.
  virtual void cut(const Division& division, const EffectsConfig& effects);

  /// Continues from the shape of `before`, this model before a cut. Node i was node_before[i]. Throws as cut() does.
  virtual void go_on_from(const Model& before, std::span<const int> node_before);

  virtual double step() const noexcept { return 0; }  ///< s, time that one press simulates; 0: always at rest

  virtual bool still() const noexcept { return true; }  ///< an untouched body always has the shape of its mesh

  virtual bool glides() const noexcept { return false; }  ///< computes Reaction::glide for patches with curvatures

  virtual std::size_t bytes() const noexcept = 0;
};

/// Presses until the relative difference of two answers is below `tolerance`, or for at most `most` seconds. For a body
/// with time, the two answers are 0.01 s apart. The error of the answer includes the remaining change.
Reaction settle(Model& model, const Patch& patch, Prescribed given, double value, double tolerance = 1e-4,
                double most = 5);

}  // namespace tendon::softbody
