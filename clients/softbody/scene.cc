// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/scene.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <variant>
#include <vector>

#include "clients/softbody/fem/file_text.h"
#include "server/scene/reader.h"
#include "server/scene/reference.h"
#include "server/scene/values.h"

// The keys are declared in the same way as those of a server's scene, see server/scene.

namespace tendon::softbody {
namespace {

using namespace scene_file;
using enum EffectKind;

constexpr Number up_to(double most) { return {.least = 0, .most = most, .without_least = true}; }
constexpr Number kLength = up_to(1e6);  // larger values are in a wrong unit
constexpr Number kLengthOrZero{.least = 0, .most = 1e6};
constexpr Vector kPoint{.each = {.least = -1e6, .most = 1e6}};
constexpr std::size_t kMostTables = 1000;

struct Direction : Vector {
  Verdict take(const toml::node& node, const Unit& unit, Vec3& to) const {
    Vec3 vector;
    if (auto refusal = Vector::take(node, unit, vector)) return refusal;
    if (!(vector.norm() > 1e-6)) return Refusal{&node, "a direction [x, y, z] other than zero"};
    to = vector.normalized();
    return {};
  }
};
constexpr Direction kDirection{kPoint};

struct Text {
  std::string_view what;

  std::string expected(const Unit&) const { return std::string(what); }
  Verdict take(const toml::node& node, const Unit& unit, std::string& to) const {
    const auto* text = node.as_string();
    if (text == nullptr || (*text)->empty()) return Refusal{&node, expected(unit)};
    to = **text;
    return {};
  }
  static std::string shown(const Unit&, const std::string& value) { return in_quotes(value); }
};

struct ModelNames : Names<ModelKind> {
  Verdict take(const toml::node& node, const Unit& unit, ModelKind& to) const {
    constexpr std::array<std::string_view, 7> kOfTheLab = {"stvk",        "mass-spring", "projective", "modal",
                                                           "tensor-mass", "tled",        "xpbd"};
    Verdict refusal = Names::take(node, unit, to);
    const auto* name = node.as_string();
    if (refusal && name != nullptr && std::ranges::count(kOfTheLab, std::string_view(**name)) > 0) {
      refusal->hint = ", which is only a model of the accuracy experiment (tests/tools/lab/models)";
    }
    return refusal;
  }
};

template <class Info, class T>
Names<T> all_names(std::span<const Info> infos, T Info::*value) {
  Names<T> names;
  for (const Info& each : infos) names.all.emplace_back(each.name, each.*value);
  return names;
}

template <class Info>
std::string described(std::string text, std::span<const Info> infos) {
  for (const Info& each : infos) text.append("\n          ").append(each.name).append(": ").append(each.what);
  return text;
}

struct Draft {
  std::filesystem::path directory{};
  std::vector<EffectKind> listed{};
  Scene scene{};

