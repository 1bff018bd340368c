// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "tests/tools/conformance/conversation.h"
#include "tests/tools/conformance/opening.h"

// What both ends owe to each other once a conversation is open. Each function judges the checks it is named after.

namespace tendon::conformance {

/// How a peer shows that it believed a datagram: a client computes its force from the tick of a state, a server renders
/// the sequence number of a force.
struct Evidence {
  /// A frame with this tick or sequence.
  std::function<pb::Frame(std::uint64_t)> frame;
  /// Whether this very number has shown, ever.
  std::function<bool(std::uint64_t)> shown;
  std::uint64_t next = 1;  ///< the next number that is new
  bool any = true;         ///< false: this peer (an observer) shows nothing of what it believes
};

void check_bad_datagrams(Conversation& talk, Evidence& evidence);
void check_replay(Conversation& talk);
void check_reordering(Conversation& talk, Evidence& evidence);
void check_window(Conversation& talk, Evidence& evidence);
void check_unknown(Conversation& talk, Evidence& evidence);
/// `bad` are frames with a value out of bounds, of numbers that must never show.
void check_out_of_bounds(Conversation& talk, Evidence& evidence,
                         const std::vector<std::function<void(pb::Frame&)>>& damages);
/// Sends each request with each field out of bounds, and expects an answer to each of them. `id` is the id of the first
/// request.
void check_bad_requests(Conversation& talk, std::uint32_t id);
void check_newest_wins(Conversation& talk, Evidence& evidence);
/// In suite 1 we move on to the next key; the old one is good for a little longer.
void check_rekey(Conversation& talk);
/// … and, more than 2 s after `renewed`, no more.
void check_old_key(Conversation& talk, LocalTime renewed);
/// The peer has nothing to say but that it is there.
void check_keep_alive(Conversation& talk);
/// We fall silent, but for what is no sign of life. `timeout` is the peer's.
void check_timeout(Conversation& talk, Duration timeout);
/// We say Bye.
void check_bye_silence(Conversation& talk);
/// The peer has said Bye in what was heard from index `since` on, or is about to.
void check_byes(Conversation& talk, std::size_t since);
/// Checks that the peer renews its key. This takes `options.key_age`, so it runs only with `options.long_checks`.
void check_rekey_sent(Conversation& talk, const Options& options);

}  // namespace tendon::conformance
