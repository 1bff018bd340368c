// SPDX-License-Identifier: Apache-2.0
#include "clients/dashboard/foxglove_feed.h"

#include <algorithm>
#include <chrono>
#include <span>
#include <variant>

namespace tendon::dash {
namespace {

bool made_of_states(FoxgloveKind kind) {
  return kind == FoxgloveKind::kStep || kind == FoxgloveKind::kTransforms || kind == FoxgloveKind::kScene;
}

StatusLevel level_of(Contact contact) {
  switch (contact) {
    case Contact::kGreeting:
    case Contact::kOpen:
      return StatusLevel::kInfo;
    case Contact::kUnanswered:
    case Contact::kLost:
      return StatusLevel::kWarning;
    case Contact::kRefused:
      return StatusLevel::kError;
  }
  return StatusLevel::kError;
}

}  // namespace

FoxgloveFeed::ClientId FoxgloveFeed::join(LocalTime now) {
  take_channels();
  Client& client =
      clients_.emplace(++last_, Client{.session = {}, .orders = RateLimit(kMaxOrdersHz, now)}).first->second;
  client.session.put_text(server_info_text(config_.name, std::to_string(config_.unix_offset.count())));
  std::vector<FoxgloveChannel> all;
  for (const Channel& channel : channels_) all.push_back(channel.about);
  if (!all.empty()) client.session.put_text(advertise_text(all));
  client.session.put_server_state(server_state());
  return last_;
}

void FoxgloveFeed::leave(ClientId client) { clients_.erase(client); }

bool FoxgloveFeed::wants_states() const {
  return std::ranges::any_of(channels_, [&](const Channel& channel) {
    return made_of_states(channel.about.kind) && subscribed(channel.about.kind, channel.device) != nullptr;
  });
}

bool FoxgloveFeed::receive(LocalTime now, ClientId client, std::string_view text) {
  const auto found = clients_.find(client);
  if (found == clients_.end() || !found->second.orders.take(now)) return false;
  FoxgloveSession& session = found->second.session;
  const auto object = [&](const std::string& sentence) {
    session.put_text(status_text(StatusLevel::kWarning, "order", sentence));
  };
  const FoxgloveOrder order = parse_foxglove_order(text);
  if (const auto* subscribe = std::get_if<Subscribe>(&order)) {
    for (const auto& [subscription, channel] : subscribe->all) {
      const bool known =
          std::ranges::any_of(channels_, [wanted = channel](const Channel& one) { return one.about.id == wanted; });
      if (!known) {
        object("There is no channel " + std::to_string(channel) + ".");
      } else if (!session.subscribe(subscription, channel)) {
        object("Subscription " + std::to_string(subscription) + " already exists, or channel " +
               std::to_string(channel) + " already has a subscription: each channel can only have one.");
      }
      if (session.too_slow()) return false;
    }
  } else if (const auto* unsubscribe = std::get_if<Unsubscribe>(&order)) {
    for (const std::uint32_t subscription : unsubscribe->subscriptions) {
      if (!session.unsubscribe(subscription)) {
        object("There is no subscription " + std::to_string(subscription) + ".");
      }
      if (session.too_slow()) return false;
    }
  } else {
    object(std::get<NotUnderstood>(order).sentence);
  }
  return !session.too_slow();
}

void FoxgloveFeed::take(LocalTime now) {
  take_channels();
  for (const auto& [number, device] : board_.devices()) {
    take_states(now, number, device);
    take_reports(now, number, device);
  }
  if (board_.contact() == said_.first && board_.words() == said_.second) return;
  said_ = {board_.contact(), board_.words()};
  for (auto& [id, client] : clients_) client.session.put_server_state(server_state());
}

void FoxgloveFeed::tick(LocalTime now) {
  if (clients_.empty() || board_.contact() != Contact::kOpen) return;
  std::vector<Drawn> devices;
  for (const auto& [number, device] : board_.devices()) {
    if (!device.about || !device.newest) continue;
    const auto towards = device.handle ? device.handle->operator_from_device : std::nullopt;
    devices.push_back({.name = device.about->name,
                       .place = number,
                       .operator_from_device = towards,
                       .state = *device.newest,
                       .at = unix_time(now, device.newest->sampled)});
    if (const Channel* const scene = subscribed(FoxgloveKind::kScene, number)) {
      put(*scene, devices.back().at, scene_payload(devices.back()));
    }
  }
  const Channel* const transforms = subscribed(FoxgloveKind::kTransforms, 0);
  if (transforms != nullptr && !devices.empty()) {
    put(*transforms, std::ranges::max(devices, {}, &Drawn::at).at, transforms_payload(devices));
  }
}

std::optional<FoxgloveSession::Message> FoxgloveFeed::next(ClientId client) {
  const auto found = clients_.find(client);
  return found == clients_.end() ? std::nullopt : found->second.session.next();
}

void FoxgloveFeed::take_channels() {
  if (std::exchange(version_, board_.version()) == board_.version()) return;
  const std::vector<Channel> wanted = wanted_channels();
  const auto listed = [](const std::vector<Channel>& list, const Channel& channel) {
    return std::ranges::any_of(list, [&](const Channel& one) {
      return one.about.topic == channel.about.topic && one.device == channel.device;
    });
  };
  std::vector<std::uint32_t> gone;
  std::erase_if(channels_, [&](const Channel& channel) {
    if (listed(wanted, channel)) return false;
    gone.push_back(channel.about.id);
    return true;
  });
  std::vector<FoxgloveChannel> come;
  for (const Channel& channel : wanted) {
    if (listed(channels_, channel)) continue;
    channels_.push_back(channel);
    channels_.back().about.id = ++last_channel_;
    come.push_back(channels_.back().about);
  }
  for (auto& [id, client] : clients_) {
    for (const std::uint32_t channel : gone) client.session.forget(channel);
    if (!gone.empty()) client.session.put_text(unadvertise_text(gone));
    if (!come.empty()) client.session.put_text(advertise_text(come));
  }
}

/// The ids of the returned channels are not set.
std::vector<FoxgloveFeed::Channel> FoxgloveFeed::wanted_channels() const {
  std::vector<Channel> wanted;
  for (const auto& [number, device] : board_.devices()) {
    if (!device.about) continue;
    const std::string name = "/" + device.about->name;
    const auto add = [&, of = number](std::string topic, FoxgloveKind kind) {
      wanted.push_back({.about = {.topic = std::move(topic), .kind = kind}, .device = of});
    };
    add(number == 0 ? "/haptic/step" : name + "/haptic/step", FoxgloveKind::kStep);
    add(name + "/device", FoxgloveKind::kDevice);
    add(name + "/peer", FoxgloveKind::kPeer);
    add(name + "/scene", FoxgloveKind::kScene);
  }
  if (!wanted.empty()) wanted.push_back({.about = {.topic = "/tf", .kind = FoxgloveKind::kTransforms}});
  return wanted;
}

void FoxgloveFeed::take_states(LocalTime now, std::uint32_t device, const Board::Device& news) {
  std::uint64_t& taken = states_[device];
  // The counter restarts if a device was removed and has returned.
  const std::uint64_t fresh = news.states - std::min(std::exchange(taken, news.states), news.states);
  const Channel* const channel = subscribed(FoxgloveKind::kStep, device);
  if (channel == nullptr) return;
  for (const DeviceState& state : std::span(news.waiting).last(std::min<std::uint64_t>(fresh, news.waiting.size()))) {
    put(*channel, unix_time(now, state.sampled), step_payload(state));
  }
}

void FoxgloveFeed::take_reports(LocalTime now, std::uint32_t device, const Board::Device& news) {
  if (news.report && std::exchange(reported_[device], news.report->until) != news.report->until) {
    if (const Channel* const channel = subscribed(FoxgloveKind::kDevice, device)) {
      put(*channel, unix_time(now, news.report->until), report_payload(*news.report));
    }
  }
  for (const auto& [number, engine] : news.engines) {
    const PeerTime until = engine.newest.link.until;
    if (std::exchange(engines_[{device, number}], until) == until) continue;
    if (const Channel* const channel = subscribed(FoxgloveKind::kPeer, device)) {
      put(*channel, unix_time(now, until), report_payload(engine.newest));
    }
  }
}

const FoxgloveFeed::Channel* FoxgloveFeed::subscribed(FoxgloveKind kind, std::uint32_t device) const {
  const auto channel = std::ranges::find_if(
      channels_, [&](const Channel& one) { return one.about.kind == kind && one.device == device; });
  if (channel == channels_.end()) return nullptr;
  const bool wanted = std::ranges::any_of(
      clients_, [&](const auto& client) { return client.second.session.subscribes_to(channel->about.id); });
  return wanted ? &*channel : nullptr;
}

void FoxgloveFeed::put(const Channel& channel, UnixTime at, const std::string& payload) {
  for (auto& [id, client] : clients_) client.session.put(channel.about.id, at, payload);
}

UnixTime FoxgloveFeed::unix_time(LocalTime now, PeerTime at) {
  // Before the clocks are compared, assume no network delay.
  const Duration server_ahead = board_.server_ahead().value_or(at.time_since_epoch() - now.time_since_epoch());
  const Duration ahead = config_.unix_offset - server_ahead;
  if (!unix_ahead_ || ahead > *unix_ahead_ + kClockSlack || ahead < *unix_ahead_ - kClockSlack) unix_ahead_ = ahead;
  return (at.time_since_epoch() + *unix_ahead_).count();
}

std::string FoxgloveFeed::server_state() const {
  return status_text(level_of(board_.contact()), "server", board_.words());
}

}  // namespace tendon::dash
