// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/scene.h"

#include <toml++/toml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iomanip>
#include <limits>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "clients/softbody/fem/file_text.h"

namespace tendon::softbody {
namespace {

/// toml++ recurses: even a small file of brackets could overflow the stack.
constexpr std::uintmax_t kMaxSceneBytes = 16'384;
constexpr double kMaxLength = 1e3;  // m: a larger value is a mistaken unit
constexpr std::int64_t kMaxCells = 200;
constexpr double kMaxError = 10;  // %: more is felt

template <class Infos>
std::string names(const Infos& infos) {
  std::string all;
  for (const auto& each : infos) all.append(all.empty() ? "" : ", ").append(each.name);
  return all;
}

/// A table of a scene. Keys become known by being asked for; at the end, keys that were never asked for are errors.
class Table {
 public:
  Table(const toml::table& table, std::string path, const std::string& file)
      : table_(table), path_(std::move(path)), file_(file) {}

  [[noreturn]] void fail(const toml::node& node, std::string_view key, const std::string& what) const {
    std::ostringstream text;
    text << file_ << ':' << node.source().begin.line << ": " << path_ << key << ": " << what;
    throw SceneError(text.str());
  }

  const toml::node* find(std::string_view key) {
    known_.emplace(key);
    return table_.get(key);
  }

  const toml::node& need(std::string_view key, std::string_view expected) {
    if (const toml::node* node = find(key)) return *node;
    missing(key, expected);
  }

  [[noreturn]] void missing(std::string_view key, std::string_view expected) {
    throw SceneError(file_ + ": " + path_ + std::string(key) + ": expected " + std::string(expected) +
                     ", found nothing");
  }

  /// A number above `least` (or equal to it, with `or_equal`) and not above `most`, divided by `per_si`.
  double number(std::string_view key, double least, bool or_equal, double most, double per_si,
                std::optional<double> otherwise = {}) {
    std::ostringstream expected;
    expected << "a number " << (or_equal ? "of at least " : "above ") << least << " and at most " << most;
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (otherwise) return *otherwise;
      missing(key, expected.str());
    }
    const std::optional<double> value = node->value<double>();
    const bool good = value && (or_equal ? *value >= least : *value > least) && *value <= most;
    if (!good || node->is_boolean()) fail(*node, key, "expected " + expected.str());
    return *value / per_si;
  }

  /// A length in mm above 0.
  double length(std::string_view key) { return number(key, 0, false, 1e3 * kMaxLength, 1e3); }

  /// false where it is left out.
  bool flag(std::string_view key) {
    const toml::node* node = find(key);
    if (node == nullptr) return false;
    const auto* value = node->as_boolean();
    if (value == nullptr) fail(*node, key, "expected true or false");
    return **value;
  }

  int count(std::string_view key, std::int64_t most, std::optional<int> otherwise = {}) {
    const std::string expected = "a whole number from 1 to " + std::to_string(most);
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (otherwise) return *otherwise;
      missing(key, expected);
    }
    const auto* whole = node->as_integer();
    if (whole == nullptr || **whole < 1 || **whole > most) fail(*node, key, "expected " + expected);
    return static_cast<int>(**whole);
  }

  std::string text(std::string_view key, std::string_view expected) {
    const toml::node& node = need(key, expected);
    const auto* value = node.as_string();
    if (value == nullptr) fail(node, key, "expected " + std::string(expected));
    return **value;
  }

  /// One of the names of a catalogue.
  template <class Named>
  auto choice(std::string_view key, const std::string& all, Named named) {
    const std::string name = text(key, "one of " + all);
    const auto found = named(name);
    if (!found) fail(*table_.get(key), key, "expected one of " + all + ", found \"" + name + '"');
    return *found;
  }

  Vec3 vector(std::string_view key, double most, double per_si, std::optional<Vec3> otherwise = {}) {
    constexpr std::string_view kExpected = "[x, y, z]";
    const toml::node* node = find(key);
    if (node == nullptr) {
      if (otherwise) return *otherwise;
      missing(key, kExpected);
    }
    Vec3 vector;
    const auto* array = node->as_array();
    for (std::size_t i = 0; i < 3; ++i) {
      const auto value = array != nullptr && array->size() == 3 ? array->get(i)->value<double>() : std::nullopt;
      if (!value || !(std::abs(*value) <= most)) fail(*node, key, "expected " + std::string(kExpected));
      vector[static_cast<Eigen::Index>(i)] = *value / per_si;
    }
    return vector;
  }

