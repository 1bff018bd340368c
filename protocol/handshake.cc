// SPDX-License-Identifier: Apache-2.0
#include "protocol/handshake.h"

#include <algorithm>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>

#include "core/base/bytes.h"

namespace tendon {
namespace {

std::span<const std::byte> text(std::string_view text) noexcept { return std::as_bytes(std::span(text)); }

template <std::size_t Size>
std::array<std::byte, Size> first_of(const Bytes32& bytes) noexcept {
  std::array<std::byte, Size> first;
  std::copy_n(bytes.begin(), Size, first.begin());
  return first;
}

/// Does not include the cookie, so that all datagrams of an attempt contain the same message 1. A different prologue
/// would use the same ephemeral key and nonce for another message.
std::vector<std::byte> prologue(const KeyId& id, const ClientRandom& random) {
  const auto header = encode_header({.type = DatagramType::kHello, .suite = Suite::kNoise});
  std::vector<std::byte> out;
  for (const std::span<const std::byte> piece : {text("tendon-1"), std::span<const std::byte>(header),
                                                 std::span<const std::byte>(id), std::span<const std::byte>(random)}) {
    out.insert(out.end(), piece.begin(), piece.end());
  }
  return out;
}

/// The sealed messages of the handshake contain this feature, so the choice of suite 2 is authenticated.
bool names_aes(const std::vector<std::string>& features) noexcept {
  return std::find(features.begin(), features.end(), kFeatureAesGcm) != features.end();
}

Hello offering(Hello hello, const Suites& suites) {
  if (contains(suites, Suite::kAesGcm)) hello.features.emplace_back(kFeatureAesGcm);
  return hello;
}

NoiseSplit split_of(Suite suite, const NoiseSplit& split) noexcept {
  return suite == Suite::kAesGcm ? split_of_suite_2(split) : split;
}

std::int64_t floor_divide(std::int64_t a, std::int64_t b) noexcept { return a / b - (a % b < 0 ? 1 : 0); }

}  // namespace

ClientHandshake::ClientHandshake(const Config& config, LocalTime now)
    : version_min_(config.hello.version_min),
      version_max_(config.hello.version_max),
      random_(config.random),
      resend_(config.resend),
      suites_(config.suites),
      body_(write_body(config.secret ? offering(config.hello, config.suites) : config.hello)),
      next_tick_(now) {
  constexpr std::size_t kMost = kMaxHandshakeBody - sizeof(KeyId) - kNoiseOverhead;
  if (body_.size() > kMost) {
    throw std::invalid_argument("the Hello has " + std::to_string(body_.size()) + " bytes of " + std::to_string(kMost) +
                                ": use fewer claims or shorter names");
  }
  if (!config.secret) return;
  expect_speakable(suites_);
  const KeyId id = key_id(config.secret->key);
  noise_.emplace(config.secret->key, config.secret->ephemeral, prologue(id, random_), body_);
  body_.assign(id.begin(), id.end());
  body_.insert(body_.end(), noise_->message().begin(), noise_->message().end());
}

void ClientHandshake::receive(LocalTime now, std::span<const std::byte> datagram) {
  if (outcome_) return;
  const Suite suite = noise_ ? Suite::kNoise : Suite::kPlain;
  if (const auto retry = decode_retry(datagram); retry && retry->suite == suite && retry->random == random_) {
    // Replies at once to the first cookie only, or a server that rejects cookies could cause an endless fast exchange.
    if (!cookie_) {
      due_ = true;
      next_tick_ = now;
    }
    cookie_ = retry->cookie;
  } else if (const auto answer = decode_answer(datagram);
             answer && answer->suite == suite && answer->random == random_) {
    settle(*answer);
  }
}

void ClientHandshake::settle(const AnswerDatagram& datagram) {
  std::optional<NoiseInitiator::Answer> opened;
  if (noise_) {
    opened = noise_->read(datagram.body);
    if (!opened) return;
  }
  auto answer = read_answer(opened ? std::span<const std::byte>(opened->payload) : datagram.body);
  if (!answer) return;
  if (auto* refused = std::get_if<Refused>(&*answer)) {
    outcome_ = std::move(*refused);
  } else {
    auto& welcome = std::get<Welcome>(*answer);
    if (welcome.version < version_min_ || welcome.version > version_max_) return;
    const bool aes = contains(suites_, Suite::kAesGcm) && names_aes(welcome.features);
    Accepted accepted{.connection_id = datagram.connection_id, .welcome = std::move(welcome), .keys = {}};
    if (opened) {
      const Suite suite = aes ? Suite::kAesGcm : Suite::kNoise;
      const NoiseSplit split = split_of(suite, opened->split);
      accepted.keys = {split.initiator_to_responder, split.responder_to_initiator, suite};
    }
    if (accepted.keys && !contains(suites_, accepted.keys->suite)) {
      outcome_ =
          Refused{Code::kUnsupported, "no common cipher suite: the server uses " + names_of({accepted.keys->suite}) +
                                          ", this client only accepts " + names_of(suites_)};
    } else {
      outcome_ = std::move(accepted);
    }
  }
  noise_.reset();  // erases the ephemeral key
  due_ = false;
  next_tick_ = LocalTime::max();
}

void ClientHandshake::tick(LocalTime now) {
  if (!outcome_ && now >= next_tick_) due_ = true;
}

std::size_t ClientHandshake::next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  if (!due_) return 0;
  due_ = false;
  next_tick_ = now + resend_;
  return encode({.suite = noise_ ? Suite::kNoise : Suite::kPlain,
                 .random = random_,
                 .cookie = cookie_.value_or(Cookie{}),
                 .body = body_},
                buffer);
}

