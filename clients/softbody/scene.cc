// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/scene.h"

#include <toml++/toml.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <stdexcept>
#include <vector>

#include "clients/softbody/fem/file_text.h"
#include "core/base/nearest_word.h"

namespace tendon::softbody {
namespace {

/// The TOML parser is recursive, so the file must be small.
constexpr std::uintmax_t kMaxSceneBytes = 16'384;
constexpr double kMaxLength = 1e3;  // m; larger values are in a wrong unit
constexpr std::int64_t kMaxCells = 200;
constexpr double kMaxError = 10;  // %; larger errors can be felt

template <class Infos>
std::string names(const Infos& infos) {
  std::string all;
  for (const auto& each : infos) all.append(all.empty() ? "" : ", ").append(each.name);
  return all;
}

/// Keys that are never requested are errors (check_unknown()).
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

  /// Returns the number divided by `per_si`.
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

  double length(std::string_view key) { return number(key, 0, false, 1e3 * kMaxLength, 1e3); }

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

  template <class Named>
  auto choice(std::string_view key, const std::string& all, Named named) {
    const std::string name = text(key, "one of " + all);
    const auto found = named(name);
    if (!found) {
      fail(*table_.get(key), key, "expected one of " + all + ", found \"" + name + '"' + did_you_mean(name, all));
    }
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
    if (!(vector.norm() > 1e-6)) fail(*table_.get(key), key, "expected a direction, found [0, 0, 0]");
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

  [[noreturn]] void fail(const std::string& what) const { fail(table_, "", what); }

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
        const std::string all = join(known_);
        const std::string meant = did_you_mean(key.str(), all);
        fail(node, key.str(), "unknown key" + (meant.empty() ? "; expected one of " + all : meant));
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
                           1 / table.number("units_per_m", 0, false, 1e9, 1), table.flag("slits")};
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

Tool read_tool(Table& table, const std::filesystem::path& directory, double radius) {
  std::string kind = "patch";
  if (table.find("tool") != nullptr) {
    kind = table.choice("tool", "patch, sphere, capsule, box, mesh", [](std::string_view name) {
      constexpr std::array kKinds = {"patch", "sphere", "capsule", "box", "mesh"};
      return std::ranges::count(kKinds, name) > 0 ? std::optional(std::string(name)) : std::nullopt;
    });
  }
  if (kind == "sphere") return SphereTool{radius};
  if (kind == "capsule") {
    const double length = table.number("tool_length_mm", 0, true, 1e3 * kMaxLength, 1e3);
    return CapsuleTool{
        .radius = radius, .half_length = length / 2, .axis = table.direction("tool_axis", Vec3::UnitZ())};
  }
  if (kind == "box") {
    const Vec3 size = table.vector("tool_size_mm", 1e3 * kMaxLength, 1e3);
    if (!(size.array() > 0).all()) table.fail(*table.find("tool_size_mm"), "tool_size_mm", "expected lengths above 0");
    return BoxTool{.size = size, .edge = table.number("tool_edge_mm", 0, false, 1e3 * size.minCoeff() / 2, 1e3)};
  }
  if (kind == "mesh") {
    std::filesystem::path file = directory / table.text("tool_file", "the path of a surface: .stl, .obj or .off");
    const double scale = 1 / table.number("tool_units_per_m", 0, false, 1e9, 1);
    return MeshTool{.file = std::move(file), .scale = scale, .cell = table.length("tool_cell_mm")};
  }
  return PatchTool{radius};
}

void read_touch(Table table, const std::filesystem::path& directory, Scene& scene) {
  BodyConfig& body = scene.body;
  body.towards_tool = table.direction("from", Vec3::UnitZ());
  body.middle = table.vector("middle_mm", 1e3 * kMaxLength, 1e3, Vec3(Vec3::Zero()));
  body.patch_radius = table.length("patch_radius_mm");
  const double tool_radius = table.number("tool_radius_mm", 0, true, 1e3 * kMaxLength, 1e3, 0);
  if (body.near.learns()) {
    body.reach = table.number("reach_mm", 0, false, 1e3 * NearConfig::kFarthest * body.patch_radius, 1e3);
  } else if (table.find("reach_mm") != nullptr) {
    body.reach = table.length("reach_mm");
  }
  body.tool = read_tool(table, directory, tool_radius);
  body.tool_offset = table.vector("tool_offset_mm", 1e3 * kMaxLength, 1e3, Vec3(Vec3::Zero()));
  if (is_rigid_on_nonlinear(body)) body.layer = table.number("layer_mm", 0, false, 1e3 * kMaxLength, 1e3, body.layer);
  if (table.find("side") != nullptr) {
    body.side = table.choice("side", "unilateral, bilateral", [](std::string_view name) {
      if (name == "unilateral") return std::optional(PatchContact::Side::kUnilateral);
      return name == "bilateral" ? std::optional(PatchContact::Side::kBilateral) : std::nullopt;
    });
  }
  const EffectSet simulated = effects_of(body);
  const bool can_leave_out = info(body.model).law == Law::kLinear || simulated.has(EffectKind::kPlasticity);
  const bool patch = std::holds_alternative<PatchTool>(body.tool);
  if (can_leave_out && patch && !body.effects.has_time()) {
    body.whole_stiffness = table.flag("whole_stiffness");
  }
  if (const toml::node* asked = table.find("table_mm")) {
    scene.table = table.length("table_mm");
    if (body.model != ModelKind::kCondensed || body.side != PatchContact::Side::kUnilateral || body.friction) {
      table.fail(
          *asked, "table_mm",
          "expected the model condensed, unilateral and without friction, because the others depend on the past");
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

/// These models are now in tests/tools/lab/models.
constexpr std::array<std::string_view, 7> kOfTheLab = {"stvk",        "mass-spring", "projective", "modal",
                                                       "tensor-mass", "tled",        "xpbd"};

ModelKind read_model(Table& model) {
  const std::string all = names(models());
  const std::string name = model.text("kind", "one of " + all);
  if (std::ranges::count(kOfTheLab, name) > 0) {
    model.fail(*model.find("kind"), "kind",
               '"' + name + "\" is only a model of the accuracy experiment (tests/tools/lab/models); expected " + all);
  }
  return model.choice("kind", all, model_named);
}

std::optional<Law> law_named(std::string_view name) {
  const auto found = std::ranges::find(near_laws(), name, &NearLaw::name);
  return found == near_laws().end() ? std::nullopt : std::optional(found->law);
}

void check_law(Table& root, Law law, EffectSet listed) {
  const bool simulates = law == Law::kNeoHookean;
  if (simulates == listed.has(EffectKind::kMaterialNonlinearity)) return;
  root.fail(*root.find("effects"), "effects",
            simulates
                ? "the law \"neo-hookean\" simulates \"material-nonlinearity\", which is not listed"
                : "the law does not simulate \"material-nonlinearity\", which is listed: only \"neo-hookean\" does");
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
        table.fail("expected a different device for each hand, found twice \"" + hand.device + '"');
      }
    }
  }
  if (hands.size() < 2) root.fail(*root.find("hands"), "hands", "expected two or more; omit [[hands]] for one hand");
  return hands;
}

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
      const std::string all = names(effects());
      root.fail(each, "effects",
                "unknown effect \"" + **name + "\"; expected one of " + all + did_you_mean(**name, all));
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
                  "\"" + **name + "\" cannot be simulated together with \"" + std::string(other.name) + '"');
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
  // Keys are only requested if their effect is listed.
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
  scene.body.model = read_model(model);
  const ModelInfo& chosen = info(scene.body.model);
  const EffectSet listed = read_effects(root, chosen, scene.body);
  switch (chosen.kind) {
    case ModelKind::kNear:
      if (model.find("law") != nullptr) scene.body.near.law = model.choice("law", names(near_laws()), law_named);
      check_law(root, scene.body.near.law, listed);
      scene.body.max_iterations = model.count("max_iterations", 1000, scene.body.max_iterations);
      scene.body.near.learn = model.flag("learn");
      scene.body.near.tabulate = model.flag("tabulate");
      if (scene.body.near.learns()) {
        scene.body.tolerance = NearConfig::kErrorOfLearned;
        if (model.find("learned_in") != nullptr) {
          scene.body.near.learned_in = directory / model.text("learned_in", "a folder for the learned data");
        }
      }
      scene.body.tolerance = model.number("error_percent", 0, false, kMaxError, 100, scene.body.tolerance);
      break;
    case ModelKind::kLinear:
      if (!scene.body.plasticity) break;
      [[fallthrough]];
    case ModelKind::kCorotational:
    case ModelKind::kNeoHookean:
      scene.body.max_iterations = model.count("max_iterations", 1000, scene.body.max_iterations);
      scene.body.tolerance = model.number("error_percent", 0, false, kMaxError, 100, scene.body.tolerance);
      break;
    case ModelKind::kCondensed:
      if (model.find("table") != nullptr) {
        scene.body.table_file = directory / model.text("table", "the path of a table from tendon-softbody condense");
      }
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
    throw std::runtime_error(refused.what());
  }
  return parse_scene(text, file.string(), file.parent_path());
}

Mat3 to_device(const Scene& scene) { return shortest_rotation(scene.body.towards_tool, scene.towards_hand); }

}  // namespace tendon::softbody
