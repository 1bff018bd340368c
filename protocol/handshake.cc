// SPDX-License-Identifier: Apache-2.0
#include "protocol/handshake.h"

#include <sodium.h>

#include <algorithm>
#include <stdexcept>
#include <string_view>

namespace tendon {
namespace {

/// A message to be authenticated, of at most 64 bytes, put together piece by piece.
class Message {
 public:
  Message& operator<<(std::string_view text) noexcept {
    for (const char c : text) put(static_cast<unsigned char>(c));
    return *this;
  }
  Message& operator<<(std::span<const std::uint8_t> raw) noexcept {
    for (const std::uint8_t b : raw) put(b);
    return *this;
  }
  Message& operator<<(std::span<const std::byte> raw) noexcept {
    for (const std::byte b : raw) put(std::to_integer<unsigned char>(b));
    return *this;
  }
  template <class Unsigned>
  Message& little_endian(Unsigned value) noexcept {
    for (std::size_t i = 0; i < sizeof(Unsigned); ++i) put(static_cast<unsigned char>(value >> (8 * i) & 0xFFU));
    return *this;
  }

  using Tag = std::array<unsigned char, crypto_auth_BYTES>;
  Tag authenticate(const unsigned char* key) const noexcept {
    Tag tag;
    crypto_auth(tag.data(), bytes_.data(), size_, key);
    return tag;
  }

 private:
  void put(unsigned char b) noexcept { bytes_[size_++] = b; }

  std::array<unsigned char, 64> bytes_{};
  std::size_t size_ = 0;
};
static_assert(sizeof(Doorman::Config::secret) == crypto_auth_KEYBYTES && crypto_auth_BYTES == crypto_auth_KEYBYTES);

std::int64_t floor_divide(std::int64_t a, std::int64_t b) noexcept { return a / b - (a % b < 0 ? 1 : 0); }

/// The highest version that both speak; 0 when there is none.
std::uint32_t common_version(const Hello& hello, const Doorman::Config& config) noexcept {
  const std::uint32_t highest = std::min(hello.version_max, config.version_max);
  return highest >= std::max(hello.version_min, config.version_min) ? highest : 0;
}

}  // namespace

// ---- ClientHandshake ----

ClientHandshake::ClientHandshake(const Config& config, LocalTime now) : config_(config), next_tick_(now) {}

void ClientHandshake::receive(LocalTime now, std::span<const std::byte> datagram) {
  if (outcome_) return;
  if (const auto retry = decode_retry(datagram); retry && retry->random == config_.random) {
    // Only the first cookie is worth an immediate Hello. Were every Retry, a server that dislikes our
    // cookies and we would play ping-pong.
    if (!cookie_) {
      due_ = true;
      next_tick_ = now;
    }
    cookie_ = retry->cookie;
  } else if (const auto answer = decode_answer(datagram); answer && answer->random == config_.random) {
    if (const auto* refused = std::get_if<Refused>(&answer->answer)) {
      outcome_ = *refused;
    } else {
      const Welcome& welcome = std::get<Welcome>(answer->answer);
      if (welcome.version < config_.hello.version_min || welcome.version > config_.hello.version_max) return;
      outcome_ = Accepted{.connection_id = answer->connection_id, .welcome = welcome};
    }
    due_ = false;
    next_tick_ = LocalTime::max();
  }
}

void ClientHandshake::tick(LocalTime now) {
  if (!outcome_ && now >= next_tick_) due_ = true;
}

std::size_t ClientHandshake::next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  if (!due_) return 0;
  due_ = false;
  next_tick_ = now + config_.resend;
  return encode({.random = config_.random, .cookie = cookie_.value_or(Cookie{}), .hello = config_.hello}, buffer);
}

// ---- Doorman ----

Doorman::Doorman(const Config& config) : config_(config) {
  if (config.key_lifetime <= Duration::zero()) throw std::invalid_argument("doorman: key_lifetime must be positive");
  if (config.version_min < 1 || config.version_min > config.version_max) {
    throw std::invalid_argument("doorman: version_min must be at least 1 and at most version_max");
  }
  if (sodium_init() < 0) throw std::runtime_error("libsodium cannot be initialised");
}

Cookie Doorman::cookie(std::int64_t key_number, const Address& from, const ClientRandom& random) const noexcept {
  const auto* secret = reinterpret_cast<const unsigned char*>(config_.secret.data());
  Message key_message;
  key_message << std::string_view("tendon-cookie-key");
  const Message::Tag key = key_message.little_endian(static_cast<std::uint64_t>(key_number)).authenticate(secret);

  Message message;
  message << std::string_view("tendon-cookie") << std::span<const std::uint8_t>(from.ip);
  message.little_endian(from.port) << std::span<const std::byte>(random);
  const Message::Tag tag = message.authenticate(key.data());

  Cookie cookie;
  std::transform(tag.begin(), tag.begin() + cookie.size(), cookie.begin(), [](auto b) { return std::byte{b}; });
  return cookie;
}

Doorman::Reply Doorman::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                                std::span<std::byte, kMaxDatagram> answer) {
  const auto hello = decode_hello(datagram);
  if (!hello) {
    ++malformed_;
    return {};
  }
  const std::int64_t key_number = floor_divide(now.time_since_epoch().count(), config_.key_lifetime.count());
  const Cookie fresh = cookie(key_number, from, hello->random);
  const Cookie previous = cookie(key_number - 1, from, hello->random);
  // In constant time: how much of a guess was right must not show.
  const auto is = [&](const Cookie& good) {
    return sodium_memcmp(good.data(), hello->cookie.data(), good.size()) == 0;
  };
  if (!is(fresh) && !is(previous)) {
    return {.size = encode(RetryDatagram{.random = hello->random, .cookie = fresh}, answer), .guest = {}};
  }
  return {
      .size = 0,
      .guest = Guest{.hello = hello->hello, .random = hello->random, .version = common_version(hello->hello, config_)}};
}

std::size_t Doorman::welcome(std::uint32_t connection_id, const ClientRandom& random, const Welcome& welcome,
                             std::span<std::byte, kMaxDatagram> buffer) {
  return encode(AnswerDatagram{.connection_id = connection_id, .random = random, .answer = welcome}, buffer);
}

std::size_t Doorman::refuse(const ClientRandom& random, const Refused& refused,
                            std::span<std::byte, kMaxDatagram> buffer) {
  return encode(AnswerDatagram{.connection_id = 0, .random = random, .answer = refused}, buffer);
}

}  // namespace tendon
