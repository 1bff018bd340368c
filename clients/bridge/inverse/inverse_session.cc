// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/inverse/inverse_session.h"

#include <algorithm>
#include <chrono>
#include <optional>
#include <utility>

#include "clients/bridge/view.h"

namespace tendon::bridge {
namespace {

constexpr double kMostAtOnce = InverseSession::kMostPerSecond / 10;  ///< maximum of older messages to read

double milliseconds_of(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

std::optional<Quat> operator_from_device(const BridgedDevice& bridged) {
  return bridged.handle() ? bridged.handle()->operator_from_device : std::nullopt;
}

void set_basis(const std::string& permutation, std::string& text, Frame& frame) {
  text = permutation;
  frame = inverse_frame(*basis_of(permutation));
}

}  // namespace

std::vector<InverseDevice> inverse_devices(std::span<const std::pair<std::string, BridgedDevice*>> all_bridged) {
  std::vector<InverseDevice> devices;
  for (const auto& [name, bridged] : all_bridged) {
    const auto taken = [&](const std::string& id) {
      return std::ranges::any_of(devices, [&](const InverseDevice& d) { return d.id == id || d.grip_id == id; });
    };
    InverseDevice device{.name = name, .id = id_of(name), .grip_id = id_of(name + " grip"), .bridged = bridged};
    for (std::string more = name; taken(device.id) || taken(device.grip_id);) {
      more += '\'';
      device.id = id_of(more);
      device.grip_id = id_of(more + " grip");
    }
    devices.push_back(std::move(device));
  }
  return devices;
}

InverseSession::InverseSession(BridgedDevice::Program program, std::span<const InverseDevice> devices,
                               InverseCounts& counts, LocalTime now)
    : program_(program), devices_(devices), counts_(counts), eyes_(devices.size()), refilled_(now) {
  ++counts_.clients;
  see(now);
}

InverseSession::~InverseSession() {
  for (const InverseDevice& device : devices_) device.bridged->release(program_);
}

std::string InverseSession::greeting(LocalTime now) { return reply(now, {}, true); }

bool InverseSession::see(LocalTime now) {
  bool pushed = false;
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    BridgedDevice& bridged = *devices_[i].bridged;
    Eye& eye = eyes_[i];
    if (std::exchange(eye.states, bridged.states()) != bridged.states() && bridged.state())
      eye.buttons |= bridged.state()->buttons;
    if (!eye.waiting || !may_push(now, bridged, eye)) continue;
    const Touch waited = *eye.waiting;
    if (now >= eye.until) {
      eye.waiting.reset();
    } else {
      push(now, bridged, eye, waited);
      pushed = true;
    }
  }
  return pushed;
}

LocalTime InverseSession::due() const noexcept {
  LocalTime due = LocalTime::max();
  for (const Eye& eye : eyes_) {
    if (eye.waiting) due = std::min(due, eye.pushed + kPace);
  }
  return due;
}

bool InverseSession::may_push(LocalTime now, const BridgedDevice& bridged, const Eye& eye) const noexcept {
  return bridged.owner() != program_ || eye.answered != bridged.states() || now >= eye.pushed + kPace;
}

BridgedDevice::Answer InverseSession::push(LocalTime now, BridgedDevice& bridged, Eye& eye, const Touch& touch) {
  if (!may_push(now, bridged, eye)) {
    eye.waiting = touch;
    eye.until = now + kFresh;
    return BridgedDevice::Answer::kTaken;
  }
  eye.waiting.reset();
  eye.pushed = now;
  eye.answered = bridged.states();
  return bridged.push(program_, now, now + kFresh, touch);
}

/// The newest message of a batch is always read, so it is subtracted first.
void InverseSession::refill(LocalTime now) {
  const double passed = std::chrono::duration<double>(now - refilled_).count();
  refilled_ = now;
  readable_ = std::clamp(readable_ + passed * kMostPerSecond, 0.0, kMostAtOnce) - 1;
}

std::vector<std::string> InverseSession::answer(LocalTime now, std::span<const std::string> messages) {
  std::vector<std::string> replies;
  replies.reserve(messages.size());
  counts_.messages += messages.size();
  refill(now);
  for (std::size_t i = 0; i < messages.size(); ++i) {
    if (i + 1 < messages.size()) {
      if (readable_ < 1) {
        ++counts_.skipped;
        replies.push_back(reply(now, {}, false));
        continue;
      }
      readable_ -= 1;
    }
    Wish wish = read_wish(messages[i]);
    if (!wish.read) ++counts_.unread;
    take(now, wish);
    counts_.ignored += wish.ignored;
    counts_.refused += wish.refused.size();
    replies.push_back(reply(now, std::move(wish.refused), wish.full_state));
  }
  return replies;
}

void InverseSession::take(LocalTime now, Wish& wish) {
  if (wish.permutation) {
    for (Eye& eye : eyes_) set_basis(*wish.permutation, eye.permutation, eye.frame);
  }
  for (const DeviceWish& asked : wish.devices) take(now, asked, wish);
}

void InverseSession::take(LocalTime now, const DeviceWish& asked, Wish& wish) {
  const auto refuse = [&](std::string sentence) {
    if (wish.refused.size() < kMostRefusals) wish.refused.push_back(std::move(sentence));
  };
  const auto found = std::ranges::find(devices_, asked.device_id, &InverseDevice::id);
  if (found == devices_.end()) return refuse("device_id: expected one of the devices in the replies");
  Eye& eye = eyes_[static_cast<std::size_t>(found - devices_.begin())];
  if (asked.permutation) set_basis(*asked.permutation, eye.permutation, eye.frame);
  if (!asked.force && !asked.torque && !asked.grip_force) return;
  BridgedDevice& bridged = *found->bridged;
  if (asked.torque && bridged.handle() && bridged.handle()->max_torque == 0)
    refuse(found->name + ": the device has no motors for rotation");
  const bool nothing = asked.force.value_or(Vec3::Zero()).isZero(0) && asked.torque.value_or(Vec3::Zero()).isZero(0) &&
                       asked.grip_force.value_or(0) == 0;
  if (nothing && bridged.owner() != program_) return;

  const View turned(eye.frame, operator_from_device(bridged));
  Touch touch = turned.base_force(asked.force.value_or(Vec3::Zero()));
  if (asked.torque) touch.torque = turned.base_torque(*asked.torque);
  touch.grip_force = asked.grip_force;
  switch (push(now, bridged, eye, touch)) {
    case BridgedDevice::Answer::kTaken:
      return;
    case BridgedDevice::Answer::kOwned:
      return refuse(found->name + ": another client controls the force, so this one was ignored");
    case BridgedDevice::Answer::kObserving:
      return refuse(found->name + ": forces are disabled by --observe");
  }
}

std::string InverseSession::reply(LocalTime now, std::vector<std::string> refused, bool whole) {
  News news;
  if (whole) news.session_id = program_;
  for (std::size_t i = 0; i < devices_.size(); ++i) news.devices.push_back(news_of(now, devices_[i], eyes_[i]));
  news.refused = std::move(refused);
  return to_json(news);
}

DeviceNews InverseSession::news_of(LocalTime now, const InverseDevice& device, Eye& eye) const {
  const BridgedDevice& bridged = *device.bridged;
  DeviceNews news{.name = device.name,
                  .device_id = device.id,
                  .grip_id = device.grip_id,
                  .permutation = eye.permutation,
                  .left_handed = bridged.handle() && bridged.handle()->hand == Hand::kLeft,
                  .in_use = bridged.owner() != 0};
  if (!bridged.state()) return news;
  const DeviceState& state = *bridged.state();
  const View turned(eye.frame, operator_from_device(bridged));
  DeviceNews::State& told = news.state.emplace();
  told.position = turned.position(state.position);
  told.velocity = turned.position(state.velocity);
  told.force = turned.force(state.force_applied);
  told.orientation = Quat{};
  if (state.turning) {
    told.orientation = quaternion_of(turned.orientation(state.turning->orientation));
    told.angular_velocity = turned.torque(state.turning->angular_velocity);
  }
  told.buttons = std::exchange(eye.buttons, 0U) | state.buttons;
  told.tick = state.tick;
  told.age_ms = milliseconds_of(now - bridged.arrived());
  told.reasons = to_string(Reasons::from_bits(state.reasons));
  told.energy_j = state.energy;
  told.permitted_force_n = state.permitted_force;
  told.force_age_ms = milliseconds_of(state.force_age);
  if (state.torque_applied) told.torque = turned.torque(*state.torque_applied);
  if (state.grip) told.grip_rad = state.grip->opening;
  told.grip_force_n = state.grip_applied;
  return news;
}

}  // namespace tendon::bridge
