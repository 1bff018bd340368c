// SPDX-License-Identifier: Apache-2.0
#include "server/network_loop.h"

#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "protocol/secrets/blake2b.h"
#include "protocol/wire/header.h"
#include "server/clients/requests.h"
#include "server/clients/states.h"

namespace tendon {

namespace {

using enum DatagramFilter::Sender;

}  // namespace

NetworkLoop::NetworkLoop(const Config& config, Link& link, LocalTime now)
    : config_(config),
      link_(link),
      filter_(config.recorded),
      devices_(served_devices(config.devices, config.shard)),
      first_device_(config.shard.first_device(config.devices.size())),
      handshake_(
          {.secret = config.secret, .keys = config.keys, .suites = config.suites, .number = config.shard.number}),
      admission_(
          {.keys = config.keys.size(), .needs_no_key = config.needs_no_key, .max_observers = config.max_observers}),
      next_connection_id_(config.first_connection_id / config.shard.of * config.shard.of + config.shard.number) {
  half_open_.reserve(config.max_half_open);
  if (FieldIntake::needed(devices_)) {
    FieldIntake::Config fields{.secret = crypto::blake2b_128(config.secret)};
    for (const ClientKey& key : config.keys) fields.keys.push_back(key.name);
    fields_ = std::make_unique<FieldIntake>(fields, devices_, clients_);
  }
  const auto out = [this](LocalTime at, const Address& to, std::span<const std::byte> datagram) {
    send(at, kClient, to, datagram);
  };
  for (std::uint32_t i = 0; i < devices_.size(); ++i) {
    states_.push_back({&devices_[i].mail->state});
    if (const auto& server = config.devices[first_device_ + i].dial) ports_.dial(now, i, *server, out);
  }
  for (ServedDevice::Config& device : config_.devices) device.dial.reset();
  config_.secret = {};
}

LocalTime NetworkLoop::turn(LocalTime now) {
  // Send the newest states before any system call to receive.
  publish(now);
  const bool more = drain(now);
  report(now);
  for (ServedClient& client : clients_) {
    if (client.session.open() && client.session.next_tick() > now) continue;  // usually nothing is due
    if (!client.gone) client.session.tick(now);
    take_events(now, client);
    send_all(now, client);
  }
  std::erase_if(clients_, [](const ServedClient& client) { return client.gone; });
  stats_.half_open_forgotten += std::erase_if(
      half_open_, [&](const ServedClient& client) { return now - client.arrived >= config_.half_open_timeout; });

  LocalTime next = ports_.turn(now);
  if (fields_) {
    next = std::min(next, fields_->turn(now));
    for (std::string& said : fields_->take_notices()) notice(true, std::move(said));
  }
  for (Peer::Notice& said : ports_.take_notices()) notice(said.warning, std::move(said.text));
  if (more) return now;
  for (const ServedClient& client : clients_) next = std::min(next, client.session.next_tick());
  return next;
}

bool NetworkLoop::drain(LocalTime& now) {
  std::array<std::byte, kMaxDatagram> buffer;
  for (std::size_t i = 0; i < config_.max_datagrams; ++i) {
    Address from;
    const std::size_t size = link_.receive(from, buffer);
    if (size == 0) return false;
    now = link_.arrived(now);
    const auto datagram = std::span(buffer).first(std::min(size, buffer.size()));
    if (size > buffer.size()) {
      ++stats_.malformed;
      tap(now, DatagramRecord::Direction::kIn, kUnauthenticated, from, datagram, size);
    } else {
      receive(now, from, datagram);
    }
  }
  return true;
}

void NetworkLoop::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  const auto tap_from = [&](DatagramFilter::Sender sender) {
    tap(now, DatagramRecord::Direction::kIn, sender, from, datagram, datagram.size());
  };
  const LocalTime reached = link_.reached(now);
  const auto header = decode_header(datagram);
  if (header && header->type == DatagramType::kHello) return greet(now, from, datagram);
  if (ports_.receive(now, from, datagram, reached)) return tap_from(kClient);
  if (!header || header->type != DatagramType::kData) {
    ++stats_.malformed;
    return tap_from(kUnauthenticated);
  }
  const auto is_meant = [&](const ServedClient& client) {
    return !client.gone && client.id() == header->connection_id && (client.key != nullptr || client.address == from);
  };
  if (const auto client = std::find_if(clients_.begin(), clients_.end(), is_meant); client != clients_.end()) {
    const std::uint64_t accepted = client->session.stats().datagrams_received;
    const bool newest = client->session.receive(now, datagram, reached);
    tap_from(client->session.stats().datagrams_received > accepted ? kClient : kUnauthenticated);
    if (newest && client->address != from) {
      client->address = from;
      ++stats_.roamed;
    }
    if (newest) hear(now, *client);
    take_refused(*client);
    take_events(now, *client);  // before `measure`, which can wait
    if (newest) measure(now, *client);
  } else if (const auto waiting = std::find_if(half_open_.begin(), half_open_.end(), is_meant);
             waiting != half_open_.end()) {
    if (!waiting->session.receive(now, datagram, reached)) return tap_from(kUnauthenticated);
    tap_from(kClient);
    ServedClient arrived = std::move(*waiting);
    half_open_.erase(waiting);
    arrived.address = from;
    open(now, std::move(arrived));
  } else {
    ++stats_.unknown_connection;
    tap_from(kUnauthenticated);
  }
}

