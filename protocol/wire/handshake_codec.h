// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "protocol/link.h"
#include "protocol/messages.h"
#include "protocol/wire/header.h"

// Encodes and decodes the datagrams and messages of the handshake (WIRE.md, types 1, 2 and 4).

namespace tendon {

using ClientRandom = std::array<std::byte, 16>;  ///< chosen by the client, to identify the attempt
using Cookie = std::array<std::byte, 16>;        ///< chosen by the server; zero in the first Hello

/// `body` points into the datagram: write_body() in suite 0, and else a Noise message, after the key id in a Hello.
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
  std::uint32_t connection_id = 0;
  ClientRandom random{};
  std::span<const std::byte> body;
};

/// For the largest Hello without claims (882), the largest Welcome (874), and the overhead of suite 1 (56).
inline constexpr std::size_t kMaxHandshakeBody = 1000;

/// Returns the size. Pads a Hello to kMaxDatagram, so that replies are never larger. Bodies: at most kMaxHandshakeBody.
std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer);
std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer);

/// Returns nullopt if the type or the layout is wrong. Does not check the body.
std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept;
std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept;
std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept;

std::vector<std::byte> write_body(const Hello& hello);
std::vector<std::byte> write_body(const Answer& answer);

/// Returns nullopt if the message is malformed or a value is out of bounds.
std::optional<Hello> read_hello(std::span<const std::byte> body);
std::optional<Answer> read_answer(std::span<const std::byte> body);

}  // namespace tendon
