// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/replay/rerun.h"

#include <array>
#include <bit>
#include <charconv>
#include <cstdint>
#include <limits>
#include <string_view>

#include "core/base/arithmetic.h"

namespace tendon::replay {

namespace {

/// The reasons of a step that come from the input of the law.
constexpr std::uint32_t kUpstream =
    static_cast<std::uint32_t>(Reason::kRampIn) | static_cast<std::uint32_t>(Reason::kHeld) |
    static_cast<std::uint32_t>(Reason::kDecaying) | static_cast<std::uint32_t>(Reason::kSafeStop);

constexpr double kFurtherThanAnyHand = 1e100;  // m; its square is finite

ForceChannels::Wanted wanted_in(const StepRecord& recorded) {
  ForceChannels::Wanted wanted;
  wanted.force = recorded.wanted;
  wanted.stiffness = recorded.stiffness;
  wanted.mode = recorded.mode;
  wanted.reasons = Reasons::from_bits(recorded.reasons.bits() & kUpstream);
  wanted.age = recorded.force_age;
  wanted.loop_age = recorded.loop_age;
  wanted.channel = recorded.channel;
  if (recorded.turn() || recorded.grip()) wanted.handle.emplace();
  if (recorded.turn()) wanted.handle->torque = recorded.turn()->wanted;
  if (recorded.grip()) wanted.handle->grip = recorded.grip()->wanted;
  return wanted;
}

std::optional<HandleSample> handle_in(const StepRecord& recorded, const Effort& held) {
  if (!recorded.turn() && !recorded.grip()) return std::nullopt;
  HandleSample handle{.torque = held.torque, .grip_force = held.grip};
  if (recorded.turn()) handle.turning = recorded.turn()->hand;
  if (recorded.grip()) handle.grip = recorded.grip()->hand;
  return handle;
}

Effort was_held(const StepRecord& recorded) {
  Effort held{.force = recorded.was_applied};
  if (recorded.turn()) held.torque = recorded.turn()->was_applied;
  if (recorded.grip()) held.grip = recorded.grip()->was_applied;
  return held;
}

std::string digits(double value) {
  std::array<char, 32> text{};
  return {text.data(), std::to_chars(text.data(), text.data() + text.size(), value).ptr};
}

std::string digits(const Vec3& value) {
  return "(" + digits(value.x()) + ", " + digits(value.y()) + ", " + digits(value.z()) + ")";
}

bool same(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }
bool same(const Vec3& a, const Vec3& b) { return same(a.x(), b.x()) && same(a.y(), b.y()) && same(a.z(), b.z()); }

/// Removes the device's clamp, which is applied after the law.
Reasons of_the_law(Reasons reasons) {
  return Reasons::from_bits(reasons.bits() & ~static_cast<std::uint32_t>(Reason::kDeviceClamp));
}

}  // namespace

Step Rerun::take(const StepRecord& recorded, const Effort& held) {
  const Vec3& applied = held.force;
  const auto sample = handle_in(recorded, held);
  const HandleSample* const handle = sample ? &*sample : nullptr;
  if (!recorded.reasons.has(Reason::kUnseen)) {
    missed_ = 0;
    const bool has_port = settled_at_ == recorded.tick;
    return controller_.step(recorded.hand, applied, recorded.hand_force, wanted_in(recorded), handle,
                            has_port ? settled_ : EnergyTank::Settlement{},
                            has_port ? grip_settled_ : EnergyTank::Settlement{}, recorded.field);
  }
  // For a rejected position the record contains only the rejection.
  ++missed_;
  Motion hand = recorded.hand;
  const bool jumped = recorded.mode == Mode::kFault && controller_.fault() == HapticController::Fault::kNone;
  if (recorded.reasons.has(Reason::kNotFinite)) {
    hand.position.setConstant(std::numeric_limits<double>::quiet_NaN());
  } else if (jumped && missed_ < max_missed_) {
    hand.position.setConstant(kFurtherThanAnyHand);
  } else {
    return controller_.step_unseen(recorded.hand.at, applied, handle);
  }
  return controller_.step(hand, applied, recorded.hand_force, wanted_in(recorded), handle);
}

StepRecord Rerun::step(const StepRecord& recorded) {
  const DenormalsOff off;
  if (recorded.rearmed) {
    controller_.rearm();
    missed_ = 0;
  }
  if (recorded.disarmed) controller_.disarm();
  StepRecord again = recorded;
  static_cast<Step&>(again) = take(recorded, held_ == Held::kRecorded ? was_held(recorded) : own_);
  // The law does not compute these fields.
  again.force_sequence = recorded.force_sequence;
  again.loop_age = recorded.loop_age;
  again.force_error = recorded.force_error;
  again.force_way = recorded.force_way;
  own_ = {.force = again.force};
  if (TurnStep* const turn = again.turn()) {
    own_.torque = turn->torque;
    turn->applied = held_ == Held::kOwn || !recorded.turn() ? own_.torque : recorded.turn()->applied;
  }
  if (GripStep* const grip = again.grip()) {
    own_.grip = grip->force;
    grip->applied = held_ == Held::kOwn || !recorded.grip() ? own_.grip : recorded.grip()->applied;
  }
  if (held_ == Held::kOwn) again.applied = own_.force;
  return again;
}

std::string difference(const StepRecord& recorded, const StepRecord& again) {
  std::string text;
  const auto say = [&text](std::string_view name, const std::string& was, const std::string& is) {
    text.append(text.empty() ? "" : "; ").append(name).append(": recorded ").append(was).append(", again ").append(is);
  };
  const auto number = [&say](std::string_view name, double was, double is) {
    if (!same(was, is)) say(name, digits(was), digits(is));
  };
  if (recorded.held != again.held) {
    say("interval_ns", std::to_string(recorded.held.count()), std::to_string(again.held.count()));
  }
  number("energy_j", recorded.energy, again.energy);
  number("permitted_n", recorded.permitted, again.permitted);
  if (!same(recorded.force, again.force)) say("force_commanded_n", digits(recorded.force), digits(again.force));
  if (recorded.turn() && again.turn() && !same(recorded.turn()->torque, again.turn()->torque)) {
    say("torque_commanded_nm", digits(recorded.turn()->torque), digits(again.turn()->torque));
  }
  if (recorded.grip() && again.grip()) {
    number("grip.energy_j", recorded.grip()->energy, again.grip()->energy);
    number("grip.force_commanded_n", recorded.grip()->force, again.grip()->force);
  }
  if (recorded.field.has_value() != again.field.has_value()) {
    say("field", recorded.field ? "in use" : "none", again.field ? "in use" : "none");
  } else if (recorded.field) {
    const FieldStep& was = *recorded.field;
    const FieldStep& is = *again.field;
    if (was.generation != is.generation) {
      say("field.generation", std::to_string(was.generation), std::to_string(is.generation));
    }
    if (!same(was.force, is.force)) say("field.force_n", digits(was.force), digits(is.force));
    if (!same(was.proxy, is.proxy)) say("field.proxy_m", digits(was.proxy), digits(is.proxy));
    number("field.depth_m", was.depth, is.depth);
    number("field.stored_j", was.stored, is.stored);
    number("field.refused_j", was.refused, is.refused);
    number("field.credited_j", was.credit, is.credit);
  }
  if (recorded.mode != again.mode) {
    say("mode", std::to_string(static_cast<int>(recorded.mode)), std::to_string(static_cast<int>(again.mode)));
  }
  if (of_the_law(recorded.reasons) != of_the_law(again.reasons)) {
    say("reasons", "\"" + to_string(of_the_law(recorded.reasons)) + "\"",
        "\"" + to_string(of_the_law(again.reasons)) + "\"");
  }
  return text;
}

}  // namespace tendon::replay
