// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "clients/dashboard/foxglove_message.h"

// The bytes of Foxglove's WebSocket protocol, version 1 (foxglove/ws-protocol, docs/spec.md). Text messages are JSON
// objects with a member `op`; integers of binary messages are little-endian. Only what a source of messages needs is
// here: no parameters, services, assets, connection graph or client publishing.
//
// Thread-safe, realtime-safe: no.

namespace tendon::dash {

struct FoxgloveChannel {
  std::uint32_t id = 0;
  std::string topic{};
  FoxgloveKind kind = FoxgloveKind::kStep;
};

/// {"op":"serverInfo"}: `session` differs from run to run, so that a viewer forgets what it had of another run.
std::string server_info_text(std::string_view name, std::string_view session);
/// {"op":"advertise"}, with each channel's schema: base64 of foxglove_schema.
std::string advertise_text(std::span<const FoxgloveChannel> channels);
std::string unadvertise_text(std::span<const std::uint32_t> channels);

enum class StatusLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };
/// {"op":"status"}: a sentence for the person at the viewer. A new one with the same `id` takes the place of the old.
std::string status_text(StatusLevel level, std::string_view id, std::string_view sentence);

/// Byte 1, the subscription (4 bytes), the time (8 bytes), the payload.
std::string message_data(std::uint32_t subscription, UnixTime at, std::string_view payload);
inline constexpr std::size_t kMessageDataHead = 13;

struct Subscribe {
  struct One {
    std::uint32_t subscription = 0;
    std::uint32_t channel = 0;
  };
  std::vector<One> all{};
};
struct Unsubscribe {
  std::vector<std::uint32_t> subscriptions{};
};
/// Not understood; the sentence says what was expected.
struct NotUnderstood {
  std::string sentence;
};
using FoxgloveOrder = std::variant<Subscribe, Unsubscribe, NotUnderstood>;

/// Reads a text message of a client. Never throws. Numbers are whole, 0 … 2^32 − 1.
FoxgloveOrder parse_foxglove_order(std::string_view text);

}  // namespace tendon::dash
