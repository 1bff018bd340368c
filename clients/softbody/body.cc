// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/body.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "clients/softbody/fem/gmsh.h"
#include "clients/softbody/models/linear.h"
#include "clients/softbody/touch/capsule.h"
#include "clients/softbody/touch/friction.h"
#include "clients/softbody/touch/rigid_contact.h"
#include "clients/softbody/touch/sphere.h"
#include "protocol/expect.h"

namespace tendon::softbody {
namespace {

using enum EffectKind;

FileMesh mesh_of(const BodyConfig& config) {
  const Shape shape = info(config.element).shape;
  if (const auto* b = std::get_if<BlockShape>(&config.shape)) return {.mesh = block(shape, b->size, b->cells)};
  if (const auto* c = std::get_if<CylinderShape>(&config.shape)) {
    return {.mesh = cylinder(shape, c->radius, c->height, c->across, c->up)};
  }
  const auto& file = std::get<FileShape>(config.shape);
  return read_gmsh(file.file, file.scale, file.slits);
}

Solid solid_of(const BodyConfig& config) {
  FileMesh read = mesh_of(config);
  Mesh& mesh = read.mesh;
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& node : mesh.nodes) lowest = std::min(lowest, node.z());
  const double held = lowest + std::max(config.clamped_below, 1e-9);
  const Fixed fixed = fix_where(mesh, [&](const Vec3& node) { return node.z() <= held; });
  if (const auto* file = std::get_if<FileShape>(&config.shape)) expect_held(read, fixed, file->file.string());
  const Law law = config.model == ModelKind::kNear ? config.near.law : info(config.model).law;
  std::vector<Material> of_elements = materials_of(mesh, config.material, config.regions);
  return {std::move(mesh), config.element, config.material, law, fixed, std::move(of_elements)};
}

/// Whether linear models and plasticity compute their Glide.
bool wants_glide(const BodyConfig& config, const TouchSurface& surface) {
  return config.whole_stiffness || surface.curved();
}

struct BuiltModel {
  std::unique_ptr<Model> model;
  std::optional<double> linear_up_to{};  ///< m, if a table file provides it
  const CondensedModel* condensed = nullptr;
  QuasiStaticModel* newton = nullptr;
  StiffeningModel* stiffening = nullptr;
  NearModel* near = nullptr;
  const FallbackModel* fallbacks = nullptr;
};

Patch middle_patch(const TouchSurface& surface, const Vec3& middle) {
  if (auto found = surface.patch(surface.across(middle))) return *std::move(found);
  throw std::invalid_argument("the centre of the touched side is not on the body");
}

std::unique_ptr<Model> solved_model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface,
                                       const SolverOf& solver) {
  EffectSet known = info(ModelKind::kLinear).always;
  known.add(kFriction);
  if (config.model != ModelKind::kLinear || !effects_of(config).within(known)) {
    throw std::invalid_argument(
        "on several machines, expected the model \"linear\" and no effects except contact and friction");
  }
  return std::make_unique<SolvedModel>(solid, surface, middle_patch(surface, config.middle), solver(solid));
}

std::unique_ptr<Model> plain_model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface) {
  QuasiStaticModel::Config newton{.max_iterations = config.max_iterations, .tolerance = config.tolerance};
  if (config.plasticity) newton.glides = wants_glide(config, surface);
  if (config.self_collision) newton.self_collision = config.material.young / *config.self_collision;
  const EffectsConfig& effects = config.effects;
  if (config.plasticity) return std::make_unique<PlasticModel>(solid, surface, newton, effects, *config.plasticity);
  if (config.model == ModelKind::kLinear) {
    return std::make_unique<LinearModel>(solid, surface, effects, wants_glide(config, surface));
  }
  return std::make_unique<QuasiStaticModel>(solid, surface, newton, effects);
}

std::vector<int> touchable(const BodyConfig& config, const TouchSurface& surface) {
  return config.reach ? surface.nodes_of_patches(surface.across(config.middle), *config.reach) : surface.nodes();
}

double stiffness_under(Model& model, const Patch& patch) { return model.press(patch, Prescribed::kForce, 1).stiffness; }

