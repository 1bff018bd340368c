// SPDX-License-Identifier: Apache-2.0
// touch_mjcf: the hand holds a body of a MuJoCo scene.
#include <mujoco/mujoco.h>
#include <algorithm>
#include <bit>
#include <iostream>

#include "clients/cpp/engine/held_tool.h"

using namespace tendon;

int main(int argc, char** argv) try {
  Options options{.client = {.name = "touch_mjcf", .rate_hz = 1000}};
  HeldTool::Config config;
  std::string file, error(1000, '\0');
  CommandLine line("Touch a MuJoCo scene. The hand holds a body of it that has a <freejoint/>.", options);
  line.add_argument("MJCF", file, "File of the scene");
  config.add_to(line);
  if (const auto exit_code = line.parse(argc, argv)) return *exit_code;

  static const auto say = [](const char* text) { std::cerr << "touch_mjcf: MuJoCo: " << text << std::endl; };
  static unsigned warnings = 0;
  mju_user_error = [](const char* text) { say(text), std::_Exit(1); };
  mju_user_warning = [](const char* text) { std::has_single_bit(++warnings) ? say(text) : void(); };
  const mjModel* const m = mj_loadXML(file.c_str(), nullptr, error.data(), static_cast<int>(error.size()));
  if (m == nullptr) throw std::runtime_error(file + ": " + error.c_str());
  const int body = mj_name2id(m, mjOBJ_BODY, config.tool.c_str());
  const int joint = body < 0 ? -1 : m->body_jntadr[body], dof = joint < 0 ? -1 : m->jnt_dofadr[joint];
  if (dof < 0 || m->jnt_type[joint] != mjJNT_FREE)
    throw std::runtime_error(file + ": expected a body \"" + config.tool + "\" with a <freejoint/>");
  mjData* const d = mj_makeData(m);
  const auto motion = [&, at = d->qpos + m->jnt_qposadr[joint]]() -> ToolEngine::Motion {
    return {Vec3::Map(at), {at[3], at[4], at[5], at[6]}, ToolEngine::Six::Map(d->qvel + dof)};
  };
  const auto pull = [&](const ToolEngine::Six& now) {
    ToolEngine::Six::Map(d->qfrc_applied + dof) = now;
    mju_scl3(d->xfrc_applied + 6 * body, m->opt.gravity, -m->body_mass[body]);  // the hand does not carry the tool
  };
  const auto step = [&] {
    mj_step(m, d);
    const bool good = std::all_of(d->warning, d->warning + mjNWARNING, [](auto& kind) { return kind.number == 0; });
    if (!good) mj_resetData(m, d);
    return good;
  };
  const auto held = [&](bool moved) -> ToolEngine::Six {
    mj_forwardSkip(m, d, moved ? mjSTAGE_NONE : mjSTAGE_VEL, 1);
    return ToolEngine::Six::Map(d->qfrc_constraint + dof);
  };
  const auto contacts = [&](std::vector<Contact>& found) {
    for (const mjContact* contact = d->contact; contact != d->contact + d->ncon; ++contact) {
      const int side = (m->geom_bodyid[contact->geom2] == body) - (m->geom_bodyid[contact->geom1] == body);
      if (side != 0) found.push_back({.normal = side * Vec3::Map(contact->frame), .gap = contact->dist});
    }
  };
  const double inertia = *std::min_element(m->dof_M0 + dof + 3, m->dof_M0 + dof + 6);
  HeldTool tool(config, {m->opt.timestep, m->dof_M0[dof], inertia, motion, pull, step, held, contacts});
  return run(options, [&](const DeviceState& hand) { return tool.answer(hand); });
} catch (const std::exception& error) {
  return std::cerr << "touch_mjcf: " << error.what() << '\n', 1;
}
