// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_server.h"

#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <stdexcept>

namespace tendon::bridge::vrpn {
namespace {

constexpr int kMaxAccepted = 16;             ///< per turn
constexpr int kMaxHellos = 64;               ///< per turn
constexpr int kMaxDatagrams = 256;           ///< per client and turn
constexpr std::size_t kMaxRead = 64 * 1024;  ///< per client and turn; 256 messages of 256 bytes
constexpr int kPortTries = 16;
/// Delay before reading a program that exceeds its rate, so that its messages are handled in batches.
constexpr Duration kRest = std::chrono::microseconds(500);
constexpr std::size_t kEach = 2;  ///< sockets per client

std::string host_of(const Address& address) {
  const std::string text = to_string(address);
  return text.substr(0, text.rfind(':'));
}

}  // namespace

struct Server::Client {
  Client(std::span<const Station> stations, const Moment& now, Descriptor socket, const Address& from,
         std::uint32_t its_number, bool dialled)
      : tcp(std::move(socket)),
        address(from),
        number(its_number),
        name("client " + std::to_string(its_number) + " (" + to_string(from) + ")"),
        dialling(dialled),
        until(now.at + kPatience),
        peer(stations, now) {
    for (std::size_t i = 0; i < stations.size(); ++i) askers.emplace_back(number, name, i);
  }

  Descriptor tcp;
  Descriptor udp;
  Address address;
  std::uint32_t number;
  std::string name;
  bool dialling;    ///< the connection to the program is not established yet
  LocalTime until;  ///< deadline for the connection or the cookie
  LocalTime rests_until{};
  Peer peer;
  std::vector<Asker> askers;
  std::string over;
};

Server::Server(BridgeHost& host, Config config, LocalTime now)
    : host_(host), config_(std::move(config)), dialled_(now) {
  for (const Alias& alias : config_.names) {
    stations_.push_back({.name = alias.name});
  }
  seen_.resize(stations_.size());
  buffer_.resize(kMaxRead);
  int error = 0;
  for (int i = 0; i < kPortTries && !udp_; ++i) {  // the port may be in use for UDP even if it is free for TCP
    tcp_ = new_listener(config_.listen);
    if (!tcp_) {
      error = errno;
      break;
    }
    address_ = local_address(tcp_.number());
    Descriptor udp = new_socket(SOCK_DGRAM);
    if (bind_to(udp.number(), address_)) {
      udp_ = std::move(udp);
    } else {
      error = errno;
      if (config_.listen.port != 0) break;
    }
  }
  if (!udp_) throw std::runtime_error("cannot listen at " + to_string(config_.listen) + ": " + words_of(error));
  poll_again(now);
}

Server::~Server() {
  for (const auto& client : clients_) {
    for (const Alias& alias : config_.names) host_.device(alias.index).release(client->number);
  }
}

std::span<const BridgeHost::Count> Server::counts() {
  Peer::Counts sum = gone_;
  std::uint64_t open = 0;
  for (const auto& client : clients_) {
    const Peer::Counts& one = client->peer.counts();
    sum.messages += one.messages;
    sum.skipped += one.skipped;
    sum.nonsense += one.nonsense;
    sum.not_rendered += one.not_rendered;
    sum.reports += one.reports;
    open += client->peer.open() ? 1 : 0;
  }
  counts_ = {{"clients", open},        {"reports", sum.reports},   {"messages", sum.messages},
             {"skipped", sum.skipped}, {"nonsense", sum.nonsense}, {"not_rendered", sum.not_rendered}};
  return counts_;
}

void Server::serve_states(const Moment& now) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    const BridgedDevice& bridged = host_.device(config_.names[i].index);
    if (const auto sentence = stations_[i].learn(bridged)) host_.say(*sentence);
    if (bridged.lost() != seen_[i].lost) {
      seen_[i].lost = bridged.lost();
      for (const auto& client : clients_) {
        client->peer.tell(now, i, seen_[i].lost ? Severity::kWarning : Severity::kNormal,
                          seen_[i].lost ? "the connection to the haptic server is lost; retrying"
                                        : "connecting to the haptic server");
      }
    }
    if (!bridged.state() || bridged.states() == seen_[i].states) continue;
    seen_[i].states = bridged.states();
    const Moment arrived{bridged.arrived(), now.since_1970 - (now.at - bridged.arrived())};
    for (const auto& client : clients_) {
      client->peer.report(arrived, i, *bridged.state(), bridged.link().smoothed_round_trip);
    }
  }
  for (const auto& client : clients_) write(*client);
}

