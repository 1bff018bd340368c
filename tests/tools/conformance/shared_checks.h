// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tests/tools/conformance/conversation.h"
#include "tests/tools/conformance/opening.h"

// For an open session of a client or a server. The name of each function contains the name of the check.

namespace tendon::conformance {

/// How a peer shows that it accepted a datagram: a client by a force from a state's tick, a server by the sequence
/// number of the rendered force.
struct Evidence {
  std::function<pb::Frame(std::uint64_t)> frame;
  std::function<bool(std::uint64_t)> shown;
  std::uint64_t next = 1;
  bool any = true;  ///< false: this peer (an observer) does not show what it accepts
};

void check_bad_datagrams(Conversation& talk, Evidence& evidence);
void check_replay(Conversation& talk);
void check_reordering(Conversation& talk, Evidence& evidence);
void check_window(Conversation& talk, Evidence& evidence);
void check_unknown(Conversation& talk, Evidence& evidence);
/// Sends frames with a value out of bounds, whose numbers must never be shown. `damages` make a frame invalid.
void check_out_of_bounds(Conversation& talk, Evidence& evidence,
                         const std::vector<std::function<void(pb::Frame&)>>& damages);
/// Sends each request with each field out of bounds, and expects an answer to each. `id` is that of the first.
void check_bad_requests(Conversation& talk, std::uint32_t id);
void check_newest_wins(Conversation& talk, Evidence& evidence);
/// Switches to the next key in suite 1; the peer still accepts the old one for a short time.
void check_rekey(Conversation& talk);
void check_old_key(Conversation& talk, LocalTime renewed);
void check_keep_alive(Conversation& talk);
/// Sends only invalid datagrams, which must not reset the timeout. `timeout` is the peer's.
void check_timeout(Conversation& talk, Duration timeout);
void check_bye_silence(Conversation& talk);
void check_byes(Conversation& talk, std::size_t since);
/// Checks that the peer renews its key. This takes `options.key_age`, so it runs only with `options.long_checks`.
void check_rekey_sent(Conversation& talk, const Options& options);

}  // namespace tendon::conformance