  Vec3 direction(std::string_view key, const Vec3& otherwise) {
    const Vec3 vector = this->vector(key, 1e6, 1, otherwise);
    if (!(vector.norm() > 1e-6)) fail(*table_.get(key), key, "expected a direction, not [0, 0, 0]");
    return vector.normalized();
  }

  Table table(std::string_view key) {
    const toml::node& node = need(key, "a table");
    const auto* table = node.as_table();
    if (table == nullptr) fail(node, key, "expected a table");
    return {*table, path_ + std::string(key) + ".", file_};
  }

  std::vector<Table> tables(std::string_view key, const std::string& expected) {
    const toml::node& node = need(key, expected);
    const auto* array = node.as_array();
    if (array == nullptr || array->empty()) fail(node, key, "expected " + expected);
    std::vector<Table> all;
    for (const toml::node& each : *array) {
      const auto* table = each.as_table();
      if (table == nullptr) fail(each, key, "expected " + expected);
      all.emplace_back(*table, path_ + std::string(key) + '[' + std::to_string(all.size() + 1) + "].", file_);
    }
    return all;
  }

  /// An error at the line of this table.
  [[noreturn]] void fail(const std::string& what) const { fail(table_, "", what); }

  /// Numbers above `least` (or equal to it, with `or_equal`).
  std::vector<double> numbers(std::string_view key, double least, bool or_equal) {
    std::ostringstream expected;
    expected << "a list of numbers " << (or_equal ? "of at least " : "above ") << least;
    const toml::node& node = need(key, expected.str());
    const auto* array = node.as_array();
    if (array == nullptr || array->empty()) fail(node, key, "expected " + expected.str());
    std::vector<double> all;
    for (const toml::node& each : *array) {
      const std::optional<double> value = each.value<double>();
      if (!value || each.is_boolean() || !std::isfinite(*value) || !(or_equal ? *value >= least : *value > least)) {
        fail(each, key, "expected " + expected.str());
      }
      all.push_back(*value);
    }
    return all;
  }

  void check_unknown() const {
    for (const auto& [key, node] : table_) {
      if (!known_.contains(key.str())) {
        fail(node, key.str(), "unknown key; expected one of " + join(known_));
      }
    }
  }

  const std::string& file() const { return file_; }

 private:
  static std::string join(const std::set<std::string, std::less<>>& keys) {
    std::string all;
    for (const auto& key : keys) all.append(all.empty() ? "" : ", ").append(key);
    return all;
  }

  const toml::table& table_;
  std::string path_;
  std::string file_;
  std::set<std::string, std::less<>> known_;
};

/// With the density, kg/m³, where one is wanted.
Material read_material(Table& of, double* density = nullptr) {
  Table table = of.table("material");
  Material material;
  material.young = table.number("young_pa", 0, false, 1e12, 1);
  material.poisson = table.number("poisson", 0, true, 0.4999, 1);
  if (density != nullptr) *density = table.number("density_kg_per_m3", 0, false, 1e6, 1);
  table.check_unknown();
  return material;
}