/// Throws if the table does not belong to this body, or does not reproduce its recorded stiffness.
std::unique_ptr<CondensedModel> condensed_from(const BodyConfig& config, const Solid& solid,
                                               const TouchSurface& surface, double& linear_up_to) {
  SurfaceTable table = read_table(*config.table_file);
  const auto refuse = [&](const std::string& why) { throw std::invalid_argument(config.table_file->string() + why); };
  if (table.body != digest_of(solid, surface.normal())) {
    refuse(" is the table of another body: create it again with tendon-softbody condense");
  }
  for (const int node : touchable(config, surface)) {
    if (!std::ranges::binary_search(table.nodes, node)) refuse(" does not cover reach_mm");
  }
  linear_up_to = table.linear_up_to;
  const double expected = table.stiffness;
  const TouchSurface then(solid.mesh(), surface.normal(), table.patch_radius);
  const auto patch = then.patch(table.middle);
  auto model = std::make_unique<CondensedModel>(solid.mesh().nodes.size(), std::move(table.nodes),
                                                std::move(table.compliance), wants_glide(config, surface));
  constexpr double kSame = 1e-9;  // summation order differs
  if (!patch || !(std::abs(stiffness_under(*model, *patch) / expected - 1) < kSame)) {
    refuse(" does not reproduce the answers for which it was created");
  }
  return model;
}

int near_modes(const BodyConfig& config) {
  return config.near.exact_interface ? std::numeric_limits<int>::max() : NearModel::Config{}.modes;
}

Learned learn_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface, const Tell& tell) {
  return learn(solid, surface,
               {.shapes = config.near.learn,
                .answers = config.near.tabulate,
                .middle = surface.across(config.middle),
                .reach = *config.reach,
                .folder = config.near.learned_in},
               tell);
}

std::vector<std::unique_ptr<FallbackLevel>> levels_of(const BodyConfig& config, const Solid& solid,
                                                      const TouchSurface& surface) {
  std::vector<std::unique_ptr<FallbackLevel>> levels;
  const Learned learned = config.near.learned ? *config.near.learned : learn_of(config, solid, surface, {});
  if (config.near.tabulate && learned.answers) {
    levels.push_back(std::make_unique<TabulatedLevel>(*learned.answers, config.tolerance));
  }
  if (config.near.learn && learned.shapes) {
    levels.push_back(std::make_unique<LearnedLevel>(solid, surface, *learned.shapes, config.tolerance));
  }
  return levels;
}

/// If there are `fields`, they build the near field.
std::unique_ptr<NearModel> near_model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface,
                                         Background fields) {
  const NearModel::Config made{.newton = {.max_iterations = config.max_iterations, .tolerance = config.tolerance},
                               .modes = near_modes(config)};
  if (fields) return std::make_unique<NearModel>(solid, surface, made, std::move(fields));
  return std::make_unique<NearModel>(solid, surface, middle_patch(surface, config.middle), made);
}

BuiltModel model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface, const SolverOf& solver,
                    Background fields) {
  BuiltModel made;
  if (solver) {
    made.model = solved_model_of(config, solid, surface, solver);
  } else if (config.model == ModelKind::kCondensed) {
    auto condensed = config.table_file ? condensed_from(config, solid, surface, made.linear_up_to.emplace())
                                       : std::make_unique<CondensedModel>(solid, surface, touchable(config, surface),
                                                                          wants_glide(config, surface));
    made.condensed = condensed.get();
    made.model = std::move(condensed);
  } else if (config.model == ModelKind::kNear) {
    auto near = near_model_of(config, solid, surface, std::move(fields));
    made.near = near.get();
    if (config.near.learns()) {
      auto fallbacks = std::make_unique<FallbackModel>(levels_of(config, solid, surface), std::move(near));
      made.fallbacks = fallbacks.get();
      made.model = std::move(fallbacks);
    } else {
      made.model = std::move(near);
    }
  } else {
    made.model = plain_model_of(config, solid, surface);
    if (is_rigid_on_nonlinear(config)) made.newton = static_cast<QuasiStaticModel*>(made.model.get());
  }
  if (config.stiffening) {
    auto stiffening = std::make_unique<StiffeningModel>(std::move(made.model), *config.stiffening);
    made.stiffening = stiffening.get();
    made.model = std::move(stiffening);
  }
  return made;
}

