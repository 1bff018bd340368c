// SPDX-License-Identifier: Apache-2.0
#include "server/clients/force_intake.h"

#include <algorithm>
#include <limits>
#include <optional>
#include <utility>

namespace tendon {

/// Stores the reported error and solver path of a force. Returns the number of the path.
std::uint8_t ForceIntake::note(const ForceCommand& command, const ServedClient& client, ServedDevice& device) {
  ServedChannel& channel = device.channels[command.channel];
  const bool named = command.way > 0 && command.way <= client.ways.size();
  const std::uint8_t way = named ? device.mail->ways.number_of(client.ways[command.way - 1]) : std::uint8_t{0};
  channel.doubt.observe(command.error, way);
  channel.worst_error = std::max(channel.worst_error, command.error);
  if (way > 0) {
    channel.by_way.resize(std::max<std::size_t>(channel.by_way.size(), way + 1U));
    ++channel.by_way[way];
  }
  return way;
}

void ForceIntake::take(LocalTime now, ServedClient& client, const ForceCommand& command) {
  const std::uint32_t index = client.device_of(command.device);
  const bool there = index < devices_.size() && command.channel < devices_[index].channels.size();
  if (!there || leases_.holder(index, command.channel) != client.id()) {
    ++stats_.denied;
    return;
  }
  ServedDevice& device = devices_[index];
  ServedChannel& channel = device.channels[command.channel];
  const auto answered = device.sampled.find(command.based_on_tick);
  if (!answered) {
    ++stats_.unanswerable;
    ++client.refused.unknown_tick;
    channel.lateness.refused(Lateness::Cause::kUnknownTick, 1);
    return;
  }
  if (client.adaptation && client.adaptation->unusable()) {
    ++stats_.unusable;
    return;
  }
  leases_.renew(now, index, command.channel);
  const double bound = device.about.max_force;  // N; 0 if unknown
  if (bound > 0 && command.force.squaredNorm() > bound * bound) channel.lateness.cut();
  const LinkStats& link = client.session.stats();
  const std::uint64_t lost = link.lost + link.lost_outgoing;
  channel.lateness.observe({.sampled = answered->at,
                            .sent = answered->sent,
                            .received = now,
                            .round_trip = link.round_trip,
                            .valid_for = command.valid_for,
                            .lost = lost > std::exchange(client.lost, lost)});
  RemoteForce& force = device.mail->forces[command.channel].back();  // contains an old value
  force.sequence = command.sequence;
  force.answers_tick = command.based_on_tick;
  force.answers = answered->at;
  force.received = now;
  force.force = command.force;
  force.model = command.model;
  if (force.model && force.model->contact && force.model->contact->table) {
    // The haptic loop flushes denormal numbers to zero and would refuse a table with such a step.
    double& step = force.model->contact->table->step;
    step = std::max(step, std::numeric_limits<double>::min());
  }
  force.valid_for = command.valid_for;
  force.source = channel.holder;
  force.field = command.field;
  force.topology_changed = command.topology_changed;
  force.error = command.error;
  force.way = note(command, client, device);
  // If the client does not support this feature, it does not know the limits of the handle.
  if (!client.has<kFeatureHandle>() && (command.torque || command.grip_force)) ++stats_.denied;
  force.torque = client.has<kFeatureHandle>() ? command.torque : std::nullopt;
  force.grip_force = client.has<kFeatureHandle>() ? command.grip_force : std::nullopt;
  device.mail->forces[command.channel].put();
  ++channel.forces;
  ++stats_.forces;
}

void ForceIntake::take_refused(ServedClient& client) {
  const RefusedForces& all = client.session.stats().refused_forces;
  const auto take = [&](std::uint64_t RefusedForces::*count, Lateness::Cause cause) {
    if (const std::uint64_t before = std::exchange(client.refused.*count, all.*count); before != all.*count) {
      blame(client, cause, all.*count - before);
    }
  };
  take(&RefusedForces::not_finite, Lateness::Cause::kNotFinite);
  take(&RefusedForces::out_of_bounds, Lateness::Cause::kOutOfBounds);
  take(&RefusedForces::old_sequence, Lateness::Cause::kOldSequence);
}

void ForceIntake::blame(const ServedClient& client, Lateness::Cause cause, std::uint64_t count) {
  for (const Slot& slot : client.slots) {
    ServedChannel& channel = devices_[slot.device].channels[slot.channel];
    if (channel.holder == client.id()) channel.lateness.refused(cause, count);
  }
}

}  // namespace tendon
