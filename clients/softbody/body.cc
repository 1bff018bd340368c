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
#include "clients/softbody/surface/outside.h"
#include "clients/softbody/touch/capsule.h"
#include "clients/softbody/touch/friction.h"
#include "clients/softbody/touch/rigid_contact.h"
#include "clients/softbody/touch/sphere.h"

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

/// Throws if the config is not valid.
Solid solid_of(const BodyConfig& config) {
  check(config);
  FileMesh read = mesh_of(config);
  Mesh& mesh = read.mesh;
  double lowest = std::numeric_limits<double>::infinity();
  for (const Vec3& node : mesh.nodes) lowest = std::min(lowest, node.z());
  const double held = lowest + std::max(config.clamped_below, 1e-9);
  const Fixed fixed = fix_where(mesh, [&](const Vec3& node) { return node.z() <= held; });
  if (const auto* file = std::get_if<FileShape>(&config.shape)) expect_held(read, fixed, file->file.string());
  const auto* near = std::get_if<NearConfig>(&config.model);
  const Law law = near != nullptr ? near->law : info(config.model).law;
  std::vector<Material> of_elements = materials_of(mesh, config.material, config.regions);
  return {std::move(mesh), config.element, config.material, law, fixed, std::move(of_elements)};
}

/// Whether linear models and plasticity compute their Glide.
bool wants_glide(const BodyConfig& config, const TouchSurface& surface) {
  return config.whole_stiffness || surface.curved();
}

Patch middle_patch(const TouchSurface& surface, const Vec3& middle) {
  if (auto found = surface.patch(surface.across(middle))) return *std::move(found);
  throw std::invalid_argument("the centre of the touched side is not on the body");
}

std::vector<int> touchable(const BodyConfig& config, const TouchSurface& surface) {
  return config.reach ? surface.nodes_of_patches(surface.across(config.middle), *config.reach) : surface.nodes();
}

double stiffness_under(Model& model, const Patch& patch) { return model.press(patch, Prescribed::kForce, 1).stiffness; }

template <class... Models>
using OneOf = std::variant<std::unique_ptr<Models>...>;
using AnyModel =
    OneOf<LinearModel, SolvedModel, CondensedModel, QuasiStaticModel, PlasticModel, NearModel, FallbackModel>;

Model& base_of(const AnyModel& model) {
  return std::visit([](const auto& of) -> Model& { return *of; }, model);
}

template <class Kind>
Kind* as(const AnyModel& model) {
  const auto* found = std::get_if<std::unique_ptr<Kind>>(&model);
  return found != nullptr ? found->get() : nullptr;
}

NearModel* near_in(const AnyModel& model) {
  if (auto* fallbacks = as<FallbackModel>(model)) return &fallbacks->near();
  return as<NearModel>(model);
}

Learned learn_of(const BodyConfig& config, const NearConfig& near, const Solid& solid, const TouchSurface& surface,
                 const Tell& tell) {
  return learn(solid, surface,
               {.shapes = near.learn,
                .answers = near.tabulate,
                .middle = surface.across(config.middle),
                .reach = *config.reach,
                .folder = near.learned_in},
               tell);
}

struct Factory {
  const BodyConfig& config;
  const Solid& solid;
  const TouchSurface& surface;
  Background fields;                    ///< if any, it builds the near fields
  std::optional<double>& linear_up_to;  ///< m, set if a table file provides it

  AnyModel operator()(const LinearConfig& of) const {
    if (of.plasticity) return plastic(newton(of), *of.plasticity);
    return std::make_unique<LinearModel>(solid, surface, config.effects, wants_glide(config, surface));
  }

  AnyModel operator()(const CondensedConfig& of) const {
    if (of.table_file) return condensed_from(*of.table_file);
    return std::make_unique<CondensedModel>(solid, surface, touchable(config, surface), wants_glide(config, surface));
  }

  AnyModel operator()(const CorotationalConfig& of) const {
    if (of.plasticity) return plastic(newton(of), *of.plasticity);
    return std::make_unique<QuasiStaticModel>(solid, surface, newton(of), config.effects);
  }

  AnyModel operator()(const NeoHookeanConfig& of) const {
    return std::make_unique<QuasiStaticModel>(solid, surface, newton(of), config.effects);
  }

