// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/operator.h"

#include <algorithm>
#include <utility>

#include "clients/dashboard/page_json.h"

namespace tendon::dash {
namespace {

constexpr std::uint32_t kStateHz = 20;  ///< a low rate is enough for a few round trips

const ChannelDescription* channel_of(const Board::Device& device, const std::string& name) {
  if (!device.about) return nullptr;
  const auto found = std::ranges::find(device.about->channels, name, &ChannelDescription::name);
  return found == device.about->channels.end() ? nullptr : &*found;
}

std::string names_of(const std::vector<ChannelDescription>& channels) {
  std::string names;
  for (const ChannelDescription& channel : channels) names += (names.empty() ? "\"" : ", \"") + channel.name + "\"";
  return names;
}

std::string because(const std::string& detail, Code code) {
  return detail.empty() ? "the server refused it (code " + std::to_string(static_cast<int>(code)) + ")" : detail;
}

int rank(Order order) {  // an order cancels pending orders of lower rank
  switch (order) {
    case Order::kDisarm:
      return 2;
    case Order::kDisengage:
      return 1;
    case Order::kArm:
    case Order::kEngage:
      return 0;
  }
  return 0;
}

bool is_engaged(PortPhase phase) {
  return phase == PortPhase::kAligning || phase == PortPhase::kEngaged || phase == PortPhase::kClutched;
}

}  // namespace

Operator::Operator(Link& link, const Address& server, const Config& config, Board& board)
    : link_(link), server_(server), config_(config), board_(board), secrets_(config.seed) {
  config_.seed = {};
}

std::string Operator::held_by(const ChannelDescription& channel) const {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(channel.lease).count();
  return "\"" + channel.holder + "\" holds the channel \"" + channel.name + "\", " +
         (ms > 0 ? "until " + std::to_string(ms) + " ms after its last force" : "until it leaves") +
         ". It is not taken over.";
}

std::string Operator::objection(std::uint32_t number) const {
  if (board_.contact() != Contact::kOpen) return "There is no connection to the server.";
  const auto device = board_.devices().find(number);
  if (device == board_.devices().end() || !device->second.about) return "The server has no such device.";
  const ChannelDescription* const channel = channel_of(device->second, config_.channel);
  if (channel == nullptr) {
    return "This device has no channel \"" + config_.channel + "\", which is set by --arm; it has " +
           names_of(device->second.about->channels) + ".";
  }
  // The operator may still be in the list after the end of its session.
  if (!channel->holder.empty() && channel->holder != config_.name) return held_by(*channel);
  return {};
}

std::string Operator::press(LocalTime now, std::uint32_t device, Order order) {
  if (under_way_) {
    if (device == device_ && order == order_) return {};
    if (rank(order) <= rank(order_)) return "Another order is in progress.";
    finish(now, false, order == Order::kDisarm ? "Cancelled by disarming." : "Cancelled by disengaging.");
  }
  if (std::string words = objection(device); !words.empty()) return words;
  if (std::string words = coupling_objection(board_.devices().at(device), order); !words.empty()) return words;
  ForceClient::Config config;
  config.name = config_.name;
  config.device = board_.devices().at(device).about->name;
  config.channel = config_.channel;
  config.key = config_.key;
  config.seed = Seed(secrets_.next().bytes());
  config.state_hz = kStateHz;
  config.operates = true;
  const Watch nothing = [](const DeviceState&, const LinkStats&) {};
  client_.emplace(link_, server_, config, nothing, now);
  device_ = device;
  order_ = order;
  under_way_ = true;
  asked_ = false;
  give_up_ = now + config_.patience;
  tell(Press::State::kUnderWay, "Requesting the server to " + name(order) + " …");
  return {};
}

std::string Operator::coupling_objection(const Board::Device& device, Order order) const {
  if (order != Order::kEngage && order != Order::kDisengage) return {};
  if (!device.ports) return "This device has no coupling.";
  if (order == Order::kDisengage) return {};
  switch (device.ports->own.phase) {
    case PortPhase::kAlone:
      return "The other end is not connected.";
    case PortPhase::kLost:
      return "The other end does not respond.";
    case PortPhase::kFault:
      return "This device exerts no force at the moment.";
    case PortPhase::kAligning:
    case PortPhase::kEngaged:
    case PortPhase::kClutched:
      return "The coupling is already engaged.";
    case PortPhase::kCoupled:
      break;
  }
  return role_of(*device.ports) == PortRole::kFollower
             ? "The other end is the leader: the coupling can only be engaged there."
             : "";
}

void Operator::tell(Press::State state, std::string words) {
  board_.tell(Press{.device = device_, .order = order_, .state = state, .words = std::move(words)});
}

void Operator::turn(LocalTime now) {
  if (client_) {
    ask(now);
  } else if (under_way_) {
    look(now);
  }
}

/// Runs until the server has answered.
void Operator::ask(LocalTime now) {
  client_->turn(now);
  const ForceClient::Phase phase = client_->phase();
  if (phase != ForceClient::Phase::kGreeting && phase != ForceClient::Phase::kOpen) {
    return finish(now, false, "Not done: " + because(client_->stats().reason, client_->stats().code) + ".");
  }
  if (const auto& answer = client_->order_answer()) {
    if (answer->code != Code::kOk) {
      return finish(now, false, "Not done: " + because(answer->detail, answer->code) + ".");
    }
    client_->stop(now);
    client_.reset();
    const auto device = board_.devices().find(device_);
    const bool seen = device != board_.devices().end() && device->second.newest;
    answered_ = seen ? device->second.newest->sampled : PeerTime{};
    give_up_ = now + config_.granted_within;
    return tell(Press::State::kUnderWay, order_ == Order::kArm
                                             ? "The server has requested arming: the handle must be at rest …"
                                             : "The server has accepted the order …");
  }
  if (now >= give_up_) {
    return finish(now, false,
                  "Not confirmed: the server at " + to_string(server_) + " has not replied. Does it have this key?");
  }
  if (asked_ || phase != ForceClient::Phase::kOpen) return;
  if (client_->holds()) {
    asked_ = send();
    client_->turn(now);
  } else if (const auto& about = client_->description()) {
    // Another client has taken the channel since the last update of the Board.
    const auto channel = std::ranges::find(about->channels, config_.channel, &ChannelDescription::name);
    finish(now, false,
           "Not done: " + (channel != about->channels.end() ? held_by(*channel) : "the channel no longer exists."));
  }
}

bool Operator::send() {
  switch (order_) {
    case Order::kArm:
      return client_->rearm();
    case Order::kDisarm:
      return client_->disarm();
    case Order::kEngage:
      return client_->engage();
    case Order::kDisengage:
      return client_->disengage();
  }
  return false;
}

/// Waits for the reaction of the device after the answer.
void Operator::look(LocalTime now) {
  const auto found = board_.devices().find(device_);
  const Board::Device* const device = found != board_.devices().end() ? &found->second : nullptr;
  if (order_ == Order::kEngage || order_ == Order::kDisengage) return look_at_coupling(now, device);
  look_at_safety(now, device);
}

void Operator::look_at_coupling(LocalTime now, const Board::Device* device) {
  const bool known = device != nullptr && device->ports;
  const bool engaged = known && is_engaged(device->ports->own.phase);
  if (order_ == Order::kEngage && engaged) {
    finish(now, true, "Engaged: the two handles are coupled.");
  } else if (order_ == Order::kDisengage && known && !engaged) {
    finish(now, true, "Disengaged: the handles are not coupled.");
  } else if (now >= give_up_) {
    finish(now, false,
           order_ == Order::kEngage
               ? "Not engaged. Both devices must be armed, and the network must work in both directions."
               : "The server has accepted the order, but the device does not show it.");
  }
}

void Operator::look_at_safety(LocalTime now, const Board::Device* device) {
  const DeviceState* const state =
      device != nullptr && device->newest && device->newest->sampled > answered_ ? &*device->newest : nullptr;
  const DeviceReport* const report =
      device != nullptr && device->report && device->report->until > answered_ ? &*device->report : nullptr;
  const bool disarmed = state != nullptr && Reasons::from_bits(state->reasons).has(Reason::kDisarmed);
  if (order_ == Order::kDisarm) {
    if (disarmed && state->force_applied.isZero(0)) {
      finish(now, true, "Disarmed: no force until the device is armed again.");
    } else if (now >= give_up_) {
      finish(now, false, "The server has accepted the order, but the device does not show it. Switch off its power.");
    }
    return;
  }
  const bool ready = state != nullptr && !disarmed && report != nullptr;
  if (ready && report->safety == Safety::kArmed) {
    finish(now, true, "Armed: the device exerts forces.");
  } else if (ready && report->safety == Safety::kUnguarded) {
    finish(now, true, "The device exerts forces again; it has no safety layer, so it does not have to be armed.");
  } else if (now >= give_up_) {
    const std::string is = report != nullptr ? " It is " + name(report->safety) + "." : "";
    finish(now, false,
           "Not armed." + is +
               " The handle must be at rest, the requested force must be almost zero, and the dead man's button must "
               "be held if the scene has one.");
  }
}

void Operator::finish(LocalTime now, bool done, std::string words) {
  if (client_) client_->stop(now);
  client_.reset();
  under_way_ = false;
  tell(done ? Press::State::kDone : Press::State::kFailed, std::move(words));
}

void Operator::stop(LocalTime now) {
  if (under_way_) finish(now, false, "tendon-dash has stopped.");
}

}  // namespace tendon::dash
