// SPDX-License-Identifier: Apache-2.0
#include "protocol/connection.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <span>
#include <utility>

namespace tendon {

Connection::Connection(Link& link, const Address& server, const Config& config)
    : link_(link), server_(server), config_(config), secrets_(config.seed), back_off_(config.retry_min) {
  config_.seed = {};  // later keys can be computed from the seed
}

void Connection::greet(LocalTime now, const Hello& hello) {
  ClientHandshake::Config config;
  config.hello = hello;
  const Key random = secrets_.next();
  std::copy_n(random.bytes().begin(), config.random.size(), config.random.begin());
  config.suites = config_.suites;
  if (config_.key) config.secret = {.key = *config_.key, .ephemeral = secrets_.next()};
  handshake_.emplace(config, now);
  give_up_ = now + config_.patience;
}

void Connection::begin_turn() noexcept {
  left_ = config_.max_datagrams;
  more_ = false;
  ticked_ = false;
}

const Connection::Event* Connection::next(LocalTime& now) {
  for (;;) {
    if (const Event* const event = next_of_session(now)) return event;
    if (left_ > 0) {
      if (const Event* const event = receive(now)) return event;
    } else if (!std::exchange(ticked_, true)) {
      if (const Event* const event = tick(now)) return event;
    } else {
      return nullptr;
    }
  }
}

const Connection::Event* Connection::next_of_session(LocalTime now) {
  const Session::Event* const event = session_ ? session_->next_event() : nullptr;
  if (event == nullptr) return nullptr;
  if (const auto* closed = std::get_if<Session::Closed>(event)) {
    flush(now);
    return end(now, Cause::kLost, closed->code, closed->reason);
  }
  if (std::holds_alternative<Session::StateArrived>(*event)) back_off_ = config_.retry_min;
  told_ = event;
  return &told_;
}

const Connection::Event* Connection::receive(LocalTime& now) {
  std::array<std::byte, kMaxDatagram + 1> buffer;  // the extra byte marks datagrams that are too large
  Address from;
  const std::size_t size = link_.receive(from, buffer);
  if (size == 0) {
    left_ = 0;
    return nullptr;
  }
  more_ = --left_ == 0;
  now = link_.arrived(now);
  if (from != server_) {
    ++foreign_;
    return nullptr;
  }
  const auto datagram = std::span<const std::byte>(buffer).first(std::min(size, buffer.size()));
  if (handshake_) {
    handshake_->receive(now, datagram);
    return settle(now);
  }
  if (session_) session_->receive(now, datagram, link_.reached(now));
  return nullptr;
}

const Connection::Event* Connection::tick(LocalTime now) {
  if (session_) {
    session_->tick(now);
  } else if (handshake_) {
    if (now >= give_up_) {
      return end(now, Cause::kUnanswered, Code::kTimedOut, "no answer from " + to_string(server_));
    }
    handshake_->tick(now);
  } else if (now >= retry_) {
    told_ = GreetingDue{};
    return &told_;
  }
  return nullptr;
}

const Connection::Event* Connection::settle(LocalTime now) {
  if (!handshake_->outcome()) return nullptr;
  ClientHandshake::Outcome outcome = *handshake_->outcome();
  if (auto* refused = std::get_if<Refused>(&outcome)) {
    return end(now, Cause::kRefused, refused->code, std::move(refused->detail));
  }
  auto& accepted = std::get<ClientHandshake::Accepted>(outcome);
  handshake_.reset();
  Session::Config config;
  config.connection_id = accepted.connection_id;
  if (accepted.keys) {
    session_.emplace(config, *accepted.keys, now);
  } else {
    session_.emplace(config, now);
  }
  told_ = Opened{std::move(accepted.welcome)};
  return &told_;
}

const Connection::Event* Connection::end(LocalTime now, Cause cause, Code code, std::string reason) {
  drop(now);
  told_ = Ended{cause, code, std::move(reason)};
  return &told_;
}

void Connection::drop(LocalTime now) {
  forget_session();
  retry_ = now + back_off_;
  back_off_ = std::min(2 * back_off_, config_.retry_max);
}

void Connection::close(LocalTime now, std::string reason) {
  if (session_) {
    session_->close(Code::kOk, std::move(reason));
    flush(now);
  }
  forget_session();
}

void Connection::forget_session() {
  last_stats_ = link_stats();
  handshake_.reset();
  session_.reset();
}

void Connection::flush(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer;
  const auto next = [&] {
    if (session_) return session_->next_datagram(now, buffer);
    if (handshake_) return handshake_->next_datagram(now, buffer);
    return std::size_t{0};
  };
  while (const std::size_t size = next()) link_.send(server_, std::span<const std::byte>(buffer).first(size));
}

LocalTime Connection::next_turn() const {
  if (session_) return session_->next_tick();
  if (handshake_) return std::min(give_up_, handshake_->next_tick());
  return retry_;
}

}  // namespace tendon