  AnyModel operator()(const NearConfig& of) {
    const NearModel::Config made{
        .newton = newton(of),
        .modes = of.exact_interface ? std::numeric_limits<int>::max() : NearModel::Config{}.modes};
    auto near = fields ? std::make_unique<NearModel>(solid, surface, made, std::move(fields))
                       : std::make_unique<NearModel>(solid, surface, middle_patch(surface, config.middle), made);
    if (!of.learns()) return near;
    return std::make_unique<FallbackModel>(levels(of), std::move(near));
  }

 private:
  QuasiStaticModel::Config newton(const auto& of) const {
    QuasiStaticModel::Config made{.max_iterations = of.newton.max_iterations, .tolerance = of.newton.tolerance};
    if constexpr (requires { of.self_collision; }) {
      if (of.self_collision) made.self_collision = config.material.young / *of.self_collision;
    }
    return made;
  }

  AnyModel plastic(QuasiStaticModel::Config newton, const Yield& yield) const {
    newton.glides = wants_glide(config, surface);
    return std::make_unique<PlasticModel>(solid, surface, newton, config.effects, yield);
  }

  /// Throws if the table does not belong to this body, or does not reproduce its recorded stiffness.
  AnyModel condensed_from(const std::filesystem::path& file) const {
    SurfaceTable table = read_table(file);
    const auto refuse = [&](const std::string& why) { throw std::invalid_argument(file.string() + why); };
    if (table.body != digest_of(solid, surface.normal())) {
      refuse(" is the table of another body: create it again with tendon-softbody condense");
    }
    for (const int node : touchable(config, surface)) {
      if (!std::ranges::binary_search(table.nodes, node)) refuse(" does not cover reach_mm");
    }
    linear_up_to = table.linear_up_to;
    const TouchSurface then(solid.mesh(), surface.normal(), table.patch_radius);
    const auto patch = then.patch(table.middle);
    auto model = std::make_unique<CondensedModel>(solid.mesh().nodes.size(), std::move(table.nodes),
                                                  std::move(table.compliance), wants_glide(config, surface));
    constexpr double kSame = 1e-9;  // summation order differs
    if (!patch || !(std::abs(stiffness_under(*model, *patch) / table.stiffness - 1) < kSame)) {
      refuse(" does not reproduce the answers for which it was created");
    }
    return model;
  }

  std::vector<std::unique_ptr<FallbackLevel>> levels(const NearConfig& of) const {
    std::vector<std::unique_ptr<FallbackLevel>> made;
    const Learned learned = of.learned ? *of.learned : learn_of(config, of, solid, surface, {});
    if (of.tabulate && learned.answers) {
      made.push_back(std::make_unique<TabulatedLevel>(*learned.answers, of.newton.tolerance));
    }
    if (of.learn && learned.shapes) {
      made.push_back(std::make_unique<LearnedLevel>(solid, surface, *learned.shapes, of.newton.tolerance));
    }
    return made;
  }
};

AnyModel model_of(const BodyConfig& config, const Solid& solid, const TouchSurface& surface, const SolverOf& solver,
                  Background fields, std::optional<double>& linear_up_to) {
  if (!solver) return std::visit(Factory{config, solid, surface, std::move(fields), linear_up_to}, config.model);
  EffectSet known = info(ModelKind::kLinear).always;
  known.add(kFriction);
  if (!std::holds_alternative<LinearConfig>(config.model) || !effects_of(config).within(known)) {
    throw std::invalid_argument(
        "on several machines, expected the model \"linear\" and no effects except contact and friction");
  }
  return std::make_unique<SolvedModel>(solid, surface, middle_patch(surface, config.middle), solver(solid));
}

std::unique_ptr<Friction> friction_of(const BodyConfig& config) {
  if (!config.friction) return nullptr;
  return std::make_unique<Friction>(*config.friction, sideways_stiffness(config.material, config.patch_radius));
}

constexpr double kPointsAcrossTool = 4;  ///< thinner tools slip off the points of the layer (layer.h)

struct HeldCapsule {
  CapsuleContact contact;
  Vec3 axis;
};
struct RigidHands {
  RigidContact contact;
  std::vector<std::optional<Pose>> handles;
};
using Contact = std::variant<PatchContact, SphereContact, HeldCapsule, RigidHands>;

