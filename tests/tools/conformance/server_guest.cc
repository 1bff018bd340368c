// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_guest.h"

#include <algorithm>

namespace tendon::conformance {
namespace {

void judge_welcome(const pb::Hello& words, const ServerGuest& guest, const Attempt& attempt, const Answered& answered) {
  const pb::Welcome& welcome = answered.body.welcome();
  const Head& head = answered.head;
  const Head wanted{.type = kAnswerType, .suite = guest.options.suite(), .connection_id = head.connection_id};
  const auto expect = [&](bool kept, const std::string& expected) {
    guest.report.judge("welcome", kept,
                       hex(Span(answered.datagram).first(kHeadSize)) + ", " + welcome.ShortDebugString(), expected);
  };
  expect(head == wanted && head.connection_id != 0, hex(write(wanted)) + ", with a connection id");
  expect(answered.datagram.size() < kLargest, "shorter than a Hello");
  expect(sixteen(answered.datagram, 16) == attempt.random(), "the client random of the Hello");
  expect(welcome.version() == 1, "a version within the range of the client, 1");
  expect(welcome.role() == pb::ROLE_OBSERVER || welcome.role() == pb::ROLE_CONTROLLER, "a role");
  expect(welcome.device_name().size() <= 64 && welcome.server().size() <= 64, "names of at most 64 bytes");
  expect(welcome.max_force_n() >= 0 && welcome.max_force_n() <= 1e12, "max_force_n in 0 … 1e12");
  expect(welcome.position_resolution_m() >= 0 && welcome.position_resolution_m() <= 1e12,
         "position_resolution_m in 0 … 1e12");
  expect(welcome.loop_hz() >= 1 && welcome.loop_hz() <= 1'000'000, "loop_hz in 1 … 1e6");
  expect(welcome.timeout_ms() >= 1 && welcome.timeout_ms() <= 3'600'000, "timeout_ms in 1 … 3 600 000");
  const auto offered = [&](const std::string& feature) { return std::ranges::count(words.features(), feature) > 0; };
  expect(welcome.features_size() <= words.features_size() && std::ranges::all_of(welcome.features(), offered),
         "only offered features");
}

}  // namespace

Bytes32 ServerGuest::random32() {
  Bytes32 out;
  for (std::size_t i = 0; i < out.size(); i += 8) {
    const std::uint64_t number = wire.random();
    for (std::size_t j = 0; j < 8; ++j) out[i + j] = static_cast<std::byte>(number >> (8 * j));
  }
  return out;
}

Attempt ServerGuest::attempt(Span hello, const std::optional<Key>& key) {
  const Bytes32 bytes = random32();
  return {key, hello, sixteen(bytes, 0), Key(random32())};
}

pb::Hello ServerGuest::hello(pb::Role role) const {
  pb::Hello out;
  out.set_version_min(1);
  out.set_version_max(1);
  out.set_role(role);
  out.set_name("conformance");
  out.add_features("local-model");
  if (options.aes) out.add_features(std::string(kAesGcm));
  return out;
}

std::vector<Bytes> ServerGuest::replies(int port, Duration patience) {
  std::vector<Bytes> out;
  const LocalTime end = wire.now() + patience;
  while (const auto arrival = wire.receive(port, end)) out.push_back(arrival->datagram);
  return out;
}

std::optional<Sixteen> ServerGuest::cookie(int port, const Attempt& attempt) {
  const LocalTime end = wire.now() + kPatience;
  while (wire.now() < end) {
    wire.send(port, attempt.hello({}));
    const LocalTime again = wire.now() + kRepeat;
    while (const auto arrival = wire.receive(port, again)) {
      const auto head = read_head(arrival->datagram);
      if (head && head->type == kRetryType && sixteen(arrival->datagram, 16) == attempt.random()) {
        return sixteen(arrival->datagram, 32);
      }
    }
  }
  return std::nullopt;
}

std::optional<Answered> ServerGuest::ask(int port, const Attempt& attempt, const Sixteen& cookie) {
  const LocalTime end = wire.now() + kPatience;
  while (wire.now() < end) {
    wire.send(port, attempt.hello(cookie));
    const LocalTime again = wire.now() + kRepeat;
    while (const auto arrival = wire.receive(port, again)) {
      if (auto answered = attempt.read(arrival->datagram)) return answered;
    }
  }
  return std::nullopt;
}

Conversation::Setup ServerGuest::setup(int port, const Answered& answered) const {
  return {.port = port,
          .suite = answered.suite,
          .connection_id = answered.head.connection_id,
          .send = answered.client_to_server,
          .receive = answered.server_to_client,
          .version = static_cast<std::uint8_t>(answered.body.welcome().version())};
}

std::optional<Answered> ServerGuest::ask(const pb::Hello& words) {
  const int port = wire.open_port();
  const Attempt attempt = this->attempt(words);
  const auto its = cookie(port, attempt);
  return its ? ask(port, attempt, *its) : std::nullopt;
}

std::optional<ServerGuest::Session> ServerGuest::enter(const pb::Hello& words) {
  const int port = wire.open_port();
  const Attempt attempt = this->attempt(words);
  const auto cookie = this->cookie(port, attempt);
  const auto answered = cookie ? ask(port, attempt, *cookie) : std::nullopt;
  report.judge("welcome", answered && answered->body.has_welcome(),
               answered ? answered->body.ShortDebugString() : "no answer", "a Welcome");
  if (!answered || !answered->body.has_welcome()) return std::nullopt;
  judge_welcome(words, *this, attempt, *answered);
  if (options.aes) {
    report.judge("suite-2", answered->suite == 2, answered->body.ShortDebugString(),
                 "a Welcome that names aes-256-gcm");
  } else {
    report.not_applicable("suite-2", "suite 2 is not selected (--suite 2)");
  }
  Session session{answered->body.welcome(), attempt, *cookie, Conversation(wire, report, setup(port, *answered))};
  const std::size_t before = session.talk.heard().size();
  session.talk.say();
  const bool spoke = session.talk.listen_until(
      kPatience, [&] { return session.talk.heard().size() > before; }, false);
  report.judge("first-data", spoke, "nothing", "Data 0");
  session.talk.listen_until(kPatience, [&] {
    return session.talk.count_frames(
               0, [](const pb::Frame& frame) { return frame.has_state() || frame.has_states(); }) > 0;
  });
  return session;
}

void ServerGuest::expect_silence(std::string_view check, int port, const std::string& after) {
  const auto heard = replies(port, kSilence);
  report.judge(check, heard.empty(), heard.empty() ? "" : hex(heard.front()), "silence after " + after);
}

}  // namespace tendon::conformance
