// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <variant>

#include "core/base/time.h"
#include "protocol/messages.h"

namespace tendon {

/// An acknowledgment of the newest datagram. `Sent` and `Received` are the clocks of its sender and its receiver.
template <class Sent, class Received>
struct BasicEcho {
  Sent sent{};          ///< T1
  Received received{};  ///< T2
  std::uint64_t packet_number = 0;
  std::uint32_t received_mask = 0;  ///< bit i: packet_number − 1 − i has arrived
};
using OutgoingEcho = BasicEcho<PeerTime, LocalTime>;
using IncomingEcho = BasicEcho<LocalTime, PeerTime>;

struct Control {
  std::uint32_t id = 0;
  std::optional<Request> request{};  ///< empty if unknown or invalid
  std::string_view invalid{};        ///< field that is out of bounds (static storage)
};

using Frame = std::variant<DeviceState, ForceCommand, Control, ControlAck, Bye, LinkReport, DeviceReport, PeerReport,
                           PortFrame, FieldBrick, FieldStatus, FieldPose>;

}  // namespace tendon
