// SPDX-License-Identifier: Apache-2.0
#include "tests/injector/proxy.h"

#include <algorithm>
#include <stdexcept>
#include <string>

namespace tendon::injector {
namespace {

/// What one datagram on its way costs besides its payload: the map node and two heap headers.
constexpr std::size_t kBookkeepingBytes = 128;

Injector prototype(const char* name, const Profile& profile, std::uint64_t seed, Direction direction) {
  try {
    return {profile, seed, 0, direction};
  } catch (const std::invalid_argument& error) {
    throw std::invalid_argument(std::string(name) + ": " + error.what());
  }
}

}  // namespace

Proxy::Proxy(const ProxyOptions& options)
    : options_(options),
      prototypes_{prototype("up", options.up, options.seed, Direction::kUp),
                  prototype("down", options.down, options.seed, Direction::kDown)} {}

Proxy::Client* Proxy::find(ClientIndex index) {
  const auto found = std::ranges::find(clients_, index, &Client::index);
  return found == clients_.end() ? nullptr : &*found;
}

std::optional<ClientIndex> Proxy::receive_from_client(const Address& client, std::span<const std::byte> datagram,
                                                      LocalTime now) {
  ++count(Direction::kUp).received;
  auto found = std::ranges::find(clients_, client, &Client::address);
  if (found == clients_.end()) {
    if (clients_.size() >= options_.max_clients) {
      ++count(Direction::kUp).refused;
      return std::nullopt;
    }
    const ClientIndex index = next_index_++;
    clients_.push_back({.index = index,
                        .address = client,
                        .last_heard = now,
                        .injectors = {prototypes_[0].for_link(index), prototypes_[1].for_link(index)}});
    found = std::prev(clients_.end());
  }
  found->last_heard = now;
  inject(*found, Direction::kUp, datagram, now);
  return found->index;
}

void Proxy::receive_from_server(ClientIndex client, const Address& from, std::span<const std::byte> datagram,
                                LocalTime now) {
  ++count(Direction::kDown).received;
  Client* const known = find(client);
  if (known == nullptr || from != options_.server) {
    ++count(Direction::kDown).refused;
    return;
  }
  inject(*known, Direction::kDown, datagram, now);
}

void Proxy::inject(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime now) {
  // The decision comes first: a refusal must not shift the decisions on later datagrams.
  const Packet packet{.arrival = now, .size = static_cast<std::uint32_t>(datagram.size()), .bytes = datagram};
  const Decision decision = client.injectors[static_cast<std::size_t>(direction)].decide(packet);
  if (decision.verdict == Verdict::kDrop) {
    ++count(direction).lost;
    return;
  }
  take_off(client, direction, datagram, decision.release, false);
  if (decision.duplicate) take_off(client, direction, datagram, *decision.duplicate, true);
}

void Proxy::take_off(Client& client, Direction direction, std::span<const std::byte> datagram, LocalTime due,
                     bool second_copy) {
  const std::size_t bytes = datagram.size() + kBookkeepingBytes;
  if (bytes > options_.max_bytes_in_flight - bytes_in_flight_) {
    if (!second_copy) ++count(direction).refused;
    return;
  }
  bytes_in_flight_ += bytes;
  ++client.in_flight;
  in_flight_.emplace(std::pair(due, next_sequence_++),
                     Flying{direction, client.index, second_copy, {datagram.begin(), datagram.end()}});
}

std::optional<Proxy::Departure> Proxy::next_due(LocalTime now) {
  if (in_flight_.empty() || in_flight_.begin()->first.first > now) return std::nullopt;
  auto node = in_flight_.extract(in_flight_.begin());
  Flying& flying = node.mapped();
  bytes_in_flight_ -= flying.datagram.size() + kBookkeepingBytes;
  ProxyCounters& counters = count(flying.direction);
  ++(flying.second_copy ? counters.duplicated : counters.forwarded);

  Client& client = *find(flying.client);  // there: no client is forgotten while something is on its way
  --client.in_flight;
  return Departure{.direction = flying.direction,
                   .client = flying.client,
                   .to = flying.direction == Direction::kUp ? options_.server : client.address,
                   .due = node.key().first,
                   .datagram = std::move(flying.datagram)};
}

std::optional<ClientIndex> Proxy::next_evicted(LocalTime now) {
  const auto idle = std::ranges::find_if(clients_, [&](const Client& client) {
    return client.in_flight == 0 && now - client.last_heard >= options_.idle_timeout;
  });
  if (idle == clients_.end()) return std::nullopt;
  const ClientIndex index = idle->index;
  clients_.erase(idle);
  return index;
}

std::optional<LocalTime> Proxy::next_wake() const {
  std::optional<LocalTime> wake;
  const auto consider = [&](LocalTime at) { wake = wake ? std::min(*wake, at) : at; };
  if (!in_flight_.empty()) consider(in_flight_.begin()->first.first);
  for (const Client& client : clients_) {
    if (client.in_flight == 0) consider(client.last_heard + options_.idle_timeout);
  }
  return wake;
}

}  // namespace tendon::injector
