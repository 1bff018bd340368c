// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/lab/experiments/candidate.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "clients/softbody/fem/mesh.h"
#include "tests/tools/lab/models/explicit.h"

namespace tendon::lab {
namespace {

using namespace softbody;

constexpr double kReach = 0.3;     // patch radii, size of a surface table
constexpr int kStaticModes = 3;    // per axis
constexpr double kDensity = 1000;  // kg/m³, the density of water

std::array<int, 3> cells_of(const PressedBlock& block, int n) {
  const auto along = [&](int axis) {
    return std::max(1, static_cast<int>(std::lround(n * block.size[axis] / block.size.x())));
  };
  return {n, along(1), along(2)};
}

BodyConfig body_of(const PressedBlock& block, const Candidate& candidate, ModelKind model) {
  BodyConfig config;
  config.shape = BlockShape{block.size, cells_of(block, candidate.n)};
  config.element = candidate.element;
  config.material = block.material;
  config.model = model_config(model);
  if (auto* near = std::get_if<NearConfig>(&config.model)) {
    near->law = law_of(model);
    near->learn = candidate.by == Candidate::By::kLearned;
    near->tabulate = candidate.by == Candidate::By::kTable;
    if (near->learns()) near->newton.tolerance = NearConfig::kErrorOfLearned;
  }
  config.patch_radius = block.patch_radius;
  config.reach = kReach * block.patch_radius;
  config.middle = block.touch_point();
  return config;
}

std::unique_ptr<PressedEngine> compared_engine_of(const PressedBlock& block, const Candidate& candidate,
                                                  compared::Kind model) {
  compared::Config config{.static_modes = kStaticModes, .reach = kReach * block.patch_radius};
  Solid solid = solid_of(block, candidate, law_of(model), block.material);
  if (info(model).has_time) {
    // The damping is high enough that the body comes to rest quickly. The time step has a safety margin because a
    // compressed body needs shorter steps, and it is at most one period of the device.
    const double step = std::min(1e-3, 0.7 * compared::largest_step(solid, kDensity));
    config.effects = {.density = kDensity, .step = step, .inertia = true, .damping = 40};
  }
  return compared_engine(model, std::move(solid), block.patch_radius, block.touch_point(), config);
}

}  // namespace

std::vector<AnyModel> all_models() {
  std::vector<AnyModel> all;
  for (const ModelInfo& model : softbody::models()) all.emplace_back(model.kind);
  for (const compared::Info& model : compared::models()) all.emplace_back(model.kind);
  return all;
}

std::string names_of_models() {
  std::string names;
  for (const AnyModel& model : all_models()) names.append(names.empty() ? "" : "|").append(name_of(model));
  return names;
}

std::optional<AnyModel> any_model_named(std::string_view name) {
  for (const AnyModel& model : all_models()) {
    if (name_of(model) == name) return model;
  }
  return std::nullopt;
}

std::string_view name_of(const AnyModel& model) {
  return std::visit([](auto kind) { return info(kind).name; }, model);
}

bool for_comparison(const AnyModel& model) { return std::holds_alternative<compared::Kind>(model); }

bool wants_tetrahedra(const AnyModel& model) {
  const auto* const kind = std::get_if<compared::Kind>(&model);
  return kind != nullptr && info(*kind).tetrahedra;
}

softbody::Law law_of(const AnyModel& model) {
  if (model == AnyModel(ModelKind::kNear)) return softbody::Law::kNeoHookean;
  return std::visit([](auto kind) { return info(kind).law; }, model);
}

std::string Candidate::way() const {
  const std::string model_name(name_of(model));
  switch (by) {
    case By::kLearned:
      return model_name + "-learned";
    case By::kTable:
      return model_name + "-table";
    case By::kWorker:
      return "worker";
    case By::kModel:
      break;
  }
  return model_name;
}

std::string Candidate::name() const { return way() + "-" + std::string(info(element).name); }

Solid solid_of(const PressedBlock& block, const Candidate& candidate, softbody::Law law, const Material& material) {
  Mesh mesh = softbody::block(info(candidate.element).shape, block.size, cells_of(block, candidate.n));
  const Fixed fixed = fix_where(mesh, [](const Vec3& node) { return node.z() < 1e-9; });
  return {std::move(mesh), candidate.element, material, law, fixed};
}

std::unique_ptr<PressedEngine> engine_of(const PressedBlock& block, const Candidate& candidate,
                                         const std::string& worker) {
  if (const auto* const kind = std::get_if<compared::Kind>(&candidate.model))
    return compared_engine_of(block, candidate, *kind);
  const BodyConfig config = body_of(block, candidate, std::get<ModelKind>(candidate.model));
  return candidate.elsewhere() ? worker_engine(config, worker) : own_engine(config);
}

}  // namespace tendon::lab
