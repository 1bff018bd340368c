// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>

#include "core/base/time.h"
#include "tests/tools/injector/traces/capture.h"
#include "tests/tools/injector/traces/import.h"
#include "tests/tools/injector/traces/trace.h"

namespace tendon::injector {

/// A capture and its name in errors.
struct Tap {
  std::string name;
  Capture capture;
};

struct TapOptions {
  std::uint16_t port = 0;         ///< UDP port of the server
  std::uint16_t server_port = 0;  ///< at the server's tap, if it is translated in between; 0: the same
  Duration clock_offset{};        ///< server's clock minus client's clock; 0 if both taps use the same clock
};

/// Two captures of the same datagrams, at the client and at the server. A datagram is recognized by the hash of its
/// payload, so addresses can be translated in between. A payload that was sent more than once is matched first to first;
/// a second copy behind the network is a duplicate.
///
/// A datagram without a match is lost if it was sent while the far tap was recording, and more than the longest delay
/// before its end. Otherwise its fate is not known, and it is left out. `summary` is a line for each direction with the
/// number of unknown fates, and a line for each kind of packet that was skipped.
///
/// Throws std::runtime_error if there are no datagrams of this port at either tap, no payload matches, payloads are cut
/// by the snapshot length, more than 1 % of the payloads were sent more than once, or a delay is negative, which
/// means that the captures are swapped or their clocks differ.
struct TwoTaps {
  Trace trace;
  std::string summary;
};
TwoTaps import_two_taps(const Tap& client, const Tap& server, const TapOptions& options);

/// ICMP echo requests and replies at one tap, as import_ping. Throws std::runtime_error if there are none: other
/// protocols do not contain a one-way delay.
Trace import_echoes(const Tap& tap, const ImportOptions& options);

}  // namespace tendon::injector
