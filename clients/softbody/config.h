// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <optional>
#include <span>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

#include "clients/softbody/effects/cutting.h"
#include "clients/softbody/effects/effects.h"
#include "clients/softbody/fem/material.h"
#include "clients/softbody/fem/region.h"
#include "clients/softbody/models/plasticity.h"
#include "clients/softbody/models/quasi_static.h"
#include "clients/softbody/models/stiffening.h"
#include "clients/softbody/near/learn.h"
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

struct Newton {
  int max_iterations = QuasiStaticModel::Config{}.max_iterations;
  double tolerance = QuasiStaticModel::Config{}.tolerance;  ///< accepted relative error of the force; see Feel::error
};
struct LinearConfig {
  std::optional<Yield> plasticity{};
  Newton newton{};  ///< with plasticity
};
struct CondensedConfig {
  std::optional<std::filesystem::path> table_file{};  ///< empty: Body computes the table
};
struct CorotationalConfig {
  Newton newton{};
  std::optional<double> self_collision{};  ///< m, overlap for a pressure of Young's modulus
  std::optional<Yield> plasticity{};
};
struct NeoHookeanConfig {
  Newton newton{};
  std::optional<double> self_collision{};  ///< as in CorotationalConfig
};
struct NearConfig {
  Newton newton{};
  Law law = Law::kCorotational;
  bool exact_interface = false;  ///< all unknowns of the interface instead of modes; slow
  /// Precompute shapes (`learn`) or an energy table (`tabulate`) for presses within the required BodyConfig::reach (at
  /// most kFarthest patch radii) of `middle` along each axis. They answer with errors up to Newton::tolerance.
  bool learn = false;
  bool tabulate = false;
  std::filesystem::path learned_in{};  ///< folder for precomputed results; empty: not stored
  std::optional<Learned> learned{};    ///< empty: computed by Body

  bool learns() const noexcept { return learn || tabulate; }

  static constexpr double kFarthest = 1.5;
  static constexpr double kErrorOfLearned = 0.02;
};
using ModelConfig = std::variant<LinearConfig, CondensedConfig, CorotationalConfig, NeoHookeanConfig, NearConfig>;

ModelConfig model_config(ModelKind kind);  ///< the defaults of the model
const ModelInfo& info(const ModelConfig& model) noexcept;

/// Have no effect on a model that does not simulate it.
void set_plasticity(ModelConfig& model, const std::optional<Yield>& yield);
void set_self_collision(ModelConfig& model, std::optional<double> layer);

/// Returns the settings of Newton's method in a ModelConfig, or null if the model has none.
template <class Config>
auto newton_of(Config& model) noexcept {
  using Found = std::conditional_t<std::is_const_v<Config>, const Newton, Newton>*;
  return std::visit(
      [](auto& of) -> Found {
        if constexpr (requires { of.newton; }) return &of.newton;
        return nullptr;
      },
      model);
}

struct BodyConfig {
  std::variant<BlockShape, CylinderShape, FileShape> shape;
  Element element = Element::kHex8Sri;
  Material material;
  std::vector<Region> regions{};  ///< the last one wins where regions overlap
  ModelConfig model = CondensedConfig{};
  EffectsConfig effects;
  std::optional<double> friction;  ///< coefficient
  std::vector<PlannedCut> cuts;
  std::optional<StiffnessOverTime> stiffening;
  double clamped_below = 0;  ///< m, maximum height of fixed nodes

  Vec3 towards_tool = Vec3::UnitZ();  ///< unit vector, body frame
  double patch_radius = 0;            ///< m
  std::optional<double> reach;        ///< m, maximum tangential distance from `middle`, for kCondensed and kNear
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

void check(const BodyConfig& config);  ///< throws std::invalid_argument if the values describe no valid body

bool is_rigid_on_nonlinear(const BodyConfig& config);  ///< the tool is rigid and the body nonlinear (RigidContact)

bool turns_the_hand(const BodyConfig& config);  ///< true if contact produces a torque on the hand

/// Returns the vector from the handle to the deepest point of the tool, m, in the body frame.
Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn);

EffectSet effects_of(const BodyConfig& config);  ///< simulated effects, including those of the model

bool learns(const BodyConfig& config);  ///< kNear with precomputed answers

bool is_elastic(const BodyConfig& config);  ///< true if a closed path of the tool loses no energy

}  // namespace tendon::softbody