const BodyConfig& checked(const BodyConfig& config) {
  const ModelInfo& model = info(config.model);
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
  if (config.model == ModelKind::kNear && config.near.law == Law::kLinear) {
    throw std::invalid_argument("the law of the model \"near\" cannot be linear");
  }
  if (config.near.learns()) {
    if (config.model != ModelKind::kNear) {
      throw std::invalid_argument("only the model \"near\" can learn or tabulate answers");
    }
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
    } else if (config.model != ModelKind::kCondensed) {
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
  if (config.table_file) {
    if (config.model != ModelKind::kCondensed) {
      throw std::invalid_argument("a table in a file requires the model \"condensed\"");
    }
    if (capsule != nullptr) throw std::invalid_argument("a capsule cannot use a table in a file");
  }
  if (capsule != nullptr) {
    expect(std::abs(capsule->axis.norm() - 1) < 1e-9, "norm of tool_axis", capsule->axis.norm(), "1");
  }
  expect(config.tool_offset.allFinite(), "tool_offset", config.tool_offset.norm(), "finite numbers");
  return config;
}

std::unique_ptr<Friction> friction_of(const BodyConfig& config) {
  if (!config.friction) return nullptr;
  return std::make_unique<Friction>(*config.friction, sideways_stiffness(config.material, config.patch_radius));
}

constexpr double kPointsAcrossTool = 4;  ///< thinner tools slip off the points of the layer (layer.h)

RigidContact rigid_contact_of(const BodyConfig& config, QuasiStaticModel& body, const Solid& solid,
                              const TouchSurface& surface) {
  const RigidShape shape = shape_of(config.tool, config.layer);
  RigidContact::Config made;
  made.layer = {.thickness = config.layer,
                .young = config.material.young,
                .friction = config.friction.value_or(0),
                .shear = config.material.mu(),
                .piece = std::min(shape.reach() / 10, shape.thinnest() / kPointsAcrossTool)};
  made.tolerance = config.tolerance;
  made.max_iterations = config.max_iterations;
  made.turns = turns_the_hand(config);
  return {body, solid, surface, std::vector<HeldTool>(config.hands, {shape, config.tool_offset}), made};
}

double linear_limit(const Solid& solid, const TouchSurface& surface, const Patch& patch, const Solver& solver) {
  const VectorXd load = solid.to_free(patch_load(solid, surface.normal(), patch));
  const VectorXd per_newton = solver.solve(load);
  const double depth = 1e-6 * surface.radius();  // small, so that rotations are proportional to it
  VectorXd u = VectorXd::Zero(solid.size());
  solid.add_free(depth / load.dot(per_newton) * per_newton, u);
  return depth * Body::kLargestTurn / solid.largest_turn(u);
}

}  // namespace

bool is_rigid_on_nonlinear(const BodyConfig& config) {
  return !is_patch(config.tool) && (config.model == ModelKind::kCorotational || config.model == ModelKind::kNeoHookean);
}

bool turns_the_hand(const BodyConfig& config) {
  return !(is_patch(config.tool) || is_sphere(config.tool)) || config.tool_offset != Vec3::Zero();
}

Vec3 lowest_of_tool(const BodyConfig& config, const Mat3& turn) {
  return turn * config.tool_offset + lowest_of(config.tool, config.layer, turn, config.towards_tool);
}

EffectSet effects_of(const BodyConfig& config) {
  EffectSet set = info(config.model).always;
  if (config.model == ModelKind::kNear && config.near.law == Law::kNeoHookean) set.add(kMaterialNonlinearity);
  if (config.effects.gravity) set.add(kGravity);
  if (config.effects.inertia) set.add(kInertia);
  if (config.effects.damping) set.add(kDamping);
  if (config.effects.viscosity) set.add(kViscosity);
  if (config.friction) set.add(kFriction);
  if (!config.cuts.empty()) set.add(kCutting);
  if (config.stiffening) set.add(kStiffening);
  if (config.plasticity) set.add(kPlasticity);
  if (config.self_collision) set.add(kSelfCollision);
  return set;
}

