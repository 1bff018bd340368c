// SPDX-License-Identifier: Apache-2.0
#include "server/clients/reports.h"

#include <algorithm>
#include <map>
#include <utility>

namespace tendon {

namespace {

RefusedForces since(const RefusedForces& before, const RefusedForces& now) {
  return {.not_finite = now.not_finite - before.not_finite,
          .out_of_bounds = now.out_of_bounds - before.out_of_bounds,
          .unknown_tick = now.unknown_tick - before.unknown_tick,
          .old_sequence = now.old_sequence - before.old_sequence};
}

template <class Report>
void publish_to_observers(std::uint32_t device, const Report& report, std::vector<ServedClient>& clients) {
  for (ServedClient& client : clients) {
    if (client.has<kFeatureDiagnostics>() && subscription_to(client, device) != nullptr) client.session.send(report);
  }
}

/// Skips devices without an update from the log thread.
void publish_devices(std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients) {
  for (std::uint32_t index = 0; index < devices.size(); ++index) {
    ServedDevice& device = devices[index];
    const Health* const health = device.mail->health.take();
    if (health == nullptr) continue;
    if (device.told) {
      DeviceReport report = tendon::report(*device.told, *health);
      report.number = ++device.reports;
      report.device = device.about.device;
      publish_to_observers(index, report, clients);
    }
    device.told = *health;
  }
}

}  // namespace

Reports::Sums Reports::turn(LocalTime now, std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients) {
  Sums sum;
  if (now - reported_ < kPeriod) return sum;
  std::map<std::uint32_t, Lateness::Report> of_holder;  // combined for all channels, by connection id
  for (ServedDevice& device : devices) {
    for (std::size_t i = 0; i < device.channels.size(); ++i) {
      ServedChannel& channel = device.channels[i];
      const Lateness::Report& report = channel.newest = channel.lateness.report(now);
      sum.late_ours += report.late_ours;
      sum.late_network += report.late_network;
      sum.late_engine += report.late_engine;
      sum.late_unknown += report.late_unknown;
      channel.late += report.late();
      if (channel.holder != 0) of_holder[channel.holder].add(report);
      if (report.text.empty()) continue;
      const bool only_one = devices.size() == 1 && device.channels.size() == 1;
      sum.warnings.push_back((only_one ? "" : device.about.name + "/" + device.about.channels[i].name + ": ") +
                             report.text);
    }
  }
  for (ServedClient& client : clients) {
    if (client.gone || !client.meter) continue;
    const LinkMeter::Report link = client.meter->report(now);
    publish_engine(now, client, link, devices, clients);
    const Lateness::Report& forces = of_holder[client.id()];
    if (forces.forces > 0 || !forces.advice.empty()) {
      LinkReport report = link_report(now, client, link, forces);
      report.number = ++client.reports;
      client.session.send(report);
    }
    client.refused_reported = client.refused;
  }
  publish_devices(devices, clients);
  reported_ = now;
  return sum;
}

void Reports::publish_engine(LocalTime now, const ServedClient& engine, const LinkMeter::Report& link,
                             std::vector<ServedDevice>& devices, std::vector<ServedClient>& clients) const {
  for (const Slot& slot : engine.slots) {
    ServedChannel& channel = devices[slot.device].channels[slot.channel];
    if (slot.role != Role::kController || channel.holder != engine.id()) continue;
    PeerReport report;
    report.device = number_of(slot.device);
    report.channel = slot.channel;
    report.name = engine.name;
    report.state_one_in = engine.adaptation ? engine.adaptation->one_in() : 1;
    report.forces_refused = engine.adaptation && engine.adaptation->unusable();
    report.link = link_report(now, engine, link, channel.newest);
    report.link.number = ++channel.reports;
    const ServedChannel::Doubt doubt = std::exchange(channel.doubt, {});
    report.error = doubt.error;
    report.way = devices[slot.device].mail->ways.name_of(doubt.way);
    publish_to_observers(slot.device, report, clients);
  }
}

LinkReport Reports::link_report(LocalTime now, const ServedClient& client, const LinkMeter::Report& link,
                                const Lateness::Report& forces) const {
  const LinkStats& counted = client.session.stats();
  LinkReport report;
  report.until = PeerTime(now.time_since_epoch());
  report.span = now - std::max(reported_, client.arrived);
  report.forces = forces.forces;
  report.late_server = forces.late_ours;
  report.late_network = forces.late_network;
  report.late_engine = forces.late_engine;
  report.late_unknown = forces.late_unknown;
  report.refused = since(client.refused_reported, client.refused);
  report.worst_late = forces.worst;
  report.longest_gap = link.longest_gap;
  report.round_trip = link.round_trip;
  report.to_server = link.from_peer;
  report.to_client = link.to_peer;
  if (const auto clock = client.session.peer_clock()) {
    report.clock_offset = clock->offset;
    report.clock_drift_ppm = 1e6 * clock->drift;
    report.clock_error = clock->error_bound;
  }
  report.received = counted.datagrams_received;
  report.lost = counted.lost;
  report.reordered = counted.reordered;
  report.duplicated = counted.duplicated;
  report.words = forces.advice;
  return report;
}

}  // namespace tendon
