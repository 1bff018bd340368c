// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "clients/bridge/bridged_device.h"
#include "clients/bridge/view.h"
#include "clients/bridge/vrpn/vrpn_force.h"

namespace tendon::bridge::vrpn {

/// A device under the name used by VRPN programs. It is a Tracker, Button, Analog and ForceDevice.
struct Station {
  std::string name;
  View view{*find_frame("openhaptics"), {}};  ///< VRPN uses the frame of its Phantom server
  double stiffest = 1000;  ///< N/m, stiffness of a plane with spring 1; from the device description if it is known
  std::optional<DeviceDescription::Box> workspace{};  ///< in the device base frame
  int buttons = 0;
  std::uint32_t loop_hz = 1000;
  bool described = false;        ///< the description was read
  bool handle_is_known = false;  ///< `view` and `buttons` are valid
  bool axes_said = false;

  Hand hand(const DeviceState& state) const { return {view.position(state.position), view.position(state.velocity)}; }

  /// Reads the description. Returns a message, once, if the orientation is unknown; the device's axes then apply.
  std::optional<std::string> learn(const BridgedDevice& bridged);
};

class Peer;

/// Requests from a BridgedDevice what a program has drawn at its station: after each change, at most 4000 times per
/// second, and twice per second while it is fresh (StreamFreshness) to keep the ownership. When the drawing is removed,
/// it requests a zero force, after which the BridgedDevice releases the program. If another program owns the device,
/// the program is informed that its force is not applied. Thread-safe: no. Realtime-safe: no.
class Asker {
 public:
  /// `number` identifies the program for each BridgedDevice, and `who` in messages. `i` is the index of the station.
  Asker(BridgedDevice::Program number, std::string who, std::size_t i) : number_(number), who_(std::move(who)), i_(i) {}

  /// `peer` and `station` must outlive the request, until BridgedDevice::release. Returns true if it is due now.
  bool turn(LocalTime now, Duration since_1970, BridgedDevice& bridged, const Station& station, Peer& peer);

  std::optional<std::string> next_sentence() { return std::exchange(sentence_, {}); }

 private:
  BridgedDevice::Program number_;
  std::string who_;
  std::size_t i_;
  std::optional<std::string> sentence_;
  LocalTime at_{};
  bool asks_ = false;
  bool is_stale_ = false;  ///< the program has stopped sending
  bool is_refused_ = false;
  bool for_long_ = false;
};

}  // namespace tendon::bridge::vrpn