bool is_elastic(const BodyConfig& config) {
  const EffectSet lossless{kContact, kGeometricNonlinearity, kMaterialNonlinearity, kGravity, kSelfCollision};
  return effects_of(config).within(lossless);
}

struct Body::Parts {
  Parts(const BodyConfig& config, const SolverOf& solver) : Parts(config, solver, solid_of(checked(config))) {
    if (!config.cuts.empty()) cutting = std::make_unique<Planned>(config, solid.mesh(), solid.fixed(), surface);
  }
  Parts(const BodyConfig& config, const SolverOf& solver, Solid of, Background fields = {})
      : solid(std::move(of)),
        surface(solid.mesh(), config.towards_tool, config.patch_radius),
        made(model_of(config, solid, surface, solver, std::move(fields))),
        model(*made.model),
        contact(model, surface, radius_of(config.tool), config.side, friction_of(config)),
        patch(middle_patch(surface, config.middle)),
        knows_turns(info(config.model).always.has(kGeometricNonlinearity)),
        turns(turns_the_hand(config)),
        offset(config.tool_offset) {
    // checked() ensures that the model for other spheres and capsules is condensed.
    if (made.newton != nullptr) {
      rigid.emplace(rigid_contact_of(config, *made.newton, solid, surface));
      hands.resize(config.hands);
      return;
    }
    if (is_sphere(config.tool)) sphere.emplace(*made.condensed, surface, radius_of(config.tool));
    if (const auto* tool = std::get_if<CapsuleTool>(&config.tool)) {
      axis = tool->axis;
      capsule.emplace(solid, surface, touchable(config, surface), tool->radius, tool->half_length);
    }
  }

  void cut(PlannedCut::When when, double value);
  void prepare();
  void go_on_from(Parts& before);
  void note(Feel& feel);

  struct Planned {
    Planned(const BodyConfig& config, const Mesh& mesh, const Fixed& fixed, const TouchSurface& surface);
    Cutting cuts;
    BodyConfig described;
    Background background{};
    std::future<std::unique_ptr<Parts>> next{};
  };

  Solid solid;
  TouchSurface surface;
  BuiltModel made;
  Model& model;
  PatchContact contact;
  std::optional<SphereContact> sphere;
  std::optional<CapsuleContact> capsule;
  std::optional<RigidContact> rigid;
  std::vector<std::optional<Pose>> hands;
  Patch patch;
  bool knows_turns;
  bool turns;
  Vec3 offset;
  Vec3 axis = Vec3::UnitZ();
  std::unique_ptr<Planned> cutting;
  std::vector<int> node_before{};  ///< set if the body was prepared in the background
};

/// Makes all cuts on a mesh first, so that an invalid plan is an error at the start.
Body::Parts::Planned::Planned(const BodyConfig& config, const Mesh& mesh, const Fixed& fixed,
                              const TouchSurface& surface)
    : cuts(config.cuts), described(config) {
  described.near.learned.emplace();  // precomputed data is invalid after a cut
  Division body{.mesh = mesh, .fixed = fixed, .node_before = {}};
  for (Cutting trial = cuts; trial.left() > 0;) {
    const std::span<const Cut> done = trial.make_next();
    const std::string which = "cutting: cut " + std::to_string(done.size());
    if (divide(mesh, fixed, done.last(1)).opened == 0) {
      throw std::invalid_argument(which + " does not separate any elements of the body");
    }
    body = divide(body.mesh, body.fixed, done);
    try {
      middle_patch(TouchSurface(body.mesh, surface.normal(), surface.radius()), config.middle);
    } catch (const std::invalid_argument& error) {
      throw std::invalid_argument(which + " leaves no surface to touch: " + error.what());
    }
  }
}

namespace {

Solid divided(const Solid& solid, const Division& division) {
  std::vector<Material> of_elements;
  if (!solid.of_elements().empty()) {
    for (const int before : division.element_before) of_elements.push_back(solid.material(before));
  }
  return {division.mesh, solid.element(), solid.material(), solid.law(), division.fixed, std::move(of_elements)};
}

}  // namespace