bool Server::has_place(const std::string& whom) {
  if (clients_.size() < kMaxClients) return true;
  if (!std::exchange(full_said_, true)) {
    host_.say(whom + " was refused: " + std::to_string(kMaxClients) + " is the maximum number of clients");
  }
  return false;
}

void Server::take_hello(const Moment& now) {
  for (int i = 0; i < kMaxHellos; ++i) {
    sockaddr_in from{};
    socklen_t size = sizeof from;
    const ssize_t got =
        ::recvfrom(udp_.number(), buffer_.data(), buffer_.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
    if (got < 0) return;
    const auto port = port_in_hello(std::span(buffer_).first(static_cast<std::size_t>(got)));
    if (!port) {
      ++gone_.nonsense;
      continue;
    }
    Address to = address_of(from);
    to.port = *port;
    dial(now, to);
  }
}

void Server::dial(const Moment& now, const Address& to) {
  // A client repeats its hello every second until the connection is established.
  if (std::ranges::any_of(clients_, [&](const auto& client) { return client->address == to; })) return;
  dials_ = std::min<double>(kDialsPerSecond, dials_ + kDialsPerSecond * seconds(now.at - dialled_));
  dialled_ = now.at;
  if (dials_ < 1 || !has_place("a program at " + to_string(to))) return;
  dials_ -= 1;
  Descriptor socket = new_socket(SOCK_STREAM);
  const sockaddr_in name = socket_address(to);
  set_up_stream(socket.number(), Peer::kMaxUnread);
  if (::connect(socket.number(), reinterpret_cast<const sockaddr*>(&name), sizeof name) != 0 && errno != EINPROGRESS) {
    return;
  }
  clients_.push_back(std::make_unique<Client>(stations_, now, std::move(socket), to, ++last_number_, true));
}

void Server::take_connections(const Moment& now) {
  for (int i = 0; i < kMaxAccepted; ++i) {
    Address address;
    Descriptor socket = accept_next(tcp_.number(), address);
    if (!socket) return;
    if (!has_place("a program at " + to_string(address))) continue;
    set_up_stream(socket.number(), Peer::kMaxUnread);
    clients_.push_back(std::make_unique<Client>(stations_, now, std::move(socket), address, ++last_number_, false));
  }
}

void Server::finish_dial(const Moment& now, Client& client, short ready) {
  if ((ready & (POLLOUT | POLLERR | POLLHUP)) == 0) return;
  int error = 0;
  socklen_t size = sizeof error;
  ::getsockopt(client.tcp.number(), SOL_SOCKET, SO_ERROR, &error, &size);
  if (error != 0) {
    client.over = "does not answer: " + words_of(error);
    return;
  }
  client.dialling = false;
  client.until = now.at + kPatience;
}

void Server::open_udp(const Moment& now, Client& client) {
  Address ours = local_address(client.tcp.number());
  ours.port = 0;
  Descriptor socket = new_socket(SOCK_DGRAM);
  if (!bind_to(socket.number(), ours)) return;
  client.udp = std::move(socket);
  client.peer.describe_port(now, host_of(ours), local_address(client.udp.number()).port);
}

void Server::read(const Moment& now, Client& client, short ready, short datagrams_ready) {
  const std::uint64_t before = client.peer.counts().messages;
  if ((ready & (POLLIN | POLLERR | POLLHUP)) != 0) {
    for (std::size_t left = kMaxRead; left > 0;) {
      const ssize_t got = ::recv(client.tcp.number(), buffer_.data(), left, 0);
      if (got == 0) client.over = "has left";
      if (got < 0 && errno != EAGAIN && errno != EINTR) client.over = "has left: " + words_of(errno);
      if (got <= 0) break;
      left -= static_cast<std::size_t>(got);
      client.peer.take_stream(now, std::span(buffer_).first(static_cast<std::size_t>(got)));
    }
  }
  if (datagrams_ready != 0) {
    for (int i = 0; i < kMaxDatagrams; ++i) {
      sockaddr_in from{};
      socklen_t size = sizeof from;
      const ssize_t got =
          ::recvfrom(client.udp.number(), buffer_.data(), buffer_.size(), 0, reinterpret_cast<sockaddr*>(&from), &size);
      if (got < 0) break;
      if (address_of(from).ip != client.address.ip) continue;  // a program may send datagrams from any of its ports
      client.peer.take_datagram(now, std::span(buffer_).first(static_cast<std::size_t>(got)));
    }
  }
  client.peer.end_of_batch(now);
  if (client.peer.counts().messages > before && client.peer.is_above_its_share()) client.rests_until = now.at + kRest;
  if (client.peer.udp_port() && !client.udp) open_udp(now, client);
}

void Server::write(Client& client) {
  if (client.dialling || !client.over.empty()) return;
  if (client.udp && client.peer.udp_port()) {
    Address to = client.address;
    to.port = *client.peer.udp_port();
    const sockaddr_in name = socket_address(to);
    for (const Buffer& datagram : client.peer.datagrams()) {
      ::sendto(client.udp.number(), datagram.data(), datagram.size(), MSG_NOSIGNAL,
               reinterpret_cast<const sockaddr*>(&name), sizeof name);
    }
  }
  client.peer.datagrams().clear();
  while (!client.peer.stream().empty()) {
    const Bytes bytes = client.peer.stream();
    const ssize_t done = ::send(client.tcp.number(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (done <= 0) {
      if (errno != EAGAIN && errno != EINTR) client.over = "has left: " + words_of(errno);
      break;
    }
    client.peer.sent(static_cast<std::size_t>(done));
  }
}

void Server::drop(Client& client, const std::string& why) {
  for (const Alias& alias : config_.names) host_.device(alias.index).release(client.number);
  host_.say(client.name + " " + why);
  const Peer::Counts& counts = client.peer.counts();
  gone_.messages += counts.messages;
  gone_.skipped += counts.skipped;
  gone_.nonsense += counts.nonsense;
  gone_.not_rendered += counts.not_rendered;
  gone_.reports += counts.reports;
  full_said_ = false;
}

LocalTime Server::turn(const Moment& now) {
  serve_states(now);
  bool asked = false;
  LocalTime next = LocalTime::max();
  const std::size_t known = clients_.size();  // polled_ covers these clients, in this order
  for (std::size_t c = 0; c < known; ++c) {
    Client& client = *clients_[c];
    const short ready = polled_[2 + kEach * c].revents;
    const bool was_open = client.peer.open();
    if (client.dialling) {
      finish_dial(now, client, ready);
    } else {
      read(now, client, ready, polled_[2 + kEach * c + 1].revents);
    }
    while (const auto sentence = client.peer.next_sentence()) host_.say(client.name + ": " + *sentence);
    if (!was_open && client.peer.open()) host_.say(client.name + " has connected");
    for (std::size_t i = 0; i < stations_.size(); ++i) {
      Asker& asker = client.askers[i];
      asked =
          asker.turn(now.at, now.since_1970, host_.device(config_.names[i].index), stations_[i], client.peer) || asked;
      if (const auto sentence = asker.next_sentence()) host_.say(*sentence);
    }
    write(client);
    if (!client.peer.open() && now.at >= client.until && client.over.empty()) {
      client.over = client.dialling ? "does not answer" : "did not send the VRPN handshake";
    }
    if (!client.peer.end().empty()) client.over = "is dropped: " + client.peer.end();
    if (!client.peer.open()) next = std::min(next, client.until);
    if (client.rests_until > now.at) next = std::min(next, client.rests_until);
  }
  if (polled_[0].revents != 0) take_hello(now);
  if (polled_[1].revents != 0) take_connections(now);
  for (const auto& client : clients_) write(*client);
  for (auto& client : clients_) {
    if (!client->over.empty()) drop(*client, client->over);
  }
  std::erase_if(clients_, [](const auto& client) { return !client->over.empty(); });
  poll_again(now.at);
  return asked ? now.at : next;
}

void Server::poll_again(LocalTime now) {
  polled_.clear();
  polled_.push_back({udp_.number(), POLLIN, 0});
  polled_.push_back({tcp_.number(), POLLIN, 0});
  for (const auto& client : clients_) {
    const bool reads = client->rests_until <= now;
    const bool writes = client->dialling || !client->peer.stream().empty();
    const auto events = static_cast<short>((reads ? POLLIN : 0) | (writes ? POLLOUT : 0));
    polled_.push_back({client->tcp.number(), events, 0});
    polled_.push_back({reads ? client->udp.number() : -1, POLLIN, 0});  // poll() ignores −1
  }
}

}  // namespace tendon::bridge::vrpn