void read_body(Table table, const std::filesystem::path& directory, BodyConfig& body) {
  const std::string kind = table.choice("shape", "block, cylinder, file", [](std::string_view name) {
    return name == "block" || name == "cylinder" || name == "file" ? std::optional(std::string(name)) : std::nullopt;
  });
  body.element = table.choice("element", names(elements()), element_named);
  if (kind == "block") {
    BlockShape block{};
    block.size = table.vector("size_mm", 1e3 * kMaxLength, 1e3);
    if (!(block.size.array() > 0).all()) table.fail(*table.find("size_mm"), "size_mm", "expected lengths above 0");
    const toml::node& cells = table.need("cells", "[nx, ny, nz]");
    for (std::size_t i = 0; i < 3; ++i) {
      const auto* array = cells.as_array();
      const auto* count = array != nullptr && array->size() == 3 ? array->get(i)->as_integer() : nullptr;
      if (count == nullptr || **count < 1 || **count > kMaxCells) {
        table.fail(cells, "cells", "expected three whole numbers from 1 to " + std::to_string(kMaxCells));
      }
      block.cells[i] = static_cast<int>(**count);
    }
    body.shape = block;
  } else if (kind == "cylinder") {
    body.shape = CylinderShape{table.length("radius_mm"), table.length("height_mm"),
                               table.count("cells_across", kMaxCells), table.count("cells_up", kMaxCells)};
  } else {
    body.shape = FileShape{directory / table.text("file", "the path of a gmsh file"),
                           1 / table.number("units_per_m", 0, false, 1e9, 1)};
  }
  body.clamped_below = table.number("clamped_below_mm", 0, true, 1e3 * kMaxLength, 1e3, 0);
  const bool has_mass = body.effects.gravity || body.effects.inertia || body.effects.damping;
  body.material = read_material(table, has_mass ? &body.effects.density : nullptr);
  table.check_unknown();
}

std::vector<Region> read_regions(Table& root) {
  std::vector<Region> regions;
  for (Table& table : root.tables("region", "one or more tables [[region]]")) {
    const bool ball = table.find("radius_mm") != nullptr;
    if (ball == (table.find("size_mm") != nullptr)) table.fail("expected either radius_mm or size_mm");
    const Vec3 middle = table.vector("middle_mm", 1e3 * kMaxLength, 1e3);
    Region& region = regions.emplace_back();
    if (ball) {
      region.where = Region::Ball{.middle = middle, .radius = table.length("radius_mm")};
    } else {
      const Vec3 size = table.vector("size_mm", 1e3 * kMaxLength, 1e3);
      if (!(size.array() > 0).all()) table.fail(*table.find("size_mm"), "size_mm", "expected lengths above 0");
      region.where = Region::Box{.middle = middle, .size = size};
    }
    region.material = read_material(table);
    table.check_unknown();
  }
  return regions;
}

void read_touch(Table table, const std::filesystem::path& directory, Scene& scene) {
  BodyConfig& body = scene.body;
  body.towards_tool = table.direction("from", Vec3::UnitZ());
  body.middle = table.vector("middle_mm", 1e3 * kMaxLength, 1e3, Vec3(Vec3::Zero()));
  body.patch_radius = table.length("patch_radius_mm");
  body.tool_radius = table.number("tool_radius_mm", 0, true, 1e3 * kMaxLength, 1e3, 0);
  if (body.learn || body.tabulate) {
    body.reach = table.number("reach_mm", 0, false, 1e3 * BodyConfig::kFarthestLearned * body.patch_radius, 1e3);
  } else if (table.find("reach_mm") != nullptr) {
    body.reach = table.length("reach_mm");
  }
  if (table.find("tool") != nullptr) {
    body.tool = table.choice("tool", "patch, sphere, capsule, box, mesh", [](std::string_view name) {
      if (name == "patch") return std::optional(BodyConfig::Tool::kPatch);
      if (name == "sphere") return std::optional(BodyConfig::Tool::kSphere);
      if (name == "box") return std::optional(BodyConfig::Tool::kBox);
      if (name == "mesh") return std::optional(BodyConfig::Tool::kMesh);
      return name == "capsule" ? std::optional(BodyConfig::Tool::kCapsule) : std::nullopt;
    });
  }
  body.tool_offset = table.vector("tool_offset_mm", 1e3 * kMaxLength, 1e3, Vec3(Vec3::Zero()));
  if (body.tool == BodyConfig::Tool::kCapsule) {
    body.tool_half_length = table.number("tool_length_mm", 0, true, 1e3 * kMaxLength, 1e3) / 2;
    body.tool_axis = table.direction("tool_axis", Vec3::UnitZ());
  }
  if (body.tool == BodyConfig::Tool::kBox) {
    body.tool_size = table.vector("tool_size_mm", 1e3 * kMaxLength, 1e3);
    const toml::node& size = *table.find("tool_size_mm");
    if (!(body.tool_size.array() > 0).all()) table.fail(size, "tool_size_mm", "expected lengths above 0");
    body.tool_edge = table.number("tool_edge_mm", 0, false, 1e3 * body.tool_size.minCoeff() / 2, 1e3);
  }
  if (body.tool == BodyConfig::Tool::kMesh) {
    body.tool_file = ToolFile{directory / table.text("tool_file", "the path of a surface: .stl, .obj or .off"),
                              1 / table.number("tool_units_per_m", 0, false, 1e9, 1), table.length("tool_cell_mm")};
  }
  if (is_rigid_on_nonlinear(body)) body.layer = table.number("layer_mm", 0, false, 1e3 * kMaxLength, 1e3, body.layer);
  if (table.find("side") != nullptr) {
    body.side = table.choice("side", "unilateral, bilateral", [](std::string_view name) {
      if (name == "unilateral") return std::optional(PatchContact::Side::kUnilateral);
      return name == "bilateral" ? std::optional(PatchContact::Side::kBilateral) : std::nullopt;
    });
  }
  const EffectSet simulated = effects_of(body);
  const bool can_leave_out = info(body.model).law == Law::kLinear || simulated.has(EffectKind::kPlasticity);
  const bool patch = body.tool == BodyConfig::Tool::kPatch;
  if (can_leave_out && patch && !info(body.model).tetrahedra && !body.effects.has_time()) {
    body.whole_stiffness = table.flag("whole_stiffness");
  }
  if (const toml::node* asked = table.find("table_mm")) {
    scene.table = table.length("table_mm");
    if (body.model != ModelKind::kCondensed || body.side != PatchContact::Side::kUnilateral || body.friction) {
      table.fail(*asked, "table_mm", "only for the model condensed, unilateral and without friction: others remember");
    }
  }
  table.check_unknown();
}

