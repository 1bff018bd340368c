// SPDX-License-Identifier: Apache-2.0
#include <array>
#include <cstddef>
#include <span>
#include <string_view>

#include "clients/softbody/body.h"

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
// info() uses the kind as the index.
static_assert(each_is_at_its_kind(kEffects) && kEffects.back().kind == kSelfCollision);
static_assert(each_is_at_its_kind(kModels) && kModels.back().kind == ModelKind::kNear);

}  // namespace

std::span<const EffectInfo> effects() noexcept { return kEffects; }

const EffectInfo& info(EffectKind kind) noexcept { return kEffects[static_cast<std::size_t>(kind)]; }

std::span<const ModelInfo> models() noexcept { return kModels; }

const ModelInfo& info(ModelKind kind) noexcept { return kModels[static_cast<std::size_t>(kind)]; }

std::span<const NearLaw> near_laws() noexcept { return kNearLaws; }

}  // namespace tendon::softbody