void NetworkLoop::adapt(LocalTime now, ServedClient& client) {
  const LinkStats& link = client.session.stats();
  if (!client.adaptation || link.round_trip == Duration::zero()) return;
  const std::uint32_t before = client.adaptation->one_in();
  client.adaptation->observe(now, link.round_trip, link.seen_outgoing, link.lost_outgoing);
  const std::uint32_t one_in = client.adaptation->one_in();
  if (one_in != before) {
    notice(one_in > before, "\"" + client.name + "\" receives one state in " + std::to_string(one_in) +
                                (one_in > before ? ": the network to it is congested" : " again"));
  }
  if (std::exchange(client.unusable, client.adaptation->unusable()) != client.unusable) {
    notice(client.unusable,
           "the connection to \"" + client.name +
               (client.unusable ? "\" loses too many datagrams: its forces are ignored" : "\" is usable again"));
  }
}

/// Passes on the timing of the datagram before the forces in it are judged.
void NetworkLoop::hear(LocalTime now, ServedClient& client) {
  const auto& exchange = client.session.exchange();
  const auto sent = exchange ? std::optional(exchange->answered) : std::nullopt;
  for (const Slot& slot : client.slots) {
    ServedChannel& channel = devices_[slot.device].channels[slot.channel];
    if (channel.holder == client.id()) channel.lateness.heard(now, sent, client.session.stats().lost);
  }
  adapt(now, client);
}

void NetworkLoop::measure(LocalTime now, ServedClient& client) {
  if (!client.meter) return;
  client.meter->heard(now);
  const auto& exchange = client.session.exchange();
  if (!exchange) return;
  if (const auto clock = client.session.peer_clock()) client.meter->observe(*exchange, *clock);
}

void NetworkLoop::report(LocalTime now) {
  Reports::Sums sums = reports_.turn(now, devices_, clients_);
  stats_.late_ours += sums.late_ours;
  stats_.late_network += sums.late_network;
  stats_.late_engine += sums.late_engine;
  stats_.late_unknown += sums.late_unknown;
  for (std::string& warning : sums.warnings) notice(true, std::move(warning));
}

/// Sends the states before the next client is processed, to reduce the latency.
void NetworkLoop::publish(LocalTime now) {
  ports_.publish(now);
  for (std::size_t index = 0; index < states_.size(); ++index) {
    const DeviceState* const fresh = states_[index].fresh = states_[index].box->take();
    if (fresh == nullptr) continue;
    devices_[index].sampled.observe(fresh->tick, LocalTime(fresh->sampled.time_since_epoch()), now);
    for (ServedChannel& channel : devices_[index].channels) channel.lateness.took_state(now);
  }
  for (ServedClient& client : clients_) {
    for (Subscription& subscription : client.subscriptions) {
      const DeviceState* const state = states_[subscription.device].fresh;
      if (state != nullptr && publish_state(client, subscription, *state)) ++stats_.predicted;
    }
    send_all(now, client);
  }
}

void NetworkLoop::take_events(LocalTime now, ServedClient& client) {
  while (const Session::Event* const event = client.session.next_event()) {
    if (const auto* force = std::get_if<Session::ForceArrived>(event)) {
      take_force(now, client, force->command);
    } else if (const auto* brick = std::get_if<Session::BrickArrived>(event)) {
      if (!fields_ || !fields_->take(now, client, brick->brick)) ++stats_.denied;
    } else if (const auto* pose = std::get_if<Session::FieldPoseArrived>(event)) {
      if (!fields_ || !fields_->take(now, client, pose->pose)) ++stats_.denied;
    } else if (const auto* port = std::get_if<Session::PortArrived>(event)) {
      if (!ports_.take(now, client, port->port)) ++stats_.denied;
    } else if (const auto* asked = std::get_if<Session::RequestArrived>(event)) {
      answer(now, client, asked->id, asked->request);
    } else if (const auto* closed = std::get_if<Session::Closed>(event)) {
      if (closed->code == Code::kTimedOut) ++stats_.timed_out;
      const bool is_polite = closed->code == Code::kOk;
      const std::size_t before = notices_.size();
      leave(client, closed->reason);
      if (is_polite && notices_.size() > before) notices_.back().warning = false;
    }
  }
}

void NetworkLoop::send_all(LocalTime now, ServedClient& client) {
  std::array<std::byte, kMaxDatagram> buffer;
  while (const std::size_t size = client.session.next_datagram(now, buffer)) {
    send(now, kClient, client.address, std::span(buffer).first(size));
  }
}