  bool lists(EffectKind effect) const { return std::ranges::count(listed, effect) > 0; }
};

/// Paths are relative to the scene.
template <class Table, class Target>
void declare_path(Table& keys, std::string_view name, const Draft& draft, Target& target, std::string_view meaning,
                  const Absent& absent) {
  std::filesystem::path file;
  if (keys.key(name, file, Path{}, meaning, absent)) target = draft.directory / file;
}

template <class Table>
void declare_units(Table& keys, std::string_view name, double& scale) {
  double units = 1;
  keys.key(name, units, up_to(1e9), "Number of the file's units in a metre: 1000 if it is in mm", kRequired);
  scale = 1 / units;
}

template <class Table>
void declare_listed(Table& root, Draft& draft) {
  root.key("effects", draft.listed, ListOf<Names<EffectKind>>{all_names(effects(), &EffectInfo::kind)},
           described("Simulated effects. All others are off, and their keys are unknown:", effects()), kRequired);
}

template <class Table>
void declare_effects(Table& root, Draft& draft) {
  BodyConfig& body = draft.scene.body;
  EffectsConfig& config = body.effects;
  const auto has = [&](auto... of) { return Table::kDocuments || (draft.lists(of) || ...); };
  config.inertia = draft.lists(kInertia);
  if (has(kGravity)) {
    root.key("gravity_m_per_s2", config.gravity.emplace(0.0, 0.0, -9.81), kPoint,
             "With gravity: its acceleration, in the body's frame");
  }
  if (has(kDamping)) {
    root.key("damping_per_s", config.damping, up_to(1e6), "With damping: viscous drag per mass", kRequired);
  }
  if (has(kViscosity)) {
    root.key("viscosity_ms", config.viscosity, up_to(1e6),
             "With viscosity: time constant of a Kelvin-Voigt material, in which a strain rate acts like a strain",
             kRequired);
  }
  if (has(kFriction)) {
    root.key("friction", body.friction, Number{.least = 0, .most = 10},
             "With friction: Coulomb coefficient of the tool on the surface", kRequired);
  }
  if (has(kInertia, kDamping, kViscosity)) {
    root.key("step_ms", config.step, up_to(1e3), "With inertia, damping or viscosity: time simulated by one step",
             kRequired);
  }
  if (has(kCutting)) {
    root.tables("cutting", body.cuts, kMostTables, [](Table& keys, PlannedCut& cut) {
      keys.key("corner_mm", cut.cut.corner, kPoint,
               "Corner of a parallelogram, in the body's frame at rest. The cuts are made in order and follow the "
               "faces of elements",
               kRequired);
      keys.key("along_mm", cut.cut.along, kPoint, "First side from the corner", kRequired);
      keys.key("deep_mm", cut.cut.deep, kPoint, "Second side from the corner", kRequired);
      const bool timed = keys.either("at_s", "above_n");
      cut.when = timed ? PlannedCut::When::kTime : PlannedCut::When::kForce;
      if (timed) {
        keys.key("at_s", cut.value, Number{.least = 0, .most = 1e9}, "Time of the cut after the first answer",
                 Absent{.text = "required, or above_n"});
      }
      if (Table::kDocuments || !timed) {
        keys.key("above_n", cut.value, up_to(1e6),
                 "Force along the normal. The cut is made after an answer with a larger force",
                 Absent{.text = "required, or at_s"});
      }
    });
  }
  if (has(kStiffening)) {
    root.table("stiffening", [&body](Table& keys) {
      StiffnessOverTime& law = body.stiffening.emplace();
      keys.key("at_s", law.at, ListOf<Number>{kZeroOrMore}, "Times after the first answer", kRequired);
      keys.key("factor", law.factor, ListOf<Number>{kAboveZero},
               "Factors of Young's modulus at these times. It is linear in between", kRequired);
    });
  }
  if (has(kPlasticity)) {
    root.table("plasticity", [&body](Table& keys) {
      Yield yield;
      keys.key("yield_pa", yield.stress, kAboveZero, "Yield stress of a bar", kRequired);
      keys.key("hardening_pa", yield.hardening, kAboveZero,
               "Hardening modulus H. After yielding, the modulus of a bar is E H/(E + H), and E on unloading",
               kRequired);
      set_plasticity(body.model, yield);
    });
  }
  if (has(kSelfCollision)) {
    root.table("self-collision", [&body](Table& keys) {
      std::optional<double> layer;
      keys.key("layer_mm", layer, kLength, "Penetration of two sides at which their pressure is Young's modulus",
               kRequired);
      set_self_collision(body.model, layer);
    });
  }
}

template <class Table>
void declare_material(Table& of, Material& material, double* density) {
  of.table("material", [&](Table& keys) {
    keys.key("young_pa", material.young, kAboveZero, "Young's modulus", kRequired);
    keys.key("poisson", material.poisson, Number{.least = 0, .most = 0.4999}, "Poisson's ratio", kRequired);
    if (density == nullptr) return;
    keys.key("density_kg_per_m3", *density, up_to(1e6), "With gravity, inertia or damping: density of the whole body",
             kRequired);
  });
}

enum class ShapeKind : std::uint8_t { kBlock, kCylinder, kFile };

template <class Table>
void declare_body(Table& root, Draft& draft) {
  BodyConfig& body = draft.scene.body;
  root.table("body", [&](Table& keys) {
    constexpr Count kCells{200, 1};
    ShapeKind kind{};
    const Names<ShapeKind> kinds{
        {{"block", ShapeKind::kBlock}, {"cylinder", ShapeKind::kCylinder}, {"file", ShapeKind::kFile}}};
    const bool known = keys.key("shape", kind, kinds, "Shape of the body", kRequired);
    keys.key("element", body.element, all_names(elements(), &ElementInfo::element),
             described("Type of the elements:", elements()), kRequired);
    if (!known || kind == ShapeKind::kBlock) {
      auto& block = body.shape.emplace<BlockShape>();
      keys.key("size_mm", block.size, Vector{kLength}, "For a block: lengths of its edges", kRequired);
      keys.key("cells", block.cells, ListOf<Count>{kCells, "[nx, ny, nz]"}, "For a block: number of cells on each edge",
               kRequired);
    }
    if (!known || kind == ShapeKind::kCylinder) {
      auto& cylinder = body.shape.emplace<CylinderShape>();
      keys.key("radius_mm", cylinder.radius, kLength, "For a cylinder: its radius", kRequired);
      keys.key("height_mm", cylinder.height, kLength, "For a cylinder: its height", kRequired);
      keys.key("cells_across", cylinder.across, kCells, "For a cylinder: number of cells across it, an even number",
               kRequired);
      keys.key("cells_up", cylinder.up, kCells, "For a cylinder: number of cells along its axis", kRequired);
    }
    if (!known || kind == ShapeKind::kFile) {
      auto& file = body.shape.emplace<FileShape>();
      declare_path(keys, "file", draft, file.file, "For a file: a mesh of gmsh, relative to the scene", kRequired);
      declare_units(keys, "units_per_m", file.scale);
      keys.key("slits", file.slits, YesNo{}, "For a file: keep nodes at the same place separate instead of merging");
    }
    keys.key("clamped_below_mm", body.clamped_below, kLengthOrZero,
             "Height above the lowest node up to which nodes are fixed. The lowest nodes always are");
    const bool heavy = Table::kDocuments || body.effects.gravity || body.effects.inertia || body.effects.damping;
    declare_material(keys, body.material, heavy ? &body.effects.density : nullptr);
  });
  root.tables("region", body.regions, kMostTables, [](Table& keys, Region& region) {
    Vec3 middle = Vec3::Zero();
    keys.key("middle_mm", middle, kPoint,
             "Centre of a part of another material, in the body's frame at rest. It has the elements whose centre is "
             "inside. Where two overlap, the later one is used",
             kRequired);
    const bool is_ball = keys.either("radius_mm", "size_mm");
    if (is_ball) {
      auto& ball = region.where.emplace<Region::Ball>();
      ball.middle = middle;
      keys.key("radius_mm", ball.radius, kLength, "Radius of a ball", Absent{.text = "required, or size_mm"});
    }
    if (Table::kDocuments || !is_ball) {
      auto& box = region.where.emplace<Region::Box>();
      box.middle = middle;
      keys.key("size_mm", box.size, Vector{kLength}, "Size of a box", Absent{.text = "required, or radius_mm"});
    }
    declare_material(keys, region.material, nullptr);
  });
}

template <class Table>
void declare_model(Table& root, Draft& draft) {
  BodyConfig& body = draft.scene.body;
  root.table("model", [&](Table& keys) {
    const ModelNames kinds{all_names(models(), &ModelInfo::kind)};
    ModelKind kind{};
    const bool known = keys.key("kind", kind, kinds, described("Model of the body:", models()), kRequired);
    if (known) body.model = model_config(kind);
    // The keys of all models are known if the model is not.
    CondensedConfig no_condensed;
    NearConfig no_near;
    Newton no_newton;
    auto* const condensed = known ? std::get_if<CondensedConfig>(&body.model) : &no_condensed;
    auto* const near = known ? std::get_if<NearConfig>(&body.model) : &no_near;
    if (condensed != nullptr) {
      declare_path(keys, "table", draft, condensed->table_file,
                   "For condensed: file written by `tendon-softbody condense` or `tendon-fem condense`",
                   Absent{.text = "the table is computed at the start"});
    }
    if (near != nullptr) {
      keys.key("law", near->law, all_names(near_laws(), &NearLaw::law),
               "For near: law of the elements near the tool; the rest is linear. \"neo-hookean\" requires "
               "material-nonlinearity");
      keys.key("learn", near->learn, YesNo{},
               "For near: solve presses within reach_mm at the start, and approximate all others by a few shapes. "
               "Where the error is larger than error_percent, and after a cut, the near field is used");
      keys.key("tabulate", near->tabulate, YesNo{},
               "For near: compute a table of the energy from the same presses, which is used before the shapes");
      if (near->learns()) near->newton.tolerance = NearConfig::kErrorOfLearned;
      if (Table::kDocuments || near->learns()) {
        declare_path(keys, "learned_in", draft, near->learned_in,
                     "With learn or tabulate: folder of the results, relative to the scene",
                     Absent{.text = "nothing is stored"});
      }
    }
    if (!known || draft.lists(kPlasticity) || info(kind).law != Law::kLinear) {
      Newton* const found = newton_of(body.model);
      Newton& newton = found != nullptr ? *found : no_newton;
      keys.key("max_iterations", newton.max_iterations, Count{1000, 1},
               "For corotational, neo-hookean, near, and linear with plasticity: iterations of one answer");
      keys.key("error_percent", newton.tolerance, up_to(10),
               "For the same models: accepted error of the force. The estimated error is part of the answer; near "
               "adds that of the linear far field",
               Absent{.text = "0.0001; with learn or tabulate 2"});
    }
  });
}

enum class ToolKind : std::uint8_t { kPatch, kSphere, kCapsule, kBox, kMesh };

template <class Table>
void declare_tool(Table& keys, Draft& draft) {
  Tool& tool = draft.scene.body.tool;
  ToolKind kind{};
  const Names<ToolKind> kinds{{{"patch", ToolKind::kPatch},
                               {"sphere", ToolKind::kSphere},
                               {"capsule", ToolKind::kCapsule},
                               {"box", ToolKind::kBox},
                               {"mesh", ToolKind::kMesh}}};
  keys.key("tool", kind, kinds,
           "All tools except the patch are rigid, with a contact that grows with the depth. sphere and capsule are for "
           "condensed without friction, corotational and neo-hookean; box and mesh for the last two");
  double radius = 0;
  keys.key("tool_radius_mm", radius, kLengthOrZero,
           "Radius of a sphere or a capsule, or distance at which a patch touches");
  if (kind == ToolKind::kPatch) tool = PatchTool{radius};
  if (kind == ToolKind::kSphere) tool = SphereTool{radius};
  if (Table::kDocuments || kind == ToolKind::kCapsule) {
    CapsuleTool capsule{.radius = radius, .half_length = 0};
    double length = 0;
    keys.key("tool_length_mm", length, kLengthOrZero,
             "For a capsule: distance between the centres of its ends; 0 is a ball", kRequired);
    keys.key("tool_axis", capsule.axis, kDirection, "For a capsule: direction from end to end, in the handle's frame");
    capsule.half_length = length / 2;
    tool = capsule;
  }
  if (Table::kDocuments || kind == ToolKind::kBox) {
    BoxTool box{};
    const bool sized = keys.key("tool_size_mm", box.size, Vector{kLength},
                                "For a box: lengths of its edges along the handle's axes", kRequired);
    keys.key("tool_edge_mm", box.edge, sized ? up_to(1e3 * box.size.minCoeff() / 2) : kLength,
             "For a box: radius of its edges and corners, at most half of its shortest edge", kRequired);
    tool = box;
  }
  if (Table::kDocuments || kind == ToolKind::kMesh) {
    MeshTool mesh{};
    declare_path(keys, "tool_file", draft, mesh.file,
                 "For a mesh: closed surface (.stl, .obj, .off) around the tool's centre, along the handle's axes",
                 kRequired);
    declare_units(keys, "tool_units_per_m", mesh.scale);
    keys.key("tool_cell_mm", mesh.cell, kLength,
             "For a mesh: cell size of its distance grid, at most half of its thinnest part", kRequired);
    tool = mesh;
  }
}

template <class Table>
void declare_touch(Table& root, Draft& draft) {
  using Side = PatchContact::Side;
  BodyConfig& body = draft.scene.body;
  root.table("touch", [&](Table& keys) {
    keys.key("from", body.towards_tool, kDirection, "Direction to the tool, in the body's frame");
    keys.key("middle_mm", body.middle, kPoint, "Centre of the touched side. Only its place across `from` is used");
    const bool sized = keys.key("patch_radius_mm", body.patch_radius, kLength,
                                "Radius of the patch on which the tool presses", kRequired);
    const bool learned = learns(body);
    const bool bounded = learned && sized;
    keys.key("reach_mm", body.reach, bounded ? up_to(1e3 * NearConfig::kFarthest * body.patch_radius) : kLength,
             "For condensed: maximum distance of the tool from the centre. For near with learn or tabulate: range "
             "along each axis, at most 1.5 patch radii",
             Absent{.required = learned, .text = "no limit; required with learn or tabulate"});
    declare_tool(keys, draft);
    keys.key("tool_offset_mm", body.tool_offset, kPoint,
             "From the handle to the tool's centre, in the handle's frame. With an offset, a capsule, a box or a mesh, "
             "there is a torque on the handle");
    if (Table::kDocuments || is_rigid_on_nonlinear(body)) {
      keys.key("layer_mm", body.layer, kLength,
               "For rigid tools on corotational and neo-hookean: thickness of the contact layer");
    }
    keys.key("side", body.side, Names<Side>{{{"unilateral", Side::kUnilateral}, {"bilateral", Side::kBilateral}}},
             "Bilateral: after the first touch, the tool sticks to the body and can pull");
    const bool can_leave_out = info(body.model).law == Law::kLinear || draft.lists(kPlasticity);
    if (Table::kDocuments || (can_leave_out && is_patch(body.tool) && !body.effects.has_time())) {
      keys.key("whole_stiffness", body.whole_stiffness, YesNo{},
               "For a patch on linear, condensed or with plasticity, at rest: send the complete stiffness of a flat "
               "surface, as it is always done for curved surfaces and Newton's method");
    }
    keys.key("table_mm", draft.scene.table, kLength,
             "For condensed, unilateral, without friction: answers contain the force at 16 depths within this "
             "distance, for slow networks. This costs 16 more answers",
             Absent{.text = "no table"});
  });
}

template <class Table>
void declare_hands(Table& root, Scene& scene) {
  root.tables("hands", scene.hands, kMostTables, [](Table& keys, Scene::Hand& hand) {
    keys.key("device", hand.device, Text{"the name of a device"},
             "Device of this hand. Two or more hands at the body, for rigid tools on corotational and neo-hookean",
             kRequired);
    keys.key("server", hand.server, Text{"HOST:PORT"}, "Server of this device",
             Absent{.text = "the server of the command line"});
    keys.key("at_mm", hand.at, kPoint, "As at_mm of [place], in the frame of this device", kRequired);
  });
  root.table("place", [&scene](Table& keys) {
    if (scene.hands.empty()) {
      keys.key("at_mm", scene.at, kPoint, "Centre of the touched side, in the frame of the device; without [[hands]]");
    }
    keys.key("towards_hand", scene.towards_hand, kDirection, "Direction from there to the hand, in the same frame");
  });
}

template <class Table>
void declare_field(Table& root, Scene& scene) {
  root.part(Name{"field", "the server renders the body at rest"}, scene.field, [](Table& keys, Scene::Upload& field) {
    keys.key("stiffness_n_per_m", field.stiffness, up_to(1e12),
             "Upload the body's shape at rest, which the server then renders with this stiffness and without the delay "
             "of the network. The answers correct it. `explain` prints the stiffness at first touch",
             kRequired);
    keys.key("friction", field.friction, Number{.least = 0, .most = 2}, "Coulomb coefficient of the shape");
    keys.key("spacing_mm", field.spacing, Number{.least = 0.25, .most = 8},
             "Distance of the samples. Walls must be at least twice as thick");
    keys.key("relax_s", field.relaxation, Number{.least = 0.01, .most = 10},
             "Time constant of a second spring, whose force decays", Absent{.text = "no second spring"});
    keys.key("branch_n_per_m", field.branch_stiffness, up_to(1e12), "With relax_s: stiffness of the second spring",
             Absent{.text = "stiffness_n_per_m"});
  });
}

/// The list must contain all effects that the model always simulates, and only effects that it supports.
void check_effects(const SceneErrors& errors, const Draft& draft) {
  const BodyConfig& body = draft.scene.body;
  const ModelInfo& model = info(body.model);
  const std::string of_model = "the model " + in_quotes(model.name);
  EffectSet before;
  for (std::size_t i = 0; i < draft.listed.size(); ++i) {
    const EffectInfo& effect = info(draft.listed[i]);
    const std::string name = in_quotes(effect.name);
    const auto refuse = [&](const std::string& why) {
      errors.blame("effects", {"effects[" + std::to_string(i) + "]"}, why);
    };
    if (before.has(effect.kind)) refuse(name + " is listed twice");
    if (!model.always.has(effect.kind) && !model.may.has(effect.kind)) {
      refuse(of_model + " does not simulate " + name + ", which is listed");
    }
    for (const EffectInfo& other : effects()) {
      if (before.has(other.kind) && (effect.not_with.has(other.kind) || other.not_with.has(effect.kind))) {
        refuse(name + " cannot be simulated together with " + in_quotes(other.name));
      }
    }
    before.add(effect.kind);
  }
  for (const EffectInfo& effect : effects()) {
    if (!model.always.has(effect.kind) || before.has(effect.kind)) continue;
    errors.blame("effects", {}, of_model + " simulates " + in_quotes(effect.name) + ", which is not listed");
  }
  const auto* near = std::get_if<NearConfig>(&body.model);
  if (near == nullptr || (near->law == Law::kNeoHookean) == before.has(kMaterialNonlinearity)) return;
  errors.blame("effects", {},
               near->law == Law::kNeoHookean
                   ? "the law \"neo-hookean\" simulates \"material-nonlinearity\", which is not listed"
                   : "the law does not simulate \"material-nonlinearity\", which is listed: only \"neo-hookean\" does");
}

void check_field(const SceneErrors& errors, const Draft& draft) {
  const BodyConfig& body = draft.scene.body;
  const auto refuse = [&](const std::string& why) { errors.blame("field", {}, why); };
  if (!draft.scene.hands.empty()) refuse("expected one hand, because a field has one holder");
  if (draft.lists(kCutting)) refuse("expected a body without cutting, because the field is its uncut shape");
  if (body.side == PatchContact::Side::kBilateral) refuse("expected a unilateral side, because a field cannot pull");
  if (turns_the_hand(body))
    refuse("expected a patch or a sphere without tool_offset_mm, because a field has no torque");
  if (draft.scene.field->branch_stiffness && !draft.scene.field->relaxation) {
    errors.blame("field.branch_n_per_m", {}, "expected relax_s");
  }
}

void check_values(const SceneErrors& errors, const Draft& draft) {
  const BodyConfig& body = draft.scene.body;
  if (draft.lists(kCutting) && body.cuts.empty()) {
    errors.blame("cutting", {}, "missing, expected one or more tables [[cutting]]");
  }
  if (body.stiffening) errors.build("stiffening", [&] { check(*body.stiffening); });
  const bool remembers = !std::holds_alternative<CondensedConfig>(body.model) ||
                         body.side != PatchContact::Side::kUnilateral || body.friction;
  if (draft.scene.table > 0 && remembers) {
    errors.blame(
        "touch.table_mm", {},
        "expected the model condensed, unilateral and without friction, because the others depend on the past");
  }
  const std::vector<Scene::Hand>& hands = draft.scene.hands;
  if (draft.scene.field) check_field(errors, draft);
  if (hands.size() == 1) errors.blame("hands", {}, "expected two or more; omit [[hands]] for one hand");
  for (std::size_t i = 0; i < hands.size(); ++i) {
    const auto same = [&](const Scene::Hand& other) {
      return other.device == hands[i].device && other.server == hands[i].server;
    };
    if (std::ranges::count_if(hands, same) == 1) continue;
    errors.blame("hands[" + std::to_string(i) + "]", {},
                 "expected a different device for each hand, found twice " + in_quotes(hands[i].device));
  }
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory) {
  const toml::table file = parse_toml(text, name);
  const SceneErrors errors(file, name);
  SceneProblems problems;
  Reader root(problems, &file, "", {});
  Draft draft{.directory = directory};
  declare_listed(root, draft);
  declare_model(root, draft);
  problems.throw_first(name);
  check_effects(errors, draft);  // before any key is called unknown because its effect is not listed
  declare_effects(root, draft);
  declare_body(root, draft);
  declare_touch(root, draft);
  declare_hands(root, draft.scene);
  declare_field(root, draft.scene);
  root.refuse_unknown();
  problems.throw_first(name);
  check_values(errors, draft);
  Scene& scene = draft.scene;
  if (!scene.hands.empty()) {
    scene.body.hands = scene.hands.size();
    scene.at = scene.hands.front().at;
  }
  return std::move(scene);
}

std::string scene_reference() {
  std::string text;
  Reference root(text);
  Draft draft;
  declare_listed(root, draft);
  declare_effects(root, draft);
  declare_model(root, draft);
  declare_body(root, draft);
  declare_touch(root, draft);
  declare_hands(root, draft.scene);
  declare_field(root, draft.scene);
  return text;
}

Scene read_scene(const std::filesystem::path& file) {
  std::string text;
  try {
    text = read_file(file, kMaxSceneBytes);
  } catch (const std::invalid_argument& refused) {
    throw std::runtime_error(refused.what());
  }
  return parse_scene(text, file.string(), file.parent_path());
}

Mat3 to_device(const Scene& scene) { return shortest_rotation(scene.body.towards_tool, scene.towards_hand); }

}  // namespace tendon::softbody
