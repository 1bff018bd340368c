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
#include "clients/softbody/near/ladder.h"
#include "clients/softbody/near/learn.h"
#include "clients/softbody/near/near_model.h"
#include "clients/softbody/tool.h"
#include "clients/softbody/touch/contact.h"

namespace tendon::softbody {

/// Effects that a scene can list under `effects`. Others are not simulated.
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
  std::string_view what;  ///< one line
  EffectSet not_with;     ///< effects that exclude this one
};
std::span<const EffectInfo> effects() noexcept;  ///< indexed by kind
const EffectInfo& info(EffectKind kind) noexcept;

/// Models that a scene can choose. The sources are in models/, and near/ for kNear.
enum class ModelKind : std::uint8_t { kLinear, kCondensed, kCorotational, kNeoHookean, kNear };

struct ModelInfo {
  ModelKind kind;
  Law law;                ///< default for kNear: NearConfig::law
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  EffectSet always;       ///< always simulated
  EffectSet may;          ///< simulated if listed
};

/// All models, in the order used by tables.
std::span<const ModelInfo> models() noexcept;
const ModelInfo& info(ModelKind kind) noexcept;
std::optional<ModelKind> model_named(std::string_view name) noexcept;

/// A material law for the near elements of a kNear body.
struct NearLaw {
  Law law;
  std::string_view name;  ///< in scenes
};
std::span<const NearLaw> near_laws() noexcept;

struct BlockShape {
  Vec3 size;  ///< m
  std::array<int, 3> cells;
};
struct CylinderShape {
  double radius;  ///< m
  double height;  ///< m
  int across;     ///< cells across its core
  int up;         ///< cells along its axis
};
struct FileShape {
  std::filesystem::path file;
  double scale;        ///< from the file's units to m
  bool slits = false;  ///< keep coincident nodes unmerged; see joined()
};
/// Settings of the model kNear.
struct NearConfig {
  Law law = Law::kCorotational;  ///< of the elements near the tool; not kLinear
  /// Keeps all unknowns of the near-far interface instead of modes. Slow; for comparisons.
  bool exact_interface = false;
  /// Precompute shapes (`learn`) or an energy table (`tabulate`) for presses within BodyConfig::reach of `middle` along
  /// each axis. They answer where their error is at most BodyConfig::tolerance. Both require `reach`, at most kFarthest
  /// patch radii.
  bool learn = false;
  bool tabulate = false;
  std::filesystem::path learned_in{};  ///< folder for precomputed results; empty: not stored
  std::optional<Learned> learned{};    ///< result of learn() for the uncut body; empty: Body computes it

  bool learns() const noexcept { return learn || tabulate; }

  static constexpr double kFarthest = 1.5;
  static constexpr double kErrorOfLearned = 0.02;  ///< default tolerance of a body that learns
};

/// A soft body and the tool that touches it, as plain values. Blocks and cylinders stand on z = 0.
struct BodyConfig {
  std::variant<BlockShape, CylinderShape, FileShape> shape;
  Element element = Element::kHex8Sri;
  Material material;
  std::vector<Region> regions{};  ///< parts of another material; the last one wins where they overlap
  ModelKind model = ModelKind::kCondensed;
  NearConfig near{};
  /// kCondensed: a table written by condense(). Empty: Body computes it.
  std::optional<std::filesystem::path> table_file{};
  int max_iterations = QuasiStaticModel::Config{}.max_iterations;  ///< iterative models: per answer
  /// Iterative models: an answer ends when its estimated relative force error, reported in Feel::error, is at most
  /// this.
  double tolerance = QuasiStaticModel::Config{}.tolerance;
  EffectsConfig effects;           ///< effects on the whole body
  std::optional<double> friction;  ///< coefficient
  std::vector<PlannedCut> cuts;    ///< in order of execution
  std::optional<StiffnessOverTime> stiffening;
  std::optional<Yield> plasticity;
  std::optional<double> self_collision;  ///< m, overlap at which two sides press with Young's modulus
  double clamped_below = 0;  ///< m above the lowest nodes; nodes up to this height are fixed, and the lowest always are

  Vec3 towards_tool = Vec3::UnitZ();  ///< unit vector, body frame
  double patch_radius = 0;            ///< m
  /// m, kCondensed: largest tangential distance of a touch from `middle`; empty: no limit
  std::optional<double> reach;
  Vec3 middle = Vec3::Zero();  ///< m; only the tangential position counts
  Tool tool;
  double layer = 1e-4;              ///< m, rigid tools on nonlinear bodies: Layer::Config::thickness
  std::size_t hands = 1;            ///< rigid tools on nonlinear bodies: number of hands, with one tool each
  Vec3 tool_offset = Vec3::Zero();  ///< m, handle frame, from the handle's position to the tool's center
  PatchContact::Side side = PatchContact::Side::kUnilateral;
  /// Computes the full second derivative of the energy as stiffness also for linear models and plasticity on a flat
  /// surface. On a curved surface, and for other models at rest, it is always computed.
  bool whole_stiffness = false;
};

