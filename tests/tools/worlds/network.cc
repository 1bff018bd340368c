// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/worlds/network.h"

#include <algorithm>
#include <cstring>
#include <stdexcept>
#include <utility>

namespace tendon::simulation {

namespace {

/// Between a client's ports before and after a NAT rebinding; larger than the number of clients.
constexpr std::uint32_t kRebindStride = 128;

}  // namespace

class Network::End final : public Link {
 public:
  End(Network& network, std::optional<std::uint32_t> link) : network_(network), link_(link) {}

  void send(const Address& to, std::span<const std::byte> datagram) override {
    if (!link_) return network_.launch_down(to, datagram);
    // Clients can only reach the server.
    if (to == network_.server_address_) network_.launch_up(*link_, datagram);
  }

  std::size_t receive(Address& from, std::span<std::byte> buffer) override {
    if (unread() == 0) return 0;
    const Letter& letter = letters_[next_++];
    from = letter.from;
    std::copy_n(letter.bytes.begin(), std::min(buffer.size(), letter.bytes.size()), buffer.begin());
    if (unread() == 0) next_ = count_ = 0;
    return letter.bytes.size();
  }

  void arrive(const Address& from, std::span<const std::byte> datagram) {
    if (datagram.empty()) return;  // Link::receive returns 0 if nothing is received
    if (count_ == letters_.size()) letters_.emplace_back();
    Letter& letter = letters_[count_++];
    letter.from = from;
    letter.bytes.assign(datagram.begin(), datagram.end());
    ++arrived_;
    news_ = true;
  }

  std::size_t unread() const noexcept { return count_ - next_; }
  void forget() noexcept { next_ = count_ = 0; }
  bool take_news() noexcept { return std::exchange(news_, false); }
  std::uint64_t arrivals() const noexcept { return arrived_; }

 private:
  struct Letter {
    Address from;
    std::vector<std::byte> bytes;
  };

  Network& network_;
  std::optional<std::uint32_t> link_;
  std::vector<Letter> letters_;
  std::size_t next_ = 0;
  std::size_t count_ = 0;
  std::uint64_t arrived_ = 0;
  bool news_ = false;
};

struct Network::Client {
  Client(Network& network, std::uint32_t link, const Address& the_address)
      : address(the_address),
        outside(the_address),
        end(network, link),
        up(network.make_way(injector::Direction::kUp, link)),
        down(network.make_way(injector::Direction::kDown, link)) {}

