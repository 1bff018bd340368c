// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/body.h"

#include <algorithm>
#include <array>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/gmsh.h"
#include "clients/softbody/linear.h"

namespace tendon::softbody {
namespace {

constexpr std::array kModels{
    ModelInfo{ModelKind::kLinear, Law::kLinear, "linear", "small strains; one solution with a kept factor", false,
              false},
    ModelInfo{ModelKind::kCondensed, Law::kLinear, "condensed",
              "the same answers from a table of the surface: the fastest", false, false},
    ModelInfo{ModelKind::kCorotational, Law::kCorotational, "corotational",
              "large rotations, small strains; Newton at every answer", true, false},
    ModelInfo{ModelKind::kStVenantKirchhoff, Law::kStVenantKirchhoff, "stvk",
              "large rotations; for comparison only: it collapses under a hard press", true, false},
    ModelInfo{ModelKind::kNeoHookean, Law::kNeoHookean, "neo-hookean",
              "large rotations and strains; recovers from being turned inside out", true, true},
};

Mesh mesh_of(const BodyConfig& config) {
  const Shape shape = info(config.element).shape;
  if (const auto* b = std::get_if<BlockShape>(&config.shape)) return block(shape, b->size, b->cells);
  if (const auto* c = std::get_if<CylinderShape>(&config.shape)) {
    return cylinder(shape, c->radius, c->height, c->across, c->up);
  }
  const auto& file = std::get<FileShape>(config.shape);
  return read_gmsh(file.file, file.scale);
}

Solid solid_of(const BodyConfig& config) {
  Mesh mesh = mesh_of(config);
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& node : mesh.nodes) lowest = std::min(lowest, node.z());
  const double held = lowest + std::max(config.clamped_below, 1e-9);
  Fixed fixed = fix_where(mesh, [&](const Vec3& node) { return node.z() <= held; });
  return {std::move(mesh), config.element, config.material, info(config.model).law, std::move(fixed)};
}

std::unique_ptr<Model> model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface) {
  switch (config.model) {
    case ModelKind::kLinear:
      return std::make_unique<LinearModel>(solid, surface);
    case ModelKind::kCondensed:
      return std::make_unique<CondensedModel>(
          solid, surface,
          config.reach ? surface.nodes_of_patches(surface.across(config.middle), *config.reach) : surface.nodes());
    case ModelKind::kCorotational:
    case ModelKind::kStVenantKirchhoff:
    case ModelKind::kNeoHookean:
      break;
  }
  return std::make_unique<QuasiStaticModel>(solid, surface,
                                            QuasiStaticModel::Config{.max_iterations = config.max_iterations});
}

}  // namespace

std::span<const ModelInfo> models() noexcept { return kModels; }

const ModelInfo& info(ModelKind kind) noexcept { return kModels[static_cast<std::size_t>(kind)]; }

std::optional<ModelKind> model_named(std::string_view name) noexcept {
  const auto* const found = std::ranges::find(kModels, name, &ModelInfo::name);
  return found == kModels.end() ? std::nullopt : std::optional(found->kind);
}

struct Body::Parts {
  explicit Parts(const BodyConfig& config)
      : solid(solid_of(config)),
        surface(solid.mesh(), config.towards_tool, config.patch_radius),
        model(model_of(config, solid, surface)),
        contact(*model, surface, config.tool_radius, config.side) {
    const auto found = surface.patch(surface.across(config.middle));
    if (!found) throw std::invalid_argument("the middle of the touched side is not on the body");
    patch = *found;
  }

  Solid solid;
  TouchSurface surface;
  std::unique_ptr<Model> model;
  PatchContact contact;
  Patch patch;  ///< around the middle
};

Body::Body(const BodyConfig& config) : parts_(std::make_unique<Parts>(config)) {}
Body::~Body() = default;
Body::Body(Body&&) noexcept = default;
Body& Body::operator=(Body&&) noexcept = default;

Feel Body::touch(const Vec3& tool) { return parts_->contact.at(tool); }

Reaction Body::press(Given given, double value) { return parts_->model->press(parts_->patch, given, value); }

Vec3 Body::touch_point() const {
  Vec3 point = Vec3::Zero();
  for (Eigen::Index i = 0; i < parts_->patch.weights.size(); ++i) {
    const auto node = static_cast<std::size_t>(parts_->patch.nodes[static_cast<std::size_t>(i)]);
    point += parts_->patch.weights[i] * parts_->solid.mesh().nodes[node];
  }
  return point;
}

const Vec3& Body::normal() const { return parts_->surface.normal(); }

Body::Size Body::size() const {
  return {parts_->solid.mesh().nodes.size(), static_cast<std::size_t>(parts_->solid.mesh().element_count()),
          static_cast<std::size_t>(parts_->solid.free_count()), parts_->surface.nodes().size(), parts_->model->bytes()};
}

}  // namespace tendon::softbody