std::vector<PlannedCut> read_cuts(Table& root) {
  std::vector<PlannedCut> cuts;
  for (Table& table : root.tables("cutting", "one or more tables [[cutting]]")) {
    PlannedCut& cut = cuts.emplace_back();
    cut.cut.corner = table.vector("corner_mm", 1e3 * kMaxLength, 1e3);
    cut.cut.along = table.vector("along_mm", 1e3 * kMaxLength, 1e3);
    cut.cut.deep = table.vector("deep_mm", 1e3 * kMaxLength, 1e3);
    const bool timed = table.find("at_s") != nullptr;
    if (timed == (table.find("above_n") != nullptr)) table.fail("expected either at_s or above_n");
    cut.when = timed ? PlannedCut::When::kTime : PlannedCut::When::kForce;
    cut.value = timed ? table.number("at_s", 0, true, 1e9, 1) : table.number("above_n", 0, false, 1e6, 1);
    table.check_unknown();
  }
  return cuts;
}

StiffnessOverTime read_stiffening(Table table) {
  StiffnessOverTime law;
  law.at = table.numbers("at_s", 0, true);
  law.factor = table.numbers("factor", 0, false);
  try {
    check(law);
  } catch (const std::invalid_argument& error) {
    table.fail(error.what());
  }
  table.check_unknown();
  return law;
}

Yield read_plasticity(Table table) {
  const Yield yield{.stress = table.number("yield_pa", 0, false, 1e12, 1),
                    .hardening = table.number("hardening_pa", 0, false, 1e12, 1)};
  table.check_unknown();
  return yield;
}

double read_self_collision(Table table) {
  const double layer = table.number("layer_mm", 0, false, 1e3 * kMaxLength, 1e3);
  table.check_unknown();
  return layer;
}

constexpr std::string_view kLaws = "corotational, stvk, neo-hookean";

std::optional<Law> law_named(std::string_view name) {
  if (name == "corotational") return Law::kCorotational;
  if (name == "stvk") return Law::kStVenantKirchhoff;
  return name == "neo-hookean" ? std::optional(Law::kNeoHookean) : std::nullopt;
}

/// Large strains are an effect of one law of the model "near".
void check_law(Table& root, Law law, EffectSet listed) {
  const bool simulates = law == Law::kNeoHookean;
  if (simulates == listed.has(EffectKind::kMaterialNonlinearity)) return;
  root.fail(*root.find("effects"), "effects",
            simulates ? "the law \"neo-hookean\" simulates \"material-nonlinearity\", which is not listed"
                      : "the law simulates no \"material-nonlinearity\", which is listed: only \"neo-hookean\" does");
}

