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

/// The effects that a scene can list under `effects`. An effect that is not listed is not simulated.
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
  EffectSet not_with;     ///< effects with which it cannot be simulated
};
std::span<const EffectInfo> effects() noexcept;  ///< in the order of their kinds
const EffectInfo& info(EffectKind kind) noexcept;

/// The models that a scene can choose; folder models/ has a file for each family, near/ the last.
enum class ModelKind : std::uint8_t { kLinear, kCondensed, kCorotational, kNeoHookean, kNear };

struct ModelInfo {
  ModelKind kind;
  Law law;                ///< of kNear the usual one: see NearConfig::law
  std::string_view name;  ///< in scenes, tables and command lines
  std::string_view what;  ///< one line
  EffectSet always;       ///< always simulated
  EffectSet may;          ///< simulated when they are listed
};

/// Every model, in the order in which tables list them.
std::span<const ModelInfo> models() noexcept;
const ModelInfo& info(ModelKind kind) noexcept;
std::optional<ModelKind> model_named(std::string_view name) noexcept;

/// A possible law of the elements near the tool of a kNear body.
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
  int across;     ///< cells from side to side of its core
  int up;         ///< cells along its axis
};
struct FileShape {
  std::filesystem::path file;
  double scale;        ///< from the file's units to m
  bool slits = false;  ///< do not merge nodes at the same place; see joined()
};
/// The settings that only the model kNear uses.
struct NearConfig {
  Law law = Law::kCorotational;  ///< The law of the elements near the tool. It cannot be kLinear.
  /// Keeps all unknowns of the boundary instead of modes. This is slow and serves comparisons.
  bool exact_interface = false;
  /// The body learns shapes, or tabulates answers, for presses within BodyConfig::reach of `middle` along each axis. It
  /// uses them where their error is at most BodyConfig::tolerance. `reach` is then required, and is at most kFarthest
  /// patch radii.
  bool learn = false;
  bool tabulate = false;
  std::filesystem::path learned_in{};  ///< The folder that keeps the results. If it is empty, they are not kept.
  std::optional<Learned> learned{};    ///< The result of learn() for the uncut body. If it is empty, Body learns.

  bool learns() const noexcept { return learn || tabulate; }

  static constexpr double kFarthest = 1.5;
  static constexpr double kErrorOfLearned = 0.02;  ///< The default tolerance of a body that learns.
};

/// The description of a soft body that a tool touches, as plain values. Blocks and cylinders stand on z = 0.
struct BodyConfig {
  std::variant<BlockShape, CylinderShape, FileShape> shape;
  Element element = Element::kHex8Sri;
  Material material;
  std::vector<Region> regions{};  ///< parts of another material; where two overlap, the later one counts
  ModelKind model = ModelKind::kCondensed;
  NearConfig near{};
  /// For kCondensed: the table that condense() has made. If it is empty, Body makes one.
  std::optional<std::filesystem::path> table_file{};
  int max_iterations = QuasiStaticModel::Config{}.max_iterations;  ///< for models that iterate until they converge
  /// Of the force, for the same models: an answer ends when it may be wrong by so much, and says so (Feel::error).
  double tolerance = QuasiStaticModel::Config{}.tolerance;
  EffectsConfig effects;           ///< effects that act on the whole body
  std::optional<double> friction;  ///< coefficient
  std::vector<PlannedCut> cuts;    ///< in the order in which they are made
  std::optional<StiffnessOverTime> stiffening;
  std::optional<Yield> plasticity;
  std::optional<double> self_collision;  ///< m: the overlap at which two sides press on each other with Young's modulus
  double clamped_below = 0;  ///< m; nodes up to this height above the lowest ones are held. The lowest always are

  Vec3 towards_tool = Vec3::UnitZ();  ///< unit vector, body frame
  double patch_radius = 0;            ///< m
  std::optional<double> reach;        ///< m, kCondensed: largest distance of a touch from `middle`; empty: no limit
  Vec3 middle = Vec3::Zero();         ///< m; only its position across `towards_tool` counts
  Tool tool;
  double layer = 1e-4;              ///< m, rigid tools on nonlinear bodies: Layer::Config::thickness
  std::size_t hands = 1;            ///< rigid tools on nonlinear bodies: how many hands hold one each
  Vec3 tool_offset = Vec3::Zero();  ///< m, handle frame, from the handle's position to the tool's middle
  PatchContact::Side side = PatchContact::Side::kUnilateral;
  /// The stiffness of linear models, and with plasticity, is the whole second derivative of the energy on a flat
  /// surface too. On a curved one, and of other models at rest, it always is.
  bool whole_stiffness = false;
};

