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
#include "server/clients/unknown_keys.h"

namespace tendon {

namespace {

using enum DatagramFilter::Sender;

constexpr std::size_t kMaxNotices = 64;
constexpr std::size_t kMaxForeign = 64;

/// Keeps at most one of these notices per turn, so that a flood of Hellos cannot displace other notices.
void note_unknown_key(std::vector<NetworkLoop::Notice>& notices, const Address& from) {
  const auto is_one = [](const NetworkLoop::Notice& one) { return UnknownKeys::is_notice(one.text); };
  const auto noted = std::ranges::find_if(notices, is_one);
  if (noted != notices.end()) {
    noted->text = UnknownKeys::notice(from);
  } else if (notices.size() < kMaxNotices) {
    notices.push_back({true, UnknownKeys::notice(from)});
  }
}

const ClockExchange* exchange_of(LocalTime now, const ServedClient& client) {
  const auto& exchange = client.session.newest_exchange();
  return exchange && exchange->answered_at == now ? &*exchange : nullptr;
}

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
  LocalTime next = fields_ ? fields_->turn(now) : LocalTime::max();
  for (ServedClient& client : clients_) {
    if (client.session.open() && client.session.next_tick() > now) continue;  // usually nothing is due
    if (!client.gone) client.session.tick(now);
    take_events(now, client);
    send_all(now, client);
  }
  std::erase_if(clients_, [](const ServedClient& client) { return client.gone; });
  stats_.half_open_forgotten += std::erase_if(
      half_open_, [&](const ServedClient& client) { return now - client.arrived >= config_.half_open_timeout; });