  Address address;
  Address outside;  ///< as seen by the server
  End end;
  Way up;
  Way down;
  std::size_t on_their_way_up = 0;
};

Network::Network(std::uint64_t seed, const Weather& weather, const Address& server, Players players)
    : seed_(seed),
      weather_(weather),
      server_address_(server),
      players_(std::move(players)),
      server_(std::make_unique<End>(*this, std::nullopt)) {}

Network::~Network() = default;

Link& Network::server() { return *server_; }

Link& Network::open(const Address& address) {
  for (const auto& client : clients_) {
    if (client->address != address) continue;
    client->end.forget();
    return client->end;
  }
  if (clients_.size() == kRebindStride) throw std::length_error("too many clients for one simulated network");
  clients_.push_back(std::make_unique<Client>(*this, static_cast<std::uint32_t>(clients_.size()), address));
  return clients_.back()->end;
}

Network::Way Network::make_way(injector::Direction direction, std::uint32_t link) {
  Way way;
  const injector::Profile& profile = direction == injector::Direction::kUp ? weather_.up : weather_.down;
  if (players_) way.decider = players_(direction, link);
  if (!way.decider) {
    auto injector = std::make_unique<injector::Injector>(profile, seed_, link, direction);
    way.injector = injector.get();
    way.decider = std::move(injector);
  }
  if (way.injector == nullptr || profile.replay.probability > 0) way.history = std::make_unique<injector::History>();
  return way;
}

void Network::change(const Weather& weather, LocalTime now) {
  weather_ = weather;
  for (const auto& client : clients_) {
    if (client->up.injector != nullptr) client->up.injector->change(weather.up, now);
    if (client->down.injector != nullptr) client->down.injector->change(weather.down, now);
    if (weather.up.replay.probability > 0 && !client->up.history) {
      client->up.history = std::make_unique<injector::History>();
    }
    if (weather.down.replay.probability > 0 && !client->down.history) {
      client->down.history = std::make_unique<injector::History>();
    }
  }
}

void Network::launch_up(std::uint32_t link, std::span<const std::byte> datagram) {
  Client& client = *clients_[link];
  const injector::Decision decision =
      client.up.decider->decide({now_, static_cast<std::uint32_t>(datagram.size()), datagram});
  if (watch_) watch_(injector::Direction::kUp, link, decision);
  client.outside.port = static_cast<std::uint16_t>(client.address.port + decision.rebinds * kRebindStride);
  const std::size_t before = flight_.size();
  launch(client.up, {link, injector::Direction::kUp, client.outside.port}, decision, datagram);
  client.on_their_way_up += flight_.size() - before;
}

void Network::launch_down(const Address& to, std::span<const std::byte> datagram) {
  const auto client = std::ranges::find_if(clients_, [&](const auto& c) { return c->outside == to; });
  if (client == clients_.end()) {
    ++counts_.sent;
    ++counts_.nowhere;
    return;
  }
  const auto link = static_cast<std::uint32_t>(client - clients_.begin());
  const injector::Decision decision =
      (*client)->down.decider->decide({now_, static_cast<std::uint32_t>(datagram.size()), datagram});
  if (watch_) watch_(injector::Direction::kDown, link, decision);
  launch((*client)->down, {link, injector::Direction::kDown, to.port}, decision, datagram);
}

void Network::launch(Way& way, Tag tag, const injector::Decision& decision, std::span<const std::byte> datagram) {
  tag.damaged = decision.flipped_bit || (decision.truncated_to && *decision.truncated_to < datagram.size());
  const std::size_t before = flight_.size();
  flight_.launch(decision, datagram, tag, way.history.get());
  const std::size_t launched = flight_.size() - before;
  const bool dropped = decision.verdict == injector::Verdict::kDrop;
  LocalTime& latest = dropped ? latest_of_lost_ : latest_arrival_;
  latest = std::max(latest, decision.release);
  if (decision.duplicate) latest_arrival_ = std::max(latest_arrival_, *decision.duplicate);
  if (decision.stale) latest_arrival_ = std::max(latest_arrival_, decision.stale->release);
  ++counts_.sent;
  counts_.lost += dropped ? 1 : 0;
  counts_.copies += launched - (dropped ? 0 : 1);
}

void Network::deliver(LocalTime now) {
  now_ = now;
  while (const auto due = flight_.next_due(now)) {
    Client& client = *clients_[due->tag.link];
    const bool up = due->tag.direction == injector::Direction::kUp;
    if (watch_arrivals_ && (up || due->tag.port == client.outside.port)) {
      const bool whole = !due->tag.damaged || due->copy != injector::Copy::kFirst;
      watch_arrivals_({due->tag.direction, due->tag.link, due->datagram, whole});
    }
    if (up) {
      Address from = client.address;
      from.port = due->tag.port;
      --client.on_their_way_up;
      server_->arrive(from, due->datagram);
    } else if (due->tag.port == client.outside.port) {
      client.end.arrive(server_address_, due->datagram);
    } else {
      ++counts_.nowhere;
      continue;
    }
    ++counts_.delivered;
  }
}

bool Network::take_news_of_server() { return server_->take_news(); }
bool Network::take_news_of(std::uint32_t link) { return clients_[link]->end.take_news(); }
std::size_t Network::unread_by_server() const { return server_->unread(); }
std::size_t Network::unread_by(std::uint32_t link) const { return clients_[link]->end.unread(); }
std::uint64_t Network::arrived_at_server() const { return server_->arrivals(); }
std::uint64_t Network::arrived_at(std::uint32_t link) const { return clients_[link]->end.arrivals(); }
std::size_t Network::on_their_way_up(std::uint32_t link) const { return clients_[link]->on_their_way_up; }
Address Network::outside(std::uint32_t link) const { return clients_[link]->outside; }

void Network::forge(const Address& from, const Address& to, std::span<const std::byte> datagram) {
  if (to == server_address_) return server_->arrive(from, datagram);
  const auto client = std::ranges::find_if(clients_, [&](const auto& c) { return c->address == to; });
  if (client != clients_.end()) (*client)->end.arrive(from, datagram);
}

}  // namespace tendon::simulation
