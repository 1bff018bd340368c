// SPDX-License-Identifier: Apache-2.0
#include "server/clients/leases.h"

namespace tendon {

void Leases::hold(LocalTime now, std::uint32_t device, std::uint32_t channel, const ServedClient& client) {
  ServedChannel& held = devices_[device].channels[channel];
  held.holder = client.id();
  held.renewed = now;
  held.lateness.begin(now, is_loopback(client.address));
  held.doubt = {};
}

void Leases::give(std::uint32_t device, std::uint32_t channel, std::uint32_t client) {
  ServedChannel& held = devices_[device].channels[channel];
  if (held.holder != client) return;
  // The queue can only be full if the haptic thread is blocked. The force then expires because of its age, and
  // FieldSlots stops a field.
  devices_[device].mail->orders.try_push({.kind = HapticOrder::Kind::kRelease, .channel = channel, .source = client});
  held.holder = 0;
  if (devices_[device].outputs.turn_off_those_of(client)) {
    devices_[device].mail->outputs.put(devices_[device].outputs.settings());
  }
  held.lateness.end();
}

void Leases::give_all(std::uint32_t client) {
  for (std::uint32_t device = 0; device < devices_.size(); ++device) {
    for (std::uint32_t channel = 0; channel < devices_[device].channels.size(); ++channel)
      give(device, channel, client);
  }
}

Leases::Taken Leases::take(LocalTime now, std::uint32_t device, std::uint32_t channel, const ServedClient& client,
                           bool may_take_over) {
  ServedChannel& wanted = devices_[device].channels[channel];
  const std::uint32_t before = wanted.holder;
  if (before == client.id()) return {.granted = true};
  if (before != 0) {
    const Duration lease = devices_[device].about.channels[channel].lease;
    const Duration left = wanted.renewed + lease - now;
    const bool over = lease > Duration::zero() && left <= Duration::zero();
    if (!over && (lease == Duration::zero() || !may_take_over)) {
      return {.holder = before, .wait = lease > Duration::zero() ? left : Duration::zero()};
    }
    ++wanted.handovers;
    give(device, channel, before);
  }
  hold(now, device, channel, client);
  return {.granted = true, .loser = before};
}

}  // namespace tendon