  if (fields_) {
    for (std::string& said : fields_->take_notices()) notice(true, std::move(said));
  }
  next = std::min(next, ports_.turn(now));
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
  const auto header = decode_header(datagram);
  if (header && header->type == DatagramType::kHello) return greet(now, from, datagram);
  if (ports_.receive(now, from, datagram)) return tap_from(kClient);
  if (!header || header->type != DatagramType::kData) {
    ++stats_.malformed;
    return tap_from(kUnauthenticated);
  }
  const auto is_meant = [&](const ServedClient& client) {
    return !client.gone && client.id() == header->connection_id && (client.key != nullptr || client.address == from);
  };
  if (const auto client = std::find_if(clients_.begin(), clients_.end(), is_meant); client != clients_.end()) {
    const std::uint64_t accepted = client->session.stats().datagrams_received;
    const bool newest = client->session.receive(now, datagram);
    tap_from(client->session.stats().datagrams_received > accepted ? kClient : kUnauthenticated);
    if (newest && client->address != from) {
      client->address = from;
      ++stats_.roamed;
    }
    if (newest) hear(now, *client);
    forces_.take_refused(*client);
    take_events(now, *client);  // before `measure`, which can wait
    if (newest) measure(now, *client);
  } else if (const auto waiting = std::find_if(half_open_.begin(), half_open_.end(), is_meant);
             waiting != half_open_.end()) {
    if (!waiting->session.receive(now, datagram)) return tap_from(kUnauthenticated);
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

void NetworkLoop::greet(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> answer;
  const std::uint64_t unknown_keys = handshake_.stats().unknown_key;
  const ServerHandshake::Reply reply = handshake_.receive(now, from, datagram, answer);
  if (handshake_.stats().unknown_key > unknown_keys) note_unknown_key(notices_, from);
  const DatagramFilter::Sender sender = reply.client ? sender_of(*reply.client, from) : kUnauthenticated;
  tap(now, DatagramRecord::Direction::kIn, sender, from, datagram, datagram.size());
  if (reply.client) return admit(now, from, *reply.client, datagram);
  if (reply.size > 0) send(now, sender, from, std::span(answer).first(reply.size));
}

void NetworkLoop::receive_foreign(LocalTime now, const Address& from, std::span<const std::byte> hello) {
  std::array<std::byte, kMaxDatagram> answer;
  const ServerHandshake::Reply reply = handshake_.receive(now, from, hello, answer);
  if (reply.client) admit(now, from, *reply.client, hello);  // otherwise its cookie has expired
}

/// If keys are configured, a client without a key counts as unauthenticated, unless it does not need one.
DatagramFilter::Sender NetworkLoop::sender_of(const ServerHandshake::Client& client, const Address& from) const {
  const bool let_in = config_.keys.empty() || (config_.needs_no_key != nullptr && config_.needs_no_key(from));
  return client.key != nullptr || let_in ? kClient : kUnauthenticated;
}

/// Repeats a lost answer. In suites 1 and 2 to any address, because only the owner of the ephemeral key can use it.
bool NetworkLoop::answer_again(LocalTime now, const Address& from, const ServerHandshake::Client& client) {
  for (const auto* list : {&clients_, &half_open_}) {
    for (const ServedClient& present : *list) {
      if (present.random != client.random || present.key != client.key || present.gone) continue;
      if (present.key == nullptr && present.address != from) continue;
      send(now, sender_of(client, from), from, present.answer);
      return true;
    }
  }
  return false;
}

void NetworkLoop::refuse(LocalTime now, const Address& from, const ServerHandshake::Client& client, Refusal refusal) {
  std::array<std::byte, kMaxDatagram> answer;
  ++stats_.refused;
  notice(true, "refused \"" + client.hello.name + "\" at " + to_string(from) + ": " + refusal.reason);
  const Refused refused{refusal.code, std::move(refusal.reason), kProtocolVersion, kProtocolVersion};
  const auto size = handshake_.refuse(client, refused, answer).size;
  send(now, sender_of(client, from), from, std::span(answer).first(size));
}

/// The value 0 is reserved.
std::uint32_t NetworkLoop::take_connection_id() {
  if (next_connection_id_ == 0) next_connection_id_ = config_.shard.of;
  return std::exchange(next_connection_id_, next_connection_id_ + config_.shard.of);
}

void NetworkLoop::admit(LocalTime now, const Address& from, const ServerHandshake::Client& client,
                        std::span<const std::byte> hello) {
  if (answer_again(now, from, client)) return;
  if (client.version == 0) return refuse(now, from, client, {Code::kUnsupported, "no common protocol version"});
  if (!client.suite) {
    return refuse(now, from, client,
                  {Code::kUnsupported, "no common cipher suite: this server only accepts " + names_of(config_.suites)});
  }
  auto claimed = Admission::slots_of(client.hello, config_.devices);
  if (auto* const cannot_be = std::get_if<Refusal>(&claimed)) return refuse(now, from, client, std::move(*cannot_be));
  auto& slots = std::get<std::vector<Slot>>(claimed);
  const std::uint32_t owner = config_.shard.owner_of(slots.front().device, config_.devices.size());
  if (owner != config_.shard.number) {
    if (foreign_.size() < kMaxForeign) foreign_.push_back({owner, from, {hello.begin(), hello.end()}});
    return;
  }
  for (Slot& slot : slots) slot.device -= static_cast<std::uint32_t>(first_device_);
  if (auto refusal = admission_.reason_to_refuse(from, client.key, slots, devices_, clients_)) {
    return refuse(now, from, client, std::move(*refusal));
  }

  const Role role = client.hello.role;
  Session::Config session;
  session.connection_id = take_connection_id();
  session.timeout = role == Role::kController ? config_.controller_timeout : config_.observer_timeout;
  session.rekey = config_.rekey;
  session.life = config_.session_life;
  Welcome welcome = Admission::welcome_for(client, from, slots, devices_, clients_);
  const Features features(welcome.features);
  session.states_in_columns = features.has<kFeatureStateColumns>();
  welcome.timeout = session.timeout;
  welcome.server = config_.server_name;
  std::array<std::byte, kMaxDatagram> answer;
  const ServerHandshake::Answered answered = handshake_.welcome(client, session.connection_id, welcome, answer);
  if (answered.size == 0) return;
  const auto bytes = std::span(answer).first(answered.size);
  send(now, sender_of(client, from), from, bytes);

  ServedClient arrived{from,
                       client.random,
                       client.key,
                       client.hello.name,
                       role,
                       features,
                       features.has<kFeatureWays>() ? client.hello.ways : std::vector<std::string>(),
                       slots,
                       Admission::subscriptions_of(slots),
                       {bytes.begin(), bytes.end()},
                       answered.keys ? Session(session, *answered.keys, now) : Session(session, now),
                       now};
  if (half_open_.size() >= config_.max_half_open) {
    half_open_.erase(half_open_.begin());
    ++stats_.half_open_forgotten;
  }
  half_open_.push_back(std::move(arrived));
}

void NetworkLoop::open(LocalTime now, ServedClient client) {
  // Another client may have taken the slots in the meantime.
  if (const auto refusal = admission_.reason_to_refuse(client.address, client.key, client.slots, devices_, clients_)) {
    ++stats_.refused;
    notice(true, "refused \"" + client.name + "\" at " + to_string(client.address) + ": " + refusal->reason);
    client.session.close(refusal->code, refusal->reason);
    return send_all(now, client);
  }
  for (ServedClient& present : clients_) {
    if (present.gone || !Admission::replaces(present, client.address, client.key, client.slots)) continue;
    if (present.address == client.address) {
      leave(present, "the client has restarted");
    } else {
      present.session.close(Code::kReplaced, "a program with the same key has replaced this session");
      send_all(now, present);
      ++stats_.replaced;
      leave(present, "replaced by a program with the same key");
    }
  }
  std::erase_if(clients_, [](const ServedClient& present) { return present.gone; });
  ++stats_.welcomed;
  notice(false,
         "welcomed " + std::string(client.role == Role::kController ? "controller" : "observer") + " \"" + client.name +
             "\" at " + to_string(client.address) +
             (client.key != nullptr
                  ? " with the key \"" + client.key->name + "\", encrypted by " + names_of({client.session.suite()})
                  : ""),
         change_of(client, true, ""));
  if (client.role == Role::kController) client.meter.emplace(now);
  if (config_.adapt_state_rate) client.adaptation.emplace(RateAdaptation::Config{}, now);
  clients_.push_back(std::move(client));
  ServedClient& arrived = clients_.back();
  for (const Slot& slot : arrived.slots) {
    if (slot.role != Role::kController) continue;
    const ServedClient* const holder = client_of(clients_, leases_.holder(slot.device, slot.channel));
    if (holder == nullptr) {
      leases_.hold(now, slot.device, slot.channel, arrived);
    } else if (arrived.has<kFeatureChannels>()) {
      arrived.session.request(LeaseLost{.device = number_of(slot.device), .channel = slot.channel, .to = holder->name});
    }
  }
}

bool NetworkLoop::may_take_over(const ServedClient& client) const {
  const std::string& name = client.key != nullptr ? client.key->name : client.name;
  return std::find(config_.takeover.begin(), config_.takeover.end(), name) != config_.takeover.end();
}

void NetworkLoop::dispossess(LocalTime now, ServedClient& loser, const ServedClient& winner, const TakeLease& lost) {
  const DeviceDescription& about = devices_[lost.device].about;
  notice(false, "\"" + winner.name + "\" takes " + about.name + "/" + about.channels[lost.channel].name + " from \"" +
                    loser.name + "\"");
  loser.uncouple(lost.device, lost.channel);
  const LeaseLost news{.device = number_of(lost.device), .channel = lost.channel, .to = winner.name};
  if (loser.has<kFeatureChannels>() && loser.session.request(news)) return;
  // The client does not support LeaseLost, or has too many open requests.
  loser.session.close(Code::kReplaced, "\"" + winner.name + "\" has replaced this session");
  send_all(now, loser);
  ++stats_.replaced;
  leave(loser, "replaced by \"" + winner.name + "\"");
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
  const ClockExchange* const exchange = exchange_of(now, client);
  const auto sent = exchange != nullptr ? std::optional(exchange->answered) : std::nullopt;
  for (const Slot& slot : client.slots) {
    ServedChannel& channel = devices_[slot.device].channels[slot.channel];
    if (channel.holder == client.id()) channel.lateness.heard(now, sent, client.session.stats().lost);
  }
  adapt(now, client);
}

void NetworkLoop::measure(LocalTime now, ServedClient& client) {
  if (!client.meter) return;
  client.meter->heard(now);
  const ClockExchange* const exchange = exchange_of(now, client);
  if (exchange == nullptr) return;
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
      forces_.take(now, client, force->command);
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

void NetworkLoop::leave(ServedClient& client, const std::string& how) {
  client.gone = true;
  notice(client.role == Role::kController,
         "\"" + client.name + "\" at " + to_string(client.address) + " has left: " + how,
         change_of(client, false, how));
  leases_.give_all(client.id());
  stats_.add(client);
}

void NetworkLoop::close(LocalTime now) {
  ports_.close(now);
  const std::string why = "the server is shutting down";
  for (ServedClient& client : clients_) {
    client.session.close(Code::kShutdown, why);
    send_all(now, client);
    stats_.add(client);
    notice(false, "\"" + client.name + "\" is disconnected: " + why, change_of(client, false, why));
  }
  clients_.clear();
  half_open_.clear();
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
