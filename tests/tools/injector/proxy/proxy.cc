// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/injector/proxy/proxy.h"

#include <algorithm>
#include <cstring>
#include <numeric>
#include <string>
#include <utility>

namespace tendon::injector {

std::uint64_t ProxyCounters::lost() const noexcept {
  return std::accumulate(dropped.begin(), dropped.end(), std::uint64_t{0});
}

/// Mixes the bytes, because client addresses often differ only in the port.
std::size_t Proxy::AddressHash::operator()(const Address& address) const noexcept {
  std::uint64_t high = 0;
  std::uint64_t low = 0;
  std::memcpy(&high, address.ip.data(), sizeof high);
  std::memcpy(&low, address.ip.data() + sizeof high, sizeof low);
  return static_cast<std::size_t>(((high * 31 + low) * 31 + address.port) * 0x9e3779b97f4a7c15U >> 16);
}

Proxy::Proxy(Config config) : config_(std::move(config)), flight_(config_.max_bytes_in_flight) {
  // Throws if the trace is invalid.
  if (config_.replay != nullptr) TracePlayer(*config_.replay, Direction::kUp, 0, config_.playback.by);
}

Proxy::Client& Proxy::add_client(const Address& address) {
  auto client = std::make_unique<Client>();
  client->index = next_index_++;
  client->address = address;
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const std::size_t d = index_of(direction);
    Way& way = client->ways[d];
    if (config_.replay != nullptr) {
      auto player = std::make_unique<TracePlayer>(*config_.replay, direction, client->index, config_.playback.by,
                                                  *start_, config_.playback.at_end);
      if (config_.playback.add) player->add(config_.networks[d].for_link(client->index, *start_));
      way.player = player.get();
      way.decider = std::move(player);
      way.history = std::make_unique<History>();
      continue;
    }
    const auto own = of_one_client_[d].find(client->index);
    auto injector = std::make_unique<Injector>(
        own != of_one_client_[d].end() ? own->second.injector.for_link(client->index, own->second.since)
                                       : config_.networks[d].for_link(client->index, changed_[d].value_or(*start_)));
    way.injector = injector.get();
    way.decider = std::move(injector);
    if (way.injector->profile().replay.depth > 0) way.history = std::make_unique<History>();
  }
  Client& added = *client;
  by_address_.emplace(address, &added);
  clients_.emplace(added.index, std::move(client));
  return added;
}

bool Proxy::is_new(const Address& client) const {
  return clients_.size() < config_.max_clients && !by_address_.contains(client);
}

std::optional<ClientIndex> Proxy::receive_from_client(const Address& address, std::span<const std::byte> datagram,
                                                      LocalTime arrival, bool may_add) {
  if (!start_) start_ = arrival;
  ++count(Direction::kUp).received;
  follow_timeline(arrival);
  const auto found = by_address_.find(address);
  if (found == by_address_.end() && (!may_add || clients_.size() >= config_.max_clients)) {
    ++count(Direction::kUp).refused_clients;
    return std::nullopt;
  }
  Client& client = found != by_address_.end() ? *found->second : add_client(address);
  client.last_heard = arrival;
  inject(client, Direction::kUp, datagram, arrival);
  return client.index;
}

void Proxy::receive_from_server(ClientIndex index, std::span<const std::byte> datagram, LocalTime arrival) {
  ++count(Direction::kDown).received;
  follow_timeline(arrival);
  const auto found = clients_.find(index);
  if (found == clients_.end()) {
    ++count(Direction::kDown).refused_clients;
    return;
  }
  inject(*found->second, Direction::kDown, datagram, arrival);
}

void Proxy::inject(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime arrival) {
  Way& way = client.ways[index_of(direction)];
  ++way.received;
  ended_ = ended_ || (way.player != nullptr && way.player->stops(arrival));
  if (ended_) {
    ++count(direction).after_end;
    return;
  }
  Tag tag{&client, {}};
  TraceRecord& record = tag.record;
  static_cast<Decision&>(record) =
      way.decider->decide({arrival, static_cast<std::uint32_t>(datagram.size()), datagram});
  if (way.player != nullptr) {
    double& played = measurements_[index_of(direction)].played;
    played = std::max(played, way.player->played());
  }
  record.direction = direction;
  record.link = client.index;
  if (config_.record) record.payload_hash = payload_hash(datagram);

  const std::size_t before = flight_.size();
  const bool fits = flight_.launch(record, datagram, tag, way.history.get());
  client.in_flight += flight_.size() - before;
  if (!fits) ++count(direction).refused_full;
  const bool dropped = record.verdict == Verdict::kDrop;
  if (dropped) ++count(direction).dropped[static_cast<std::size_t>(record.cause)];
  if (dropped || !fits) complete(record);
}