/// Whether the tool is rigid and the body nonlinear, so that RigidContact is used.
bool is_rigid_on_nonlinear(const BodyConfig& config);

/// Whether contact produces a torque: the tool is not a patch or sphere, or is offset from the handle.
bool turns_the_hand(const BodyConfig& config);

/// Vector from the handle to the tool's deepest point, m, body frame, with handle orientation `turn`.
Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn);

/// The simulated effects, including those implied by the model.
EffectSet effects_of(const BodyConfig& config);

/// Whether a closed path of the tool loses no energy: the body is always at rest, the solution is converged, and no
/// effect dissipates or changes the body.
bool is_elastic(const BodyConfig& config);

/// Computes the table of a kCondensed body, to be stored in a file. `solver` solves the body on this machine
/// (with_factor) or on many (mpi/spread_solver.h). Throws the errors of Body and of the solver.
SurfaceTable condense(const BodyConfig& config, const SolverOf& solver = with_factor);

/// Precomputes a kNear body for NearConfig::learned; empty for other bodies. Reads the stored result if there is one;
/// otherwise it can take minutes and reports progress to `tell`. Throws the errors of Body, and std::runtime_error if a
/// result cannot be stored.
Learned learn(const BodyConfig& config, const Tell& tell);

/// Mesh, model and contact of one body, built from a BodyConfig. Thread-safe: no. Realtime-safe: no.
class Body {
 public:
  /// Throws std::invalid_argument if the values describe no valid body, or if the cuts leave nothing to touch.
  explicit Body(const BodyConfig& config);
  /// Solved by `solver`: only for a kLinear body with no effects other than contact and friction. Throws
  /// std::invalid_argument for others.
  Body(const BodyConfig& config, const SolverOf& solver);
  ~Body();
  Body(Body&&) noexcept;
  Body& operator=(Body&&) noexcept;

  /// The force on a tool centered at `tool` (m, body frame), with the handle not rotated. Advances a body with time by
  /// one step. A cut triggered by this answer's force is made afterwards; the next answer belongs to the cut body and
  /// sets Feel::topology_changed.
  Feel touch(const Vec3& tool);

  /// With the handle at `handle` (body frame) and the tool at its offset. If turns_the_hand(), the answer includes the
  /// torque about the handle's position.
  Feel touch(const Pose& handle);

  /// For a body held by several hands: one joint solution, and each hand's answer. `handles` has BodyConfig::hands
  /// entries; an empty one means an absent hand.
  std::vector<Feel> touch(std::span<const std::optional<Pose>> handles);

  /// Moves the preparation of cuts and near fields to `background`, so that no answer waits for it. While a cut is
  /// being prepared, answers are those of the uncut body with an error of at least their force, because the cut body
  /// may push much less. The first touch() after completion continues from the current shape on the prepared body. A
  /// kNear body also requests its near fields this way (NearModel::make_fields_by). An exception in the work is
  /// rethrown by the next touch(). Without this call, cuts are made between answers and near fields in pieces within
  /// answers.
  void prepare_by(Background background);

  /// Sets the time since the start of the scene, s: updates Young's modulus and makes the cuts that are due. An earlier
  /// time undoes no cut.
  void tick(double time);
  bool has_clock() const noexcept;  ///< true if tick() has an effect

  /// Presses the model with a patch at `middle`, for tests of stiffness and force. Advances a body with time by one
  /// step; settle() repeats until the body is at rest or an iterative model has converged.
  Reaction press(Given given, double value);
  Reaction settle(Given given, double value);

  /// Depth in m to which `middle` may be pressed before the material rotates anywhere by more than kLargestTurn. Beyond
  /// it a model without geometric nonlinearity takes rotation for strain (1 − cos) and its forces are wrong. ∞ for
  /// other models. Each call factorizes, unless a table file provides the value.
  double linear_up_to() const;
  /// rad; on the benchmark block B1 the force is then 5 to 7 % above the corotational one
  static constexpr double kLargestTurn = 0.1;

  double step() const noexcept;  ///< s simulated per answer; 0: always at rest

  /// The surface point at rest at `middle`, and the unit normal towards the tool; body frame.
  Vec3 touch_point() const;
  const Vec3& normal() const;

  struct Size {
    std::size_t nodes;
    std::size_t elements;
    std::size_t free;       ///< unknown displacements
    std::size_t touchable;  ///< nodes
    std::size_t bytes;      ///< kept by the model, effects included
  };
  Size size() const;
  /// Of a kNear body: the near field, and the precomputed rungs, if any.
  std::optional<NearModel::Size> near_field() const;
  std::vector<Ladder::Step> ladder() const;
  /// Size of the body without building its model (`bytes` is 0). `under_patch` receives the number of nodes of the
  /// patch at `middle`. Throws the errors of the constructor.
  static Size size_of(const BodyConfig& config, int& under_patch);

 private:
  struct Parts;
  void take_prepared();
  std::unique_ptr<Parts> parts_;
};

}  // namespace tendon::softbody