std::vector<Scene::Hand> read_hands(Table& root) {
  std::vector<Scene::Hand> hands;
  for (Table& table : root.tables("hands", "two or more tables [[hands]]")) {
    Scene::Hand& hand = hands.emplace_back();
    hand.device = table.text("device", "the name of a device");
    if (hand.device.empty()) table.fail(*table.find("device"), "device", "expected the name of a device");
    if (table.find("server") != nullptr) hand.server = table.text("server", "HOST:PORT");
    hand.at = table.vector("at_mm", 1e3 * kMaxLength, 1e3);
    table.check_unknown();
    for (const Scene::Hand& other : hands) {
      if (&other != &hand && other.device == hand.device && other.server == hand.server) {
        table.fail("two hands at one device, \"" + hand.device + '"');
      }
    }
  }
  if (hands.size() < 2) root.fail(*root.find("hands"), "hands", "expected two or more; one hand needs no [[hands]]");
  return hands;
}

/// Reads the list of effects. It must have all effects that the model always simulates, and only effects that the model
/// can simulate. Returns what is listed.
EffectSet read_effects(Table& root, const ModelInfo& model, BodyConfig& body) {
  const toml::node& node = root.need("effects", "a list of effects");
  const auto* list = node.as_array();
  if (list == nullptr) root.fail(node, "effects", "expected a list of effects");
  EffectSet listed;
  for (const toml::node& each : *list) {
    const auto* name = each.as_string();
    if (name == nullptr) root.fail(each, "effects", "expected names in quotes");
    const auto found = std::ranges::find(effects(), std::string_view(**name), &EffectInfo::name);
    if (found == effects().end()) {
      root.fail(each, "effects", "unknown effect \"" + **name + "\"; expected one of " + names(effects()));
    }
    if (listed.has(found->kind)) root.fail(each, "effects", "\"" + **name + "\" is listed twice");
    listed.add(found->kind);
    if (!model.always.has(found->kind) && !model.may.has(found->kind)) {
      root.fail(each, "effects",
                "the model \"" + std::string(model.name) + "\" does not simulate \"" + **name + "\", which is listed");
    }
    for (const EffectInfo& other : effects()) {
      if (listed.has(other.kind) && (found->not_with.has(other.kind) || other.not_with.has(found->kind))) {
        root.fail(each, "effects",
                  "\"" + **name + "\" is not simulated together with \"" + std::string(other.name) + '"');
      }
    }
  }
  for (const EffectInfo& effect : effects()) {
    if (model.always.has(effect.kind) && !listed.has(effect.kind)) {
      root.fail(node, "effects",
                "the model \"" + std::string(model.name) + "\" simulates \"" + std::string(effect.name) +
                    "\", which is not listed");
    }
  }
  // Each key is asked for only when its effect is listed: without it, it is an unknown key.
  constexpr double kMost = 1e6;
  EffectsConfig& config = body.effects;
  config.inertia = listed.has(EffectKind::kInertia);
  if (listed.has(EffectKind::kGravity)) {
    config.gravity = root.vector("gravity_m_per_s2", kMost, 1, Vec3(0, 0, -9.81));
  }
  if (listed.has(EffectKind::kDamping)) config.damping = root.number("damping_per_s", 0, false, kMost, 1);
  if (listed.has(EffectKind::kViscosity)) config.viscosity = root.number("viscosity_ms", 0, false, kMost, 1e3);
  if (listed.has(EffectKind::kFriction)) body.friction = root.number("friction", 0, true, 10, 1);
  if (listed.has(EffectKind::kCutting)) body.cuts = read_cuts(root);
  if (listed.has(EffectKind::kStiffening)) body.stiffening = read_stiffening(root.table("stiffening"));
  if (listed.has(EffectKind::kPlasticity)) body.plasticity = read_plasticity(root.table("plasticity"));
  if (listed.has(EffectKind::kSelfCollision)) body.self_collision = read_self_collision(root.table("self-collision"));
  if (config.has_time()) config.step = root.number("step_ms", 0, false, 1e3, 1e3);
  return listed;
}

}  // namespace

