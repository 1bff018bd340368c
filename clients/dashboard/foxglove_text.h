// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "clients/dashboard/foxglove_message.h"

// Encoding of Foxglove's WebSocket protocol, version 1 (foxglove/ws-protocol, docs/spec.md). Text messages are JSON
// objects with a member `op`. Integers in binary messages are little-endian. Only the parts for publishing are
// implemented: no parameters, services, assets, connection graph or client publishing. Thread-safe, realtime-safe: no.

namespace tendon::dash {

struct FoxgloveChannel {
  std::uint32_t id = 0;
  std::string topic{};
  FoxgloveKind kind = FoxgloveKind::kStep;
};

/// {"op":"serverInfo"}. `session` differs between runs, so that viewers discard the data of previous runs.
std::string server_info_text(std::string_view name, std::string_view session);
/// {"op":"advertise"}, with the schema of each channel: base64 of foxglove_schema.
std::string advertise_text(std::span<const FoxgloveChannel> channels);
std::string unadvertise_text(std::span<const std::uint32_t> channels);

enum class StatusLevel : std::uint8_t { kInfo = 0, kWarning = 1, kError = 2 };
/// {"op":"status"}, a message for the user of the viewer. It replaces an earlier one with the same `id`.
std::string status_text(StatusLevel level, std::string_view id, std::string_view sentence);

/// Byte 1, subscription (4 bytes), time (8 bytes), payload.
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
struct NotUnderstood {  // `sentence` describes what was expected
  std::string sentence;
};
using FoxgloveOrder = std::variant<Subscribe, Unsubscribe, NotUnderstood>;

/// Parses a text message of a client. Never throws. Numbers must be integers, 0 … 2^32 − 1.
FoxgloveOrder parse_foxglove_order(std::string_view text);

}  // namespace tendon::dash