namespace {

Seed ephemerals_of(const ServerHandshake::Config& config) {
  const Bytes32 first = crypto::hmac_sha256(config.secret, {text("tendon-ephemerals")});
  if (config.number == 0) return Seed(first);
  return Seed(crypto::hmac_sha256(first, {little_endian(std::uint64_t{config.number})}));
}

}  // namespace

ServerHandshake::Stats& ServerHandshake::Stats::operator+=(const Stats& more) noexcept {
  retries += more.retries;
  malformed += more.malformed;
  plain += more.plain;
  limited += more.limited;
  unknown_key += more.unknown_key;
  forged += more.forged;
  return *this;
}

ServerHandshake::ServerHandshake(const Config& config)
    : version_min_(config.version_min),
      version_max_(config.version_max),
      suites_(config.suites),
      key_lifetime_(config.key_lifetime),
      cookie_secret_(crypto::hmac_sha256(config.secret, {text("tendon-cookies")})),
      ephemerals_(ephemerals_of(config)),
      limit_(first_of<16>(crypto::hmac_sha256(config.secret, {text("tendon-hello-limit")}))) {
  if (config.key_lifetime <= Duration::zero())
    throw std::invalid_argument("server handshake: key_lifetime must be positive");
  if (config.version_min < 1 || config.version_min > config.version_max) {
    throw std::invalid_argument("server handshake: version_min must be at least 1 and at most version_max");
  }
  expect_speakable(suites_);
  for (const ClientKey& key : config.keys) {
    const auto [present, added] = keys_.emplace(key_id(key.key), key);
    if (!added) {
      throw std::invalid_argument("the clients \"" + present->second.name + "\" and \"" + key.name +
                                  "\" have the same key: expected a different key for each client");
    }
  }
}

Cookie ServerHandshake::cookie(std::int64_t key_number, const Address& from,
                               const ClientRandom& random) const noexcept {
  const Key key(crypto::hmac_sha256(
      cookie_secret_.bytes(), {text("tendon-cookie-key"), little_endian(static_cast<std::uint64_t>(key_number))}));
  return first_of<sizeof(Cookie)>(crypto::hmac_sha256(
      key.bytes(), {text("tendon-cookie"), std::as_bytes(std::span(from.ip)), little_endian(from.port), random}));
}

