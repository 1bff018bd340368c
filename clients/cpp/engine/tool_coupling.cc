// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/tool_coupling.h"

#include "protocol/expect.h"

namespace tendon {

ToolCoupling::ToolCoupling(const Config& config) : config_(config) {
  expect_above_zero(config.stiffness, "stiffness");
  expect_not_negative(config.damping, "damping");
  expect_above_zero(config.tool_mass, "tool_mass");
  expect_above_zero(config.step_s, "step_s");
  expect_above_zero(config.max_force, "max_force");
  share_ = 1 / (1 + (config.damping + config.stiffness * config.step_s) * config.step_s / config.tool_mass);
}

ToolCoupling ToolCoupling::felt_as(Config config) {
  static_cast<void>(ToolCoupling(config));  // checks it
  const double least = config.stiffness * config.step_s * config.step_s;
  expect(config.tool_mass > least, "tool_mass", config.tool_mass, "more than stiffness·step_s², " + shortest(least));
  config.stiffness *= (1 + config.damping * config.step_s / config.tool_mass) / (1 - least / config.tool_mass);
  return ToolCoupling(config);
}

ToolCoupling::Forces ToolCoupling::couple(const DeviceState& hand, const Vec3& tool_position,
                                          const Vec3& tool_velocity) const noexcept {
  return couple(Vec3(hand.position - tool_position), Vec3(hand.velocity - tool_velocity));
}

ToolCoupling::Forces ToolCoupling::couple(const Vec3& apart, const Vec3& parting) const noexcept {
  Vec3 force = share_ * (config_.stiffness * (apart + config_.step_s * parting) + config_.damping * parting);
  const double size = force.norm();
  if (size > config_.max_force) force *= config_.max_force / size;
  return {.on_tool = force, .on_hand = -force};
}

}  // namespace tendon
