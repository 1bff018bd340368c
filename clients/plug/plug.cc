// SPDX-License-Identifier: Apache-2.0
#include "clients/plug/plug.h"

#include <algorithm>
#include <utility>

namespace tendon::plug {
namespace {

using Phase = ForceClient::Phase;

bool waits(const ForceClient& client) {
  const Phase phase = client.phase();
  return phase == Phase::kUnanswered || phase == Phase::kRefused || phase == Phase::kLost;
}

}  // namespace

Plug::Plug(const Way& watcher, const Way& controller, Config config, LocalTime now)
    : watcher_way_(watcher),
      controller_way_(controller),
      config_(std::move(config)),
      watcher_(new_client(now, false)) {}

std::unique_ptr<ForceClient> Plug::new_client(LocalTime now, bool controls) {
  const Way& way = controls ? controller_way_ : watcher_way_;
  ForceClient::Config config = config_.client;
  config.seed = config_.new_seed();
  if (controls) {
    const Physics physics = [this](const DeviceState& state) { return answer(state); };
    return std::make_unique<ForceClient>(way.link, way.server, config, physics, now);
  }
  config.take_lease = false;
  const Watch watch = [this](const DeviceState& state, const LinkStats&) {
    if (!pushes()) take(state, now_);
  };
  return std::make_unique<ForceClient>(way.link, way.server, config, watch, now);
}

void Plug::take(const DeviceState& state, LocalTime now) {
  if (state_ && state_->tick == state.tick) return;
  state_ = state;
  arrived_ = now;
  ++states_;
}

Touch Plug::answer(const DeviceState& state) {
  take(state, now_);
  if (physics_ && now_ < until_) return physics_(state);
  Touch nothing;
  nothing.unknown = true;
  return nothing;
}

void Plug::learn_from(const ForceClient& client) {
  if (client.phase() != Phase::kOpen) return;
  if (!welcome_) welcome_ = client.welcome();
  if (!description_) description_ = client.description();
  if (!handle_) handle_ = client.handle();
}

void Plug::end_controller(LocalTime now) {
  const ForceClient::Stats stats = controller_->stats();
  forces_before_ += stats.forces;
  unusable_before_ += stats.forces_unusable;
  controller_->stop(now);
  controller_.reset();
}

LocalTime Plug::turn(LocalTime now) {
  if (stopped_) return LocalTime::max();
  now_ = now;
  LocalTime next = LocalTime::max();
  if (controller_ || owner_ != 0) {
    const LocalTime end = asked_ + config_.idle;
    if (now >= end) {
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
  }
  if (pushes()) {
    if (watcher_) {
      watcher_->stop(now);
      watcher_.reset();
    }
  } else if (!watcher_) {
    watcher_ = new_client(now, false);
  }
  if (watcher_) {
    next = std::min(next, watcher_->turn(now));
    learn_from(*watcher_);
  }
  if (lost()) {
    state_.reset();
    welcome_.reset();
    description_.reset();
    handle_.reset();
  }
  return next;
}

Plug::Answer Plug::ask(Program program, LocalTime now, LocalTime until, Physics physics) {
  if (config_.observe || (owner_ != 0 && owner_ != program)) {
    ++dropped_;
    return config_.observe ? Answer::kObserving : Answer::kOwned;
  }
  owner_ = program;
  physics_ = std::move(physics);
  asked_ = now;
  until_ = until;
  if (stopped_) return Answer::kTaken;
  if (!controller_) controller_ = new_client(now, true);
  if (controller_->holds()) controller_->answer_again();
  return Answer::kTaken;
}

void Plug::release(Program program) {
  if (owner_ != program) return;
  owner_ = 0;
  physics_ = nullptr;
}

std::uint64_t Plug::forces() const noexcept { return forces_before_ + (controller_ ? controller_->stats().forces : 0); }

std::uint64_t Plug::forces_unusable() const noexcept {
  return unusable_before_ + (controller_ ? controller_->stats().forces_unusable : 0);
}

LinkStats Plug::link() const { return stopped_ ? LinkStats{} : speaker().stats().link; }

std::string Plug::connection_in_words() const {
  const ForceClient& client = speaker();
  const ForceClient::Stats stats = client.stats();
  const std::string at = to_string(watcher_ ? watcher_way_.server : controller_way_.server);
  switch (stats.phase) {
    case Phase::kOpen:
      return "connected to " + client.welcome()->device_name + " at " + at + " (" + client.welcome()->server + ", " +
             std::to_string(client.welcome()->loop_hz) + " Hz)";
    case Phase::kUnanswered:
      return "no answer from " + at + "; is tendond running there" +
             (config_.client.key ? ", and does it have this key" : "") + "? Trying on";
    case Phase::kRefused:
      return at + " refuses: " + stats.reason + "; trying again";
    case Phase::kLost:
      return "lost " + at + ": " + stats.reason + "; trying again";
    case Phase::kStopped:
    case Phase::kGreeting:
      return {};
  }
  return {};
}

std::optional<std::string> Plug::next_sentence() {
  if (stopped_) return {};
  if (std::string words = connection_in_words(); !words.empty() && words != said_) return said_ = std::move(words);
  std::string of_force;
  if (pushes()) {
    of_force = "takes the forces of a program";
  } else if (controller_ && controller_->phase() == Phase::kOpen) {
    const std::string& by = controller_->stats().lease_lost_to;
    of_force = "takes no forces: " + (by.empty() ? "another engine" : by) + " has the channel" +
               (config_.client.take_lease ? "; asking for it" : "; --take-lease asks for it");
  } else if (controller_ && waits(*controller_)) {
    of_force = "takes no forces: " + controller_->stats().reason;
  } else if (!controller_ && !said_of_force_.empty()) {
    of_force = "takes no forces any more: no program asks for one";
  }
  if (of_force.empty() || of_force == said_of_force_) return {};
  return said_of_force_ = std::move(of_force);
}

void Plug::move_to(const Address& watcher, const Address& controller) {
  watcher_way_.server = watcher;
  controller_way_.server = controller;
  if (watcher_) watcher_->move_to(watcher);
  if (controller_) controller_->move_to(controller);
}

bool Plug::lost() const noexcept {
  return !stopped_ && (!watcher_ || waits(*watcher_)) && (!controller_ || waits(*controller_)) &&
         (watcher_ || controller_);
}

void Plug::stop(LocalTime now) {
  if (watcher_) watcher_->stop(now);
  if (controller_) end_controller(now);
  watcher_.reset();
  owner_ = 0;
  state_.reset();
  stopped_ = true;
}

}  // namespace tendon::plug
