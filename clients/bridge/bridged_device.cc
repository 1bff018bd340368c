// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/bridged_device.h"

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

namespace tendon::bridge {
namespace {

using Phase = ForceClient::Phase;

/// States may arrive out of order. A state that is older by more than this number of ticks is from a restarted server.
constexpr std::uint64_t kReordered = 1000;

constexpr std::size_t kMaxSentences = 16;
constexpr Duration kDisarmPatience = std::chrono::seconds(5);  ///< two attempts to open a session

bool is_open(const std::unique_ptr<ForceClient>& client) { return client && client->phase() == Phase::kOpen; }

}  // namespace

BridgedDevice::BridgedDevice(const Route& watcher, const Route& controller, Config config, LocalTime now)
    : watcher_route_(watcher),
      controller_route_(controller),
      config_(std::move(config)),
      watcher_(new_client(now, false)) {}

/// Discards the datagrams of a closed session, because otherwise the socket would stay readable.
void BridgedDevice::drain(Link& link) {
  Address from;
  std::array<std::byte, kMaxDatagram> forgotten;
  for (int i = 0; i < config_.client.max_datagrams && link.receive(from, forgotten) > 0; ++i) {
  }
}

std::unique_ptr<ForceClient> BridgedDevice::new_client(LocalTime now, bool controls) {
  const Route& route = controls ? controller_route_ : watcher_route_;
  ForceClient::Config config = config_.client;
  config.seed = config_.new_seed();
  if (controls) {
    config.diagnostics = false;  // only for observers
    const Physics physics = [this](const DeviceState& state) { return answer(state); };
    return std::make_unique<ForceClient>(route.link, route.server, config, physics, now);
  }
  config.take_lease = false;
  const Watch watch = [this](const DeviceState& state, const LinkStats&) { take(state, *watcher_); };
  return std::make_unique<ForceClient>(route.link, route.server, config, watch, now);
}

void BridgedDevice::take(const DeviceState& state, const ForceClient& from) {
  if (state_ && state_->tick >= state.tick && state_->tick - state.tick < kReordered) return;
  state_ = state;
  arrived_ = now_;
  const auto clock = from.server_clock();
  sampled_ = clock ? std::min(clock->to_local(state.sampled), now_) : now_;
  ++states_;
}

Touch BridgedDevice::answer(const DeviceState& state) {
  take(state, *controller_);
  Touch touch;
  touch.unknown = true;
  if (!physics_ || now_ >= until_) return touch;
  touch = physics_(state);
  if (once_) physics_ = nullptr;
  return touch;
}

void BridgedDevice::learn_from(const ForceClient& client) {
  if (client.phase() != Phase::kOpen) return;
  if (!welcome_) welcome_ = client.welcome();
  if (!description_) description_ = client.description();
  if (!handle_ && client.handle()) {
    handle_ = client.handle();
    if (!handle_->operator_from_device) {
      note(said_of_axes_, "has an unknown orientation in front of the operator; assuming x right, y up, z to the user");
    }
  }
}

void BridgedDevice::end_controller(LocalTime now) {
  const ForceClient::Stats stats = controller_->stats();
  forces_before_ += stats.forces;
  unusable_before_ += stats.forces_unusable;
  controller_->stop(now);
  controller_.reset();
}

LocalTime BridgedDevice::turn(LocalTime now) {
  if (stopped_) return LocalTime::max();
  now_ = now;
  LocalTime next = LocalTime::max();
  if (controller_ || owner_ != 0) {
    const LocalTime end = disarm_until_.value_or(asked_ + config_.idle);
    if (now >= end && !disarm_until_) {
      owner_ = 0;
      physics_ = nullptr;
      if (controller_) end_controller(now);
    } else {
      next = end;
    }
  }
  if (controller_) {
    next = std::min(next, controller_->turn(now));
    learn_from(*controller_);
    note_changes();
    if (turn_disarm(now)) next = now;
  }
  if (pushes() && !config_.always_observe) {
    if (watcher_ && controller_->stats().states > 0) {
      watcher_->stop(now);
      watcher_.reset();
    }
  } else if (!watcher_) {
    watcher_ = new_client(now, false);
  }
  if (watcher_) {
    next = std::min(next, watcher_->turn(now));
    learn_from(*watcher_);
    note_changes();
  }
  if (!watcher_) drain(watcher_route_.link);
  if (!controller_) drain(controller_route_.link);
  if (lost()) {
    state_.reset();
    welcome_.reset();
    description_.reset();
    handle_.reset();
  }
  return next;
}

BridgedDevice::Answer BridgedDevice::push(Program program, LocalTime now, LocalTime until, const Touch& touch) {
  const Answer answer = ask(program, now, until, [touch](const DeviceState&) { return touch; });
  if (answer == Answer::kTaken) once_ = true;
  return answer;
}

BridgedDevice::Answer BridgedDevice::ask(Program program, LocalTime now, LocalTime until, Physics physics) {
  if (config_.observe || (owner_ != 0 && owner_ != program)) {
    ++dropped_;
    return config_.observe ? Answer::kObserving : Answer::kOwned;
  }
  owner_ = program;
  physics_ = std::move(physics);
  once_ = false;
  asked_ = now;
  until_ = until;
  if (stopped_) return Answer::kTaken;
  if (!controller_) controller_ = new_client(now, true);
  if (controller_->holds()) controller_->answer_again();
  return Answer::kTaken;
}

bool BridgedDevice::disarm(LocalTime now) {
  if (config_.observe || stopped_) return false;
  if (disarm_until_) return true;
  disarm_until_ = now + kDisarmPatience;
  disarm_session_.reset();
  if (!controller_) controller_ = new_client(now, true);
  return true;
}

/// Returns true if a request is waiting to be sent.
bool BridgedDevice::turn_disarm(LocalTime now) {
  if (!disarm_until_) return false;
  const ForceClient::Stats stats = controller_->stats();
  if (now >= *disarm_until_) {
    say("could not be disarmed: " + (stats.reason.empty() ? "no answer" : stats.reason));
    disarm_until_.reset();
    return false;
  }
  if (stats.phase != Phase::kOpen) return false;
  if (disarm_session_ != stats.sessions) {
    if (!controller_->disarm()) return false;
    disarm_session_ = stats.sessions;
    return true;
  }
  const auto& answer = controller_->order_answer();
  if (!answer) return false;
  if (answer->code == Code::kBusy) {
    disarm_session_.reset();
    return false;
  }
  say(answer->code == Code::kOk ? "was disarmed for a program" : "could not be disarmed: " + answer->detail);
  disarm_until_.reset();
  return false;
}

void BridgedDevice::release(Program program) {
  if (owner_ != program) return;
  owner_ = 0;
  physics_ = nullptr;
}

std::uint64_t BridgedDevice::forces() const noexcept {
  return forces_before_ + (controller_ ? controller_->stats().forces : 0);
}

std::uint64_t BridgedDevice::forces_unusable() const noexcept {
  return unusable_before_ + (controller_ ? controller_->stats().forces_unusable : 0);
}

LinkStats BridgedDevice::link() const { return stopped_ ? LinkStats{} : speaker().stats().link; }

std::string BridgedDevice::connection_in_words() const {
  const ForceClient& client = speaker();
  const ForceClient::Stats stats = client.stats();
  const std::string at = to_string(watcher_ ? watcher_route_.server : controller_route_.server);
  switch (stats.phase) {
    case Phase::kOpen:
      return "connected to " + client.welcome()->device_name + " at " + at + " (" + client.welcome()->server + ", " +
             std::to_string(client.welcome()->loop_hz) + " Hz)";
    case Phase::kUnanswered:
      return "no answer from " + at + "; is tendond running there" +
             (config_.client.key ? ", and does it have this key" : "") + "? Retrying";
    case Phase::kRefused:
      return at + " refused the connection: " + stats.reason + "; retrying";
    case Phase::kLost:
      return "lost " + at + ": " + stats.reason + "; retrying";
    case Phase::kStopped:
    case Phase::kGreeting:
      return {};
  }
  return {};
}

std::string BridgedDevice::force_in_words() const {
  if (pushes()) return owner_ != 0 ? "uses the forces of a program" : "";
  if (!controller_) return said_of_force_.empty() ? "" : "uses no forces any more: no program requests one";
  const ForceClient::Stats stats = controller_->stats();
  if (is_between_attempts(stats.phase)) return "uses no forces: " + stats.reason;
  if (stats.phase != Phase::kOpen) return {};
  return "uses no forces: " + (stats.lease_lost_to.empty() ? "another engine" : stats.lease_lost_to) +
         " has the channel" + (config_.client.take_lease ? "; requesting it" : "; use --take-lease to request it");
}

void BridgedDevice::note(std::string& said, std::string words) {
  if (words.empty() || words == said) return;
  said = words;
  say(std::move(words));
}

void BridgedDevice::say(std::string words) {
  sentences_.push_back(std::move(words));
  if (sentences_.size() > kMaxSentences) sentences_.pop_front();
}

void BridgedDevice::note_changes() {
  if (controller_ && !controller_->stats().unusable.empty()) {
    note(said_of_unusable_, "a force was not sent: " + std::string(controller_->stats().unusable));
  }
  const Shown shown{.watcher = watcher_ ? watcher_->phase() : Phase::kStopped,
                    .controller = controller_ ? controller_->phase() : Phase::kStopped,
                    .pushes = pushes()};
  if (shown == std::exchange(shown_, shown)) return;
  note(said_, connection_in_words());
  note(said_of_force_, force_in_words());
}

std::optional<std::string> BridgedDevice::next_sentence() {
  if (sentences_.empty()) return {};
  std::string sentence = std::move(sentences_.front());
  sentences_.pop_front();
  return sentence;
}

void BridgedDevice::move_to(const Address& watcher, const Address& controller) {
  watcher_route_.server = watcher;
  controller_route_.server = controller;
  if (watcher_) watcher_->move_to(watcher);
  if (controller_) controller_->move_to(controller);
}

Phase BridgedDevice::phase() const noexcept {
  if (stopped_) return Phase::kStopped;
  return is_open(watcher_) || is_open(controller_) ? Phase::kOpen : speaker().phase();
}

void BridgedDevice::stop(LocalTime now) {
  if (watcher_) watcher_->stop(now);
  if (controller_) end_controller(now);
  watcher_.reset();
  owner_ = 0;
  state_.reset();
  stopped_ = true;
}

}  // namespace tendon::bridge
