// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/handshake_codec.h"

#include <algorithm>
#include <array>
#include <span>

#include "core/base/bytes.h"
#include "protocol/wire/fields/reader.h"
#include "protocol/wire/fields/writer.h"
#include "protocol/wire/generated/handshake_fields.h"
#include "protocol/wire/generated/schema.h"

namespace tendon {
namespace {

constexpr std::size_t kMostBody = 2048;  ///< after truncating texts and lists

template <class Value, class List>
std::vector<std::byte> bytes_of(const Value& value, List list) {
  std::array<wire::Byte, kMostBody> bytes;
  wire::Writer out(bytes.data());
  list(out, value);
  const auto written = std::as_bytes(std::span(bytes)).first(static_cast<std::size_t>(out.at() - bytes.data()));
  return {written.begin(), written.end()};
}

template <class Value, class List>
std::optional<Value> read_message(std::span<const std::byte> body, const wire::Schema& schema, List list) {
  wire::AnyOrder any_order;
  const auto in_order = any_order.in_order(schema, body);
  if (!in_order) return {};
  std::optional<Value> value(std::in_place);
  wire::Reader in(*in_order);
  list(in, *value);
  if (!in.done() || in.refused() != nullptr) value.reset();
  return value;
}

// Byte offsets in handshake datagrams.
constexpr std::size_t kRandomAt = kHeaderSize;
constexpr std::size_t kCookieAt = kRandomAt + sizeof(ClientRandom);
constexpr std::size_t kRetrySize = kCookieAt + sizeof(Cookie);
constexpr std::size_t kHelloLengthAt = kRetrySize;
constexpr std::size_t kHelloAt = kHelloLengthAt + 2;
constexpr std::size_t kAnswerAt = kCookieAt;

std::array<std::byte, 16> get16(std::span<const std::byte> datagram, std::size_t at) noexcept {
  std::array<std::byte, 16> value;
  std::copy_n(datagram.begin() + static_cast<std::ptrdiff_t>(at), value.size(), value.begin());
  return value;
}

void put16(const std::array<std::byte, 16>& value, std::byte* to) noexcept {
  std::copy(value.begin(), value.end(), to);
}

std::optional<Header> handshake_header(std::span<const std::byte> datagram, DatagramType type) noexcept {
  const std::optional<Header> header = decode_header(datagram);
  if (!header || header->type != type || header->packet_number != 0) return {};
  if (type != DatagramType::kAnswer && header->connection_id != 0) return {};
  return header;
}

}  // namespace

std::size_t encode(const HelloDatagram& hello, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  std::ranges::copy(encode_header({.type = DatagramType::kHello, .suite = hello.suite}), to);
  put16(hello.random, to + kRandomAt);
  put16(hello.cookie, to + kCookieAt);
  put_little_endian(static_cast<std::uint16_t>(hello.body.size()), to + kHelloLengthAt);
  std::byte* const end = std::copy(hello.body.begin(), hello.body.end(), to + kHelloAt);
  std::fill(end, to + kMaxDatagram, std::byte{0});
  return kMaxDatagram;
}

std::size_t encode(const RetryDatagram& retry, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  std::ranges::copy(encode_header({.type = DatagramType::kRetry, .suite = retry.suite}), to);
  put16(retry.random, to + kRandomAt);
  put16(retry.cookie, to + kCookieAt);
  return kRetrySize;
}

std::size_t encode(const AnswerDatagram& answer, std::span<std::byte, kMaxDatagram> buffer) {
  std::byte* const to = buffer.data();
  std::ranges::copy(
      encode_header({.type = DatagramType::kAnswer, .suite = answer.suite, .connection_id = answer.connection_id}), to);
  put16(answer.random, to + kRandomAt);
  std::copy(answer.body.begin(), answer.body.end(), to + kAnswerAt);
  return kAnswerAt + answer.body.size();
}

std::optional<HelloDatagram> decode_hello(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kHello);
  if (!header || datagram.size() != kMaxDatagram) return {};
  const std::size_t size = get_little_endian<std::uint16_t>(datagram.data() + kHelloLengthAt);
  if (size > kMaxHandshakeBody) return {};
  const auto padding = datagram.subspan(kHelloAt + size);
  if (std::any_of(padding.begin(), padding.end(), [](std::byte b) { return b != std::byte{0}; })) return {};
  return HelloDatagram{.suite = header->suite,
                       .random = get16(datagram, kRandomAt),
                       .cookie = get16(datagram, kCookieAt),
                       .body = datagram.subspan(kHelloAt, size)};
}

std::optional<RetryDatagram> decode_retry(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kRetry);
  if (!header || datagram.size() != kRetrySize) return {};
  return RetryDatagram{
      .suite = header->suite, .random = get16(datagram, kRandomAt), .cookie = get16(datagram, kCookieAt)};
}

std::optional<AnswerDatagram> decode_answer(std::span<const std::byte> datagram) noexcept {
  const std::optional<Header> header = handshake_header(datagram, DatagramType::kAnswer);
  if (!header || datagram.size() < kAnswerAt) return {};
  return AnswerDatagram{.suite = header->suite,
                        .connection_id = header->connection_id,
                        .random = get16(datagram, kRandomAt),
                        .body = datagram.subspan(kAnswerAt)};
}

std::vector<std::byte> write_body(const Hello& hello) { return bytes_of(hello, wire::kHelloFields); }
std::vector<std::byte> write_body(const Answer& answer) { return bytes_of(answer, wire::kAnswerFields); }

std::optional<Hello> read_hello(std::span<const std::byte> body) {
  return read_message<Hello>(body, wire::schema::kHello, wire::kHelloFields);
}

std::optional<Answer> read_answer(std::span<const std::byte> body) {
  return read_message<Answer>(body, wire::schema::kAnswer, wire::kAnswerFields);
}

}  // namespace tendon
