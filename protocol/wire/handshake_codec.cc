// SPDX-License-Identifier: Apache-2.0
#include "protocol/wire/handshake_codec.h"

#include <algorithm>
#include <chrono>
#include <string>

#include "core/base/bytes.h"
#include "protocol/limits.h"
#include "protocol/wire/bounds.h"
#include "protocol/wire/fields.h"
#include "protocol/wire/text.h"

namespace tendon {
namespace {

namespace pb = tendon::v1;
using wire::read;

bool read(const pb::Claim& from, Claim& to) {
  return read(from.device(), limits::kMaxLabel, to.device) && read(from.channel(), limits::kMaxLabel, to.channel) &&
         read(from.role(), to.role);
}
bool read(const pb::Grant& from, Grant& to) noexcept {
  return wire::read_device(from.device(), to.device) && wire::read_channel(from.channel(), to.channel) &&
         read(from.role(), to.role);
}

/// Claims, or grants.
template <class Messages, class Value>
bool read_claims(const Messages& from, std::vector<Value>& to) {
  if (from.size() > limits::kMaxClaims) return false;
  to.resize(static_cast<std::size_t>(from.size()));
  return std::equal(from.begin(), from.end(), to.begin(),
                    [](const auto& one, Value& value) { return read(one, value); });
}

bool read(const pb::Hello& from, Hello& to) {
  to.version_min = from.version_min();
  to.version_max = from.version_max();
  return read_claims(from.claims(), to.claims) && to.version_min >= 1 && to.version_min <= to.version_max &&
         read(from.role(), to.role) && read(from.name(), limits::kMaxName, to.name) &&
         wire::read_features(from.features(), to.features) && wire::read_labels(from.ways(), limits::kMaxWays, to.ways);
}

void write(const Hello& from, pb::Hello& to) {
  to.set_version_min(from.version_min);
  to.set_version_max(from.version_max);
  to.set_role(static_cast<pb::Role>(from.role));
  to.set_name(clip(from.name, limits::kMaxName));
  wire::write_features(from.features, *to.mutable_features());
  for (const Claim& claim : from.claims) {
    if (to.claims_size() == limits::kMaxClaims) break;
    pb::Claim& out = *to.add_claims();
    out.set_device(clip(claim.device, limits::kMaxLabel));
    out.set_channel(clip(claim.channel, limits::kMaxLabel));
    out.set_role(static_cast<pb::Role>(claim.role));
  }
  wire::write_labels(from.ways, limits::kMaxWays, *to.mutable_ways());
}

bool read(const pb::Welcome& from, Welcome& to) {
  to.version = from.version();
  to.max_force = from.max_force_n();
  to.position_resolution = from.position_resolution_m();
  to.loop_hz = from.loop_hz();
  to.timeout = std::chrono::milliseconds(from.timeout_ms());
  return to.version >= 1 && read_claims(from.grants(), to.grants) &&
         wire::read_features(from.features(), to.features) && read(from.role(), to.role) &&
         read(from.device_name(), limits::kMaxName, to.device_name) && bounded(to.max_force) && to.max_force >= 0 &&
         bounded(to.position_resolution) && to.position_resolution >= 0 && to.loop_hz >= 1 &&
         to.loop_hz <= limits::kMaxLoopHz && to.timeout > Duration::zero() && to.timeout <= limits::kMaxTimeout &&
         read(from.server(), limits::kMaxName, to.server);
}

void write(const Welcome& from, pb::Welcome& to) {
  to.set_version(from.version);
  wire::write_features(from.features, *to.mutable_features());
  to.set_role(static_cast<pb::Role>(from.role));
  to.set_device_name(clip(from.device_name, limits::kMaxName));
  to.set_max_force_n(from.max_force);
  to.set_position_resolution_m(from.position_resolution);
  to.set_loop_hz(from.loop_hz);
  to.set_timeout_ms(
      static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::milliseconds>(from.timeout).count()));
  to.set_server(clip(from.server, limits::kMaxName));
  for (const Grant& grant : from.grants) {
    if (to.grants_size() == limits::kMaxClaims) break;
    pb::Grant& out = *to.add_grants();
    out.set_device(grant.device);
    out.set_channel(grant.channel);
    out.set_role(static_cast<pb::Role>(grant.role));
  }
}

bool read(const pb::Refused& from, Refused& to) {
  to.version_min = from.version_min();
  to.version_max = from.version_max();
  return read(from.code(), to.code) && read(from.detail(), limits::kMaxDetail, to.detail);
}

void write(const Refused& from, pb::Refused& to) {
  to.set_code(static_cast<pb::Code>(from.code));
  to.set_detail(clip(from.detail, limits::kMaxDetail));
  to.set_version_min(from.version_min);
  to.set_version_max(from.version_max);
}

void write_answer(const Welcome& from, pb::Answer& to) { write(from, *to.mutable_welcome()); }
void write_answer(const Refused& from, pb::Answer& to) { write(from, *to.mutable_refused()); }

template <class Message>
std::vector<std::byte> serialized(const Message& message) {
  std::vector<std::byte> out(message.ByteSizeLong());
  message.SerializeWithCachedSizesToArray(wire::as_bytes(out.data()));
  return out;
}

// Bytes of the handshake datagrams, after the header.
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

/// The header, when the datagram is a handshake datagram of that type.
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

std::vector<std::byte> write_body(const Hello& hello) {
  pb::Hello message;
  write(hello, message);
  return serialized(message);
}

std::vector<std::byte> write_body(const Answer& answer) {
  pb::Answer message;
  std::visit([&](const auto& body) { write_answer(body, message); }, answer);
  return serialized(message);
}

std::optional<Hello> read_hello(std::span<const std::byte> body) {
  pb::Hello message;
  Hello hello;
  if (!wire::parse(body, message) || !read(message, hello)) return {};
  return hello;
}

std::optional<Answer> read_answer(std::span<const std::byte> body) {
  pb::Answer message;
  if (!wire::parse(body, message)) return {};
  Answer answer;
  switch (message.body_case()) {
    case pb::Answer::kWelcome:
      if (!read(message.welcome(), std::get<Welcome>(answer))) return {};
      return answer;
    case pb::Answer::kRefused:
      if (!read(message.refused(), answer.emplace<Refused>())) return {};
      return answer;
    case pb::Answer::BODY_NOT_SET:
      return {};
  }
  return {};
}

}  // namespace tendon
