// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_peer.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <utility>

namespace tendon::bridge::vrpn {
namespace {

constexpr std::size_t kMaxSentences = 32;
constexpr double kTurnTime = 0.01;  ///< s; a quaternion then represents up to half a turn, which is 50 turns per second
constexpr double kSlowest = 1;      ///< Hz
constexpr std::string_view kForceDevice = "vrpn_ForceDevice ";
constexpr std::string_view kControl = "VRPN Control";  ///< sender that every VRPN program creates; not a device

std::int32_t number_of(std::size_t i) { return static_cast<std::int32_t>(i); }

}  // namespace

Peer::Peer(std::span<const Station> stations, const Moment& now)
    : stations_(stations), wishes_(stations.size()), told_(stations.size()), allowed_(now.at) {
  const auto ours = cookie();
  out_.assign(ours.begin(), ours.end());
}

void Peer::say(std::string sentence) {
  if (sentences_.size() < kMaxSentences) sentences_.push_back(std::move(sentence));
}

std::optional<std::string> Peer::next_sentence() {
  if (sentences_.empty()) return {};
  std::string sentence = std::move(sentences_.front());
  sentences_.pop_front();
  return sentence;
}

void Peer::send(const Moment& now, std::int32_t sender, std::int32_t type, bool soon) {
  const Message message{.stamp = stamp_of(now.since_1970), .sender = sender, .type = type, .payload = payload_};
  if (soon && udp_port_) {
    const std::size_t size = kHeaderSize + payload_.size() + 8;  // upper bound, including padding
    if (datagrams_.empty() || datagrams_.back().size() + size > kLongestDatagram) datagrams_.emplace_back();
    append(datagrams_.back(), message, sequence_++);
  } else {
    if (sent_ > kMaxUnread) {
      out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(sent_));
      sent_ = 0;
    }
    append(out_, message, sequence_++);
    if (out_.size() - sent_ > kMaxUnread && end_.empty()) end_ = "it does not read its data";
  }
  payload_.clear();
}

void Peer::sent(std::size_t bytes) {
  sent_ += bytes;
  if (sent_ < out_.size()) return;
  out_.clear();
  sent_ = 0;
}

void Peer::describe_all(const Moment& now) {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    append_description(payload_, stations_[i].name);
    send(now, number_of(i), kSenderDescription, false);
  }
  for (std::size_t i = 0; i < kTypeNames.size(); ++i) {
    append_description(payload_, kTypeNames[i]);
    send(now, number_of(i), kTypeDescription, false);
  }
}

void Peer::describe_port(const Moment& now, std::string_view host, std::uint16_t port) {
  for (const char one : host) payload_.push_back(static_cast<std::byte>(one));
  payload_.push_back(std::byte{0});
  send(now, port, kUdpDescription, false);
}

void Peer::take_stream(const Moment& now, Bytes bytes) {
  if (!end_.empty()) return;
  in_.insert(in_.end(), bytes.begin(), bytes.end());
  std::size_t used = 0;
  if (!open_) {
    if (in_.size() < kCookieSize) return;
    const Bytes theirs = std::span(in_).first(kCookieSize);
    used = kCookieSize;
    switch (kinship(theirs)) {
      case Kinship::kOtherMajor:
        end_ = "it does not use VRPN version 07";
        return;
      case Kinship::kOtherMinor:
        say("it uses another minor version of VRPN than 07.38; continuing");
        break;
      case Kinship::kSame:
        break;
    }
    open_ = true;
    describe_all(now);
  }
  while (end_.empty()) {
    const First first = first_message(std::span(in_).subspan(used));
    if (first.broken) {
      end_ = "it sent a message with an invalid length";
      return;
    }
    if (!first.message) break;
    take(now, *first.message);
    used += first.size;
  }
  in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(used));
}

void Peer::take_datagram(const Moment& now, Bytes datagram) {
  if (!open_ || !end_.empty()) return;
  while (!datagram.empty()) {
    const First first = first_message(datagram);
    if (!first.message) {
      ++counts_.nonsense;
      return;
    }
    if (first.message->type >= 0) {
      take(now, *first.message);
    } else {
      ++counts_.nonsense;  // descriptions must arrive over TCP, because anyone can send datagrams
    }
    datagram = datagram.subspan(first.size);
  }
}