RigidHands rigid_hands_of(const BodyConfig& config, QuasiStaticModel& body, const Solid& solid,
                          const TouchSurface& surface) {
  const RigidShape shape = shape_of(config.tool, config.layer);
  const Newton& newton = *newton_of(config.model);
  RigidContact::Config made;
  made.layer = {.thickness = config.layer,
                .young = config.material.young,
                .friction = config.friction.value_or(0),
                .shear = config.material.mu(),
                .piece = std::min(shape.reach() / 10, shape.thinnest() / kPointsAcrossTool)};
  made.tolerance = newton.tolerance;
  made.max_iterations = newton.max_iterations;
  made.turns = turns_the_hand(config);
  return {RigidContact(body, solid, surface, std::vector<HeldTool>(config.hands, {shape, config.tool_offset}), made),
          std::vector<std::optional<Pose>>(config.hands)};
}

/// check() ensures that the model for a rigid tool is condensed or Newton's method without plasticity.
Contact contact_of(const BodyConfig& config, const AnyModel& made, Model& model, const Solid& solid,
                   const TouchSurface& surface) {
  const double radius = radius_of(config.tool);
  if (is_patch(config.tool)) {
    return PatchContact(model, surface, radius, config.side, friction_of(config));
  }
  if (auto* newton = as<QuasiStaticModel>(made)) return rigid_hands_of(config, *newton, solid, surface);
  if (is_sphere(config.tool)) return SphereContact(*as<CondensedModel>(made), surface, radius);
  const auto& capsule = std::get<CapsuleTool>(config.tool);
  return HeldCapsule{CapsuleContact(solid, surface, touchable(config, surface), radius, capsule.half_length),
                     capsule.axis};
}

