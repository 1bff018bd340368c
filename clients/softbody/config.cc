// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/config.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

using enum EffectKind;

constexpr std::array kEffects{
    EffectInfo{kContact, "contact", "the tool can touch the body", {}},
    EffectInfo{kGeometricNonlinearity, "geometric-nonlinearity", "large rotations", {}},
    EffectInfo{kMaterialNonlinearity, "material-nonlinearity", "large strains", {}},
    EffectInfo{kGravity, "gravity", "the body deforms under its weight", {}},
    EffectInfo{kInertia, "inertia", "the body can oscillate: each answer is a time step", {}},
    EffectInfo{kDamping, "damping", "the motion of the body is damped", {}},
    EffectInfo{kViscosity, "viscosity", "the material resists fast deformation", {}},
    EffectInfo{kFriction, "friction", "the tool has friction on the surface", {}},
    EffectInfo{kCutting, "cutting", "the body is cut at planned times or forces", {kInertia, kDamping, kViscosity}},
    EffectInfo{kStiffening, "stiffening", "Young's modulus changes over time", {kGravity, kInertia, kDamping}},
    EffectInfo{kPlasticity,
               "plasticity",
               "large stresses deform the body permanently",
               {kInertia, kDamping, kViscosity, kCutting, kStiffening}},
    EffectInfo{kSelfCollision, "self-collision", "the sides of the body cannot penetrate each other", {}},
};

constexpr EffectSet operator|(EffectSet set, EffectKind kind) {
  set.add(kind);
  return set;
}

constexpr EffectSet kSmall{kContact};
constexpr EffectSet kLargeRotations{kContact, kGeometricNonlinearity};
constexpr EffectSet kLargeStrains{kContact, kGeometricNonlinearity, kMaterialNonlinearity};
constexpr EffectSet kAllOfSolids{kGravity, kInertia, kDamping, kViscosity, kFriction, kCutting, kStiffening};
constexpr EffectSet kOfTables{kFriction, kStiffening};

constexpr std::array kModels{
    ModelInfo{ModelKind::kLinear, Law::kLinear, "linear", "small strains; one solution with a stored factorization",
              kSmall, kAllOfSolids | kPlasticity},
    ModelInfo{ModelKind::kCondensed, Law::kLinear, "condensed", "the same answers from a table of the surface; fastest",
              kSmall, kOfTables},
    ModelInfo{ModelKind::kCorotational, Law::kCorotational, "corotational",
              "large rotations, small strains; Newton's method in each answer", kLargeRotations,
              kAllOfSolids | kPlasticity | kSelfCollision},
    ModelInfo{ModelKind::kNeoHookean, Law::kNeoHookean, "neo-hookean",
              "large rotations and strains; no inverted elements", kLargeStrains, kAllOfSolids | kSelfCollision},
    ModelInfo{ModelKind::kNear, Law::kCorotational, "near",
              "large rotations or strains near the tool, and a linear body elsewhere", kLargeRotations,
              kOfTables | kCutting | kMaterialNonlinearity},
};

constexpr std::array kNearLaws{
    NearLaw{Law::kCorotational, "corotational"},
    NearLaw{Law::kStVenantKirchhoff, "stvk"},
    NearLaw{Law::kNeoHookean, "neo-hookean"},
};

template <class Info, std::size_t kCount>
constexpr bool each_is_at_its_kind(const std::array<Info, kCount>& rows) {
  for (std::size_t i = 0; i < kCount; ++i) {
    if (static_cast<std::size_t>(rows[i].kind) != i) return false;
  }
  return true;
}
template <ModelKind kKind, class Config>
constexpr bool kIsAt = std::is_same_v<std::variant_alternative_t<static_cast<std::size_t>(kKind), ModelConfig>, Config>;
// info() uses the kind or the alternative as the index.
static_assert(each_is_at_its_kind(kEffects) && kEffects.back().kind == kSelfCollision);
static_assert(each_is_at_its_kind(kModels) && kModels.back().kind == ModelKind::kNear);
static_assert(kIsAt<ModelKind::kLinear, LinearConfig> && kIsAt<ModelKind::kCondensed, CondensedConfig> &&
              kIsAt<ModelKind::kCorotational, CorotationalConfig> && kIsAt<ModelKind::kNeoHookean, NeoHookeanConfig> &&
              kIsAt<ModelKind::kNear, NearConfig> && std::variant_size_v<ModelConfig> == kModels.size());

}  // namespace

std::span<const EffectInfo> effects() noexcept { return kEffects; }

const EffectInfo& info(EffectKind kind) noexcept { return kEffects[static_cast<std::size_t>(kind)]; }

std::span<const ModelInfo> models() noexcept { return kModels; }

const ModelInfo& info(ModelKind kind) noexcept { return kModels[static_cast<std::size_t>(kind)]; }

const ModelInfo& info(const ModelConfig& model) noexcept { return kModels[model.index()]; }

ModelConfig model_config(ModelKind kind) {
  const std::array<ModelConfig, kModels.size()> all{LinearConfig{}, CondensedConfig{}, CorotationalConfig{},
                                                    NeoHookeanConfig{}, NearConfig{}};
  return all[static_cast<std::size_t>(kind)];
}

void set_plasticity(ModelConfig& model, const std::optional<Yield>& yield) {
  std::visit(
      [&yield](auto& of) {
        if constexpr (requires { of.plasticity; }) of.plasticity = yield;
      },
      model);
}

