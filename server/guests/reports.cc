// SPDX-License-Identifier: Apache-2.0
#include "server/guests/reports.h"

#include <algorithm>
#include <map>
#include <utility>

namespace tendon {
namespace {

constexpr Duration kPeriod = std::chrono::seconds(1);

}  // namespace

LinkReport link_report(LocalTime now, LocalTime since, const Guest& guest, const LinkMeter::Report& link,
                       const Lateness::Report& forces) {
  const LinkStats& counted = guest.session.stats();
  LinkReport report;
  report.until = PeerTime(now.time_since_epoch());
  report.span = now - std::max(since, guest.arrived);
  report.forces = forces.forces;
  report.late_server = forces.late_ours;
  report.late_network = forces.late_network;
  report.late_engine = forces.late_engine;
  report.worst_late = forces.worst;
  report.longest_gap = link.longest_gap;
  report.round_trip = link.round_trip;
  report.to_server = link.from_peer;
  report.to_client = link.to_peer;
  if (const auto clock = guest.session.peer_clock()) {
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

PeerReport peer_report(LocalTime now, LocalTime since, const Guest& engine, const Seat& seat,
                       const LinkMeter::Report& link, const Lateness::Report& forces) {
  PeerReport report;
  report.device = seat.device;
  report.channel = seat.channel;
  report.name = engine.name;
  report.state_one_in = engine.adaptation ? engine.adaptation->one_in() : 1;
  report.forces_refused = engine.adaptation && engine.adaptation->hopeless();
  report.link = link_report(now, since, engine, link, forces);
  return report;
}

Reports::News Reports::turn(LocalTime now) {
  News news;
  if (now - reported_ < kPeriod) return news;
  for (Guest& guest : guests_) count_refused(guest);
  std::map<std::uint32_t, Lateness::Report> told;  // by connection id
  for (ServedDevice& device : devices_) {
    for (std::size_t i = 0; i < device.channels.size(); ++i) {
      const Lateness::Report report = report_on(now, device, i, news);
      if (device.channels[i].holder != 0) told[device.channels[i].holder].add(report);
    }
  }
  for (Guest& guest : guests_) {
    if (guest.gone || !guest.meter) continue;
    const LinkMeter::Report link = guest.meter->report(now);
    tell_of_engine(now, guest, link);
    const Lateness::Report& forces = told[guest.id()];
    if (forces.forces == 0 && forces.advice.empty()) continue;
    LinkReport report = link_report(now, reported_, guest, link, forces);
    report.number = ++guest.reports;
    guest.session.send(report);
  }
  tell_of_devices();
  reported_ = now;
  return news;
}

/// A frame that the codec refuses never becomes a force: only the session counts it. A controller sends little else than
/// forces, so its refused frames are put down to the first channel that it holds.
void Reports::count_refused(Guest& guest) {
  const std::uint64_t invalid = guest.session.stats().invalid;
  const std::uint64_t more = invalid - std::exchange(guest.invalid, invalid);
  if (more == 0) return;
  for (const Seat& seat : guest.seats) {
    ServedChannel& channel = devices_[seat.device].channels[seat.channel];
    if (channel.holder == guest.id()) return channel.lateness.refuse(Lateness::Refused::kValue, more);
  }
}

Lateness::Report Reports::report_on(LocalTime now, ServedDevice& device, std::size_t number, News& news) {
  ServedChannel& channel = device.channels[number];
  const Guest* const holder = holder_of(guests_, channel);
  channel.newest = channel.lateness.report(now, holder != nullptr && is_loopback(holder->address));
  const Lateness::Report& report = channel.newest;
  news.late_ours += report.late_ours;
  news.late_network += report.late_network;
  news.late_engine += report.late_engine;
  channel.late += report.late();
  if (!report.text.empty()) {
    const bool only_one = devices_.size() == 1 && device.channels.size() == 1;
    const std::string place = only_one ? "" : device.about.name + "/" + device.about.channels[number].name + ": ";
    news.warnings.push_back(place + report.text);
  }
  return report;
}

template <class Report>
void Reports::tell_observers(std::uint32_t device, const Report& report) {
  for (Guest& guest : guests_) {
    const bool watches =
        std::any_of(guest.views.begin(), guest.views.end(), [&](const View& view) { return view.device == device; });
    if (!guest.gone && guest.diagnoses && watches) guest.session.send(report);
  }
}

/// While the log thread says nothing new, there is nothing to tell.
void Reports::tell_of_devices() {
  for (std::uint32_t number = 0; number < devices_.size(); ++number) {
    ServedDevice& device = devices_[number];
    const Health* const health = device.mail->health.take();
    if (health == nullptr) continue;
    if (device.told) {
      DeviceReport report = tendon::report(*device.told, *health);
      report.number = ++device.reports;
      report.device = number;
      tell_observers(number, report);
    }
    device.told = *health;
  }
}

void Reports::tell_of_engine(LocalTime now, const Guest& engine, const LinkMeter::Report& link) {
  for (const Seat& seat : engine.seats) {
    ServedChannel& channel = devices_[seat.device].channels[seat.channel];
    if (seat.role != Role::kController || channel.holder != engine.id()) continue;
    PeerReport report = peer_report(now, reported_, engine, seat, link, channel.newest);
    report.link.number = ++channel.reports;
    tell_observers(seat.device, report);
  }
}

}  // namespace tendon
