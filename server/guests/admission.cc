// SPDX-License-Identifier: Apache-2.0
#include "server/guests/admission.h"

#include <algorithm>
#include <stdexcept>

namespace tendon {
namespace {

/// The place of the one of that name; the first, when `name` is empty.
template <class Named>
std::optional<std::uint32_t> place_of(const std::vector<Named>& all, const std::string& name) {
  if (name.empty()) return 0;
  const auto found = std::find_if(all.begin(), all.end(), [&](const Named& one) { return one.name == name; });
  if (found == all.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - all.begin());
}

const std::string& name_of(const ServedDevice& device) { return device.about.name; }
const std::string& name_of(const ChannelDescription& channel) { return channel.name; }

template <class Named>
std::string names_of(const std::vector<Named>& all) {
  std::string names;
  for (const Named& one : all) names += (names.empty() ? "\"" : ", \"") + name_of(one) + "\"";
  return names;
}

/// Whether the holder of `key` may have `role`.
bool may(const ClientKey* key, Role role) {
  return key == nullptr || key->role == Role::kController || role == Role::kObserver;
}

bool has_controller(const std::vector<Seat>& seats) {
  return std::any_of(seats.begin(), seats.end(), [](const Seat& seat) { return seat.role == Role::kController; });
}

template <class Named>
void check_names(const std::vector<Named>& all, std::size_t most, const std::string& what) {
  if (all.empty() || all.size() > most) {
    throw std::invalid_argument("expected 1 to " + std::to_string(most) + " " + what + "s, got " +
                                std::to_string(all.size()));
  }
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (place_of(all, all[i].name) != i) throw std::invalid_argument("two " + what + "s have one name: " + all[i].name);
  }
}

}  // namespace

void check_devices(const std::vector<DeviceDescription>& devices) {
  check_names(devices, limits::kMaxDevices, "device");
  for (const DeviceDescription& device : devices) check_names(device.channels, limits::kMaxChannels, "channel");
}

std::variant<std::vector<Seat>, Refusal> Admission::seats_of(const Hello& hello) const {
  if (hello.claims.empty()) return std::vector<Seat>{{.device = 0, .channel = 0, .role = hello.role}};
  std::vector<Seat> seats;
  Role highest = Role::kObserver;
  for (const Claim& claim : hello.claims) {
    const auto found = std::find_if(devices_.begin(), devices_.end(), [&](const ServedDevice& device) {
      return claim.device.empty() || device.about.name == claim.device;
    });
    if (found == devices_.end()) {
      return Refusal{Code::kInvalid, "there is no device \"" + claim.device + "\", only " + names_of(devices_)};
    }
    const auto device = static_cast<std::uint32_t>(found - devices_.begin());
    const auto& channels = found->about.channels;
    const auto channel = claim.role == Role::kController ? place_of(channels, claim.channel) : 0;
    if (!channel) {
      return Refusal{Code::kInvalid, "there is no channel \"" + claim.channel + "\", only " + names_of(channels)};
    }
    const bool twice = std::any_of(seats.begin(), seats.end(), [&](const Seat& seat) {
      return seat.device == device && seat.channel == *channel && seat.role == claim.role;
    });
    if (twice) return Refusal{Code::kInvalid, "the same is claimed twice"};
    highest = std::max(highest, claim.role);
    seats.push_back({.device = device, .channel = *channel, .role = claim.role, .by_name = true});
  }
  if (highest != hello.role) return Refusal{Code::kInvalid, "the role is not the highest of the claims'"};
  return seats;
}

bool Admission::takes_the_place_of(const Guest& present, const Address& from, const ClientKey* key,
                                   const std::vector<Seat>& seats) {
  if (key != present.key) return false;
  if (present.address == from) return true;
  return key != nullptr && std::any_of(seats.begin(), seats.end(), [&](const Seat& seat) {
           return seat.role == Role::kController && present.sits_on(seat.device, seat.channel);
         });
}

std::optional<Refusal> Admission::reason_to_refuse(const Address& from, const ClientKey* key,
                                                   const std::vector<Seat>& seats) const {
  if (key == nullptr && config_.keys > 0) {
    return Refusal{Code::kDenied, "this server lets in those who have a key: --key FILE"};
  }
  const bool controls = has_controller(seats);
  if (!may(key, controls ? Role::kController : Role::kObserver)) {
    return Refusal{Code::kDenied, "the key \"" + key->name + "\" is an observer's"};
  }
  for (const Seat& seat : seats) {
    const ServedDevice& device = devices_[seat.device];
    const bool can_wait = seat.by_name && device.about.channels[seat.channel].lease > Duration::zero();
    const Guest* const holder = holder_of(guests_, device.channels[seat.channel]);
    if (seat.role != Role::kController || holder == nullptr || can_wait) continue;
    if (takes_the_place_of(*holder, from, key, seats)) continue;
    return Refusal{Code::kBusy, "the device is controlled by \"" + holder->name + "\" at " +
                                    to_string(holder->address) + "; observers are welcome"};
  }
  const auto stays = [&](const Guest& guest) { return !guest.gone && !takes_the_place_of(guest, from, key, seats); };
  const auto observers = static_cast<std::size_t>(std::count_if(
      guests_.begin(), guests_.end(), [&](const Guest& g) { return g.role == Role::kObserver && stays(g); }));
  // A guest that waits for a lease is no observer, yet it is sent states.
  const auto guests = static_cast<std::size_t>(std::count_if(guests_.begin(), guests_.end(), stays));
  std::size_t channels = 0;
  for (const ServedDevice& device : devices_) channels += device.channels.size();
  if (!controls && observers >= config_.max_observers) {
    return Refusal{Code::kBusy, "there are " + std::to_string(observers) + " observers already"};
  }
  if (!controls && config_.keys > 1) {
    const auto of_key = static_cast<std::size_t>(std::count_if(guests_.begin(), guests_.end(), [&](const Guest& g) {
      return g.role == Role::kObserver && g.key == key && stays(g);
    }));
    // Half of the places, at least one: no key can keep all the others out.
    if (of_key >= std::max<std::size_t>((config_.max_observers + 1) / 2, 1)) {
      return Refusal{Code::kBusy, "the key \"" + key->name + "\" has " + std::to_string(of_key) + " observers already"};
    }
  }
  if (guests >= config_.max_observers + channels) {
    return Refusal{Code::kBusy, "there are " + std::to_string(guests) + " guests already"};
  }
  return std::nullopt;
}

std::vector<Grant> Admission::grants_of(const Address& from, const ClientKey* key,
                                        const std::vector<Seat>& seats) const {
  std::vector<Grant> grants;
  for (const Seat& seat : seats) {
    if (!seat.by_name) continue;
    const Guest* const holder = holder_of(guests_, devices_[seat.device].channels[seat.channel]);
    const bool free = holder == nullptr || takes_the_place_of(*holder, from, key, seats);
    grants.push_back({seat.device, seat.channel, free ? seat.role : Role::kObserver});
  }
  return grants;
}

}  // namespace tendon
