// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/igtl/igtl_server.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

namespace tendon::bridge::igtl {
namespace {

constexpr int kMaxAccepted = 16;  ///< per turn

void add(Session::Counts& sum, const Session::Counts& more) {
  sum.used += more.used;
  sum.ignored += more.ignored;
  sum.invalid += more.invalid;
}

}  // namespace

Server::Server(BridgeHost& host, Config config)
    : host_(host), config_(std::move(config)), tcp_(new_listener(config_.listen)), buffer_(kMaxRead) {
  if (!tcp_) throw std::runtime_error("cannot listen at " + to_string(config_.listen) + ": " + words_of(errno));
  address_ = local_address(tcp_.number());
  for (const Alias& alias : config_.names) {
    config_.station.name = alias.name;
    stations_.emplace_back(config_.station);
  }
  poll_again({});
}

Server::~Server() {
  for (const auto& client : clients_) {
    for (const Alias& alias : config_.names) host_.device(alias.index).release(client->number);
  }
}

std::span<const BridgeHost::Count> Server::counts() {
  Session::Counts sum = gone_;
  for (const auto& client : clients_) add(sum, client->session.counts());
  std::uint64_t reports = 0;
  for (const Station& station : stations_) reports += station.reports();
  counts_ = {{{"clients", clients_.size()},
              {"reports", reports},
              {"used", sum.used},
              {"ignored", sum.ignored},
              {"invalid", sum.invalid}}};
  return counts_;
}

void Server::take_connections() {
  for (int i = 0; i < kMaxAccepted; ++i) {
    Address from;
    Descriptor socket = accept_next(tcp_.number(), from);
    if (!socket) return;
    if (clients_.size() >= kMaxClients) {
      if (!std::exchange(full_said_, true)) {
        host_.say("a program at " + to_string(from) + " was refused: " + std::to_string(kMaxClients) +
                  " is the maximum number of programs");
      }
      continue;
    }
    set_up_stream(socket.number(), Session::kMaxUnread);
    clients_.push_back(std::make_unique<Client>(stations_, std::move(socket), from, ++last_number_));
    host_.say(clients_.back()->name + " has connected");
  }
}

void Server::read(LocalTime now, Client& client) {
  const ssize_t got = ::recv(client.tcp.number(), buffer_.data(), buffer_.size(), 0);
  if (got == 0) client.over = "has left";
  if (got < 0 && errno != EAGAIN && errno != EINTR) client.over = "has left: " + words_of(errno);
  if (got <= 0) return;
  client.session.take(now, std::span(buffer_).first(static_cast<std::size_t>(got)));
  if (static_cast<std::size_t>(got) == buffer_.size()) client.rests_until = now + kRest;
}

void Server::write(Client& client) {
  while (client.over.empty() && !client.session.stream().empty()) {
    const Bytes bytes = client.session.stream();
    const ssize_t done = ::send(client.tcp.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (done > 0) {
      client.session.sent(static_cast<std::size_t>(done));
      continue;
    }
    if (errno != EAGAIN && errno != EINTR) client.over = "has left: " + words_of(errno);
    return;
  }
}

void Server::drop(Client& client) {
  for (const Alias& alias : config_.names) host_.device(alias.index).release(client.number);
  host_.say(client.name + " " + client.over);
  add(gone_, client.session.counts());
  full_said_ = false;
}

LocalTime Server::turn(const Moment& now) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const Bytes messages = stations_[i].turn(now, host_.device(config_.names[i].index));
    for (const auto& client : clients_) client->session.send(messages);
  }
  bool asked = false;
  LocalTime next = LocalTime::max();
  for (std::size_t c = 0; c < clients_.size(); ++c) {  // polled_ has the same order
    Client& client = *clients_[c];
    if (polled_[1 + c].revents != 0) read(now.at, client);
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      asked = client.session.ask(now, i, host_.device(config_.names[i].index)) || asked;
    }
    while (const auto sentence = client.session.next_sentence()) host_.say(client.name + ": " + *sentence);
    next = std::min(next, client.session.due());
    if (client.rests_until > now.at) next = std::min(next, client.rests_until);
  }
  if (polled_[0].revents != 0) take_connections();
  for (const auto& client : clients_) {
    if (client->session.take_status_request()) {
      for (const Station& station : stations_) client->session.send(station.greeting());
    }
    write(*client);
    if (client->over.empty() && !client->session.end().empty()) client->over = "is dropped: " + client->session.end();
    if (!client->over.empty()) drop(*client);
  }
  std::erase_if(clients_, [](const auto& client) { return !client->over.empty(); });
  poll_again(now.at);
  return asked ? now.at : next;
}

void Server::poll_again(LocalTime now) {
  polled_.clear();
  polled_.push_back({tcp_.number(), POLLIN, 0});
  for (const auto& client : clients_) {
    const bool reads = client->rests_until <= now;
    const bool writes = !client->session.stream().empty();
    polled_.push_back({client->tcp.number(), static_cast<short>((reads ? POLLIN : 0) | (writes ? POLLOUT : 0)), 0});
  }
}

}  // namespace tendon::bridge::igtl