/// Whether the tool is rigid and presses a nonlinear body: RigidContact.
bool is_rigid_on_nonlinear(const BodyConfig& config);

/// Whether contact gives a torque: the tool is neither a patch nor a sphere, or its middle is not where the handle is.
bool turns_the_hand(const BodyConfig& config);

/// From the handle to the tool's point that is farthest in the body, m, body frame, with the handle turned by `turn`.
Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn);

/// The effects that `config` simulates, including those of its model.
EffectSet effects_of(const BodyConfig& config);

/// Whether nothing takes energy on a closed way of the tool: a body at rest at every instant, solved until it is, with
/// no effect that loses or changes anything.
bool is_elastic(const BodyConfig& config);

/// The table of a kCondensed body, to be kept in a file. `solver` says how the body is solved: on this machine
/// (with_factor), or on many (mpi/spread_solver.h). Throws what Body throws, and what the solver throws.
SurfaceTable condense(const BodyConfig& config, const SolverOf& solver = with_factor);

/// What a kNear body that learns is to know, for NearConfig::learned; for others nothing. It can take
/// minutes, says so to `tell`, and is read where it was kept. Throws what Body throws, and std::runtime_error when
/// something cannot be kept.
Learned learn(const BodyConfig& config, const Tell& tell);

/// Mesh, model and contact of one body, built from a BodyConfig. Thread-safe: no. Realtime-safe: no.
class Body {
 public:
  /// Throws std::invalid_argument with a sentence when the values describe no possible body, or when the cuts leave
  /// nothing to touch.
  explicit Body(const BodyConfig& config);
  /// The same, solved by `solver`: a kLinear body without effects but contact and friction; others are refused.
  Body(const BodyConfig& config, const SolverOf& solver);
  ~Body();
  Body(Body&&) noexcept;
  Body& operator=(Body&&) noexcept;

  /// The force on a tool with its middle at `tool` (m, body frame), for a capsule with the handle not turned. A body
  /// with time advances by one step. A cut that waits for this answer's force is made after the answer: the next answer
  /// is that of the cut body, and says so.
  Feel touch(const Vec3& tool);

  /// The same with the handle at `handle` (body frame): the tool is at its offset from there, and where
  /// turns_the_hand() the answer has the torque about the handle's position.
  Feel touch(const Pose& handle);

  /// The same for a body that several hands hold at once: one solution, and what each of them feels. Empty: that hand
  /// is nowhere. As many as BodyConfig::hands.
  std::vector<Feel> touch(std::span<const std::optional<Pose>> handles);

  /// From now on no answer waits for a cut, nor for a near field. `background` is called when a cut is due: until its
  /// work has been done answers are those of the body before the cut, and their error is at least their force, because
  /// the cut body may push so much less. The first touch() after the work continues from the shape before the cut, with
  /// what has been prepared. `background` is also called when a kNear body wants its next near field
  /// (NearModel::make_fields_by). What the work throws, the next touch() throws. Without this call a cut is made between
  /// two answers, and a near field in pieces within them.
  void prepare_by(Background background);

  /// Sets the time since the scene began, s: Young's modulus becomes that of `time`, and cuts that are due are made. An
  /// earlier time undoes no cut.
  void tick(double time);
  bool has_clock() const noexcept;  ///< true when tick() changes anything

  /// Presses the model with a patch around the middle, for scripted tests of stiffness and force. A body with time
  /// advances by one step; `settle` repeats until the body is at rest, or until an iterative model has converged.
  Reaction press(Given given, double value);
  Reaction settle(Given given, double value);

  /// m, how deep the middle may be pressed before the material rotates anywhere by more than kLargestTurn. Beyond that,
  /// a model without geometric nonlinearity mistakes rotations for strains (of 1 − cos) and gives wrong forces; ∞ for
  /// the other models. Each call makes a factor, but for a table from a file, which tells it.
  double linear_up_to() const;
  static constexpr double kLargestTurn = 0.1;  ///< rad; B1's force is then 5 to 7 % above corotational's

  double step() const noexcept;  ///< s, the time that an answer simulates; 0: at rest at every instant

  /// The point of the surface at rest above `middle`, and the direction from there to the tool; body frame.
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
  /// The near field, of a kNear body; and what answers before it, where something was learned.
  std::optional<NearModel::Size> near_field() const;
  std::vector<Ladder::Step> ladder() const;
  /// The size of the body that `config` describes, without its model: `bytes` is 0. `under_patch`: the nodes of the
  /// patch around the middle. Throws as the constructor does.
  static Size size_of(const BodyConfig& config, int& under_patch);

 private:
  struct Parts;
  void take_prepared();
  std::unique_ptr<Parts> parts_;
};

}  // namespace tendon::softbody
