// SPDX-License-Identifier: Apache-2.0
#include "server/clients/port_exchange.h"

#include <algorithm>
#include <iterator>
#include <optional>
#include <utility>

namespace tendon {
namespace {

constexpr Duration kShowEvery = std::chrono::milliseconds(20);

/// Adds the scales to the port of the leader because observers do not receive the Couple message.
void write_scales(PortState& leader, const Couple& coupling) {
  if (leader.position_scale == 0) leader.position_scale = coupling.position_scale;
  if (leader.force_scale == 0) leader.force_scale = coupling.force_scale;
}

}  // namespace

PortExchange::PortExchange(std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients, Leases& leases)
    : devices_(devices), clients_(clients), leases_(leases) {
  for (std::uint32_t index = 0; index < devices.size(); ++index) {
    if (devices[index].coupling) coupled_.push_back(index);
  }
}

void PortExchange::dial(LocalTime now, std::uint32_t device, const Peer::Config& server, Peer::Send send) {
  dialled_.push_back({device, std::make_unique<Peer>(server, std::move(send), now)});
}

void PortExchange::publish(LocalTime now) {
  for (const std::uint32_t device : coupled_) {
    auto& ports = devices_[device].mail->port_out;
    for (std::uint32_t coupling = 0; coupling < ports.size(); ++coupling) {
      const PortState* const port = ports[coupling].take();
      if (port != nullptr) publish(now, device, coupling, *port);
    }
  }
}

void PortExchange::publish(LocalTime now, std::uint32_t device, std::uint32_t coupling, const PortState& port) {
  devices_[device].phase = port.phase;
  for (const Dialled& dialled : dialled_) {
    if (dialled.device == device) dialled.peer->send(now, port);
  }
  PortFrame frame;
  static_cast<PortState&>(frame) = port;
  frame.device = number_of(device);
  const auto& leaders = devices_[device].leaders;
  if (coupling < leaders.size()) frame.channel = leaders[coupling];
  for (ServedClient& client : clients_) {
    if (client.gone || !client.coupled || client.coupled->device != device) continue;
    if (coupling_by(devices_[device], client.coupled->channel) != coupling) continue;
    frame.channel = client.coupled->channel;
    client.session.send(frame);
  }
  show(now, device, coupling, frame);
}

/// Sends both ports of a coupling to the observers, at the rate of their states. `mine` has the channel of the peer.
void PortExchange::show(LocalTime now, std::uint32_t index, std::uint32_t coupling, PortFrame mine) {
  ServedDevice& device = devices_[index];
  PortFrame& theirs = device.peer_ports[coupling];
  write_scales(device.coupling->role == PortRole::kLeader ? mine : theirs, *device.coupling);
  for (ServedClient& client : clients_) {
    Subscription* const subscription = client.sees_ports() && !client.gone ? subscription_to(client, index) : nullptr;
    if (subscription == nullptr || now < subscription->ports[coupling].due) continue;
    const std::uint64_t every =
        std::max<std::uint64_t>(subscription->state_every, client.adaptation ? client.adaptation->one_in() : 1);
    const Duration period =
        static_cast<std::int64_t>(every) * Duration(std::chrono::seconds(1)) / std::max(device.about.loop_hz, 1U);
    subscription->ports[coupling].due = now + std::max(kShowEvery, period);
    client.session.send(mine);
    if (std::exchange(subscription->ports[coupling].peer_waits, false)) client.session.send(theirs);
  }
}

bool PortExchange::take(LocalTime now, const ServedClient& client, const PortFrame& port) {
  const std::uint32_t index = client.device_of(port.device);
  const bool coupled = client.coupled && client.coupled->device == index && client.coupled->channel == port.channel;
  if (!coupled || leases_.holder(index, port.channel) != client.id()) return false;
  leases_.renew(now, index, port.channel);
  const auto coupling = coupling_by(devices_[index], port.channel);
  if (coupling) arrived(now, index, *coupling, port.channel, port);
  return true;
}

void PortExchange::arrived(LocalTime now, std::uint32_t index, std::uint32_t coupling, std::uint32_t channel,
                           const PortState& port) {
  ServedDevice& device = devices_[index];
  device.mail->port_in[coupling].put({port, now, device.peers[coupling]});
  const auto waits = [&](ServedClient& client) {
    Subscription* const subscription = client.sees_ports() ? subscription_to(client, index) : nullptr;
    if (subscription != nullptr) subscription->ports[coupling].peer_waits = true;
    return subscription != nullptr;
  };
  if (std::count_if(clients_.begin(), clients_.end(), waits) == 0) return;
  PortFrame& frame = device.peer_ports[coupling];
  static_cast<PortState&>(frame) = port;
  frame.device = number_of(index);
  frame.channel = channel;
  frame.of_peer = true;
}

bool PortExchange::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram, LocalTime reached) {
  for (Dialled& dialled : dialled_) {
    if (!dialled.peer->is_from_server(from, datagram)) continue;
    dialled.peer->receive(now, from, datagram, reached);
    renew(dialled);
    const auto port = dialled.peer->take();
    if (port && dialled.coupled) arrived(now, dialled.device, 0, 0, *port);
    return true;
  }
  return false;
}

void PortExchange::renew(Dialled& dialled) {
  if (!dialled.peer->coupled()) {
    dialled.coupled = false;
  } else if (!dialled.coupled) {
    dialled.coupled = renew_peer(devices_[dialled.device], 0);
  }
}

LocalTime PortExchange::turn(LocalTime now) {
  LocalTime next = LocalTime::max();
  for (Dialled& dialled : dialled_) {
    next = std::min(next, dialled.peer->turn(now));
    renew(dialled);
  }
  return next;
}

std::vector<Peer::Notice> PortExchange::take_notices() {
  std::vector<Peer::Notice> all;
  for (Dialled& dialled : dialled_) std::ranges::move(dialled.peer->take_notices(), std::back_inserter(all));
  return all;
}

void PortExchange::close(LocalTime now) {
  for (Dialled& dialled : dialled_) dialled.peer->close(now);
}

}  // namespace tendon
