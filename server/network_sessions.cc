// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <array>
#include <utility>

#include "server/clients/unknown_keys.h"
#include "server/network_loop.h"

// How the sessions of a NetworkLoop begin and end.

namespace tendon {

namespace {

using enum DatagramFilter::Sender;

constexpr std::size_t kMaxForeign = 64;

/// Keeps at most one of these notices per turn, so that a flood of Hellos cannot displace other notices.
void note_unknown_key(std::vector<NetworkLoop::Notice>& notices, std::size_t most, const Address& from) {
  const auto is_one = [](const NetworkLoop::Notice& one) { return UnknownKeys::is_notice(one.text); };
  const auto noted = std::ranges::find_if(notices, is_one);
  if (noted != notices.end()) {
    noted->text = UnknownKeys::notice(from);
  } else if (notices.size() < most) {
    notices.push_back({true, UnknownKeys::notice(from)});
  }
}

}  // namespace

void NetworkLoop::greet(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> answer;
  const std::uint64_t unknown_keys = handshake_.stats().unknown_key;
  const ServerHandshake::Reply reply = handshake_.receive(now, from, datagram, answer);
  if (handshake_.stats().unknown_key > unknown_keys) note_unknown_key(notices_, kMaxNotices, from);
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
  for (const Subscription& seen : client.subscriptions) devices_[seen.device].sampled.remember();
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

}  // namespace tendon