void Body::Parts::cut(PlannedCut::When when, double value) {
  while (cutting->cuts.due(when, value)) {
    if (cutting->background) {
      if (!cutting->next.valid()) prepare();
      return;
    }
    const Division division = divide(solid.mesh(), solid.fixed(), cutting->cuts.make_next());
    solid = divided(solid, division);
    surface = TouchSurface(solid.mesh(), surface.normal(), surface.radius());
    patch = middle_patch(surface, cutting->described.middle);
    model.cut(division, cutting->described.effects);
    if (when == PlannedCut::When::kForce) return;  // the force is not known yet
  }
}

void Body::Parts::prepare() {
  if (made.near != nullptr) made.near->make_no_more_fields();
  std::promise<std::unique_ptr<Parts>> done;
  cutting->next = done.get_future();
  cutting->background(
      std::packaged_task<void()>([config = cutting->described, before = solid, cuts = cutting->cuts.with_next(),
                                  fields = cutting->background, done = std::move(done)]() mutable {
        try {
          Division division = divide(before.mesh(), before.fixed(), cuts);
          auto parts = std::make_unique<Parts>(config, SolverOf(), divided(before, division), std::move(fields));
          parts->node_before = std::move(division.node_before);
          done.set_value(std::move(parts));
        } catch (...) {
          done.set_exception(std::current_exception());
        }
      }));
}

void Body::Parts::go_on_from(Parts& before) {
  model.go_on_from(before.model, node_before);
  contact.go_on_from(before.contact);
  cutting = std::move(before.cutting);
  cutting->cuts.make_next();
}

void Body::Parts::note(Feel& feel) {
  feel.topology_changed = cutting->cuts.take_changed();
  if (cutting->next.valid()) feel.error = std::max(feel.error, feel.force.norm());
  cut(PlannedCut::When::kForce, feel.force.dot(surface.normal()));
}

Body::Body(const BodyConfig& config) : Body(config, SolverOf()) {}
Body::Body(const BodyConfig& config, const SolverOf& solver) : parts_(std::make_unique<Parts>(config, solver)) {}
Body::~Body() = default;
Body::Body(Body&&) noexcept = default;
Body& Body::operator=(Body&&) noexcept = default;

void Body::prepare_by(Background background) {
  if (parts_->made.near != nullptr) parts_->made.near->make_fields_by(background);
  if (parts_->cutting) parts_->cutting->background = std::move(background);
}

