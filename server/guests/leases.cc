// SPDX-License-Identifier: Apache-2.0
#include "server/guests/leases.h"

namespace tendon {

void Leases::hold(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest) {
  ServedChannel& held = devices_[device].channels[channel];
  held.holder = guest.id();
  held.renewed = now;
  held.lateness.begin(now, is_loopback(guest.address));
  held.doubt = {};
}

void Leases::give(std::uint32_t device, std::uint32_t channel, std::uint32_t guest) {
  ServedChannel& held = devices_[device].channels[channel];
  if (held.holder != guest) return;
  // The queue can only be full if the haptic thread is blocked. In this case, the force expires because of its age.
  devices_[device].mail->orders.try_push({.kind = HapticOrder::Kind::kRelease, .channel = channel, .source = guest});
  held.holder = 0;
  if (devices_[device].outputs.turn_off_those_of(guest)) {
    devices_[device].mail->outputs.put(devices_[device].outputs.settings());
  }
  held.lateness.end();
}

void Leases::give_all(std::uint32_t guest) {
  for (std::uint32_t device = 0; device < devices_.size(); ++device) {
    for (std::uint32_t channel = 0; channel < devices_[device].channels.size(); ++channel) give(device, channel, guest);
  }
}

Leases::Taken Leases::take(LocalTime now, std::uint32_t device, std::uint32_t channel, const Guest& guest,
                           bool may_take_over) {
  ServedChannel& wanted = devices_[device].channels[channel];
  const std::uint32_t before = wanted.holder;
  if (before == guest.id()) return {.granted = true};
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
  hold(now, device, channel, guest);
  return {.granted = true, .loser = before};
}

}  // namespace tendon
