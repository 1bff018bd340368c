// SPDX-License-Identifier: Apache-2.0
#include "server/guests/leases.h"

#include <algorithm>
#include <utility>

namespace tendon {

Leases::Leases(std::vector<ServedDevice>& devices, std::vector<std::string> takeover)
    : devices_(devices), takeover_(std::move(takeover)) {}

void Leases::hold(LocalTime now, const Guest& guest, std::uint32_t device, std::uint32_t channel) {
  ServedChannel& held = devices_[device].channels[channel];
  held.holder = guest.id();
  held.renewed = now;
  held.lateness.begin(now);
}

void Leases::free(std::uint32_t device, std::uint32_t channel) {
  ServedChannel& held = devices_[device].channels[channel];
  // A full ring means that 16 orders wait: the haptic thread stands still, and the force's age will do the same later.
  devices_[device].mail->orders.try_push({HapticOrder::Kind::kRelease, channel, held.holder});
  held.holder = 0;
  held.lateness.end();
}

void Leases::free_all(const Guest& guest) {
  for (const Seat& seat : guest.seats) {
    if (devices_[seat.device].channels[seat.channel].holder == guest.id()) free(seat.device, seat.channel);
  }
}

Leases::Answer Leases::take(LocalTime now, const Guest& guest, const Guest* holder, const TakeLease& wanted) {
  ServedDevice& device = devices_[wanted.device];
  ServedChannel& channel = device.channels[wanted.channel];
  if (holder == &guest) return {};
  Answer answer;
  if (holder != nullptr) {
    const Duration lease = device.about.channels[wanted.channel].lease;
    const Duration left = channel.renewed + lease - now;
    const bool over = lease > Duration::zero() && left <= Duration::zero();
    if (!over && (lease == Duration::zero() || !may_take_over(guest))) {
      return {.code = Code::kBusy,
              .reason = "\"" + holder->name + "\" holds it",
              .wait = lease > Duration::zero() ? left : Duration::zero()};
    }
    ++channel.handovers;
    answer.loser = channel.holder;
    free(wanted.device, wanted.channel);
  }
  hold(now, guest, wanted.device, wanted.channel);
  return answer;
}

bool Leases::may_take_over(const Guest& guest) const {
  const std::string& name = guest.key != nullptr ? guest.key->name : guest.name;
  return std::find(takeover_.begin(), takeover_.end(), name) != takeover_.end();
}

}  // namespace tendon
