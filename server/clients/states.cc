// SPDX-License-Identifier: Apache-2.0
#include "server/clients/states.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "protocol/limits.h"
#include "protocol/wire/codec.h"

namespace tendon {
namespace {

/// Removes values that do not fit into a frame. Forces of engines are limited, but not their sum or the sensor.
void leave_out_what_no_frame_carries(DeviceState& state) {
  for (auto* const vector : {&state.force_wanted, &state.hand_force}) {
    if (*vector && !((*vector)->array().abs() <= limits::kMaxValue).all()) vector->reset();
  }
  std::optional<Mat3>& stiffness = state.stiffness_wanted;
  const bool tells =
      state.force_wanted && stiffness && !stiffness->isZero(0) && (stiffness->array().abs() <= limits::kMaxValue).all();
  if (!tells) stiffness.reset();
  const auto fits = [](double value) { return std::abs(value) <= limits::kMaxValue; };
  if (state.joints &&
      !(std::ranges::all_of(state.joints->angle, fits) && std::ranges::all_of(state.joints->velocity, fits)))
    state.joints.reset();
}

bool fits_a_frame(const FieldState& field) {
  return std::abs(field.depth) <= limits::kMaxValue && (field.proxy.array().abs() <= limits::kMaxValue).all();
}

void leave_out_handle(DeviceState& state) {
  state.turning.reset();
  state.torque_applied.reset();
  state.grip.reset();
  state.grip_applied.reset();
  state.hand_force.reset();
}

}  // namespace

bool publish_state(ServedClient& client, Subscription& subscription, const DeviceState& state) {
  if (client.coupled && client.coupled->device == subscription.device) return false;
  if (client.has<kFeatureHandle>()) subscription.pressed |= state.buttons;
  const std::uint64_t one_in = client.adaptation ? client.adaptation->one_in() : 1;
  if (state.tick - subscription.last_state < std::max(subscription.state_every, one_in)) return false;
  DeviceState told = state;
  told.device = number_of(subscription.device);
  if (!client.has<kFeatureDiagnostics>()) {
    told.force_wanted.reset();
    told.stiffness_wanted.reset();
  }
  if (!client.has<kFeatureHandle>()) leave_out_handle(told);
  if (!client.has<kFeatureJoints>()) told.joints.reset();
  leave_out_what_no_frame_carries(told);
  if (told.field && !(client.has<kFeatureFields>() && fits_a_frame(*told.field))) told.field.reset();
  told.buttons = subscription.pressed;
  // The client uses these rounded values for its prediction.
  if (client.has<kFeatureStateColumns>() && fits_columns(told)) round_to_columns(told);
  if (subscription.deadband && !subscription.deadband->passes(told)) {
    subscription.pressed = 0;  // otherwise, the next release would not be visible
    return true;
  }
  subscription.last_state = state.tick;
  subscription.pressed = 0;
  client.session.send(told);
  return false;
}

}  // namespace tendon