Scene parse_scene(std::string_view text, const std::string& name, const std::filesystem::path& directory) {
  toml::table parsed;
  try {
    parsed = toml::parse(text, name);
  } catch (const toml::parse_error& error) {
    std::ostringstream what;
    what << name << ':' << error.source().begin.line << ": " << error.description();
    throw SceneError(what.str());
  }
  Table root(parsed, "", name);
  Scene scene;
  Table model = root.table("model");
  scene.body.model = model.choice("kind", names(models()), model_named);
  const ModelInfo& chosen = info(scene.body.model);
  const EffectSet listed = read_effects(root, chosen, scene.body);
  switch (chosen.kind) {
    case ModelKind::kNear:
      if (model.find("law") != nullptr) scene.body.law = model.choice("law", std::string(kLaws), law_named);
      check_law(root, scene.body.law, listed);
      scene.body.max_iterations = model.count("max_iterations", 1000, scene.body.max_iterations);
      scene.body.learn = model.flag("learn");
      scene.body.tabulate = model.flag("tabulate");
      if (scene.body.learn || scene.body.tabulate) {
        scene.body.tolerance = BodyConfig::kErrorOfLearned;
        if (model.find("learned_in") != nullptr) {
          scene.body.learned_in = directory / model.text("learned_in", "a folder in which what is learned is kept");
        }
      }
      scene.body.tolerance = model.number("error_percent", 0, false, kMaxError, 100, scene.body.tolerance);
      break;
    case ModelKind::kLinear:
      if (!scene.body.plasticity) break;
      [[fallthrough]];
    case ModelKind::kCorotational:
    case ModelKind::kStVenantKirchhoff:
    case ModelKind::kNeoHookean:
    case ModelKind::kMassSpring:
      scene.body.max_iterations = model.count("max_iterations", 1000, scene.body.max_iterations);
      scene.body.tolerance = model.number("error_percent", 0, false, kMaxError, 100, scene.body.tolerance);
      break;
    case ModelKind::kXpbd:
    case ModelKind::kProjective:
      scene.body.iterations = model.count("iterations", 1000, scene.body.iterations);
      break;
    case ModelKind::kCondensed:
      if (model.find("table") != nullptr) {
        scene.body.table_file = directory / model.text("table", "the path of a table of tendon-softbody condense");
      }
      break;
    case ModelKind::kModal:
      scene.body.swings = model.count("swings", 10'000, scene.body.swings);
      if (model.find("static_modes") != nullptr) scene.body.static_modes = model.count("static_modes", 20);
      break;
    default:
      break;
  }
  model.check_unknown();
  read_body(root.table("body"), directory, scene.body);
  if (root.find("region") != nullptr) scene.body.regions = read_regions(root);
  read_touch(root.table("touch"), directory, scene);
  if (root.find("hands") != nullptr) {
    scene.hands = read_hands(root);
    scene.body.hands = scene.hands.size();
    scene.at = scene.hands.front().at;
  }
  if (root.find("place") != nullptr) {
    Table place = root.table("place");
    if (scene.hands.empty()) scene.at = place.vector("at_mm", 1e3 * kMaxLength, 1e3, Vec3(Vec3::Zero()));
    scene.towards_hand = place.direction("towards_hand", Vec3::UnitZ());
    place.check_unknown();
  }
  root.check_unknown();
  return scene;
}

Scene read_scene(const std::filesystem::path& file) {
  std::string text;
  try {
    text = read_file(file, kMaxSceneBytes);
  } catch (const std::invalid_argument& refused) {
    throw SceneError(refused.what());
  }
  return parse_scene(text, file.string(), file.parent_path());
}

Mat3 to_device(const Scene& scene) {
  return Eigen::Quaterniond::FromTwoVectors(scene.body.towards_tool, scene.towards_hand).toRotationMatrix();
}

std::string scene_reference() {
  std::ostringstream text;
  text << "effects = [...]          what is simulated; nothing else is\n";
  for (const auto& each : effects()) text << "    " << each.name << ": " << each.what << '\n';
  text << "gravity_m_per_s2 = [0, 0, -9.81]     in the body's frame; this and the next only with their effect\n"
          "damping_per_s, viscosity_ms (the stress is that of the strain and so long of its rate), friction (a "
          "coefficient)\n"
          "step_ms                  how long an answer lasts, with inertia, damping or viscosity\n"
          "[[cutting]]              a cut, a table for each, made in their order; it runs along the faces of elements\n"
          "corner_mm, along_mm, deep_mm     a parallelogram: one corner and two sides, in the body's frame at rest\n"
          "at_s                     made so long after the first answer; or in place of it\n"
          "above_n                  made after an answer of more newtons along the normal\n"
          "[stiffening]             Young's modulus, of which the material says how much it is at a factor of 1\n"
          "at_s, factor             [times after the first answer], [factors]; straight in between\n"
          "[plasticity]             with what stress of a bar the material yields, and what each strain adds to it\n"
          "yield_pa, hardening_pa   the bar then gives way with E H/(E + H)\n"
          "[self-collision]         of corotational, stvk, neo-hookean\n"
          "layer_mm                 so deep are two sides in each other where they press with Young's modulus\n"
          "[body]\n"
          "shape                    block, cylinder or file\n"
          "element                  how it is cut:\n";
  for (const auto& each : elements()) text << "    " << each.name << ": " << each.what << '\n';
  text << "size_mm, cells           of a block: [x, y, z]\n"
          "radius_mm, height_mm, cells_across, cells_up     of a cylinder\n"
          "file, units_per_m        a mesh of gmsh; 1000 when it is in mm\n"
          "clamped_below_mm = 0     nodes up to so far above the lowest are held\n"
          "[body.material]\n"
          "young_pa, poisson        0 to 0.4999\n"
          "density_kg_per_m3        with gravity, inertia or damping\n"
          "[[region]]               a part of another material, a table for each; where two overlap, the later one "
          "counts\n"
          "middle_mm                in the body's frame at rest; it has the elements whose middle lies in it\n"
          "radius_mm, or size_mm    of a ball; of a box, [x, y, z]\n"
          "material                 young_pa, poisson; the density is the body's\n"
          "[model]\n"
          "kind                     how it is computed:\n";
  for (const auto& each : models()) text << "    " << each.name << ": " << each.what << '\n';
  const BodyConfig defaults;
  text << "table                    of condensed: a file of `tendon-softbody condense SCENE FILE`; without it the "
          "table is made "
          "at the start\n";
  text << "law = \"corotational\"     of near: how the elements near the tool respond, one of " << kLaws
       << ";\n                         elsewhere the body is linear. The last wants the effect material-nonlinearity\n";
  text
      << "max_iterations = " << defaults.max_iterations
      << "      of one answer: corotational, stvk, neo-hookean, near, mass-spring, and linear with plasticity\n"
         "error_percent = "
      << 100 * defaults.tolerance
      << "   of the force, of the same: an answer ends when it may be wrong by so much, and says by how much;\n"
         "                         near adds what the linear far field may leave out\n"
         "learn = false            of near: presses within reach_mm of the middle, up and down and to and fro, are "
         "solved\n"
         "                         at the start; few shapes of these answer all between. error_percent = "
      << 100 * BodyConfig::kErrorOfLearned
      << " then: where\n"
         "                         they are wrong by more, the near field answers; it does after a cut, too\n"
         "tabulate = false         of near: the same presses make a table of the energy; it answers before the shapes\n"
         "learned_in               a folder: what is learned is kept there, and read at the next start\n"
         "iterations = "
      << defaults.iterations << "          of every answer: xpbd, projective\nswings = " << defaults.swings
      << "              of modal\n"
         "static_modes = 0         of modal: so many patches along each side of what is touched, at most 20\n"
         "[touch]\n"
         "patch_radius_mm          the tool presses on a patch of this size\n"
         "from = [0, 0, 1]         the way to the tool, in the body's frame\n"
         "middle_mm = [0, 0, 0]    of the side that is touched; its place across `from` counts\n"
         "reach_mm                 for condensed, modal: touched only so far from the middle. Without: anywhere; for "
         "near\n"
         "                         with learn or tabulate: they answer so far along each axis, at most 1.5 patch "
         "radii\n"
         "tool = \"patch\"           or sphere, capsule: rigid, its contact grows as it is pressed in; of condensed\n"
         "                         (without friction), corotational, stvk, neo-hookean; or box, mesh: of the last "
         "three\n"
         "tool_radius_mm = 0       how much earlier a patch touches; the sphere's, the capsule's\n"
         "tool_length_mm           of a capsule: between the centres of its ends\n"
         "tool_axis = [0, 0, 1]    of a capsule: from end to end, in the handle's frame\n"
         "tool_size_mm, tool_edge_mm     of a box: [x, y, z] along the handle's axes, and how round its edges are\n"
         "tool_file, tool_units_per_m    of a mesh: a closed surface (.stl, .obj, .off), along the handle's axes "
         "around "
         "the\n"
         "                         tool's middle; 1000 when it is in mm\n"
         "tool_cell_mm             of a mesh: its distances are kept on a grid of so much; at most half of its "
         "thinnest "
         "part\n"
         "layer_mm = 0.1           of rigid tools on corotational, stvk, neo-hookean: the layer that they press, how\n"
         "                         thick\n"
         "tool_offset_mm = [0, 0, 0]     from the handle to the tool's middle, in the handle's frame. A tool at an "
         "offset,\n"
         "                         a capsule, a box and a mesh, give a torque about the handle\n"
         "side = \"unilateral\"      or bilateral: once it has touched, the tool sticks, and pulls\n"
         "whole_stiffness = false  of linear, condensed, modal, plasticity, at rest: the stiffness of a flat surface "
         "is\n"
         "                         whole, too, as that of a curved one and of Newton's method always is\n"
         "table_mm                 answers bring the force at 16 depths over so much, for a slow network: 17 answers'\n"
         "                         time. Of condensed, unilateral, without friction\n"
         "[[hands]]                two or more that hold the body at once, a table for each; of rigid tools on\n"
         "                         corotational, stvk, neo-hookean\n"
         "device, server           the name of the hand's device; HOST:PORT of its server, where it is another one\n"
         "at_mm                    in place of that of [place], in the frame of this device\n"
         "[place]\n"
         "at_mm = [0, 0, 0]        where in the device's frame the middle of the touched side is\n"
         "towards_hand = [0, 0, 1] the way from there to the hand, in the device's frame\n";
  return text.str();
}

double patch_up_to(const BodyConfig& body) {
  const bool nonlinear = info(body.model).always.has(EffectKind::kGeometricNonlinearity);
  constexpr double kDeepest = 0.3;  // of the radius: beyond, the pressure of fixed profile nears its limit load
  return nonlinear && body.tool == BodyConfig::Tool::kPatch ? kDeepest * body.patch_radius
                                                            : std::numeric_limits<double>::infinity();
}

std::string beyond_the_patch(const BodyConfig& body) {
  std::ostringstream text;
  text << std::setprecision(2) << "pressed deeper than " << 1e3 * patch_up_to(body)
       << " mm, 0.3 of the patch's radius: the body gives way under a patch of fixed size as under no tool; "
          "tool = \"sphere\", \"capsule\" or \"box\" is rigid and can be pressed in far";
  return text.str();
}

std::string turned_too_far(double linear_up_to) {
  std::ostringstream text;
  text << std::setprecision(2) << "pressed deeper than " << 1e3 * linear_up_to
       << " mm, part of the body turns by more than " << Body::kLargestTurn
       << " rad, which makes forces that are not there; corotational and neo-hookean know large rotations";
  return text.str();
}

std::vector<std::string> warnings(const BodyConfig& body) {
  std::vector<std::string> all;
  const ElementInfo& element = info(body.element);
  double poisson = body.material.poisson;
  for (const Region& region : body.regions) poisson = std::max(poisson, region.material.poisson);
  if (poisson > element.locks_above) {
    std::ostringstream text;
    text << element.name << " locks above a Poisson ratio of " << element.locks_above << " (here " << poisson
         << "): forces come out far too large; use hex8-sri or hex27-sri";
    all.push_back(text.str());
  }
  return all;
}

}  // namespace tendon::softbody
