// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/igtl/igtl_session.h"

#include <algorithm>

namespace tendon::bridge::igtl {
namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(500);  ///< keeps the ownership
/// Validity of a request. It must cover a late turn, but must end so that a bridge that hangs does not push.
constexpr Duration kAskedFor = std::chrono::seconds(1);

std::string called(const Header& header) {
  return std::string(header.type) + (header.name.empty() ? "" : " ") + std::string(header.name);
}

}  // namespace

Session::Session(BridgedDevice::Program number, std::span<const Station> stations)
    : number_(number), stations_(stations), wishes_(stations.size()) {}

void Session::warn(const std::string& about, const std::string& sentence) {
  if (warned_.size() >= kMaxWarnings || !warned_.insert(about).second) return;
  sentences_.push_back(sentence);
}

std::optional<std::string> Session::next_sentence() {
  if (sentences_.empty()) return {};
  std::string sentence = std::move(sentences_.front());
  sentences_.pop_front();
  return sentence;
}

void Session::send(Bytes messages) {
  if (sent_ > kMaxUnread) {
    out_.erase(out_.begin(), out_.begin() + static_cast<std::ptrdiff_t>(sent_));
    sent_ = 0;
  }
  out_.insert(out_.end(), messages.begin(), messages.end());
  if (out_.size() - sent_ > kMaxUnread && end_.empty()) end_ = "it does not read its data";
}

void Session::sent(std::size_t bytes) {
  sent_ += bytes;
  if (sent_ < out_.size()) return;
  out_.clear();
  sent_ = 0;
}

std::optional<Session::Input> Session::input_of(const Header& header) const {
  for (std::size_t i = 0; i < stations_.size(); ++i) {
    if (header.type == kTransform && header.name == stations_[i].target()) return Input{i, true};
    if (header.type == kSensor && header.name == stations_[i].command()) return Input{i, false};
  }
  return {};
}

void Session::take(LocalTime now, Bytes bytes) {
  if (!end_.empty()) return;
  const auto skipped = static_cast<std::size_t>(std::min<std::uint64_t>(skip_, bytes.size()));
  skip_ -= skipped;
  bytes = bytes.subspan(skipped);
  in_.insert(in_.end(), bytes.begin(), bytes.end());
  std::size_t used = 0;
  while (in_.size() - used >= kHeaderSize) {
    const Bytes left = std::span(in_).subspan(used);
    const auto header = read_header(left);
    if (!header) {
      end_ = "it does not use OpenIGTLink";
      return;
    }
    if (header->body_size > kLongestSkipped) {
      end_ = "it announced a " + called(*header) + " of " + std::to_string(header->body_size) + " bytes";
      return;
    }
    const auto size = static_cast<std::size_t>(header->body_size);
    const auto input = input_of(*header);
    if (!input || size > kLongestBody) {
      if (header->type == kGetStatus) {
        wants_status_ = true;
      } else if (input) {
        ++counts_.invalid;
        warn(called(*header) + "size", "its " + called(*header) + " is refused: " + std::to_string(size) +
                                           " bytes; expected at most " + std::to_string(kLongestBody));
      } else {
        ++counts_.ignored;
        warn(called(*header), "its " + called(*header) + " is ignored; expected " + std::string(kTransform) + " " +
                                  stations_[0].target() + " or " + std::string(kSensor) + " " + stations_[0].command());
      }
      const std::size_t here = std::min(size, left.size() - kHeaderSize);
      skip_ = size - here;
      used += kHeaderSize + here;
      continue;
    }
    if (left.size() < kHeaderSize + size) break;
    take(now, *header, *input, left.subspan(kHeaderSize, size));
    used += kHeaderSize + size;
  }
  in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(used));
}

void Session::take(LocalTime now, const Header& header, const Input& input, Bytes body) {
  Wish& wish = wishes_[input.station];
  const auto refuse = [&](const std::string& why) {
    ++counts_.invalid;
    warn(called(header) + why, "its " + called(header) + " is refused: " + why);
  };
  if (header.version != 1) {
    return refuse("header version " + std::to_string(header.version) + "; expected version 1");
  }
  if (header.crc != crc64(body)) return refuse("wrong CRC");
  const std::optional<Vec3> value = input.is_target ? read_position(body) : read_force(body);
  if (!value) {
    return refuse(input.is_target ? "expected a position within 10 m, in mm" : "expected three values, in N");
  }
  ++counts_.used;
  wish.changed = true;
  if (input.is_target) {
    wish.target = value;
    wish.freshness.heard(now);
  } else {
    wish.command = value;
    wish.command_until = now + kCommandFor;
  }
}

bool Session::ask(const Moment& now, std::size_t i, BridgedDevice& bridged) {
  Wish& wish = wishes_[i];
  const LocalTime target_until = wish.target ? wish.freshness.until() : LocalTime::min();
  const bool pulls = now.at < target_until;
  const bool pushes = wish.command && now.at < wish.command_until;
  const bool ended = (wish.pulls && !pulls) || (wish.pushes && !pushes);
  if (!ended && !wish.changed && (!(pulls || pushes) || now.at - wish.asked < kAskAgain)) return false;
  if (now.at - wish.asked < kShortest) return false;
  const Station& station = stations_[i];
  const std::string who = station.name() + ": program " + std::to_string(number_);
  wish.changed = false;
  if (wish.pulls && !pulls) sentences_.push_back(who + " has stopped sending " + station.target() + ", which ends");
  wish.pulls = pulls;
  wish.pushes = pushes;
  if (!pulls && !pushes) return false;  // the server fades the force of the last request
  wish.asked = now.at;
  LocalTime until = now.at + kAskedFor;
  if (pulls) until = std::min(until, target_until);
  if (pushes) until = std::min(until, wish.command_until);
  const double stiffness = pulls ? station.stiffness() : 0;
  const Physics physics = [&station, &bridged, stiffness, target = wish.target.value_or(Vec3::Zero()),
                           command = pushes ? *wish.command : Vec3(Vec3::Zero())](const DeviceState& hand) {
    const View view = station.view(bridged);
    Touch touch(Vec3(stiffness * (view.base_position(target) - hand.position) + view.base_force(command)));
    touch.stiffness = Mat3(stiffness * Mat3::Identity());
    return touch;
  };
  const BridgedDevice::Answer answer = bridged.ask(number_, now.at, until, physics);
  const bool refused = answer != BridgedDevice::Answer::kTaken;
  if (refused == wish.refused) return !refused;
  wish.refused = refused;
  const std::string why = answer == BridgedDevice::Answer::kOwned ? "another program controls the force of this device"
                                                                  : "forces are disabled by --observe";
  sentences_.push_back(who + (refused ? " is not rendered: " + why : " is rendered now"));
  Buffer status;
  append_status(status, {station.name(), now.since_1970}, refused ? Status::kAccessDenied : Status::kOk,
                refused ? "your force is not rendered: " + why : "your force is rendered now");
  send(status);
  return !refused;
}

LocalTime Session::due() const noexcept {
  LocalTime due = LocalTime::max();
  for (const Wish& wish : wishes_) {
    if (wish.pulls) due = std::min({due, wish.freshness.until(), wish.asked + kAskAgain});
    if (wish.pushes) due = std::min(due, wish.command_until);
    if (wish.changed) due = std::min(due, wish.asked + kShortest);
  }
  return due;
}

}  // namespace tendon::bridge::igtl
