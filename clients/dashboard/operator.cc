// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/operator.h"

#include <algorithm>
#include <utility>

#include "clients/dashboard/page_json.h"

namespace tendon::dash {
namespace {

/// States per second: few, because the session lasts a few round trips and nobody looks at the states.
constexpr std::uint32_t kStateHz = 20;

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
  return detail.empty() ? "the server refuses (code " + std::to_string(static_cast<int>(code)) + ")" : detail;
}

}  // namespace

Operator::Operator(Link& link, const Address& server, const Config& config, Board& board)
    : link_(link), server_(server), config_(config), board_(board), secrets_(config.seed) {
  config_.seed = {};
}

std::string Operator::held_by(const ChannelDescription& channel) const {
  const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(channel.lease).count();
  return "\"" + channel.holder + "\" holds the channel \"" + channel.name + "\", " +
         (ms > 0 ? "and for " + std::to_string(ms) + " ms after its last force" : "until it leaves") +
         ". Nothing is taken from it.";
}

std::string Operator::objection(std::uint32_t number) const {
  if (board_.contact() != Contact::kOpen) return "There is no connection to the server.";
  const auto device = board_.devices().find(number);
  if (device == board_.devices().end() || !device->second.about) return "The server has no such device.";
  const ChannelDescription* const channel = channel_of(device->second, config_.channel);
  if (channel == nullptr) {
    return "This device has no channel \"" + config_.channel + "\", which --arm names, but " +
           names_of(device->second.about->channels) + ".";
  }
  // The operator's own name stays there for a moment after its session has ended.
  if (!channel->holder.empty() && channel->holder != config_.name) return held_by(*channel);
  return {};
}

std::string Operator::press(LocalTime now, std::uint32_t device, Order order) {
  if (under_way_) {
    if (device == device_ && order == order_) return {};
    if (order_ == Order::kDisarm || order == Order::kArm) return "Another order is under way.";
    finish(now, false, "Ended by a disarming.");
  }
  if (std::string words = objection(device); !words.empty()) return words;
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
  board_.tell(Press{.device = device,
                    .arm = order == Order::kArm,
                    .state = Press::State::kUnderWay,
                    .words = order == Order::kArm ? "Asking the server to arm …" : "Asking the server to disarm …"});
  return {};
}

void Operator::turn(LocalTime now) {
  if (client_) {
    ask(now);
  } else if (under_way_) {
    look(now);
  }
}

/// The part of a press up to the server's answer.
void Operator::ask(LocalTime now) {
  const bool arm = order_ == Order::kArm;
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
    return board_.tell(Press{.device = device_,
                             .arm = arm,
                             .state = Press::State::kUnderWay,
                             .words = arm ? "The server has asked the safety layer: the handle has to rest …"
                                          : "The server has passed it on …"});
  }
  if (now >= give_up_) {
    return finish(now, false,
                  "Not done, as far as is known: the server at " + to_string(server_) +
                      " has not answered. Does it have this key?");
  }
  if (asked_ || phase != ForceClient::Phase::kOpen) return;
  if (client_->holds()) {
    asked_ = arm ? client_->rearm() : client_->disarm();
    client_->turn(now);
  } else if (const auto& about = client_->description()) {
    // A client has taken the channel since the Board's last description.
    const auto channel = std::ranges::find(about->channels, config_.channel, &ChannelDescription::name);
    finish(now, false, "Not done: " + (channel != about->channels.end() ? held_by(*channel) : "the channel is gone."));
  }
}

/// The part of a press after the server's answer: watches what the device does.
void Operator::look(LocalTime now) {
  const auto found = board_.devices().find(device_);
  const Board::Device* const device = found != board_.devices().end() ? &found->second : nullptr;
  const DeviceState* const state =
      device != nullptr && device->newest && device->newest->sampled > answered_ ? &*device->newest : nullptr;
  const DeviceReport* const report =
      device != nullptr && device->report && device->report->until > answered_ ? &*device->report : nullptr;
  const bool disarmed = state != nullptr && Reasons::from_bits(state->reasons).has(Reason::kDisarmed);
  if (order_ == Order::kDisarm) {
    if (disarmed && state->force_applied.isZero(0)) {
      finish(now, true, "Disarmed: no force until it is armed again.");
    } else if (now >= give_up_) {
      finish(now, false, "The server has taken the order, but the device does not show it. Take its power away.");
    }
    return;
  }
  const bool ready = state != nullptr && !disarmed && report != nullptr;
  if (ready && report->safety == Safety::kArmed) {
    finish(now, true, "Armed: it gives forces.");
  } else if (ready && report->safety == Safety::kUnguarded) {
    finish(now, true, "It gives forces again; it has no safety layer that would have to grant it.");
  } else if (now >= give_up_) {
    const std::string is = report != nullptr ? " It is " + std::string(name(report->safety)) + "." : "";
    finish(now, false,
           "Not armed." + is +
               " The handle has to rest, next to no force may be asked for, and where the scene lists a dead man's "
               "button, it has to be pressed.");
  }
}

void Operator::finish(LocalTime now, bool done, std::string words) {
  if (client_) client_->stop(now);
  client_.reset();
  under_way_ = false;
  board_.tell(Press{.device = device_,
                    .arm = order_ == Order::kArm,
                    .state = done ? Press::State::kDone : Press::State::kFailed,
                    .words = std::move(words)});
}

void Operator::stop(LocalTime now) {
  if (under_way_) finish(now, false, "tendon-dash has stopped.");
}

}  // namespace tendon::dash