void Peer::take(const Moment& now, const Message& message) {
  if (message.type < 0) {
    take_system(message);
    return;
  }
  ++counts_.messages;
  const double passed = seconds(std::max(now.at - allowed_, Duration::zero()));
  allowance_ = std::min<double>(kBurst, allowance_ + kMaxPerSecond * passed);
  allowed_ = std::max(allowed_, now.at);
  if (allowance_ < 1 && !held_) {
    held_.emplace();
  } else if (allowance_ < 1) {
    ++counts_.skipped;
  }
  if (held_) {
    held_->message = message;
    held_->payload.assign(message.payload.begin(), message.payload.end());
    return;
  }
  allowance_ -= 1;
  const auto of = [](std::int32_t number, const auto& table) {
    return number >= 0 && static_cast<std::size_t>(number) < table.size() ? &table[static_cast<std::size_t>(number)]
                                                                          : nullptr;
  };
  const std::int32_t* const sender = of(message.sender, senders_);
  const Name* const name = of(message.type, types_);
  if (sender == nullptr || name == nullptr) {
    ++counts_.nonsense;
    return;
  }
  if (*sender == kNobody) return;
  const auto station = static_cast<std::size_t>(*sender);
  if (name->type) {
    understand(now, station, *name->type, message.payload);
  } else if (name->text.starts_with(kForceDevice)) {
    not_rendered(now, station, name->text.substr(kForceDevice.size()));
  }
}

void Peer::end_of_batch(const Moment& now) {
  if (!held_) return;
  Held held = std::move(*held_);
  held_.reset();
  held.message.payload = held.payload;
  --counts_.messages;
  allowance_ = std::max(allowance_, 1.0);
  take(now, held.message);
}

void Peer::take_system(const Message& message) {
  switch (message.type) {
    case kSenderDescription:
    case kTypeDescription: {
      const auto name = read_description(message.payload);
      if (!name || message.sender < 0 || message.sender >= kMostNumbers) break;
      const auto at = static_cast<std::size_t>(message.sender);
      if (message.type == kTypeDescription) {
        if (at >= types_.size()) types_.resize(at + 1);
        types_[at] = {.type = type_of(*name), .text = std::string(*name)};
        return;
      }
      if (at >= senders_.size()) senders_.resize(at + 1, kNobody);
      const auto station = std::ranges::find(stations_, *name, &Station::name);
      senders_[at] =
          station == stations_.end() ? kNobody : number_of(static_cast<std::size_t>(station - stations_.begin()));
      if (senders_[at] != kNobody || *name == kControl || warned_.size() >= kMaxWarnings) return;
      if (!warned_.emplace(*name).second) return;
      std::string names;
      for (const Station& one : stations_) names += (names.empty() ? "" : ", ") + one.name;
      std::string printable(*name);
      std::ranges::replace_if(
          printable, [](char one) { return one < ' ' || one > '~'; }, '?');
      say("it asks for \"" + printable + "\", which does not exist; expected one of " + names + " (see --name)");
      return;
    }
    case kUdpDescription:
      if (message.sender < kLowestPort || message.sender > kHighestPort) break;
      udp_port_ = static_cast<std::uint16_t>(message.sender);
      return;
    default:
      break;  // for example, a log file on this machine
  }
  ++counts_.nonsense;
}

void Peer::not_rendered(const Moment& now, std::size_t station, const std::string& what) {
  ++counts_.not_rendered;
  if (warned_.size() >= kMaxWarnings || !warned_.insert(std::string(kForceDevice) + what).second) return;
  std::string printable = what;
  std::ranges::replace_if(
      printable, [](char one) { return one < ' ' || one > '~'; }, '?');
  tell(now, station, Severity::kWarning, "Tendon renders force fields and planes; not rendered: " + printable);
}

