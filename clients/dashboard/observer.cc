// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/observer.h"

#include <algorithm>
#include <utility>
#include <variant>

#include "protocol/limits.h"

namespace tendon::dash {

Observer::Observer(Link& link, const Address& server, const Config& config, Board& board, LocalTime now)
    : config_(config),
      board_(board),
      connection_(link, server,
                  {.key = config.key,
                   .seed = config.seed,
                   .patience = config.patience,
                   .retry_min = config.retry_min,
                   .retry_max = config.retry_max,
                   .max_datagrams = config.max_datagrams}) {
  config_.seed = {};
  greet(now);
}

LocalTime Observer::turn(LocalTime now) {
  if (stopped_) return LocalTime::max();
  connection_.begin_turn();
  while (const auto event = connection_.next(now)) take(now, *event);
  ask(now);
  connection_.flush(now);
  if (const Session* const session = connection_.session()) {
    board_.observe(session->stats());
    const auto clock = session->peer_clock();
    board_.observe_clock(clock ? std::optional(clock->offset) : std::nullopt);
  }
  if (connection_.more()) return now;
  const LocalTime next = connection_.next_turn();
  return connection_.session() != nullptr ? std::min(next, describe_at_) : next;
}

void Observer::stop(LocalTime now) {
  connection_.close(now, config_.name + " stops");
  stopped_ = true;
}

void Observer::greet(LocalTime now) {
  Hello hello;
  hello.role = Role::kObserver;
  hello.name = config_.name;
  hello.features = {std::string(kFeatureChannels), std::string(kFeatureDiagnostics), std::string(kFeatureHandle),
                    std::string(kFeatureTeleoperation), std::string(kFeatureFields)};
  claims_ = counted_ && names_.size() > 1;
  if (claims_) {
    for (const auto& [number, name] : names_) hello.claims.push_back({name, "", Role::kObserver});
  } else if (!config_.device.empty()) {
    hello.claims.push_back({config_.device, "", Role::kObserver});
  }
  connection_.greet(now, hello);
}

void Observer::open(LocalTime now, const Welcome& welcome) {
  asked_.clear();
  handles_asked_.clear();
  rates_.clear();
  next_describe_ = 0;
  describe_at_ = now;
  if (!claims_) {
    names_.clear();
    counted_ = false;
  }
  board_.welcomed(welcome);
  board_.tell(Contact::kOpen, "connected to " + to_string(connection_.server()) + ", " + welcome.server);
}

void Observer::end(const Connection::Ended& ended) {
  const std::string server = to_string(connection_.server());
  switch (ended.cause) {
    case Connection::Cause::kUnanswered:
      if (!config_.further.empty()) {
        std::rotate(config_.further.begin(), config_.further.begin() + 1, config_.further.end());
        connection_.move_to(std::exchange(config_.further.back(), connection_.server()));
      }
      return board_.tell(Contact::kUnanswered, ended.reason + ": is tendond running there" +
                                                   (config_.key ? ", and does it have this key?" : "?"));
    case Connection::Cause::kRefused:
      // The address may now belong to another server with other devices.
      names_.clear();
      counted_ = false;
      return board_.tell(Contact::kRefused, server + " refused the connection: " + ended.reason);
    case Connection::Cause::kLost:
      return board_.tell(Contact::kLost, "lost " + server + ": " + ended.reason);
  }
}

void Observer::take(LocalTime now, const Connection::Event& event) {
  if (const auto* of_session = std::get_if<const Session::Event*>(&event)) {
    take_event(now, **of_session);
  } else if (const auto* opened = std::get_if<Connection::Opened>(&event)) {
    open(now, opened->welcome);
  } else if (const auto* ended = std::get_if<Connection::Ended>(&event)) {
    end(*ended);
  } else {
    greet(now);
  }
}

void Observer::take_event(LocalTime now, const Session::Event& event) {
  if (const auto* state = std::get_if<Session::StateArrived>(&event)) {
    board_.observe(state->state);
  } else if (const auto* loop = std::get_if<Session::DeviceReportArrived>(&event)) {
    board_.observe(loop->report);
  } else if (const auto* peer = std::get_if<Session::PeerReportArrived>(&event)) {
    board_.observe(peer->report);
  } else if (const auto* port = std::get_if<Session::PortArrived>(&event)) {
    board_.observe(port->port);
  } else if (const auto* answered = std::get_if<Session::RequestAnswered>(&event)) {
    take_answer(now, *answered);
  } else if (const auto* asked = std::get_if<Session::RequestArrived>(&event)) {
    connection_.session()->answer(asked->id, Code::kUnsupported, "an observer does not support requests");
  }
}

void Observer::take_answer(LocalTime now, const Session::RequestAnswered& answered) {
  const auto open = asked_.find(answered.id);
  if (open == asked_.end()) return;
  const Asked asked = open->second;
  asked_.erase(open);
  if (asked.what == Asked::What::kHandle && answered.handle) board_.described(*answered.handle);
  if (asked.what != Asked::What::kDevice) return;
  if (answered.device) {
    board_.described(*answered.device);
    names_[asked.device] = answered.device->name;
    next_describe_ = asked.device + 1;
    describe_at_ = now;
    if (next_describe_ < limits::kMaxDevices) return;
  }
  next_describe_ = 0;
  describe_at_ = now + config_.describe_every;
  if (!counted_) board_.counted(static_cast<std::uint32_t>(names_.size()));
  if (std::exchange(counted_, true) || names_.size() < 2 || claims_) return;
  connection_.close(now, config_.name + " reconnects for all devices");
  greet(now);
}

void Observer::ask(LocalTime now) {
  Session* const session = connection_.session();
  if (session == nullptr) return;
  const bool describing =
      std::ranges::any_of(asked_, [](const auto& asked) { return asked.second.what == Asked::What::kDevice; });
  if (!describing && now >= describe_at_) {
    if (counted_ && next_describe_ >= names_.size()) {
      next_describe_ = 0;
      describe_at_ = now + config_.describe_every;
    } else if (const auto id = session->request(Describe{.device = next_describe_})) {
      asked_[*id] = {.device = next_describe_, .what = Asked::What::kDevice};
      describe_at_ = LocalTime::max();
    }
  }
  const std::optional<Welcome>& welcome = board_.welcome();
  const bool tells_handles = welcome && std::ranges::find(welcome->features, kFeatureHandle) != welcome->features.end();
  for (const auto& [number, device] : board_.devices()) {
    if (!device.about || (number > 0 && !claims_)) continue;
    if (tells_handles && !handles_asked_.contains(number)) {
      if (const auto id = session->request(Describe{.device = number, .handle = true})) {
        asked_[*id] = {.device = number, .what = Asked::What::kHandle};
        handles_asked_.insert(number);
      }
    }
    const std::uint32_t wanted = watched_ ? device.about->loop_hz : std::min(kIdleStateHz, device.about->loop_hz);
    const auto rate = rates_.find(number);
    if (rate == rates_.end() ? watched_ : rate->second == wanted) continue;
    if (const auto id = session->request(SetStateRate{.hz = wanted, .device = number})) {
      asked_[*id] = {.device = number, .what = Asked::What::kStateRate};
      rates_[number] = wanted;
    }
  }
}

}  // namespace tendon::dash