/// Stores the reported error and solver path of a force. Returns the number of the path.
std::uint8_t NetworkLoop::note(const ForceCommand& command, const ServedClient& client, ServedDevice& device) {
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

void NetworkLoop::take_force(LocalTime now, ServedClient& client, const ForceCommand& command) {
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
  const auto& exchange = client.session.exchange();
  const Duration waited = exchange ? now - exchange->answered_at : Duration::zero();
  channel.lateness.observe({.sampled = answered->at,
                            .sent = answered->sent,
                            .received = now,
                            .round_trip = link.round_trip + waited,
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

/// Counts the forces that the session has refused for all channels of the client, because their channel is not known.
void NetworkLoop::take_refused(ServedClient& client) {
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

void NetworkLoop::blame(const ServedClient& client, Lateness::Cause cause, std::uint64_t count) {
  for (const Slot& slot : client.slots) {
    ServedChannel& channel = devices_[slot.device].channels[slot.channel];
    if (channel.holder == client.id()) channel.lateness.refused(cause, count);
  }
}

void NetworkLoop::answer(LocalTime now, ServedClient& client, std::uint32_t id, Request request) {
  const auto find_device = [&client](auto& wanted) {
    if constexpr (requires { wanted.device; }) wanted.device = client.device_of(wanted.device);
  };
  std::visit(find_device, request);
  const Asker asker{.client = client,
                    .may_take_over = may_take_over(client),
                    .devices = devices_,
                    .clients = clients_,
                    .leases = leases_,
                    .fields = fields_.get()};
  Outcome outcome = tendon::answer(now, asker, request);
  if (outcome.code == Code::kDenied) ++stats_.denied;
  if (!outcome.warning.empty()) notice(true, std::move(outcome.warning));
  if (ServedClient* const loser = client_of(clients_, outcome.loser)) {
    dispossess(now, *loser, client, std::get<TakeLease>(request));
  }
  if (outcome.device) return client.session.answer(id, std::move(*outcome.device));
  if (outcome.handle) return client.session.answer(id, std::move(*outcome.handle));
  client.session.answer(id, outcome.code, std::move(outcome.detail), outcome.wait);
}

NetworkStats NetworkLoop::stats() const {
  NetworkStats stats = stats_;
  stats.hellos = handshake_.stats();
  for (const ServedDevice& device : devices_) stats.add(device, clients_);
  for (const ServedClient& client : clients_) stats.add(client);
  return stats;
}

void NetworkLoop::send(LocalTime now, DatagramFilter::Sender partner, const Address& to,
                       std::span<const std::byte> datagram) {
  link_.send(to, datagram);
  tap(now, DatagramRecord::Direction::kOut, partner, to, datagram, datagram.size());
}

/// Adds the datagram to the recording if it is accepted by the filter. `peer` is the address of the other end.
void NetworkLoop::tap(LocalTime now, DatagramRecord::Direction direction, DatagramFilter::Sender partner,
                      const Address& peer, std::span<const std::byte> datagram, std::size_t size) {
  if (!config_.record) return;
  Mailboxes& mail = *devices_.front().mail;
  const auto left_out = [](std::atomic<std::uint64_t>& count) { count.fetch_add(1, std::memory_order_relaxed); };
  switch (filter_.judge(now, partner, size)) {
    case DatagramFilter::Verdict::kRecord:
      break;
    case DatagramFilter::Verdict::kUnauthenticated:
      return left_out(mail.unauthenticated_left_out);
    case DatagramFilter::Verdict::kOverBudget:
      return left_out(mail.datagrams_over_budget);
  }
  DatagramRecord* const record = mail.datagrams.back();
  if (record == nullptr) return left_out(mail.datagrams_lost);
  record->at = now;
  record->direction = direction;
  record->peer = peer;
  record->size = static_cast<std::uint32_t>(std::min<std::size_t>(size, std::numeric_limits<std::uint32_t>::max()));
  std::copy(datagram.begin(), datagram.end(), record->bytes.begin());
  mail.datagrams.push();
}

NetworkLoop::SessionChange NetworkLoop::change_of(const ServedClient& client, bool came, const std::string& why) const {
  SessionChange change{.connection = client.id(),
                       .came = came,
                       .client = client.name,
                       .role = client.role,
                       .address = client.address,
                       .why = why};
  if (!client.subscriptions.empty()) {
    const ServedDevice& device = devices_[client.subscriptions.front().device];
    change.device = device.about.name;
    change.tick = device.sampled.newest();
  }
  return change;
}

void NetworkLoop::notice(bool warning, std::string text, std::optional<SessionChange> session) {
  if (notices_.size() < kMaxNotices) notices_.push_back({warning, std::move(text), std::move(session)});
}

std::vector<NetworkLoop::Notice> NetworkLoop::take_notices() { return std::exchange(notices_, {}); }

std::vector<NetworkLoop::Foreign> NetworkLoop::take_foreign() { return std::exchange(foreign_, {}); }

}  // namespace tendon
