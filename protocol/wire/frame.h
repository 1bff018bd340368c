// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>

#include "core/base/time.h"
#include "protocol/messages.h"

namespace tendon {

/// Acknowledges the newest datagram received from the peer. `Sent` is the clock of the sender of that datagram,
/// `Received` the clock of its receiver.
template <class Sent, class Received>
struct BasicEcho {
  Sent sent{};          ///< T1, when it was sent
  Received received{};  ///< T2, when it arrived
  std::uint64_t packet_number = 0;
  std::uint32_t received_mask = 0;  ///< bit i: packet (packet_number − 1 − i) has also arrived
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
  Duration wait{};                            ///< for a TakeLease answered kBusy; 0 = unknown
  std::optional<DeviceDescription> device{};  ///< for a Describe answered kOk
  std::optional<HandleDescription> handle{};  ///< for a Describe with `handle` answered kOk
};
struct Bye {
  Code code = Code::kOk;
  std::string reason;
};

using Frame =
    std::variant<DeviceState, ForceCommand, Control, ControlAck, Bye, LinkReport, DeviceReport, PeerReport, PortFrame>;

}  // namespace tendon
