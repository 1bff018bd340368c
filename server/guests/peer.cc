// SPDX-License-Identifier: Apache-2.0
#include "server/guests/peer.h"

#include <algorithm>
#include <chrono>
#include <utility>
#include <variant>

#include "protocol/wire/header.h"

namespace tendon {
namespace {

/// A channel or a device that somebody else has is asked for again after this.
constexpr Duration kAskAgain = std::chrono::milliseconds(500);
/// Scenes that do not fit together are compared again after this: one of the two may have been started anew.
constexpr Duration kCompareAgain = std::chrono::seconds(5);

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
      connection_(line_, config.server, {.key = config.key, .seed = config.seed}) {
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

void Peer::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  line_.from = from;
  line_.arrived = datagram;
  turn(now);
}

LocalTime Peer::turn(LocalTime now) {
  line_.now = now;
  connection_.begin_turn();
  while (const auto event = connection_.next(now)) take(now, *event);
  if (connection_.session() != nullptr && !asked_ && now >= ask_again_) ask(now);
  connection_.flush(now);
  return std::min(connection_.next_turn(), asked_ ? LocalTime::max() : ask_again_);
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
    if (connection_.session() != nullptr) ask_again_ = now;
  } else if (const auto* ended = std::get_if<Connection::Ended>(&event)) {
    coupled_ = holds_ = false;
    asked_.reset();
    newest_.reset();
    ask_again_ = LocalTime::max();
    say(true, ended->reason);
  } else {
    greet(now);
  }
}

void Peer::open(const Welcome& welcome) {
  place_ = welcome.grants.empty() ? Grant{.device = 0, .channel = 0, .role = welcome.role} : welcome.grants.front();
  holds_ = place_.role == Role::kController;
  const auto& features = welcome.features;
  if (std::find(features.begin(), features.end(), kFeatureTeleoperation) == features.end()) {
    say(true, "that server does not know how to couple two devices");
    connection_.drop(line_.now);
  }
}

/// The channel first, then the coupling.
void Peer::ask(LocalTime now) {
  ask_again_ = LocalTime::max();
  Session& session = *connection_.session();
  if (!holds_) {
    asked_ = session.request(TakeLease{.device = place_.device, .channel = place_.channel});
  } else if (!coupled_) {
    Couple couple = config_.couple;
    couple.device = place_.device;
    couple.channel = place_.channel;
    asked_ = session.request(couple);
  } else {
    return;
  }
  if (!asked_) ask_again_ = now + kAskAgain;
}

void Peer::answered(LocalTime now, const Session::RequestAnswered& answer) {
  if (answer.id != asked_) return;
  asked_.reset();
  if (answer.code != Code::kOk) {
    say(true, answer.detail.empty() ? "refused" : answer.detail);
    ask_again_ = now + (answer.code == Code::kBusy ? std::max(answer.wait, kAskAgain) : kCompareAgain);
  } else if (!holds_) {
    holds_ = true;
    ask_again_ = now;
  } else {
    coupled_ = true;
    say(false, "coupled");
  }
}

void Peer::take(LocalTime now, const Session::Event& event) {
  if (const auto* arrived = std::get_if<Session::PortArrived>(&event)) {
    if (arrived->port.device == place_.device && arrived->port.channel == place_.channel) newest_ = arrived->port;
  } else if (const auto* answer = std::get_if<Session::RequestAnswered>(&event)) {
    answered(now, *answer);
  } else if (const auto* asked = std::get_if<Session::RequestArrived>(&event)) {
    const auto* lost = std::get_if<LeaseLost>(&asked->request);
    Session& session = *connection_.session();
    if (lost == nullptr) return session.answer(asked->id, Code::kUnsupported, "that is a guest's to ask");
    session.answer(asked->id, Code::kOk, {});
    holds_ = coupled_ = false;
    say(true, "\"" + lost->to + "\" has taken the channel");
    if (!asked_) ask_again_ = now + kAskAgain;
  }
}

void Peer::send(LocalTime now, const PortState& port) {
  if (!coupled_) return;
  PortFrame frame;
  static_cast<PortState&>(frame) = port;
  frame.device = place_.device;
  frame.channel = place_.channel;
  connection_.session()->send(frame);
  line_.now = now;
  connection_.flush(now);
}

std::optional<PortState> Peer::take() { return std::exchange(newest_, std::nullopt); }

void Peer::close(LocalTime now) {
  line_.now = now;
  connection_.close(now, "the server is going down");
  coupled_ = false;
}

/// Once: an attempt that fails like the one before says nothing new.
void Peer::say(bool warning, std::string text) {
  if (text == said_) return;
  said_ = text;
  notices_.push_back({warning, to_string(config_.server) + ": " + std::move(text)});
}

std::vector<Peer::Notice> Peer::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tendon