void Body::take_prepared() {
  std::future<std::unique_ptr<Parts>>& next = parts_->cutting->next;
  if (!next.valid() || next.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return;
  std::unique_ptr<Parts> parts = next.get();
  parts->go_on_from(*parts_);
  parts_ = std::move(parts);
}

Feel Body::touch(const Vec3& tool) {
  if (parts_->rigid) return touch(Pose{.position = tool - parts_->offset});
  if (parts_->cutting) take_prepared();
  if (parts_->capsule) return parts_->capsule->at(tool, parts_->axis, tool);
  Feel feel = parts_->sphere ? parts_->sphere->at(tool) : parts_->contact.at(tool);
  if (parts_->cutting) parts_->note(feel);
  return feel;
}

std::vector<Feel> Body::touch(std::span<const std::optional<Pose>> handles) {
  if (parts_->rigid) return parts_->rigid->press(handles);
  return {handles.front() ? touch(*handles.front()) : Feel{}};
}

Feel Body::touch(const Pose& handle) {
  if (parts_->rigid) {
    parts_->hands.front() = handle;
    return parts_->rigid->press(parts_->hands).front();
  }
  if (!parts_->turns) return touch(handle.position);
  const Vec3 lever = handle.turn * parts_->offset;
  const Vec3 tool = handle.position + lever;
  if (parts_->capsule) return parts_->capsule->at(tool, handle.turn * parts_->axis, handle.position);
  // For sphere and patch the force depends only on the position of the tool's center.
  Feel feel = touch(tool);
  const Mat3 cross =
      (Mat3() << 0, -lever.z(), lever.y(), lever.z(), 0, -lever.x(), -lever.y(), lever.x(), 0).finished();
  // The lever rotates with the handle, so the moment of the force changes.
  const Mat3 turned = lever.dot(feel.force) * Mat3::Identity() - lever * feel.force.transpose();
  feel.torque = {.torque = lever.cross(feel.force),
                 .stiffness = not_negative(cross * feel.stiffness * cross.transpose() + turned)};
  return feel;
}

void Body::tick(double time) {
  if (parts_->made.stiffening != nullptr) parts_->made.stiffening->tick(time);
  if (parts_->cutting) parts_->cut(PlannedCut::When::kTime, time);
}

bool Body::has_clock() const noexcept { return parts_->made.stiffening != nullptr || parts_->cutting; }

Reaction Body::press(Prescribed given, double value) { return parts_->model.press(parts_->patch, given, value); }

Reaction Body::settle(Prescribed given, double value) {
  return softbody::settle(parts_->model, parts_->patch, given, value);
}

SurfaceTable condense(const BodyConfig& config, const SolverOf& solver_of) {
  if (config.model != ModelKind::kCondensed) throw std::invalid_argument("only the model \"condensed\" has a table");
  BodyConfig anew = config;
  anew.table_file.reset();
  anew.tool = PatchTool{.radius = radius_of(config.tool)};
  const Solid solid = solid_of(checked(anew));
  const TouchSurface surface(solid.mesh(), anew.towards_tool, anew.patch_radius);
  const Patch patch = middle_patch(surface, anew.middle);
  const std::unique_ptr<Solver> solver = solver_of(solid);
  const std::vector<int> nodes = touchable(anew, surface);
  CondensedModel model(solid.mesh().nodes.size(), nodes, surface_compliance(solid, surface.normal(), nodes, *solver));
  return {.body = digest_of(solid, surface.normal()),
          .patch_radius = anew.patch_radius,
          .stiffness = stiffness_under(model, patch),
          .linear_up_to = linear_limit(solid, surface, patch, *solver),
          .middle = surface.across(anew.middle),
          .nodes = nodes,
          .compliance = model.table()};
}

Learned learn(const BodyConfig& config, const Tell& tell) {
  if (!config.near.learns()) return {};
  const Solid solid = solid_of(checked(config));
  return learn_of(config, solid, TouchSurface(solid.mesh(), config.towards_tool, config.patch_radius), tell);
}

double Body::linear_up_to() const {
  if (parts_->knows_turns) return std::numeric_limits<double>::infinity();
  if (parts_->made.linear_up_to) return *parts_->made.linear_up_to;
  return linear_limit(parts_->solid, parts_->surface, parts_->patch, *with_factor(parts_->solid));
}

double Body::step() const noexcept { return parts_->model.step(); }

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
          static_cast<std::size_t>(parts_->solid.free_count()), parts_->surface.nodes().size(),
          parts_->model.bytes() + parts_->contact.bytes() + (parts_->capsule ? parts_->capsule->bytes() : 0) +
              (parts_->rigid ? parts_->rigid->bytes() : 0) + (parts_->cutting ? parts_->cutting->cuts.bytes() : 0)};
}

std::optional<NearModel::Size> Body::near_field() const {
  return parts_->made.near == nullptr ? std::nullopt : std::optional(parts_->made.near->size());
}

std::vector<FallbackModel::Step> Body::fallbacks() const {
  return parts_->made.fallbacks == nullptr ? std::vector<FallbackModel::Step>() : parts_->made.fallbacks->steps();
}

Body::Size Body::size_of(const BodyConfig& config, int& under_patch) {
  const Solid solid = solid_of(checked(config));
  const TouchSurface surface(solid.mesh(), config.towards_tool, config.patch_radius);
  under_patch = static_cast<int>(middle_patch(surface, config.middle).nodes.size());
  return {solid.mesh().nodes.size(), static_cast<std::size_t>(solid.mesh().element_count()),
          static_cast<std::size_t>(solid.free_count()), touchable(config, surface).size(), 0};
}

}  // namespace tendon::softbody