void set_self_collision(ModelConfig& model, std::optional<double> layer) {
  std::visit(
      [layer](auto& of) {
        if constexpr (requires { of.self_collision; }) of.self_collision = layer;
      },
      model);
}

std::span<const NearLaw> near_laws() noexcept { return kNearLaws; }

bool is_rigid_on_nonlinear(const BodyConfig& config) {
  return !is_patch(config.tool) && (std::holds_alternative<CorotationalConfig>(config.model) ||
                                    std::holds_alternative<NeoHookeanConfig>(config.model));
}

bool turns_the_hand(const BodyConfig& config) {
  return !(is_patch(config.tool) || is_sphere(config.tool)) || config.tool_offset != Vec3::Zero();
}

Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn) {
  return turn * config.tool_offset + lowest_of(config.tool, config.layer, turn, config.towards_tool);
}

EffectSet effects_of(const BodyConfig& config) {
  EffectSet set = info(config.model).always;
  if (config.effects.gravity) set.add(kGravity);
  if (config.effects.inertia) set.add(kInertia);
  if (config.effects.damping) set.add(kDamping);
  if (config.effects.viscosity) set.add(kViscosity);
  if (config.friction) set.add(kFriction);
  if (!config.cuts.empty()) set.add(kCutting);
  if (config.stiffening) set.add(kStiffening);
  std::visit(
      [&set](const auto& model) {
        if constexpr (requires { model.law; }) {
          if (model.law == Law::kNeoHookean) set.add(kMaterialNonlinearity);
        }
        if constexpr (requires { model.plasticity; }) {
          if (model.plasticity) set.add(kPlasticity);
        }
        if constexpr (requires { model.self_collision; }) {
          if (model.self_collision) set.add(kSelfCollision);
        }
      },
      config.model);
  return set;
}

bool learns(const BodyConfig& config) {
  const auto* near = std::get_if<NearConfig>(&config.model);
  return near != nullptr && near->learns();
}

bool is_elastic(const BodyConfig& config) {
  const EffectSet lossless{kContact, kGeometricNonlinearity, kMaterialNonlinearity, kGravity, kSelfCollision};
  return effects_of(config).within(lossless);
}

void check(const BodyConfig& config) {
  const ModelInfo& model = info(config.model);
  const bool condensed = std::holds_alternative<CondensedConfig>(config.model);
  const EffectSet simulated = effects_of(config);
  for (const EffectInfo& effect : effects()) {
    if (simulated.has(effect.kind) && !model.always.has(effect.kind) && !model.may.has(effect.kind)) {
      throw std::invalid_argument("the model \"" + std::string(model.name) + "\" does not simulate " +
                                  std::string(effect.name));
    }
    for (const EffectInfo& other : effects()) {
      if (simulated.has(effect.kind) && simulated.has(other.kind) && effect.not_with.has(other.kind)) {
        throw std::invalid_argument(std::string(effect.name) + " cannot be simulated together with " +
                                    std::string(other.name));
      }
    }
  }
  if (const auto* near = std::get_if<NearConfig>(&config.model); near != nullptr && near->law == Law::kLinear) {
    throw std::invalid_argument("the law of the model \"near\" cannot be linear");
  }
  if (learns(config)) {
    expect(config.reach && *config.reach > 0 && *config.reach <= NearConfig::kFarthest * config.patch_radius, "reach",
           config.reach.value_or(0), "above 0 and at most 1.5 patch radii if the body learns");
  }
  const auto* capsule = std::get_if<CapsuleTool>(&config.tool);
  if (!is_patch(config.tool)) {
    const std::string tool(name_of(config.tool));
    if (is_rigid_on_nonlinear(config)) {
      for (const EffectKind effect : {kInertia, kDamping, kViscosity, kCutting, kPlasticity, kSelfCollision}) {
        if (simulated.has(effect)) {
          throw std::invalid_argument(tool + " cannot press a body with " + std::string(info(effect).name));
        }
      }
    } else if (!is_sphere(config.tool) && capsule == nullptr) {
      throw std::invalid_argument(tool + " requires the model \"corotational\" or \"neo-hookean\"");
    } else if (!condensed) {
      throw std::invalid_argument(tool + " requires the model \"condensed\", \"corotational\" or \"neo-hookean\"");
    } else if (config.friction) {
      throw std::invalid_argument(tool + " has no friction on the model \"condensed\"");
    }
    if (config.stiffening) throw std::invalid_argument(tool + " cannot be used with stiffening");
    if (config.side == PatchContact::Side::kBilateral) throw std::invalid_argument(tool + " does not stick");
  }
  if (config.hands != 1 && !is_rigid_on_nonlinear(config)) {
    throw std::invalid_argument("several hands require a rigid tool and the model \"corotational\" or \"neo-hookean\"");
  }
  if (capsule != nullptr) {
    if (condensed && std::get<CondensedConfig>(config.model).table_file) {
      throw std::invalid_argument("a capsule cannot use a table in a file");
    }
    expect(std::abs(capsule->axis.norm() - 1) < 1e-9, "norm of tool_axis", capsule->axis.norm(), "1");
  }
  expect(config.tool_offset.allFinite(), "tool_offset", config.tool_offset.norm(), "finite numbers");
}

}  // namespace tendon::softbody
