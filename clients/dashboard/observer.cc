// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/observer.h"

#include <algorithm>
#include <array>
#include <span>
#include <utility>
#include <variant>

#include "protocol/limits.h"

namespace tendon::dash {

Observer::Observer(Link& link, const Address& server, const Config& config, Board& board, LocalTime now)
    : link_(link), server_(server), config_(config), board_(board), secrets_(config.seed), back_off_(config.retry_min) {
  config_.seed = {};
  greet(now);
}

LocalTime Observer::turn(LocalTime now) {
  if (stopped_) return LocalTime::max();
  const bool more = drain(now);
  if (session_) {
    session_->tick(now);
    take_events(now);
    ask(now);
  } else if (handshake_) {
    if (now >= give_up_) {
      end(now, Contact::kUnanswered,
          "no answer from " + to_string(server_) + ": is tendond running there" +
              (config_.key ? ", and does it have this key?" : "?"));
    } else {
      handshake_->tick(now);
    }
  } else if (now >= retry_) {
    greet(now);
  }
  flush(now);
  if (more) return now;
  if (session_) return std::min(session_->next_tick(), describe_at_);
  if (handshake_) return std::min(give_up_, handshake_->next_tick());
  return retry_;
}

void Observer::stop(LocalTime now) {
  if (session_) {
    session_->close(Code::kOk, config_.name + " stops");
    flush(now);
  }
  handshake_.reset();
  session_.reset();
  stopped_ = true;
}

void Observer::greet(LocalTime now) {
  ClientHandshake::Config config;
  config.hello.role = Role::kObserver;
  config.hello.name = config_.name;
  config.hello.features = {std::string(kFeatureChannels), std::string(kFeatureDiagnostics)};
  claims_ = counted_ && names_.size() > 1;
  if (claims_) {
    for (const auto& [number, name] : names_) config.hello.claims.push_back({name, "", Role::kObserver});
  }
  const Key random = secrets_.next();
  std::copy_n(random.bytes().begin(), config.random.size(), config.random.begin());
  if (config_.key) config.secret = {.key = *config_.key, .ephemeral = secrets_.next()};
  handshake_.emplace(config, now);
  give_up_ = now + config_.patience;
}

void Observer::settle(LocalTime now) {
  if (!handshake_->outcome()) return;
  const ClientHandshake::Outcome outcome = *handshake_->outcome();
  if (const auto* refused = std::get_if<Refused>(&outcome)) {
    // Another server may run there now, with other devices.
    names_.clear();
    counted_ = false;
    return end(now, Contact::kRefused, to_string(server_) + " refuses: " + refused->detail);
  }
  const auto& accepted = std::get<ClientHandshake::Accepted>(outcome);
  Session::Config config;
  config.connection_id = accepted.connection_id;
  if (accepted.keys) {
    session_.emplace(config, *accepted.keys, now);
  } else {
    session_.emplace(config, now);
  }
  asked_.clear();
  rates_.clear();
  next_describe_ = 0;
  describe_at_ = now;
  if (!claims_) {
    names_.clear();
    counted_ = false;
  }
  board_.welcomed(accepted.welcome);
  board_.tell(Contact::kOpen, "connected to " + to_string(server_) + ", " + accepted.welcome.server);
  handshake_.reset();
}

void Observer::end(LocalTime now, Contact contact, std::string words) {
  handshake_.reset();
  session_.reset();
  board_.tell(contact, std::move(words));
  retry_ = now + back_off_;
  back_off_ = std::min(2 * back_off_, config_.retry_max);
}

/// True when there may be more in the link. `now` goes on with what it takes.
bool Observer::drain(LocalTime& now) {
  std::array<std::byte, kMaxDatagram + 1> buffer;  // one more: what is too large stays too large after the cut
  for (int i = 0; i < config_.max_datagrams; ++i) {
    Address from;
    const std::size_t size = link_.receive(from, buffer);
    if (size == 0) return false;
    now = link_.received_by(now);
    if (from != server_) continue;
    const auto datagram = std::span<const std::byte>(buffer).first(std::min(size, buffer.size()));
    if (handshake_) {
      handshake_->receive(now, datagram);
      settle(now);
    } else if (session_) {
      session_->receive(now, datagram);
      take_events(now);
    }
  }
  return true;
}

void Observer::take_events(LocalTime now) {
  while (session_) {
    const std::optional<Session::Event> event = session_->next_event();
    if (!event) return;
    if (const auto* state = std::get_if<Session::StateArrived>(&*event)) {
      back_off_ = config_.retry_min;
      board_.observe(state->state);
    } else if (const auto* loop = std::get_if<Session::DeviceReportArrived>(&*event)) {
      board_.observe(loop->report);
    } else if (const auto* peer = std::get_if<Session::PeerReportArrived>(&*event)) {
      board_.observe(peer->report);
    } else if (const auto* answered = std::get_if<Session::RequestAnswered>(&*event)) {
      take_answer(now, *answered);
    } else if (const auto* asked = std::get_if<Session::RequestArrived>(&*event)) {
      session_->answer(asked->id, Code::kUnsupported, "an observer does nothing");
    } else if (const auto* closed = std::get_if<Session::Closed>(&*event)) {
      flush(now);  // a Bye of our own
      end(now, Contact::kLost, "lost " + to_string(server_) + ": " + closed->reason);
    }
  }
}

void Observer::take_answer(LocalTime now, const Session::RequestAnswered& answered) {
  const auto open = asked_.find(answered.id);
  if (open == asked_.end()) return;
  const Asked asked = open->second;
  asked_.erase(open);
  if (!asked.describe) return;
  if (answered.device) {
    board_.described(*answered.device);
    names_[asked.device] = answered.device->name;
    next_describe_ = asked.device + 1;
    describe_at_ = now;
    if (next_describe_ < limits::kMaxDevices) return;
  }
  // There are no more.
  next_describe_ = 0;
  describe_at_ = now + config_.describe_every;
  if (!counted_) board_.counted(static_cast<std::uint32_t>(names_.size()));
  if (std::exchange(counted_, true) || names_.size() < 2 || claims_) return;
  session_->close(Code::kOk, config_.name + " comes back for all devices");
  flush(now);
  session_.reset();
  greet(now);
}

/// Asks what is due to be asked, one thing at a time of each kind.
void Observer::ask(LocalTime now) {
  if (!session_) return;
  const bool describing = std::ranges::any_of(asked_, [](const auto& asked) { return asked.second.describe; });
  if (!describing && now >= describe_at_) {
    // Once we know how many devices there are, the question after the last one need not be asked.
    if (counted_ && next_describe_ >= names_.size()) {
      next_describe_ = 0;
      describe_at_ = now + config_.describe_every;
    } else if (const auto id = session_->request(Describe{.device = next_describe_})) {
      asked_[*id] = {.device = next_describe_, .describe = true};
      describe_at_ = LocalTime::max();
    }
  }
  for (const auto& [number, device] : board_.devices()) {
    if (!device.about || (number > 0 && !claims_)) continue;
    const std::uint32_t wanted = watched_ ? device.about->loop_hz : std::min(kIdleStateHz, device.about->loop_hz);
    const auto rate = rates_.find(number);
    if (rate == rates_.end() ? watched_ : rate->second == wanted) continue;
    if (const auto id = session_->request(SetStateRate{.hz = wanted, .device = number})) {
      asked_[*id] = {.device = number, .describe = false};
      rates_[number] = wanted;
    }
  }
}

void Observer::flush(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer;
  const auto next = [&] {
    if (session_) return session_->next_datagram(now, buffer);
    if (handshake_) return handshake_->next_datagram(now, buffer);
    return std::size_t{0};
  };
  while (const std::size_t size = next()) link_.send(server_, std::span<const std::byte>(buffer).first(size));
  if (session_) board_.observe(session_->stats());
}

}  // namespace tendon::dash
