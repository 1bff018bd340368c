// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/opening.h"

#include <algorithm>
#include <string>

namespace tendon::conformance {
namespace {

constexpr std::size_t kLengthAt = 48;
constexpr std::size_t kBodyAt = 50;
constexpr std::size_t kAnswerAt = 32;

std::string out_of_bounds(const pb::Hello& hello) {
  if (hello.version_min() < 1 || hello.version_min() > hello.version_max()) return "the versions";
  if (hello.role() != pb::ROLE_OBSERVER && hello.role() != pb::ROLE_CONTROLLER) return "the role";
  if (hello.name().size() > 64) return "the name";
  const auto& features = hello.features();
  if (features.size() > 16 || std::ranges::any_of(features, [](const auto& name) { return name.size() > 32; })) {
    return "the features";
  }
  const auto& ways = hello.ways();
  if (ways.size() > 8 || std::ranges::any_of(ways, [](const auto& name) { return name.size() > 24; })) {
    return "the ways";
  }
  return {};
}

void take_keys(const NoiseSplit& split, Answered& out) {
  const bool aes = out.body.has_welcome() && names_aes(out.body.welcome());
  const auto key_of = [&](const Key& key) {
    return aes ? Key(crypto::hmac_sha256(key.bytes(), {bytes_of("tendon-suite-2"), split.handshake_hash})) : key;
  };
  out.suite = aes ? 2 : 1;
  out.client_to_server = key_of(split.initiator_to_responder);
  out.server_to_client = key_of(split.responder_to_initiator);
}

}  // namespace

Bytes key_id(const Key& key) {
  const Bytes32 hash = crypto::sha256({bytes_of("tendon-key-id"), key.bytes()});
  return {hash.begin(), hash.begin() + 8};
}

Bytes prologue(const Key& key, const Sixteen& random) {
  return bytes_of("tendon-1") + write({.type = kHelloType, .suite = 1}) + key_id(key) + random;
}

Attempt::Attempt(const std::optional<Key>& key, Span hello, const Sixteen& random, const Key& ephemeral)
    : suite_(key ? 1 : 0), random_(random), body_(hello.begin(), hello.end()) {
  if (!key) return;
  noise_.emplace(*key, ephemeral, prologue(*key, random), hello);
  body_ = key_id(*key) + noise_->message();
}

std::optional<Answered> Attempt::read(Span datagram) const {
  const auto head = read_head(datagram);
  if (!head || head->type != kAnswerType || datagram.size() < kAnswerAt || sixteen(datagram, 16) != random_) return {};
  Answered out{.head = *head, .datagram = {datagram.begin(), datagram.end()}, .body = {}};
  Bytes body(datagram.begin() + kAnswerAt, datagram.end());
  std::optional<NoiseSplit> split;
  if (noise_ && head->suite == 1) {
    auto opened = noise_->read(body);
    if (!opened) return {};
    body = std::move(opened->payload);
    split = opened->split;
  }
  if (!conformance::read(body, out.body)) return {};
  if (split) take_keys(*split, out);
  return out;
}

std::optional<Greeting> read_greeting(Span datagram, const Options& options, std::vector<Flaw>& flaws) {
  const auto expect = [&](std::string_view check, bool kept, std::string seen, std::string expected) {
    if (!kept) flaws.push_back({check, std::move(seen), std::move(expected)});
    return kept;
  };
  if (!expect("hello-size", datagram.size() == kLargest, std::to_string(datagram.size()) + " bytes", "1200 bytes")) {
    return {};
  }
  const Bytes head = write({.type = kHelloType, .suite = options.suite()});
  expect("hello-header", std::ranges::equal(datagram.first(kHeadSize), head), hex(datagram.first(kHeadSize)),
         hex(head));

  const std::size_t size =
      std::to_integer<std::size_t>(datagram[kLengthAt]) + 256 * std::to_integer<std::size_t>(datagram[kLengthAt + 1]);
  if (!expect("hello-body", size <= 1000, "n = " + std::to_string(size), "at most 1000")) return {};
  const Span padding = datagram.subspan(kBodyAt + size);
  expect("hello-padding", std::ranges::all_of(padding, [](std::byte byte) { return byte == std::byte{}; }),
         hex(padding), "zeros");

  Greeting greeting{.datagram = {datagram.begin(), datagram.end()},
                    .random = sixteen(datagram, 16),
                    .cookie = sixteen(datagram, 32),
                    .hello = {},
                    .noise = {}};
  Bytes body(datagram.begin() + kBodyAt, datagram.begin() + static_cast<std::ptrdiff_t>(kBodyAt + size));
  if (options.key) {
    const Bytes id = key_id(*options.key);
    const bool known = body.size() >= id.size() && std::equal(id.begin(), id.end(), body.begin());
    if (!expect("hello-body", known, hex(body), "the key id " + hex(id))) return {};
    greeting.noise =
        NoiseResponder::read(*options.key, prologue(*options.key, greeting.random), Span(body).subspan(id.size()));
    if (!expect("hello-body", greeting.noise.has_value(), hex(body), "a Noise message 1 of this key and prologue")) {
      return {};
    }
    body = greeting.noise->payload();
  }
  if (!expect("hello-body", read(body, greeting.hello), hex(body), "a message Hello")) return {};
  const std::string flaw = out_of_bounds(greeting.hello);
  expect("hello-body", flaw.empty(), greeting.hello.ShortDebugString(), flaw + " within bounds");
  return greeting;
}

Answered answer_to(const Greeting& greeting, std::uint32_t connection_id, const pb::Answer& body,
                   const Key& ephemeral) {
  Answered out{.head = {}, .datagram = {}, .body = body};
  Bytes bytes = bytes_of(body);
  if (greeting.noise) {
    auto reply = greeting.noise->reply(ephemeral, bytes);
    if (!reply) return out;
    bytes = std::move(reply->message);
    take_keys(reply->split, out);
  }
  out.datagram = answer(greeting.noise ? 1 : 0, connection_id, greeting.random, bytes);
  out.head = *read_head(out.datagram);
  return out;
}

pb::Answer welcome_to(const pb::Hello& hello, std::uint32_t version, bool aes) {
  pb::Answer out;
  pb::Welcome& welcome = *out.mutable_welcome();
  welcome.set_version(version);
  welcome.set_role(hello.role() == pb::ROLE_CONTROLLER ? pb::ROLE_CONTROLLER : pb::ROLE_OBSERVER);
  for (const auto& feature : hello.features()) {
    if (feature == "local-model" || (aes && feature == kAesGcm)) welcome.add_features(feature);
  }
  welcome.set_device_name("conformance");
  welcome.set_max_force_n(8);
  welcome.set_loop_hz(1000);
  welcome.set_timeout_ms(2000);
  welcome.set_server("tendon-conformance");
  return out;
}

}  // namespace tendon::conformance