void Proxy::complete(TraceRecord record) {
  if (!config_.record) return;
  const Duration start = start_->time_since_epoch();
  record.arrival -= start;
  record.release -= start;
  if (record.duplicate) *record.duplicate -= start;
  if (record.stale) record.stale->release -= start;
  if (record.actual) *record.actual -= start;
  records_.push_back(record);
}

std::optional<Proxy::Departure> Proxy::next_due(LocalTime now) {
  auto next = flight_.next_due(now);
  if (!next) return std::nullopt;
  Client& client = *next->tag.client;
  --client.in_flight;
  return Departure{.to = client.address,
                   .due = next->due,
                   .copy = next->copy,
                   .datagram = next->datagram,
                   .record = next->tag.record};
}

void Proxy::left(const Departure& departure, LocalTime now) {
  TraceRecord record = departure.record;
  ProxyMeasurements& measured = measurements_[index_of(record.direction)];
  measured.release_error.observe(now - departure.due);
  switch (departure.copy) {
    case Copy::kFirst:
      ++measured.counters.forwarded;
      measured.delay.observe(now - record.arrival);
      if (record.flipped_bit) ++measured.counters.flipped;
      if (record.truncated_to) ++measured.counters.truncated;
      record.actual = now;
      complete(record);
      break;
    case Copy::kSecond:
      ++measured.counters.duplicated;
      break;
    case Copy::kStale:
      ++measured.counters.replayed;
      break;
  }
}

void Proxy::not_sent(const Departure& departure) {
  ++count(departure.record.direction).unsent;
  if (departure.copy == Copy::kFirst) complete(departure.record);
}

void Proxy::follow_timeline(LocalTime now) {
  while (steps_done_ < config_.timeline.size() && start_ && *start_ + config_.timeline[steps_done_].at <= now) {
    const Step& step = config_.timeline[steps_done_++];
    change(step.change, *start_ + step.at);
  }
}

void Proxy::change(const PreparedChange& change, LocalTime now) {
  last_change_ = change.text;
  for (const Direction direction : {Direction::kUp, Direction::kDown}) {
    const std::size_t d = index_of(direction);
    if (!change.to[d]) continue;
    if (change.client) {
      of_one_client_[d].insert_or_assign(*change.client, Network{*change.to[d], now});
    } else {
      config_.networks[d] = *change.to[d];
      changed_[d] = now;
      of_one_client_[d].clear();
    }
    for (const auto& [index, client] : clients_) {
      Way& way = client->ways[d];
      if (way.injector == nullptr || (change.client && *change.client != index)) continue;
      way.injector->change(*change.to[d], now);
      if (way.injector->profile().replay.depth > 0 && !way.history) way.history = std::make_unique<History>();
    }
  }
}

std::optional<ClientIndex> Proxy::next_evicted(LocalTime now) {
  const auto idle = std::ranges::find_if(clients_, [&](const auto& entry) {
    return entry.second->in_flight == 0 && now - entry.second->last_heard >= config_.idle_timeout;
  });
  if (idle == clients_.end()) return std::nullopt;
  const ClientIndex index = idle->first;
  by_address_.erase(idle->second->address);
  clients_.erase(idle);
  return index;
}

std::optional<LocalTime> Proxy::next_wake() const {
  std::optional<LocalTime> wake = flight_.next_wake();
  for (const auto& [index, client] : clients_) {
    if (client->in_flight > 0) continue;
    const LocalTime idle = client->last_heard + config_.idle_timeout;
    wake = wake ? std::min(*wake, idle) : idle;
  }
  return wake;
}

std::vector<Proxy::ClientSummary> Proxy::clients() const {
  std::vector<ClientSummary> result;
  for (const auto& [index, client] : clients_) {
    result.push_back({index, client->address, {client->ways[0].received, client->ways[1].received}});
  }
  std::ranges::sort(result, {}, &ClientSummary::index);
  return result;
}

}  // namespace tendon::injector