void Peer::understand(const Moment& now, std::size_t station, Type type, Bytes payload) {
  const Station& here = stations_[station];
  Wish& wish = wishes_[station];
  const auto drawn = [&] {
    wish.changed = true;
    if (wish.drawing.empty()) {
      wish.freshness.forget();
    } else {
      wish.freshness.heard(now.at);
    }
  };
  switch (type) {
    case Type::kForceField:
      if (const auto field = read_field(payload)) {
        wish.drawing.draw(*field);
        drawn();
        return;
      }
      break;
    case Type::kPlane:
      if (const auto plane = read_plane(payload); plane && wish.drawing.draw(*plane)) {
        drawn();
        return;
      }
      break;
    case Type::kPlaneEffects:
      if (const auto any = read_effects(payload)) {
        if (*any) not_rendered(now, station, "adhesion, texture and buzz of a plane");
        return;
      }
      break;
    case Type::kPing:
      send(now, station, Type::kPong, false);
      return;
    case Type::kRequestWorkspace:
      if (here.workspace) {
        const Vec3 one = here.view.position(here.workspace->min);
        const Vec3 other = here.view.position(here.workspace->max);
        append_workspace(payload_, one.cwiseMin(other), one.cwiseMax(other));
        send(now, station, Type::kWorkspace, false);
      }
      return;
    case Type::kRequestToRoom:
      append_identity_to_room(payload_);
      send(now, station, Type::kToRoom, false);
      return;
    case Type::kRequestUnitToSensor:
      append_pose(payload_, Vec3::Zero(), Quat{});
      send(now, station, Type::kUnitToSensor, false);
      return;
    case Type::kUpdateRate:
      if (const auto hz = read_update_rate(payload)) {
        told_[station].period_ticks = std::max(1.0, here.loop_hz / std::max(*hz, kSlowest));
        told_[station].next_tick = 0;
        return;
      }
      break;
    case Type::kText:
    case Type::kPong:
      return;
    default:
      break;  // messages that only a device sends
  }
  ++counts_.nonsense;
}

void Peer::tell(const Moment& now, std::size_t station, Severity severity, std::string_view text) {
  if (!open_) return;
  append_text(payload_, severity, text);
  send(now, station, Type::kText, false);
}

void Peer::report(const Moment& now, std::size_t station, const DeviceState& state, Duration round_trip) {
  if (!open_ || !end_.empty()) return;
  const Station& here = stations_[station];
  Told& told = told_[station];

  const int buttons = std::max(here.buttons, static_cast<int>(std::bit_width(state.buttons)));
  if (buttons > told.buttons) {
    told.buttons = buttons;
    told.held = state.buttons;
    append_buttons(payload_, state.buttons, buttons);
    send(now, station, Type::kButtonStates, false);
  }
  for (int i = 0; i < told.buttons; ++i) {
    const auto bit = std::uint32_t{1} << static_cast<unsigned>(i);
    if (((state.buttons ^ told.held) & bit) == 0) continue;
    append_button(payload_, i, (state.buttons & bit) != 0);
    send(now, station, Type::kButtonChange, false);
  }
  told.held = state.buttons;

  const Reasons reasons = Reasons::from_bits(state.reasons);
  const bool stopped = state.mode == Mode::kFault || reasons.has(Reason::kFault) || reasons.has(Reason::kDisarmed);
  if (stopped && !told.stopped) {
    append_error(payload_, kForceError);
    send(now, station, Type::kForceError, false);
    tell(now, station, Severity::kError, "the device exerts no force: " + to_string(reasons));
  }
  told.stopped = stopped;

  const auto tick = static_cast<double>(state.tick);
  if (told.any && tick < told.next_tick && tick + told.period_ticks >= told.next_tick) return;
  told.any = true;
  told.next_tick = std::max(told.next_tick + told.period_ticks, tick + told.period_ticks / 2);

  const Hand hand = here.hand(state);
  Quat orientation;
  Quat turn;
  if (state.turning) {
    orientation = quaternion_of(here.view.orientation(state.turning->orientation));
    turn = rotation_by(kTurnTime * here.view.torque(state.turning->angular_velocity));
  }
  append_pose(payload_, hand.position, orientation);
  send(now, station, Type::kPosQuat, true);
  ++counts_.reports;
  if (told.reports++ % kRareReports != 0) return;
  append_velocity(payload_, hand.velocity, turn, kTurnTime);
  send(now, station, Type::kVelocity, true);
  append_force(payload_, here.view.force(state.force_applied));
  send(now, station, Type::kForce, true);
  const std::array<double, 4> channels = {state.grip ? state.grip->opening : 0, state.force_applied.norm(),
                                          state.energy, seconds(round_trip)};
  append_channels(payload_, channels);
  send(now, station, Type::kChannel, true);
}

}  // namespace tendon::bridge::vrpn
