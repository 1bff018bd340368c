// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/vrpn/vrpn_station.h"

#include <algorithm>
#include <chrono>
#include <utility>

#include "clients/bridge/vrpn/vrpn_peer.h"

namespace tendon::bridge::vrpn {
namespace {

constexpr Duration kAskAgain = std::chrono::milliseconds(500);
/// Minimum interval between requests, since each is a datagram. A changed drawing waits at most for the next state. For
/// example, VRPN's ff_client sends 60 000 fields per second.
constexpr Duration kShortest = std::chrono::microseconds(250);
/// Validity of a request. It must cover a late turn, but must end so that a program that hangs does not push.
constexpr Duration kAskedFor = std::chrono::seconds(1);

}  // namespace

std::optional<std::string> Station::learn(const BridgedDevice& bridged) {
  const bool description_is_there = bridged.description().has_value();
  const bool handle_is_there = bridged.handle().has_value();
  if (description_is_there == described && handle_is_there == handle_is_known) return {};
  described = description_is_there;
  handle_is_known = handle_is_there;
  if (bridged.welcome() && bridged.welcome()->loop_hz > 0) loop_hz = bridged.welcome()->loop_hz;
  if (described) {
    workspace = bridged.description()->workspace;
    if (bridged.description()->max_stiffness > 0) stiffest = bridged.description()->max_stiffness;
  }
  if (!handle_is_known) return {};
  buttons = static_cast<int>(bridged.handle()->buttons.size());
  view = View(*find_frame("openhaptics"), bridged.handle()->operator_from_device);
  if (bridged.handle()->operator_from_device || std::exchange(axes_said, true)) return {};
  return name + ": the scene does not specify the orientation of the device (axes); assuming the axes of VRPN";
}

bool Asker::turn(LocalTime now, Duration since_1970, BridgedDevice& bridged, const Station& station, Peer& peer) {
  if (asks_ && now - at_ < kShortest) return false;
  Drawing& drawing = peer.drawing(i_);
  const bool changed = peer.take_change(i_);
  const LocalTime until = drawing.empty() ? LocalTime::max() : peer.freshness(i_).until();
  if (drawing.empty()) {
    if (!changed || !asks_) return false;
    asks_ = is_stale_ = for_long_ = false;
  } else if (now >= until) {
    if (!std::exchange(is_stale_, true)) {
      sentence_ = station.name + ": " + who_ + " is silent and has not stopped its force, which now decays";
    }
    return false;
  } else if (!changed && now - at_ < kAskAgain) {
    return false;
  } else {
    asks_ = true;
    if (std::exchange(is_stale_, false)) sentence_ = station.name + ": " + who_ + " sends effects again";
  }
  at_ = now;
  const Physics physics = [&drawing, &station](const DeviceState& state) {
    return in_base_frame(drawing.touch(station.hand(state), station.stiffest), station.view);
  };
  const BridgedDevice::Answer answer = bridged.ask(number_, now, std::min(until, now + kAskedFor), physics);
  const Moment moment{now, since_1970};
  if (answer != BridgedDevice::Answer::kTaken) {
    if (std::exchange(is_refused_, true)) return false;
    const std::string why = answer == BridgedDevice::Answer::kOwned
                                ? "another program controls the force of this device"
                                : "forces are disabled by --observe";
    peer.tell(moment, i_, Severity::kWarning, "your force is not rendered: " + why);
    sentence_ = station.name + ": the force of " + who_ + " is not rendered: " + why;
    return false;
  }
  if (std::exchange(is_refused_, false)) {
    peer.tell(moment, i_, Severity::kNormal, "your force is rendered now");
    sentence_ = station.name + ": the force of " + who_ + " is rendered now";
  } else if (asks_ && !changed && until == LocalTime::max() && !std::exchange(for_long_, true)) {
    sentence_ = station.name + ": what " + who_ + " has set stays until it disconnects";
  }
  return true;
}

}  // namespace tendon::bridge::vrpn
