// SPDX-License-Identifier: Apache-2.0
#include "server/clients/peer.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include "protocol/wire/header.h"

namespace tendon {
namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(500);  ///< until a busy channel or device is requested again
constexpr Duration kCompareAgain = std::chrono::seconds(5);     ///< after a mismatch; a server may have been restarted

}  // namespace

std::size_t Peer::Line::receive(Address& sender, std::span<std::byte> buffer) {
  const auto datagram = std::exchange(arrived, {});
  sender = from;
  std::copy_n(datagram.begin(), std::min(datagram.size(), buffer.size()), buffer.begin());
  return datagram.size();
}

Peer::Peer(const Config& config, Send send, LocalTime now)
    : config_(config),
      line_(std::move(send)),
      connection_(line_, config.server, {.key = config.key, .seed = config.seed}),
      lease_(kAskAgain, true) {
  config_.seed = {};
  line_.now = now;
  greet(now);
}

bool Peer::is_from_server(const Address& from, std::span<const std::byte> datagram) const {
  if (from != connection_.server()) return false;
  const auto header = decode_header(datagram);
  if (!header) return false;
  if (header->type == DatagramType::kRetry || header->type == DatagramType::kAnswer) return true;
  const Session* const session = connection_.session();
  return header->type == DatagramType::kData && session != nullptr && session->connection_id() == header->connection_id;
}

void Peer::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram, LocalTime reached) {
  line_.from = from;
  line_.reached_at = reached;
  line_.arrived = datagram;
  turn(now);
}

LocalTime Peer::turn(LocalTime now) {
  line_.now = now;
  connection_.begin_turn();
  while (const auto event = connection_.next(now)) take(now, *event);
  if (connection_.session() != nullptr && now >= next_request()) ask(now);
  connection_.flush(now);
  return std::min(connection_.next_turn(), next_request());
}

LocalTime Peer::next_request() const noexcept {
  if (!lease_.holds()) return lease_.due();
  return coupled_ || asked_to_couple_ ? LocalTime::max() : couple_at_;
}

void Peer::greet(LocalTime now) {
  Hello hello;
  hello.role = Role::kController;
  hello.name = config_.name;
  hello.features = {std::string(kFeatureChannels), std::string(kFeatureTeleoperation)};
  if (!config_.device.empty() || !config_.channel.empty()) {
    hello.claims = {{.device = config_.device, .channel = config_.channel, .role = Role::kController}};
  }
  connection_.greet(now, hello);
}

void Peer::take(LocalTime now, const Connection::Event& event) {
  if (const auto* of_session = std::get_if<const Session::Event*>(&event)) {
    take(now, **of_session);
  } else if (const auto* opened = std::get_if<Connection::Opened>(&event)) {
    open(opened->welcome);
  } else if (const auto* ended = std::get_if<Connection::Ended>(&event)) {
    lease_.close();
    coupled_ = false;
    asked_to_couple_.reset();
    newest_.reset();
    say(true, ended->reason);
  } else {
    greet(now);
  }
}

void Peer::open(const Welcome& welcome) {
  lease_.open(welcome.grants.empty() ? Grant{.device = 0, .channel = 0, .role = welcome.role} : welcome.grants.front(),
              line_.now);
  couple_at_ = line_.now;
  const auto& features = welcome.features;
  if (std::find(features.begin(), features.end(), kFeatureTeleoperation) == features.end()) {
    say(true, "the other server does not support teleoperation");
    connection_.drop(line_.now);
  }
}

void Peer::ask(LocalTime now) {
  Session& session = *connection_.session();
  if (!lease_.holds()) {
    if (!lease_.ask(session)) lease_.ask_at(now + kAskAgain);
    return;
  }
  Couple couple = config_.couple;
  couple.device = lease_.place().device;
  couple.channel = lease_.place().channel;
  asked_to_couple_ = session.request(couple);
  if (!asked_to_couple_) couple_at_ = now + kAskAgain;
}

void Peer::answered(LocalTime now, const Session::RequestAnswered& answer) {
  const bool of_lease = lease_.take(answer, now);
  if (!of_lease && answer.id != asked_to_couple_) return;
  if (!of_lease) asked_to_couple_.reset();
  if (answer.code != Code::kOk) {
    say(true, answer.detail.empty() ? "refused" : answer.detail);
    const LocalTime again = now + (answer.code == Code::kBusy ? std::max(answer.wait, kAskAgain) : kCompareAgain);
    of_lease ? lease_.ask_at(again) : void(couple_at_ = again);
  } else if (of_lease) {
    couple_at_ = now;
  } else {
    coupled_ = true;
    say(false, "coupled");
  }
}

void Peer::take(LocalTime now, const Session::Event& event) {
  if (const auto* arrived = std::get_if<Session::PortArrived>(&event)) {
    const Grant& place = lease_.place();
    if (arrived->port.device == place.device && arrived->port.channel == place.channel) newest_ = arrived->port;
  } else if (const auto* answer = std::get_if<Session::RequestAnswered>(&event)) {
    answered(now, *answer);
  } else if (const auto* asked = std::get_if<Session::RequestArrived>(&event)) {
    const auto* lost = std::get_if<LeaseLost>(&asked->request);
    Session& session = *connection_.session();
    if (lost == nullptr) return session.answer(asked->id, Code::kUnsupported, "only a client can send this request");
    session.answer(asked->id, Code::kOk, {});
    if (!lease_.take(*lost, session, now)) return;
    coupled_ = false;
    asked_to_couple_.reset();  // ignores a late reply
    say(true, "\"" + lost->to + "\" has taken the channel");
  }
}

void Peer::send(LocalTime now, const PortState& port) {
  if (!coupled_) return;
  PortFrame frame;
  static_cast<PortState&>(frame) = port;
  frame.device = lease_.place().device;
  frame.channel = lease_.place().channel;
  connection_.session()->send(frame);
  line_.now = now;
  connection_.flush(now);
}

std::optional<PortState> Peer::take() { return std::exchange(newest_, std::nullopt); }

void Peer::close(LocalTime now) {
  line_.now = now;
  connection_.close(now, "the server is shutting down");
  coupled_ = false;
}

void Peer::say(bool warning, std::string text) {
  if (text == said_) return;
  said_ = text;
  notices_.push_back({warning, to_string(config_.server) + ": " + std::move(text)});
}

std::vector<Peer::Notice> Peer::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tendon
