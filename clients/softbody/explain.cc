// SPDX-License-Identifier: Apache-2.0
#include "clients/softbody/explain.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <limits>
#include <nlohmann/json.hpp>
#include <sstream>
#include <stdexcept>
#include <utility>

namespace tendon::softbody {
namespace {

constexpr double kWay = 0.003;  // m
constexpr int kAnswers = 40;    // forth and back
constexpr int kMostTurns = 4;
constexpr double kEnough = 3;       // s of processor time
constexpr double kInterval = 0.01;  // s, between answers

BodyConfig without(BodyConfig body, EffectKind effect) {
  switch (effect) {
    case EffectKind::kGravity:
      body.effects.gravity.reset();
      break;
    case EffectKind::kInertia:
      body.effects.inertia = false;
      break;
    case EffectKind::kDamping:
      body.effects.damping.reset();
      break;
    case EffectKind::kViscosity:
      body.effects.viscosity.reset();
      break;
    case EffectKind::kFriction:
      body.friction.reset();
      break;
    case EffectKind::kCutting:
      body.cuts.clear();
      break;
    case EffectKind::kStiffening:
      body.stiffening.reset();
      break;
    case EffectKind::kPlasticity:
      set_plasticity(body.model, {});
      break;
    case EffectKind::kSelfCollision:
      set_self_collision(body.model, {});
      break;
    case EffectKind::kMaterialNonlinearity: {
      auto& near = std::get<NearConfig>(body.model);
      near.law = Law::kCorotational;
      near.learned = learn(body, {});  // precomputed data depends on the law
      break;
    }
    case EffectKind::kContact:
    case EffectKind::kGeometricNonlinearity:
      break;
  }
  return body;
}

Explanation::Cost press_and_come_back(const BodyConfig& config, const Mat3& turn, const Vec3& lowest,
                                      const std::function<double()>& processor_time) {
  Body body(config);
  const Vec3 surface = body.touch_point() - lowest;
  const double start = processor_time();
  for (int i = 0; i < kAnswers; ++i) {
    const double depth = kWay * (1 - std::abs(2.0 * i / kAnswers - 1));
    body.tick(kInterval * i);
    body.touch(Pose{surface - depth * body.normal(), turn});
  }
  return {(processor_time() - start) / kAnswers, static_cast<std::int64_t>(body.size().bytes)};
}

/// Also runs and measures the work of the background thread.
std::optional<Explanation::Beside> fields_beside(const BodyConfig& config, const Mat3& turn,
                                                 const std::function<double()>& processor_time) {
  Body body(without(config, EffectKind::kCutting));  // a cut uses the thread too
  if (!body.near_field() || body.near_field()->radius == 0 || !factors_may_work_at_once()) return std::nullopt;
  double spent = 0;
  int made = 0;
  body.prepare_by([&](std::packaged_task<void()> work) {
    const double start = processor_time();
    work();
    spent += processor_time() - start;
    ++made;
  });
  const Vec3 surface = body.touch_point() - lowest_of_tool(config, turn);
  for (int i = 0; i <= kAnswers / 2 || made == 0; ++i) {
    body.touch(Pose{surface - kWay * 2 * i / kAnswers * body.normal(), turn});
  }
  return Explanation::Beside{spent / made, body.near_field()->elsewhere};
}

std::string touched_by(const BodyConfig& body) {
  std::ostringstream text;
  if (const auto* sphere = std::get_if<SphereTool>(&body.tool)) {
    text << " with a sphere of " << 1e3 * sphere->radius << " mm";
  } else if (const auto* capsule = std::get_if<CapsuleTool>(&body.tool)) {
    text << " with a capsule of " << 1e3 * capsule->radius << " mm, " << 2e3 * capsule->half_length
         << " mm between the centres of its ends";
  } else if (const auto* box = std::get_if<BoxTool>(&body.tool)) {
    text << " with a box of " << (1e3 * box->size).transpose() << " mm with edges of " << 1e3 * box->edge << " mm";
  } else if (const auto* mesh = std::get_if<MeshTool>(&body.tool)) {
    text << " with a tool with the surface " << mesh->file.string();
  } else {
    text << " on a patch of " << 1e3 * body.patch_radius << " mm";
  }
  if (body.tool_offset != Vec3::Zero()) text << ", " << 1e3 * body.tool_offset.norm() << " mm from the handle";
  if (turns_the_hand(body)) text << ", with a torque";
  if (body.hands > 1) text << "; " << body.hands << " hands at once";
  return text.str();
}

std::string milliseconds(double s, double resolution) {
  std::ostringstream text;
  if (std::abs(s) < resolution) text << "< ";
  text << std::setprecision(3) << 1e3 * (std::abs(s) < resolution ? resolution : s) << " ms";
  return text.str();
}

struct AnswerCount {
  std::string key;
  int count;
  std::string words;
};

std::vector<AnswerCount> counts_of(const Answered& answered) {
  std::vector<AnswerCount> counts;
  for (const FallbackModel::Step& step : answered.levels) {
    const std::string name(step.size.name);
    counts.push_back({name, step.answers, "answers were " + name});
  }
  if (const auto& near = answered.near) {
    counts.push_back({"linear", near->linear, "answers were from the linear body"});
    counts.push_back({"fields", near->made - 1 + near->late, "near fields were computed by the other thread"});
    counts.push_back({"fields_late", near->late, "of them were too late"});
  }
  return counts;
}

}  // namespace

double off_the_exact_interface(const BodyConfig& config) {
  BodyConfig alone = config;
  auto* near = std::get_if<NearConfig>(&alone.model);
  if (near == nullptr) {
    throw std::invalid_argument("only the model \"near\" has an interface, which can be compared with the exact one");
  }
  near->learn = near->tabulate = false;
  Body modes(alone);
  near->exact_interface = true;
  Body exact(alone);
  double most = 0;
  for (const double share : {0.01, 0.1, 0.2}) {
    const double depth = share * config.patch_radius;
    const double expected = exact.settle(Prescribed::kDepth, depth).force;
    most = std::max(most, std::abs(modes.settle(Prescribed::kDepth, depth).force / expected - 1));
  }
  return most;
}

Explanation explain(const Scene& scene, const std::function<double()>& processor_time) {
  BodyConfig config = scene.body;
  auto* near = std::get_if<NearConfig>(&config.model);
  if (near != nullptr && !near->learned) near->learned = learn(config, {});
  std::optional<Explanation::Tool> tool;
  if (std::holds_alternative<MeshTool>(scene.body.tool)) {
    const double start = processor_time();
    const RigidShape shape = shape_of(scene.body.tool, scene.body.layer);
    tool = {*shape.mesh_facts(), processor_time() - start};
  }
  Body body(config);
  // The push is small, so that the answer is linear. A depth cannot be given, because gravity moves the surface.
  const double push = 1e-3 * scene.body.material.young * scene.body.patch_radius * scene.body.patch_radius;
  Explanation out{.parts = {},
                  .all = {},
                  .size = body.size(),
                  .near = body.near_field(),
                  .tool = tool,
                  .off_exact = {},
                  .beside = fields_beside(config, to_device(scene).transpose(), processor_time),
                  .learned = {},
                  .step = body.step(),
                  .stiffness = body.settle(Prescribed::kForce, push).stiffness,
                  .linear_up_to = body.linear_up_to()};

  std::vector<BodyConfig> bodies{config, config};
  const EffectSet simulated = effects_of(scene.body);
  const EffectSet always = info(scene.body.model).always;
  for (const EffectInfo& effect : effects()) {
    out.parts.push_back({effect.kind, simulated.has(effect.kind), {}});
    if (!simulated.has(effect.kind) || always.has(effect.kind)) continue;
    out.parts.back().adds = Explanation::Cost{};
    bodies.push_back(without(config, effect.kind));
  }
  const std::size_t first_level = bodies.size();
  for (const FallbackModel::Step& step : body.fallbacks()) {
    out.learned.push_back({.size = step.size});
    bodies.push_back(config);
    (near->tabulate ? near->tabulate : near->learn) = false;
  }
  if (!out.learned.empty()) bodies.push_back(config);
  std::vector<Explanation::Cost> least(bodies.size(), {std::numeric_limits<double>::infinity(), 0});
  const Mat3 turn = to_device(scene).transpose();
  const Vec3 lowest = lowest_of_tool(scene.body, turn);
  const double start = processor_time();
  for (int round = 0; round < kMostTurns && (round == 0 || processor_time() - start < kEnough); ++round) {
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      const Explanation::Cost cost = press_and_come_back(bodies[i], turn, lowest, processor_time);
      least[i] = {std::min(least[i].answer_s, cost.answer_s), cost.bytes};
    }
  }
  out.all = least[0];
  out.resolution_s = std::abs(least[0].answer_s - least[1].answer_s);
  std::size_t next = 2;
  for (Explanation::Part& part : out.parts) {
    if (!part.adds) continue;
    const Explanation::Cost& less = least[next++];
    part.adds = {out.all.answer_s - less.answer_s, out.all.bytes - less.bytes};
  }
  for (std::size_t i = 0; i < out.learned.size(); ++i) out.learned[i].answer_s = least[first_level + i].answer_s;
  if (!out.learned.empty()) out.near_answer_s = least.back().answer_s;
  return out;
}

