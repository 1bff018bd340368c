// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/models/compared.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <stdexcept>
#include <utility>

#include "clients/softbody/models/quasi_static.h"
#include "tests/tools/lab/models/explicit.h"
#include "tests/tools/lab/models/mass_spring.h"
#include "tests/tools/lab/models/modal.h"
#include "tests/tools/lab/models/projective.h"
#include "tests/tools/lab/models/xpbd.h"

namespace tendon::softbody::compared {
namespace {

constexpr std::array kModels{
    Info{.kind = Kind::kStVenantKirchhoff,
         .law = Law::kStVenantKirchhoff,
         .name = "stvk",
         .what = "large rotations; collapses under large loads",
         .has_time = false,
         .tetrahedra = false},
    Info{.kind = Kind::kMassSpring,
         .law = Law::kLinear,
         .name = "mass-spring",
         .what = "springs along the edges, without a Poisson ratio",
         .has_time = false,
         .tetrahedra = true},
    Info{.kind = Kind::kTensorMass,
         .law = Law::kLinear,
         .name = "tensor-mass",
         .what = "small strains with explicit time steps",
         .has_time = true,
         .tetrahedra = false},
    Info{.kind = Kind::kTled,
         .law = Law::kStVenantKirchhoff,
         .name = "tled",
         .what = "stvk with explicit time steps",
         .has_time = true,
         .tetrahedra = false},
    Info{.kind = Kind::kXpbd,
         .law = Law::kNeoHookean,
         .name = "xpbd",
         .what = "stiffness depends on the step and the iterations",
         .has_time = true,
         .tetrahedra = true},
    Info{.kind = Kind::kProjective,
         .law = Law::kCorotational,
         .name = "projective",
         .what = "elements as rigid as possible, a few iterations per answer",
         .has_time = false,
         .tetrahedra = false},
    Info{.kind = Kind::kModal,
         .law = Law::kLinear,
         .name = "modal",
         .what = "a few vibration modes, too stiff near the contact",
         .has_time = false,
         .tetrahedra = false},
};

constexpr bool each_is_at_its_kind() {
  for (std::size_t i = 0; i < kModels.size(); ++i) {
    if (static_cast<std::size_t>(kModels[i].kind) != i) return false;
  }
  return true;
}
// info() uses the kind as an index.
static_assert(each_is_at_its_kind() && kModels.back().kind == Kind::kModal);

ModalModel::Config modal_config(const Config& config, const TouchSurface& surface, const Vec3& middle) {
  ModalModel::Config modal{
      .swings = config.swings, .patches = {}, .glides = config.whole_stiffness || surface.curved()};
  const int count = config.static_modes;
  const auto along = [&](int i) { return count > 1 ? config.reach * (2.0 * i / (count - 1) - 1) : 0; };
  for (int i = 0; i < count; ++i) {
    for (int j = 0; j < count; ++j) modal.patches.emplace_back(surface.across(middle) + Vec2(along(i), along(j)));
  }
  return modal;
}

std::unique_ptr<Model> model_of(Kind kind, const Solid& solid, const TouchSurface& surface, const Vec3& middle,
                                const Config& config) {
  if (solid.law() != info(kind).law) throw std::invalid_argument("the solid has a different law than the model");
  switch (kind) {
    case Kind::kStVenantKirchhoff:
      return std::make_unique<QuasiStaticModel>(solid, surface, QuasiStaticModel::Config{}, config.effects);
    case Kind::kMassSpring:
      return std::make_unique<MassSpringModel>(solid, surface, QuasiStaticModel::Config{}, config.effects);
    case Kind::kTensorMass:
    case Kind::kTled:
      return std::make_unique<ExplicitModel>(solid, surface, config.effects);
    case Kind::kXpbd:
      return std::make_unique<XpbdModel>(solid, surface, config.iterations, config.effects);
    case Kind::kProjective:
      return std::make_unique<ProjectiveModel>(solid, surface, config.iterations, config.effects);
    case Kind::kModal:
      break;
  }
  if (config.effects.gravity || config.effects.has_time()) {
    throw std::invalid_argument("this model does not simulate effects on the whole body");
  }
  return std::make_unique<ModalModel>(solid, surface, modal_config(config, surface, middle));
}

Patch patch_around(const TouchSurface& surface, const Vec3& middle) {
  if (auto found = surface.patch(surface.across(middle))) return *std::move(found);
  throw std::invalid_argument("the centre of the touched side is not on the body");
}

}  // namespace

std::span<const Info> models() noexcept { return kModels; }

const Info& info(Kind kind) noexcept { return kModels[static_cast<std::size_t>(kind)]; }

std::optional<Kind> named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kModels, name, &Info::name);
  return found == kModels.end() ? std::nullopt : std::optional(found->kind);
}

PressedBody::PressedBody(Kind kind, Solid solid, double patch_radius, const Vec3& middle, const Config& config)
    : solid_(std::move(solid)),
      surface_(solid_.mesh(), Vec3::UnitZ(), patch_radius),
      model_(model_of(kind, solid_, surface_, middle, config)),
      contact_(*model_, surface_, 0, PatchContact::Side::kUnilateral),
      patch_(patch_around(surface_, middle)) {}

Body::Size PressedBody::size() const {
  return {solid_.mesh().nodes.size(), static_cast<std::size_t>(solid_.mesh().element_count()),
          static_cast<std::size_t>(solid_.free_count()), surface_.nodes().size(), model_->bytes() + contact_.bytes()};
}

}  // namespace tendon::softbody::compared