ServerHandshake::Reply ServerHandshake::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram,
                                                std::span<std::byte, kMaxDatagram> answer) {
  const auto hello = decode_hello(datagram);
  if (!hello) {
    ++stats_.malformed;
    return {};
  }
  if (hello->suite == Suite::kPlain && !is_loopback(from)) {
    ++stats_.plain;
    return {};
  }
  const std::int64_t key_number = floor_divide(now.time_since_epoch().count(), key_lifetime_.count());
  const Cookie fresh = cookie(key_number, from, hello->random);
  if (!crypto::equal(fresh, hello->cookie) &&
      !crypto::equal(cookie(key_number - 1, from, hello->random), hello->cookie)) {
    ++stats_.retries;
    const RetryDatagram retry{.suite = hello->suite, .random = hello->random, .cookie = fresh};
    return {.size = encode(retry, answer), .client = {}};
  }
  if (!limit_.admit(now, from)) {
    ++stats_.limited;
    return {};
  }
  Reply reply{
      .size = 0,
      .client = Client{.hello = {}, .random = hello->random, .version = 0, .suite = {}, .key = {}, .noise = {}}};
  if (!read(*hello, *reply.client)) reply.client.reset();
  return reply;
}

bool ServerHandshake::read(const HelloDatagram& datagram, Client& client) {
  std::span<const std::byte> body = datagram.body;
  if (datagram.suite == Suite::kNoise) {
    KeyId id;
    if (body.size() < id.size() + kNoiseOverhead) {
      ++stats_.malformed;
      return false;
    }
    std::copy_n(body.begin(), id.size(), id.begin());
    const auto found = keys_.find(id);
    if (found == keys_.end()) {
      ++stats_.unknown_key;
      return false;
    }
    client.key = &found->second;
    client.noise = NoiseResponder::read(client.key->key, prologue(id, client.random), body.subspan(id.size()));
    if (!client.noise) {
      ++stats_.forged;
      return false;
    }
    body = client.noise->payload();
  }
  auto hello = read_hello(body);
  if (!hello) {
    ++stats_.malformed;
    return false;
  }
  client.hello = std::move(*hello);
  const std::uint32_t highest = std::min(client.hello.version_max, version_max_);
  client.version = highest >= std::max(client.hello.version_min, version_min_) ? highest : 0;
  client.suite = suite_for(client);
  return true;
}

std::optional<Suite> ServerHandshake::suite_for(const Client& client) const noexcept {
  if (!client.noise) return Suite::kPlain;
  for (const NamedSuite& one : kSealedSuites) {
    const bool theirs = one.suite == Suite::kNoise || names_aes(client.hello.features);
    if (theirs && contains(suites_, one.suite)) return one.suite;
  }
  return std::nullopt;
}

ServerHandshake::Answered ServerHandshake::answer(const Client& client, std::uint32_t connection_id, const Answer& body,
                                                  std::span<std::byte, kMaxDatagram> buffer) {
  std::vector<std::byte> bytes = write_body(body);
  AnswerDatagram datagram{.suite = client.noise ? Suite::kNoise : Suite::kPlain,
                          .connection_id = connection_id,
                          .random = client.random,
                          .body = bytes};
  if (!client.noise) return {.size = encode(datagram, buffer), .keys = {}};
  const auto reply = client.noise->reply(ephemerals_.next(), bytes);
  if (!reply) {
    ++stats_.forged;
    return {};
  }
  datagram.body = reply->message;
  Answered answered{.size = encode(datagram, buffer), .keys = {}};
  if (client.suite) {
    const NoiseSplit split = split_of(*client.suite, reply->split);
    answered.keys = {split.responder_to_initiator, split.initiator_to_responder, *client.suite};
  }
  return answered;
}

ServerHandshake::Answered ServerHandshake::welcome(const Client& client, std::uint32_t connection_id,
                                                   const Welcome& welcome, std::span<std::byte, kMaxDatagram> buffer) {
  Welcome whole = welcome;
  // first, so that it is never truncated
  if (client.suite == Suite::kAesGcm) whole.features.emplace(whole.features.begin(), kFeatureAesGcm);
  return answer(client, connection_id, whole, buffer);
}

ServerHandshake::Answered ServerHandshake::refuse(const Client& client, const Refused& refused,
                                                  std::span<std::byte, kMaxDatagram> buffer) {
  return answer(client, 0, refused, buffer);
}

}  // namespace tendon
