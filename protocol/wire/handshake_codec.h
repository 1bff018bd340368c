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

// The datagrams of the handshake, and the messages in them, to bytes and back. The bytes are in WIRE.md, "Handshake".

namespace tendon {

/// Chosen by the client; ties Retry and Answer to one attempt.
using ClientRandom = std::array<std::byte, 16>;
/// Chosen by the server; all zeros in the first Hello.
using Cookie = std::array<std::byte, 16>;

/// The three as they travel. `body` is in the clear what write_body() gives, in suite 1 that and what
/// the handshake adds: it points into the datagram.
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
  std::uint32_t connection_id = 0;  ///< 0 with Refused
  ClientRandom random{};
  std::span<const std::byte> body;
};

/// The longest body: of the largest Hello without claims, 882 bytes, and of the largest Welcome, 874, with what suite 1
/// adds to them, 56. A reply is never longer than the Hello it answers.
inline constexpr std::size_t kMaxHandshakeBody = 1000;

/// Each returns the size of the datagram. A Hello always fills kMaxDatagram bytes, so that no reply to
/// it is larger. A body has at most kMaxHandshakeBody bytes.
std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer);

/// Each is empty when the datagram is of another type or its layout is not that of the type; the body is
/// not looked into.
std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept;
std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept;
std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept;

using Answer = std::variant<Welcome, Refused>;

std::vector<std::byte> write_body(const Hello& hello);
std::vector<std::byte> write_body(const Answer& answer);

/// Each is empty when the bytes are not that message, or hold a value out of bounds.
std::optional<Hello> read_hello(std::span<const std::byte> body);
std::optional<Answer> read_answer(std::span<const std::byte> body);

}  // namespace tendon
