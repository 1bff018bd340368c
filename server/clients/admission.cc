// SPDX-License-Identifier: Apache-2.0
#include "server/clients/admission.h"

#include <algorithm>
#include <array>
#include <string_view>

#include "core/base/nearest_word.h"

namespace tendon {

namespace {

std::vector<std::string> in_common(const std::vector<std::string>& offered, Role role, bool has_fields) {
  std::vector<std::string> both;
  for (const std::string_view feature : Features::kSupported) {
    const bool not_for_it =
        (feature == kFeatureDiagnostics && role != Role::kObserver) || (feature == kFeatureFields && !has_fields);
    const bool is_offered = std::find(offered.begin(), offered.end(), feature) != offered.end();
    if (is_offered && !not_for_it) both.emplace_back(feature);
  }
  return both;
}

bool may(const ClientKey* key, Role role) {
  return key == nullptr || key->role == Role::kController || role == Role::kObserver;
}

const std::string& name_of(const ServedDevice::Config& device) { return device.about.name; }
const std::string& name_of(const ChannelDescription& channel) { return channel.name; }

/// An empty name finds the first entry.
template <class Named>
std::optional<std::uint32_t> find_by_name(const std::vector<Named>& all, const std::string& name) {
  if (name.empty()) return 0;
  const auto found = std::find_if(all.begin(), all.end(), [&](const Named& one) { return name_of(one) == name; });
  if (found == all.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - all.begin());
}

template <class Named>
Refusal not_there(const std::string& what, const std::string& name, const std::vector<Named>& all) {
  std::string reason = "there is no " + what + " \"" + name + "\", only";
  if (all.size() > limits::kMaxDevices) {
    reason += " \"" + name_of(all.front()) + "\" to \"" + name_of(all.back()) + "\"";
    return {Code::kInvalid, reason};
  }
  std::vector<std::string_view> names;
  for (const Named& one : all) {
    reason += (names.empty() ? " \"" : ", \"") + name_of(one) + "\"";
    names.push_back(name_of(one));
  }
  return {Code::kInvalid, reason + did_you_mean(name, names)};
}

bool is_controller(const Slot& slot) { return slot.role == Role::kController; }

}  // namespace

std::variant<std::vector<Slot>, Refusal> Admission::slots_of(const Hello& hello,
                                                             const std::vector<ServedDevice::Config>& devices) {
  if (hello.claims.empty()) return std::vector<Slot>{{.device = 0, .channel = 0, .role = hello.role}};
  std::vector<Slot> slots;
  Role highest = Role::kObserver;
  for (const Claim& claim : hello.claims) {
    const auto device = find_by_name(devices, claim.device);
    if (!device) return not_there("device", claim.device, devices);
    if (!slots.empty() && bank_of(*device) != bank_of(slots.front().device)) {
      const auto name = [&](std::size_t index) { return "\"" + name_of(devices[index]) + "\""; };
      const std::size_t first = slots.front().device - number_of(slots.front().device);
      const std::size_t last = std::min<std::size_t>(first + limits::kMaxDevices, devices.size()) - 1;
      return Refusal{Code::kInvalid, "all devices of a session must be in the same bank: expected " + name(first) +
                                         " to " + name(last) + ", and not " + name(*device)};
    }
    const auto& channels = devices[*device].about.channels;
    const auto channel = claim.role == Role::kController ? find_by_name(channels, claim.channel) : 0;
    if (!channel) return not_there("channel", claim.channel, channels);
    const bool twice = std::any_of(slots.begin(), slots.end(), [&](const Slot& slot) {
      return slot.device == *device && slot.channel == *channel && slot.role == claim.role;
    });
    if (twice) return Refusal{Code::kInvalid, "the same channel is claimed twice"};
    highest = std::max(highest, claim.role);
    slots.push_back({.device = *device, .channel = *channel, .role = claim.role, .by_name = true});
  }
  if (highest != hello.role)
    return Refusal{Code::kInvalid, "the role of the Hello is not the highest role of its claims"};
  return slots;
}

bool Admission::replaces(const ServedClient& present, const Address& from, const ClientKey* key,
                         const std::vector<Slot>& slots) {
  if (key != present.key) return false;
  if (present.address == from) return true;
  return key != nullptr && std::any_of(slots.begin(), slots.end(), [&](const Slot& slot) {
           return is_controller(slot) && holds_slot(present, slot.device, slot.channel);
         });
}

std::optional<Refusal> Admission::reason_to_refuse(const Address& from, const ClientKey* key,
                                                   const std::vector<Slot>& slots,
                                                   const std::vector<ServedDevice>& devices,
                                                   const std::vector<ServedClient>& clients) const {
  const bool let_in = config_.keys == 0 || (config_.needs_no_key != nullptr && config_.needs_no_key(from));
  if (key == nullptr && !let_in) {
    return Refusal{Code::kDenied, "this server only accepts clients with a key: use --key FILE"};
  }
  const bool controls = std::any_of(slots.begin(), slots.end(), is_controller);
  if (!may(key, controls ? Role::kController : Role::kObserver)) {
    return Refusal{Code::kDenied, "the key \"" + key->name + "\" only permits observers"};
  }
  for (const Slot& slot : slots) {
    const ServedDevice& device = devices[slot.device];
    const bool can_wait = slot.by_name && device.about.channels[slot.channel].lease > Duration::zero();
    const ServedClient* const holder = client_of(clients, device.channels[slot.channel].holder);
    if (!is_controller(slot) || holder == nullptr || can_wait) continue;
    if (replaces(*holder, from, key, slots)) continue;
    return Refusal{Code::kBusy, "the device is controlled by \"" + holder->name + "\" at " +
                                    to_string(holder->address) + "; it only accepts observers"};
  }
  const auto count = [&](auto counts) {
    return static_cast<std::size_t>(std::count_if(clients.begin(), clients.end(), [&](const ServedClient& client) {
      return !client.gone && counts(client) && !replaces(client, from, key, slots);
    }));
  };
  const auto observes = [](const ServedClient& client) { return client.role == Role::kObserver; };
  if (const std::size_t observers = count(observes); !controls && observers >= config_.max_observers) {
    return Refusal{Code::kBusy, "there are " + std::to_string(observers) + " observers already"};
  }
  if (!controls && key != nullptr && config_.keys > 1) {
    const std::size_t of_key = count([&](const ServedClient& client) { return observes(client) && client.key == key; });
    if (of_key >= std::max<std::size_t>((config_.max_observers + 1) / 2, 1)) {
      return Refusal{Code::kBusy, "the key \"" + key->name + "\" has " + std::to_string(of_key) + " observers already"};
    }
  }
  std::size_t channels = 0;
  for (const ServedDevice& device : devices) channels += device.channels.size();
  // A controller that waits for a lease receives states at the same rate as an observer.
  const std::size_t all = count([](const ServedClient&) { return true; });
  if (all >= config_.max_observers + channels) {
    return Refusal{Code::kBusy, "there are " + std::to_string(all) + " clients already"};
  }
  return std::nullopt;
}

Welcome Admission::welcome_for(const ServerHandshake::Client& client, const Address& from,
                               const std::vector<Slot>& slots, const std::vector<ServedDevice>& devices,
                               const std::vector<ServedClient>& clients) {
  Welcome welcome;
  welcome.version = client.version;
  const bool has_fields = std::any_of(slots.begin(), slots.end(),
                                      [&](const Slot& slot) { return devices[slot.device].fields.has_value(); });
  welcome.features = in_common(client.hello.features, client.hello.role, has_fields);
  welcome.role = client.hello.role;
  const DeviceDescription& first = devices[slots.front().device].about;
  welcome.device_name = first.model;
  welcome.max_force = first.max_force;
  welcome.position_resolution = first.position_resolution;
  welcome.loop_hz = first.loop_hz;
  for (const Slot& slot : slots) {
    const ServedClient* const holder = client_of(clients, devices[slot.device].channels[slot.channel].holder);
    const bool free = holder == nullptr || replaces(*holder, from, client.key, slots);
    const Role role = free ? slot.role : Role::kObserver;
    if (slot.by_name) welcome.grants.push_back({number_of(slot.device), slot.channel, role});
  }
  return welcome;
}

std::vector<Subscription> Admission::subscriptions_of(const std::vector<Slot>& slots) {
  std::vector<Subscription> subscriptions;
  for (const Slot& slot : slots) {
    const bool seen = std::any_of(subscriptions.begin(), subscriptions.end(),
                                  [&](const Subscription& subscription) { return subscription.device == slot.device; });
    if (!seen) subscriptions.push_back({.device = slot.device});
  }
  return subscriptions;
}

}  // namespace tendon
