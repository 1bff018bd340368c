// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <future>
#include <initializer_list>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "clients/softbody/background.h"
#include "clients/softbody/effects/cutting.h"
#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/region.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/models/plasticity.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/models/stiffening.h"
#include "clients/softbody/models/surface_table.h"
#include "clients/softbody/near/fallback_model.h"
#include "clients/softbody/near/learn.h"
#include "clients/softbody/near/near_model.h"
#include "clients/softbody/tool.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

enum class EffectKind : std::uint8_t {
  kContact,
  kGeometricNonlinearity,
  kMaterialNonlinearity,
  kGravity,
  kInertia,
  kDamping,
  kViscosity,
  kFriction,
  kCutting,
  kStiffening,
  kPlasticity,
  kSelfCollision
};

class EffectSet {
 public:
  constexpr EffectSet() = default;
  constexpr EffectSet(std::initializer_list<EffectKind> kinds) {
    for (const EffectKind kind : kinds) add(kind);
  }
  constexpr void add(EffectKind kind) { bits_ |= bit(kind); }
  constexpr bool has(EffectKind kind) const { return (bits_ & bit(kind)) != 0; }
  constexpr bool within(EffectSet other) const { return (bits_ & ~other.bits_) == 0; }

 private:
  static constexpr unsigned bit(EffectKind kind) { return 1U << static_cast<unsigned>(kind); }
  unsigned bits_ = 0;
};

struct EffectInfo {
  EffectKind kind;
  std::string_view name;
  std::string_view what;
  EffectSet not_with;
};
std::span<const EffectInfo> effects() noexcept;  ///< indexed by kind
const EffectInfo& info(EffectKind kind) noexcept;

enum class ModelKind : std::uint8_t { kLinear, kCondensed, kCorotational, kNeoHookean, kNear };

struct ModelInfo {
  ModelKind kind;
  Law law;
  std::string_view name;
  std::string_view what;
  EffectSet always;
  EffectSet may;
};

std::span<const ModelInfo> models() noexcept;
const ModelInfo& info(ModelKind kind) noexcept;

struct NearLaw {
  Law law;
  std::string_view name;
};
std::span<const NearLaw> near_laws() noexcept;

struct BlockShape {
  Vec3 size;  ///< m
  std::array<int, 3> cells;
};
struct CylinderShape {
  double radius;  ///< m
  double height;  ///< m
  int across;
  int up;
};
struct FileShape {
  std::filesystem::path file;
  double scale;        ///< from the file's units to m
  bool slits = false;  ///< keep coincident nodes unmerged; see joined()
};
struct NearConfig {
  Law law = Law::kCorotational;
  bool exact_interface = false;  ///< all unknowns of the interface instead of modes; slow
  /// Precompute shapes (`learn`) or an energy table (`tabulate`) for presses within the required BodyConfig::reach (at
  /// most kFarthest patch radii) of `middle` along each axis. They answer with errors up to BodyConfig::tolerance.
  bool learn = false;
  bool tabulate = false;
  std::filesystem::path learned_in{};  ///< folder for precomputed results; empty: not stored
  std::optional<Learned> learned{};    ///< empty: computed by Body

  bool learns() const noexcept { return learn || tabulate; }

  static constexpr double kFarthest = 1.5;
  static constexpr double kErrorOfLearned = 0.02;
};

struct BodyConfig {
  std::variant<BlockShape, CylinderShape, FileShape> shape;
  Element element = Element::kHex8Sri;
  Material material;
  std::vector<Region> regions{};  ///< the last one wins where regions overlap
  ModelKind model = ModelKind::kCondensed;
  NearConfig near{};
  std::optional<std::filesystem::path> table_file{};  ///< table of a kCondensed body; empty: Body computes it
  int max_iterations = QuasiStaticModel::Config{}.max_iterations;
  /// The accepted relative error of the force in iterative models. Feel::error reports the actual error.
  double tolerance = QuasiStaticModel::Config{}.tolerance;
  EffectsConfig effects;
  std::optional<double> friction;  ///< coefficient
  std::vector<PlannedCut> cuts;
  std::optional<StiffnessOverTime> stiffening;
  std::optional<Yield> plasticity;
  std::optional<double> self_collision;  ///< m, overlap for a pressure of Young's modulus
  double clamped_below = 0;              ///< m, maximum height of fixed nodes

  Vec3 towards_tool = Vec3::UnitZ();  ///< unit vector, body frame
  double patch_radius = 0;            ///< m
  std::optional<double> reach;        ///< m, maximum tangential distance from `middle`, for kCondensed
  Vec3 middle = Vec3::Zero();         ///< m; only the tangential position counts
  Tool tool;
  double layer = 1e-4;              ///< m, rigid tools on nonlinear bodies: Layer::Config::thickness
  std::size_t hands = 1;            ///< number of hands, for rigid tools on nonlinear bodies
  Vec3 tool_offset = Vec3::Zero();  ///< m, handle frame, from the handle's position to the tool's center
  PatchContact::Side side = PatchContact::Side::kUnilateral;
  /// Computes the second derivative of the energy on a flat surface too, for linear models and with plasticity. All
  /// other models at rest, and curved surfaces, always use it.
  bool whole_stiffness = false;
};

bool is_rigid_on_nonlinear(const BodyConfig& config);  ///< the tool is rigid and the body nonlinear (RigidContact)

bool turns_the_hand(const BodyConfig& config);  ///< true if contact produces a torque on the hand

/// Returns the vector from the handle to the deepest point of the tool, m, in the body frame.
Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn);

EffectSet effects_of(const BodyConfig& config);  ///< simulated effects, including those of the model

bool is_elastic(const BodyConfig& config);  ///< true if a closed path of the tool loses no energy

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

  Vec3 touch_point() const;    ///< the surface point at `middle`, body frame
  const Vec3& normal() const;  ///< unit vector towards the tool, body frame

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
