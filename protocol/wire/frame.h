// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/time.h"
#include "protocol/messages.h"

// What a Data datagram carries, as values.

namespace tendon {

/// The newest datagram that one end has received from the other, told back to it. `Sent` is the clock
/// of the one who sent that datagram, `Received` the clock of the one who tells.
template <class Sent, class Received>
struct BasicEcho {
  Sent sent{};                      ///< T1: when it was sent
  Received received{};              ///< T2: when it arrived
  std::uint64_t packet_number = 0;  ///< its number
  std::uint32_t received_mask = 0;  ///< bit i: packet (packet_number − 1 − i) has arrived too
};
using OutgoingEcho = BasicEcho<PeerTime, LocalTime>;
using IncomingEcho = BasicEcho<LocalTime, PeerTime>;

struct Control {
  std::uint32_t id = 0;
  std::optional<Request> request{};  ///< empty if this build does not know the request, or if it is invalid
  std::string_view invalid{};        ///< name of the field that is out of bounds (static storage), or empty
};
struct ControlAck {
  std::uint32_t id = 0;
  Code code = Code::kOk;
  std::string detail;
  Duration wait{};                            ///< with kBusy of a TakeLease; 0 = nobody knows
  std::optional<DeviceDescription> device{};  ///< with kOk of a Describe
  std::optional<HandleDescription> handle{};  ///< with kOk of a Describe that asks for the handle
};
struct Bye {
  Code code = Code::kOk;
  std::string reason;
};

using Frame =
    std::variant<DeviceState, ForceCommand, Control, ControlAck, Bye, LinkReport, DeviceReport, PeerReport, PortFrame>;

}  // namespace tendon
