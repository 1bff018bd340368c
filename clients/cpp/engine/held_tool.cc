// SPDX-License-Identifier: Apache-2.0
#include "clients/cpp/engine/held_tool.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <string_view>
#include <utility>

#include "clients/cpp/engine/fd_stiffness.h"
#include "protocol/expect.h"
#include "protocol/rotation.h"

namespace tendon {
namespace {

constexpr double kProbe = 1e-4;      // m
constexpr double kProbeTurn = 2e-3;  // rad
constexpr double kSameDirection = 0.99;

/// The damping is critical. The force is only bounded at 1 m or 1 rad.
ToolCoupling coupling(double stiffness, double inertia, std::string_view name, double step_s) {
  const double least = stiffness * step_s * step_s;
  expect(!(inertia <= least), name, inertia,
         "more than the stiffness of its coupling times step_s², " + shortest(least));
  return ToolCoupling::felt_as({.stiffness = stiffness,
                                .damping = 2 * std::sqrt(std::max(0.0, stiffness * inertia)),
                                .tool_mass = inertia,
                                .step_s = step_s,
                                .max_force = stiffness});
}

Vec3 at_most(double most, const Vec3& rate) {
  const double size = rate.norm();
  return size > most ? Vec3(most / size * rate) : rate;
}

Touch no_force() { return Vec3(Vec3::Constant(std::numeric_limits<double>::quiet_NaN())); }

}  // namespace

void HeldTool::Config::add_to(CommandLine& line) {
  line.add("--tool", tool, "BODY", "Name of the body that the hand holds");
  line.add("--stiffness-n-per-m", stiffness, "Stiffness of a rigid wall, N/m", 1);
  line.add("--angular-stiffness-nm-per-rad", angular_stiffness, "The same for rotations, N·m/rad", 1e-3);
  line.add("--z-up", z_up, "The scene has z up, and the device y; otherwise their axes are the same");
}

HeldTool::HeldTool(const Config& config, ToolEngine engine)
    : config_(config),
      engine_(std::move(engine)),
      axes_(config.z_up ? rotation_by(Vec3(std::numbers::pi / 2, 0, 0)) : Quat{}),
      spring_(coupling(config.stiffness, engine_.mass, "mass", engine_.step_s)),
      twist_(coupling(config.angular_stiffness, engine_.inertia, "inertia", engine_.step_s)) {
  expect_above_zero(config.max_speed, "max_speed");
  expect_above_zero(config.max_spin, "max_spin");
  expect(config.max_steps >= 1, "max_steps", config.max_steps, "at least 1");
  const ToolEngine::Motion start = engine_.motion();
  led_ = home_ = {.at = start.position, .turn = unit(start.orientation)};
}

Touch HeldTool::answer(const DeviceState& hand) {
  const double elapsed = seconds(hand.sampled - sampled_.value_or(hand.sampled));
  if (!hand.position.allFinite()) return no_force();
  sampled_ = hand.sampled;  // it goes back if the server was restarted
  due_ = std::clamp(due_ + elapsed / engine_.step_s, 0.0, static_cast<double>(config_.max_steps));
  const int steps = static_cast<int>(due_ + 1e-6);
  if (steps == 0) return touch_;
  due_ = std::max(0.0, due_ - steps);

  const Quat handle = hand.turning ? hand.turning->orientation : Quat{};
  const Quat turned = product(product(axes_, handle), inverse(axes_));
  const Pose goal{.at = home_.at + rotated(axes_, hand.position), .turn = product(turned, home_.turn)};
  if (advance(goal, steps)) {
    touch_ = felt(hand.turning.has_value());
  } else {
    led_ = home_;
    speed_ = spin_ = Vec3::Zero();
    touch_ = no_force();
  }
  return touch_;
}

HeldTool::Coupled HeldTool::couple(const Pose& hand) const {
  const ToolEngine::Motion tool = engine_.motion();
  const Quat turn = unit(tool.orientation);
  const Vec3 apart = hand.at - tool.position;
  const Vec3 turned = spring_torque(Mat3::Identity(), hand.turn, turn);  // from the tool to the hand, 2 w v
  const auto force = spring_.couple(apart, speed_ - tool.velocity.head<3>());
  const auto torque = twist_.couple(turned, spin_ - rotated(turn, tool.velocity.tail<3>()));
  Coupled coupled{.force = -spring_.felt_stiffness() * apart, .torque = -twist_.felt_stiffness() * turned};
  coupled.on_tool << force.on_tool, rotated(inverse(turn), torque.on_tool);
  return coupled;
}

bool HeldTool::advance(const Pose& goal, int steps) {
  for (int left = steps; left > 0; --left) {
    const double time = left * engine_.step_s;
    speed_ = at_most(config_.max_speed, (goal.at - led_.at) / time);
    spin_ = at_most(config_.max_spin, turn_between(led_.turn, goal.turn) / time);
    engine_.pull(couple(led_).on_tool);
    if (!engine_.step()) return false;
    led_.at += engine_.step_s * speed_;
    led_.turn = unit(product(rotation_by(engine_.step_s * spin_), led_.turn));
  }
  return true;
}

Touch HeldTool::felt(bool turns) {
  const Quat back = inverse(axes_);
  const ToolEngine::Motion tool = engine_.motion();
  const Coupled now = couple(led_);
  engine_.pull(now.on_tool);
  engine_.held(true);
  const auto held = [&](const Vec3& moved, const Vec3& rotation) {
    engine_.pull(couple({.at = led_.at + rotated(axes_, moved),
                         .turn = product(rotation_by(rotated(axes_, rotation)), led_.turn)})
                     .on_tool);
    return engine_.held(false);
  };
  const auto force = [&](const Vec3& moved) { return rotated(back, held(moved, Vec3::Zero()).head<3>()); };
  const auto torque = [&](const Vec3& rotation) {
    return rotated(back, rotated(unit(tool.orientation), held(Vec3::Zero(), rotation).tail<3>()));
  };

  Touch touch = rotated(back, now.force);
  if (const auto found = fd_stiffness(force, Vec3::Zero(), kProbe)) {
    touch.stiffness = found->stiffness;
    touch.valid_radius = touch.force.norm() / config_.stiffness;
  }
  touch.contact = surface(tool.position);
  if (!turns) return touch;
  touch.torque = rotated(back, now.torque);
  if (const auto found = fd_stiffness(torque, Vec3::Zero(), kProbeTurn)) touch.angular_stiffness = found->stiffness;
  return touch;
}

std::optional<Contact> HeldTool::surface(const Vec3& tool) {
  contacts_.clear();
  engine_.contacts(contacts_);
  const auto deepest = std::ranges::min_element(contacts_, {}, &Contact::gap);
  if (deepest == contacts_.end()) return std::nullopt;
  const Vec3 n = deepest->normal;
  if (!std::ranges::all_of(contacts_, [&](const Contact& one) { return one.normal.dot(n) > kSameDirection; })) {
    return std::nullopt;
  }
  return Contact{.normal = rotated(inverse(axes_), n), .gap = deepest->gap + n.dot(led_.at - tool)};
}

}  // namespace tendon
