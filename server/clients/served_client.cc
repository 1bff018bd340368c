// SPDX-License-Identifier: Apache-2.0
#include "server/clients/served_client.h"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <string>
#include <string_view>
#include <unordered_set>
#include <utility>

namespace tendon {

namespace {

template <class Named>
void check_names(const std::vector<Named>& all, std::size_t most, const std::string& what) {
  if (all.empty() || all.size() > most) {
    throw std::invalid_argument("expected 1 to " + std::to_string(most) + " " + what + "s, got " +
                                std::to_string(all.size()));
  }
  std::unordered_set<std::string_view> names;
  for (const Named& one : all) {
    if (!names.insert(one.name).second) throw std::invalid_argument("two " + what + "s have one name: " + one.name);
  }
}

template <class Clients>
auto* find_client(Clients& clients, std::uint32_t id) {
  const auto found = std::find_if(clients.begin(), clients.end(),
                                  [&](const ServedClient& client) { return !client.gone && client.id() == id; });
  return found == clients.end() ? nullptr : &*found;
}

}  // namespace

bool holds_slot(const ServedClient& client, std::uint32_t device, std::uint32_t channel) {
  return std::any_of(client.slots.begin(), client.slots.end(), [&](const Slot& slot) {
    return slot.device == device && slot.channel == channel && slot.role == Role::kController;
  });
}

bool controls(const ServedClient& client, std::uint32_t device) {
  return std::any_of(client.slots.begin(), client.slots.end(),
                     [&](const Slot& slot) { return slot.device == device && slot.role == Role::kController; });
}

Subscription* subscription_to(ServedClient& client, std::uint32_t device) {
  const auto subscription = std::find_if(client.subscriptions.begin(), client.subscriptions.end(),
                                         [&](const Subscription& seen) { return seen.device == device; });
  return subscription == client.subscriptions.end() ? nullptr : &*subscription;
}

ServedClient* client_of(std::vector<ServedClient>& clients, std::uint32_t id) { return find_client(clients, id); }
const ServedClient* client_of(const std::vector<ServedClient>& clients, std::uint32_t id) {
  return find_client(clients, id);
}

bool renew_peer(ServedDevice& device, std::uint32_t coupling) {
  const std::uint32_t number = device.peers.at(coupling) + 1;
  const HapticOrder order{.kind = HapticOrder::Kind::kRenew, .source = number, .coupling = coupling};
  if (!device.mail->orders.try_push(order)) return false;
  device.peers.at(coupling) = number;
  return true;
}

std::optional<std::uint32_t> coupling_by(const ServedDevice& device, std::uint32_t channel) {
  if (!device.coupling) return std::nullopt;
  if (device.leaders.empty()) return 0;
  const auto leader = std::find(device.leaders.begin(), device.leaders.end(), channel);
  if (leader == device.leaders.end()) return std::nullopt;
  return static_cast<std::uint32_t>(leader - device.leaders.begin());
}

std::vector<ServedDevice> served_devices(const std::vector<ServedDevice::Config>& all, const Shard& shard) {
  std::vector<DeviceDescription> about;
  for (const ServedDevice::Config& device : all) {
    about.push_back(device.about);
    check_names(device.about.channels, limits::kMaxChannels, "channel");
    if (device.mail == nullptr) throw std::invalid_argument("expected mailboxes for each device");
  }
  check_names(about, kMostDevices, "device");
  const std::size_t banks = (all.size() + limits::kMaxDevices - 1) / limits::kMaxDevices;
  if (!std::has_single_bit(shard.of) || shard.of > banks || shard.number >= shard.of) {
    throw std::invalid_argument("there is no shard " + std::to_string(shard.number) + " of " +
                                std::to_string(shard.of) + " for " + std::to_string(all.size()) + " devices");
  }
  std::vector<ServedDevice> devices;
  devices.reserve(shard.end_device(all.size()) - shard.first_device(all.size()));
  for (std::size_t i = shard.first_device(all.size()); i < shard.end_device(all.size()); ++i) {
    const ServedDevice::Config& config = all[i];
    ServedDevice& device = devices.emplace_back(ServedDevice{.about = config.about,
                                                             .handle = config.handle,
                                                             .mail = config.mail,
                                                             .coupling = config.coupling,
                                                             .leaders = config.leaders,
                                                             .fields = config.fields});
    device.about.device = device.handle.device = number_of(static_cast<std::uint32_t>(i));
    device.channels.resize(device.about.channels.size());
  }
  return devices;
}

}  // namespace tendon
