// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "clients/plug/plug.h"
#include "clients/plug/view.h"
#include "clients/plug/vrpn/vrpn_force.h"

namespace tendon::plug::vrpn {

/// A device under the name that VRPN programs ask for: Tracker, Button, Analog and ForceDevice at once.
struct Station {
  std::string name;
  View view{*find_frame("openhaptics"), {}};  ///< VRPN's frame is that of its Phantom server
  double stiffest = 1000;                     ///< N/m, of a plane with spring 1: the device's, where it is known
  std::optional<DeviceDescription::Box> workspace{};  ///< device base frame
  int buttons = 0;                                    ///< that it has
  std::uint32_t loop_hz = 1000;
  bool described = false;        ///< … have been learned from the plug
  bool handle_is_known = false;  ///< likewise view and buttons
  bool axes_said = false;

  Hand hand(const DeviceState& state) const { return {view.position(state.position), view.position(state.velocity)}; }

  /// Takes what the device's server says of it. A sentence, once, when it does not say which way is up: the device's
  /// own axes are then taken for VRPN's.
  std::optional<std::string> learn(const Plug& plug);
};

class Peer;

/// Asks a plug for what a program has drawn around its station: at a change, and again twice a second while it is fresh
/// (Freshness), so that the program stays the owner; at most 4000 times a second. Once its drawing has ended, zero is
/// asked for; then the plug lets the program go. A program whose force is not felt, because another one has the device,
/// is told.
///
/// Thread-safe: no. Realtime-safe: no.
class Asker {
 public:
  /// `number` is the program at every plug; `who` is it in sentences. `i` is the station among the peer's.
  Asker(Plug::Program number, std::string who, std::size_t i) : number_(number), who_(std::move(who)), i_(i) {}

  /// `plug` is the station's; `peer` and `station` must outlive what is asked for, which ends with Plug::release. True
  /// when something has been asked for that should leave at once.
  bool turn(LocalTime now, Duration since_1970, Plug& plug, const Station& station, Peer& peer);

  std::optional<std::string> next_sentence() { return std::exchange(sentence_, {}); }

 private:
  Plug::Program number_;
  std::string who_;
  std::size_t i_;
  std::optional<std::string> sentence_;
  LocalTime at_{};           ///< the last time that the drawing was asked for
  bool asks_ = false;        ///< a drawing is asked for
  bool is_stale_ = false;    ///< … but the program has fallen silent
  bool is_refused_ = false;  ///< another one owns the device, and the program has been told
  bool for_long_ = false;    ///< it has been said that the drawing lives as long as the connection
};

}  // namespace tendon::plug::vrpn