std::string in_words(const Scene& scene, const Explanation& explanation) {
  const BodyConfig& body = scene.body;
  const ModelInfo& model = info(body.model);
  const ElementInfo& element = info(body.element);
  const Body::Size& size = explanation.size;
  std::ostringstream text;
  text << "simulated:\n  contact: " << (body.side == PatchContact::Side::kUnilateral ? "unilateral" : "bilateral")
       << touched_by(body) << "\n  elasticity: " << model.name << ", " << model.what << '\n';
  for (std::size_t i = 0; i < body.regions.size(); ++i) {
    const Material& material = body.regions[i].material;
    text << "  region " << i + 1 << ": " << material.young << " Pa, Poisson's ratio " << material.poisson
         << "; elsewhere " << body.material.young << " Pa, " << body.material.poisson << '\n';
  }
  for (const auto& [kind, simulated, adds] : explanation.parts) {
    if (!simulated || kind == EffectKind::kContact) continue;
    const EffectInfo& effect = info(kind);
    text << "  " << effect.name << ": " << effect.what;
    if (adds) {
      text << "; adds " << milliseconds(adds->answer_s, explanation.resolution_s) << " and " << adds->bytes << " B";
    }
    text << '\n';
  }
  text << "not simulated:\n";
  for (const auto& [kind, simulated, adds] : explanation.parts) {
    if (simulated) continue;
    text << "  " << info(kind).name
         << (kind == EffectKind::kGeometricNonlinearity ? ": " + turned_too_far(explanation.linear_up_to) : "") << '\n';
  }
  if (explanation.tool) {
    const auto& [facts, made_s] = *explanation.tool;
    text << "tool: " << facts.facets << " facets, " << 1e3 * facts.size.x() << " x " << 1e3 * facts.size.y() << " x "
         << 1e3 * facts.size.z() << " mm; " << facts.points << " distances on a grid with a cell size of "
         << 1e3 * facts.cell << " mm, " << static_cast<double>(facts.bytes) / 1e6 << " MB, computed in "
         << milliseconds(made_s, 0) << " of processor time; accuracy of the surface " << 1e3 * facts.error << " mm\n";
  }
  for (const auto& [fallback_level, answer_s] : explanation.learned) {
    text << "answers, where accurate enough: " << fallback_level.name << ", within "
         << milliseconds(answer_s, explanation.resolution_s) << "; in " << fallback_level.cells << " of "
         << fallback_level.of_cells << " cells, error up to " << std::setprecision(2) << 100 * fallback_level.error
         << std::setprecision(6) << " %; ";
    if (fallback_level.shapes > 0)
      text << fallback_level.shapes << " shapes, summed over " << fallback_level.elements << " elements; ";
    text << static_cast<double>(fallback_level.bytes) / 1e6 << " MB\n";
  }
  if (!explanation.learned.empty()) {
    text << "answers elsewhere: near field, within " << milliseconds(explanation.near_answer_s, 0) << '\n';
  }
  if (explanation.near && explanation.near->radius > 0) {
    const NearModel::Size& near = *explanation.near;
    const Law law = std::get<NearConfig>(body.model).law;
    text << "near the tool: " << std::ranges::find(near_laws(), law, &NearLaw::law)->name << ", " << near.elements
         << " of " << size.elements << " elements, within " << 1e3 * near.radius << " mm or on the path of the tool; "
         << near.unknowns << " unknowns, including " << near.modes << " modes instead of the "
         << near.interface << " unknowns of the interface\n";
    if (explanation.off_exact) {
      text << "  compared with the exact interface: forces differ by up to " << std::setprecision(2)
           << 100 * *explanation.off_exact << " % for depths up to " << 200 * body.patch_radius << " mm\n"
           << std::setprecision(6);
    }
    if (explanation.beside) {
      text << "next near field: in another thread, for the current shape; "
           << milliseconds(explanation.beside->field_s, 0) << " of processor time, and "
           << static_cast<double>(explanation.beside->bytes) / 1e6 << " MB\n";
    } else {
      text << "next near field: for the shape at rest, in parts during the answers, because this OpenBLAS only "
              "supports one thread\n";
    }
  } else if (explanation.near) {
    text << "near the tool: the whole body, because it is small\n";
  }
  if (explanation.step > 0) {
    text << "time: each answer is a step of " << 1e3 * explanation.step << " ms\n";
  } else {
    text << "time: quasi-static, without velocities\n";
  }
  text << "cost:\n  mesh: " << size.nodes << " nodes, " << size.elements << " elements (" << element.name << ": "
       << element.what << ")\n  unknowns: " << size.free << "\n  touchable nodes: " << size.touchable
       << "\n  model: " << static_cast<double>(size.bytes) / 1e6
       << " MB\n  an answer: " << milliseconds(explanation.all.answer_s, 0)
       << " of processor time, measured on this machine just now at a depth of " << 1e3 * kWay << " mm, ± "
       << milliseconds(explanation.resolution_s, 0) << "\nat first touch: " << explanation.stiffness << " N/m\n";
  for (const std::string& warning : warnings(body)) text << "warning: " << warning << '\n';
  return text.str();
}

