// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/chai3d/host.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace tendon::bridge::chai3d {
namespace {

constexpr BridgedDevice::Program kProgram = 1;

std::array<double, 3> array_of(const Vec3& v) { return {v.x(), v.y(), v.z()}; }
Vec3 vector_of(const std::array<double, 3>& a) { return {a[0], a[1], a[2]}; }

std::int64_t nanoseconds(LocalTime time) {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(time.time_since_epoch()).count();
}

HandNow hand_of(const DeviceState& state, const View& view, LocalTime arrived) {
  const Mat3 rotation = state.turning ? view.orientation(state.turning->orientation) : Mat3(Mat3::Identity());
  HandNow hand{.at_ns = nanoseconds(arrived),
               .tick = state.tick,
               .position = array_of(view.position(state.position)),
               .velocity = array_of(view.position(state.velocity)),
               .buttons = state.buttons};
  for (Eigen::Index row = 0; row < 3; ++row) {
    for (Eigen::Index column = 0; column < 3; ++column) {
      hand.rotation[static_cast<std::size_t>(3 * row + column)] = rotation(row, column);
    }
  }
  return hand;
}

}  // namespace

void Host::describe(std::size_t i, BridgedDevice& bridged) {
  SharedDevice& shared = hands_.device[i];
  const DeviceDescription& about = *bridged.description();
  const std::string& model = config_.model.empty() ? about.model : config_.model;
  shared.model = {};
  std::copy_n(model.begin(), std::min(model.size(), shared.model.size() - 1), shared.model.begin());
  shared.workspace_radius =
      about.workspace ? (about.workspace->max - about.workspace->min).minCoeff() / 2 : kWorkspaceRadius;
  devices_[i].described = true;
  const bool all = std::all_of(devices_.begin(), devices_.begin() + hands_.devices,
                               [](const Device& device) { return device.described; });
  if (all) hands_.ready.store(1, std::memory_order_release);
}

bool Host::exchange(std::size_t i, BridgedDevice& bridged, LocalTime now) {
  Device& device = devices_[i];
  SharedDevice& shared = hands_.device[i];
  if (bridged.lost()) device.view.reset();  // the orientation of the next device may differ
  if (!device.view && bridged.state() && bridged.handle() && bridged.description()) {
    device.view.emplace(*find_frame("chai3d"), bridged.handle()->operator_from_device);
  }
  if (device.view && bridged.state() && bridged.states() != device.states) {
    device.states = bridged.states();
    shared.hand.put(hand_of(*bridged.state(), *device.view, bridged.arrived()));
    if (!device.described) describe(i, bridged);
    news_ = true;
  }
  Asked asked;
  if (!shared.asked.get(asked) || asked.count == device.asked) return false;
  device.asked = asked.count;
  if (asked.open == 0) {
    bridged.release(kProgram);
    return false;
  }
  if (!device.view) return false;
  const bool turns = bridged.handle() && bridged.handle()->max_torque > 0;
  Touch touch = device.view->base_force(vector_of(asked.force));
  if (turns) touch.torque = device.view->base_torque(vector_of(asked.torque));
  const LocalTime until = LocalTime(std::chrono::nanoseconds(asked.at_ns)) + config_.stale;
  if (until <= now) return false;
  return bridged.push(kProgram, now, until, touch) == BridgedDevice::Answer::kTaken;
}

bool Host::announce() {
  if (!std::exchange(news_, false)) return false;
  hands_.news.fetch_add(1);
  return hands_.waiting.load() > 0;
}

}  // namespace tendon::bridge::chai3d