std::size_t bytes_of(const Contact& contact) {
  if (const auto* patch = std::get_if<PatchContact>(&contact)) return patch->bytes();
  if (const auto* capsule = std::get_if<HeldCapsule>(&contact)) return capsule->contact.bytes();
  if (const auto* rigid = std::get_if<RigidHands>(&contact)) return rigid->contact.bytes();
  return 0;
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

struct Body::Parts {
  Parts(const BodyConfig& config, const SolverOf& solver) : Parts(config, solver, solid_of(config)) {
    if (!config.cuts.empty()) cutting = std::make_unique<Planned>(config, solid.mesh(), solid.fixed(), surface);
  }
  Parts(const BodyConfig& config, const SolverOf& solver, Solid of, Background fields = {})
      : solid(std::move(of)),
        surface(solid.mesh(), config.towards_tool, config.patch_radius),
        made(model_of(config, solid, surface, solver, std::move(fields), linear_up_to)),
        stiffening(config.stiffening ? std::make_unique<StiffeningModel>(base_of(made), *config.stiffening) : nullptr),
        model(stiffening ? *stiffening : base_of(made)),
        contact(contact_of(config, made, model, solid, surface)),
        patch(middle_patch(surface, config.middle)),
        knows_turns(info(config.model).always.has(kGeometricNonlinearity)),
        turns(turns_the_hand(config)),
        offset(config.tool_offset) {}

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
  std::optional<double> linear_up_to{};  ///< m, if a table file provides it
  AnyModel made;
  std::unique_ptr<StiffeningModel> stiffening;
  Model& model;
  Contact contact;
  Patch patch;
  bool knows_turns;
  bool turns;
  Vec3 offset;
  std::unique_ptr<Planned> cutting;
  std::vector<int> node_before{};  ///< set if the body was prepared in the background
};

/// Makes all cuts on a mesh first, so that an invalid plan is an error at the start.
Body::Parts::Planned::Planned(const BodyConfig& config, const Mesh& mesh, const Fixed& fixed,
                              const TouchSurface& surface)
    : cuts(config.cuts), described(config) {
  // Precomputed data is invalid after a cut.
  if (auto* near = std::get_if<NearConfig>(&described.model)) near->learned.emplace();
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
  if (auto* near = near_in(made)) near->make_no_more_fields();
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
  std::get<PatchContact>(contact).go_on_from(std::get<PatchContact>(before.contact));  // no other tool can cut
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
  if (auto* near = near_in(parts_->made)) near->make_fields_by(background);
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
  if (std::holds_alternative<RigidHands>(parts_->contact)) return touch(Pose{.position = tool - parts_->offset});
  if (parts_->cutting) take_prepared();
  if (auto* capsule = std::get_if<HeldCapsule>(&parts_->contact)) return capsule->contact.at(tool, capsule->axis, tool);
  if (auto* sphere = std::get_if<SphereContact>(&parts_->contact)) return sphere->at(tool);
  Feel feel = std::get<PatchContact>(parts_->contact).at(tool);
  if (parts_->cutting) parts_->note(feel);
  return feel;
}

std::vector<Feel> Body::touch(std::span<const std::optional<Pose>> handles) {
  if (auto* rigid = std::get_if<RigidHands>(&parts_->contact)) return rigid->contact.press(handles);
  return {handles.front() ? touch(*handles.front()) : Feel{}};
}

Feel Body::touch(const Pose& handle) {
  if (auto* rigid = std::get_if<RigidHands>(&parts_->contact)) {
    rigid->handles.front() = handle;
    return rigid->contact.press(rigid->handles).front();
  }
  if (!parts_->turns) return touch(handle.position);
  const Vec3 lever = handle.turn * parts_->offset;
  const Vec3 tool = handle.position + lever;
  if (auto* capsule = std::get_if<HeldCapsule>(&parts_->contact)) {
    return capsule->contact.at(tool, handle.turn * capsule->axis, handle.position);
  }
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
  if (parts_->stiffening) parts_->stiffening->tick(time);
  if (parts_->cutting) parts_->cut(PlannedCut::When::kTime, time);
}

bool Body::has_clock() const noexcept { return parts_->stiffening || parts_->cutting; }

Reaction Body::press(Prescribed given, double value) { return parts_->model.press(parts_->patch, given, value); }

Reaction Body::settle(Prescribed given, double value) {
  return softbody::settle(parts_->model, parts_->patch, given, value);
}

SurfaceTable condense(const BodyConfig& config, const SolverOf& solver_of) {
  if (!std::holds_alternative<CondensedConfig>(config.model)) {
    throw std::invalid_argument("only the model \"condensed\" has a table");
  }
  BodyConfig anew = config;
  anew.model = CondensedConfig{};
  anew.tool = PatchTool{.radius = radius_of(config.tool)};
  const Solid solid = solid_of(anew);
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
  if (!learns(config)) return {};
  const Solid solid = solid_of(config);
  const TouchSurface surface(solid.mesh(), config.towards_tool, config.patch_radius);
  return learn_of(config, std::get<NearConfig>(config.model), solid, surface, tell);
}

double Body::linear_up_to() const {
  if (parts_->knows_turns) return std::numeric_limits<double>::infinity();
  if (parts_->linear_up_to) return *parts_->linear_up_to;
  return linear_limit(parts_->solid, parts_->surface, parts_->patch, *with_factor(parts_->solid));
}

double Body::step() const noexcept { return parts_->model.step(); }

Vec3 Body::touch_point() const { return place_of(parts_->solid.mesh(), parts_->patch); }

const Vec3& Body::normal() const { return parts_->surface.normal(); }

Triangles Body::rest_shape() const { return outside(parts_->solid.mesh()); }

Body::Size Body::size() const {
  return {parts_->solid.mesh().nodes.size(), static_cast<std::size_t>(parts_->solid.mesh().element_count()),
          static_cast<std::size_t>(parts_->solid.free_count()), parts_->surface.nodes().size(),
          parts_->model.bytes() + bytes_of(parts_->contact) + (parts_->cutting ? parts_->cutting->cuts.bytes() : 0)};
}

std::optional<NearModel::Size> Body::near_field() const {
  const NearModel* near = near_in(parts_->made);
  return near == nullptr ? std::nullopt : std::optional(near->size());
}

std::vector<FallbackModel::Step> Body::fallbacks() const {
  const auto* fallbacks = as<FallbackModel>(parts_->made);
  return fallbacks == nullptr ? std::vector<FallbackModel::Step>() : fallbacks->steps();
}

Body::Size Body::size_of(const BodyConfig& config, int& under_patch) {
  const Solid solid = solid_of(config);
  const TouchSurface surface(solid.mesh(), config.towards_tool, config.patch_radius);
  under_patch = static_cast<int>(middle_patch(surface, config.middle).nodes.size());
  return {solid.mesh().nodes.size(), static_cast<std::size_t>(solid.mesh().element_count()),
          static_cast<std::size_t>(solid.free_count()), touchable(config, surface).size(), 0};
}

}  // namespace tendon::softbody