std::string in_json(const Scene& scene, const Explanation& explanation) {
  using Json = nlohmann::ordered_json;
  Json parts = Json::array();
  for (const auto& [kind, simulated, adds] : explanation.parts) {
    Json part = {{"name", info(kind).name}, {"simulated", simulated}};
    if (adds) {
      part["adds_s"] = adds->answer_s;
      part["adds_bytes"] = adds->bytes;
    }
    parts.push_back(std::move(part));
  }
  Json json = {{"model", info(scene.body.model).name}, {"element", info(scene.body.element).name},
               {"nodes", explanation.size.nodes},      {"elements", explanation.size.elements},
               {"unknowns", explanation.size.free},    {"touchable_nodes", explanation.size.touchable},
               {"bytes", explanation.size.bytes},      {"step_s", explanation.step},
               {"k_n_per_m", explanation.stiffness},   {"linear_up_to_m", explanation.linear_up_to},
               {"answer_s", explanation.all.answer_s}, {"resolution_s", explanation.resolution_s},
               {"regions", scene.body.regions.size()}, {"effects", std::move(parts)},
               {"warnings", warnings(scene.body)}};
  if (const auto& near = explanation.near) {
    json["near"] = {{"radius_m", near->radius},
                    {"elements", near->elements},
                    {"unknowns", near->unknowns},
                    {"modes", near->modes},
                    {"interface", near->interface}};
    if (explanation.off_exact) json["near"]["off_exact"] = *explanation.off_exact;
    if (explanation.beside) {
      json["near"]["field_s"] = explanation.beside->field_s;
      json["near"]["thread_bytes"] = explanation.beside->bytes;
    }
  }
  if (const auto& tool = explanation.tool) {
    const Vec3& size = tool->facts.size;
    json["tool"] = {{"facets", tool->facts.facets}, {"size_m", {size.x(), size.y(), size.z()}},
                    {"cell_m", tool->facts.cell},   {"points", tool->facts.points},
                    {"bytes", tool->facts.bytes},   {"error_m", tool->facts.error},
                    {"made_s", tool->made_s}};
  }
  for (const auto& [fallback_level, answer_s] : explanation.learned) {
    json["learned"].push_back({{"name", fallback_level.name},
                               {"answer_s", answer_s},
                               {"cells", fallback_level.cells},
                               {"of_cells", fallback_level.of_cells},
                               {"error", fallback_level.error},
                               {"shapes", fallback_level.shapes},
                               {"elements", fallback_level.elements},
                               {"bytes", fallback_level.bytes}});
  }
  if (!explanation.learned.empty()) json["near"]["answer_s"] = explanation.near_answer_s;
  return json.dump(-1, ' ', false, Json::error_handler_t::replace) + '\n';
}

std::string in_words(const Answered& answered) {
  std::string text;
  for (const auto& [key, count, words] : counts_of(answered)) {
    text += (text.empty() ? "" : ", ") + std::to_string(count) + ' ' + words;
  }
  return text.empty() ? text : text + '\n';
}

std::string in_json(const Answered& answered) {
  nlohmann::ordered_json counts;
  for (const auto& [key, count, words] : counts_of(answered)) counts[key] = count;
  if (counts.empty()) return {};
  return nlohmann::ordered_json{{"answers", std::move(counts)}}.dump() + '\n';
}

}  // namespace tendon::softbody
