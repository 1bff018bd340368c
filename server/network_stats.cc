// SPDX-License-Identifier: Apache-2.0
#include "server/network_stats.h"

namespace tendon {
namespace {

template <class Counts>
void add_dropped(NetworkStats::Dropped& sum, const Counts& more, const RefusedForces& forces) {
  sum.duplicated += more.duplicated;
  sum.malformed += more.malformed;
  sum.forged += more.forged;
  sum.old_key += more.old_key;
  sum.invalid += more.invalid;
  sum.stale += more.stale;
  sum.forces.not_finite += forces.not_finite;
  sum.forces.out_of_bounds += forces.out_of_bounds;
  sum.forces.old_sequence += forces.old_sequence;
}

std::vector<std::pair<std::string, std::uint64_t>> counts_of(const ServedChannel& channel, const SolverPaths& ways) {
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  for (std::size_t way = 1; way < channel.by_way.size(); ++way) {
    if (channel.by_way[way] > 0) counts.emplace_back(ways.name_of(static_cast<std::uint8_t>(way)), channel.by_way[way]);
  }
  return counts;
}

}  // namespace

NetworkStats& NetworkStats::operator+=(const NetworkStats& more) {
  welcomed += more.welcomed;
  refused += more.refused;
  timed_out += more.timed_out;
  replaced += more.replaced;
  roamed += more.roamed;
  half_open_forgotten += more.half_open_forgotten;
  malformed += more.malformed;
  unknown_connection += more.unknown_connection;
  hellos += more.hellos;
  forces += more.forces;
  denied += more.denied;
  unanswerable += more.unanswerable;
  late_ours += more.late_ours;
  late_network += more.late_network;
  late_engine += more.late_engine;
  late_unknown += more.late_unknown;
  predicted += more.predicted;
  unusable += more.unusable;
  add_dropped(dropped, more.dropped, more.dropped.forces);
  channels.insert(channels.end(), more.channels.begin(), more.channels.end());
  if (controller.datagrams_received == 0) {
    controller = more.controller;
    controller_clock = more.controller_clock;
  }
  return *this;
}

void NetworkStats::add(const ServedClient& client) {
  const LinkStats& link = client.session.stats();
  add_dropped(dropped, link, link.refused_forces);
  if (client.role != Role::kController) return;
  controller = link;
  controller_clock = client.session.peer_clock();
}

void NetworkStats::add(const ServedDevice& device, const std::vector<ServedClient>& clients) {
  for (std::size_t i = 0; i < device.channels.size(); ++i) {
    const ServedChannel& channel = device.channels[i];
    const ServedClient* const holder = client_of(clients, channel.holder);
    channels.push_back({.device = device.about.name,
                        .channel = device.about.channels[i].name,
                        .holder = holder != nullptr ? holder->name : std::string(),
                        .forces = channel.forces,
                        .handovers = channel.handovers,
                        .late = channel.late,
                        .worst_error = channel.worst_error,
                        .ways = counts_of(channel, device.mail->ways)});
  }
}

}  // namespace tendon
