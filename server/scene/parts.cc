// SPDX-License-Identifier: Apache-2.0
#include "server/scene/parts.h"

#include <utility>
#include <variant>

#include "server/scene/scene.h"

namespace tendon {

const std::vector<ScenePart>& scene_parts() {
  static const std::vector<ScenePart> kAll = [] {
    std::vector<ScenePart> all;
    scene_file::Draft draft;
    bool removed = false;
    scene_file::Parts parts(all, "", removed);
    scene_file::declare_scene(parts, draft);
    return all;
  }();
  return kAll;
}

bool take_out(Scene& scene, std::string_view key) {
  scene_file::Draft draft;
  HapticController::Config& control = draft.scene.loop.control;
  LimiterConfig& limiter = control.limiter;
  draft.scene = std::move(scene);
  draft.simulated = std::get<SimulatedDevice::Config>(draft.scene.device);
  if (control.coupling) draft.coupling = *control.coupling;
  std::vector<ScenePart> all;
  bool removed = false;
  scene_file::Parts parts(all, key, removed);
  scene_file::declare_scene(parts, draft);

  if (control.coupling) control.coupling = draft.coupling;
  if (!draft.scene.teleoperation) {
    control.coupling.reset();
    control.leaders.clear();
    limiter.shared_account =
        control.hold.field && (control.hold.field->push.push_j > 0 || control.hold.field->push.push_w > 0);
  }
  if (!draft.simulated.rotation) {
    control.rotation.reset();
    if (control.coupling) control.coupling->turn.reset();
  }
  if (!draft.simulated.gripper) {
    control.grip.reset();
    if (control.coupling) control.coupling->grip.reset();
  }
  if (limiter.law == Law::kNone) {
    limiter.shared_account = false;
    if (control.hold.field) control.hold.field->push = {};
    if (control.coupling) control.coupling->tank.reset();
  }
  if (!limiter.parts.adaptive_friction) control.friction_map.reset();
  if (!limiter.parts.shaping) limiter.parts.bounded_acceleration.reset();
  if (!limiter.parts.energy_cap) limiter.parts.fading_contact.reset();
  draft.scene.device = std::move(draft.simulated);
  scene = std::move(draft.scene);
  return removed;
}

}  // namespace tendon
