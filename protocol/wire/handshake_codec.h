// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <variant>
#include <vector>

#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/wire/header.h"

// Encodes and decodes the datagrams and messages of the handshake (WIRE.md, "Handshake").

namespace tendon {

/// Chosen by the client. It assigns Retry and Answer to an attempt.
using ClientRandom = std::array<std::byte, 16>;
/// Chosen by the server. All zeros in the first Hello.
using Cookie = std::array<std::byte, 16>;

/// The handshake datagrams. `body` points into the datagram. In suite 0 it is the result of write_body(), in suite 1 it
/// also contains what the handshake adds.
struct HelloDatagram {
  Suite suite = Suite::kPlain;
  ClientRandom random{};
  Cookie cookie{};
  std::span<const std::byte> body;
};
struct RetryDatagram {
  Suite suite = Suite::kPlain;
  ClientRandom random{};
  Cookie cookie{};
};
struct AnswerDatagram {
  Suite suite = Suite::kPlain;
  std::uint32_t connection_id = 0;  ///< 0 for a Refused
  ClientRandom random{};
  std::span<const std::byte> body;
};

/// Maximum size of a body in bytes: the largest Hello without claims (882) or the largest Welcome (874), and the 56
/// bytes that suite 1 adds. A reply is never longer than the Hello that it answers.
inline constexpr std::size_t kMaxHandshakeBody = 1000;

/// Returns the size of the datagram. A Hello is always padded to kMaxDatagram bytes, so that no reply is larger. The
/// body must have at most kMaxHandshakeBody bytes.
std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer);

/// Returns nullopt if the datagram has another type or an invalid layout. The body is not checked.
std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept;
std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept;
std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept;

using Answer = std::variant<Welcome, Refused>;

std::vector<std::byte> write_body(const Hello& hello);
std::vector<std::byte> write_body(const Answer& answer);

/// Returns nullopt if the bytes are not such a message or contain a value out of bounds.
std::optional<Hello> read_hello(std::span<const std::byte> body);
std::optional<Answer> read_answer(std::span<const std::byte> body);

}  // namespace tendon
