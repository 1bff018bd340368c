// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_opening_checks.h"

#include <algorithm>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/conformance/golden.h"

namespace tendon::conformance {

void check_retry(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  const Sixteen random = sixteen(from_hex(golden::kRandom), 0);
  guest.wire.send(port, conformance::hello(guest.options.suite(), random, {}, from_hex(golden::kHello)));
  const auto heard = guest.replies(port, kSilence);
  guest.report.judge("retry-once", heard.size() <= 1, std::to_string(heard.size()) + " datagrams for one Hello", "one");
  const Bytes wanted = retry(guest.options.suite(), random, {});
  const bool good = !heard.empty() && heard[0].size() == wanted.size() &&
                    std::equal(wanted.begin(), wanted.begin() + 32, heard[0].begin());
  guest.report.judge("retry", good, heard.empty() ? "nothing" : hex(heard[0], 64),
                     hex(wanted, 64) + " with the cookie at its end");
}

void check_bad_hellos(ServerGuest& guest) {
  const Attempt good = guest.attempt(guest.hello(pb::ROLE_OBSERVER));
  const Bytes bytes = good.hello({});
  const int port = guest.wire.open_port();
  const auto changed = [&](std::size_t at, std::uint8_t value) {
    Bytes out = bytes;
    out[at] = std::byte{value};
    return out;
  };
  // Sends all of them together, because one by one would take seconds. Silence means that none was answered.
  const std::vector<std::pair<std::string, Bytes>> all = {
      {"a Hello of 1199 bytes", Bytes(bytes.begin(), bytes.end() - 1)},
      {"a Hello of 1201 bytes", bytes + bytes_of(std::string_view("\0", 1))},
      {"a Hello with n = 1001",
       [&] {
         Bytes out = changed(48, 0xE9);
         out[49] = std::byte{3};
         return out;
       }()},
      {"a Hello with another magic byte", changed(0, 0x55)},
      {"a Hello of version 2", changed(1, 0x21)},
      {"type 0", changed(1, 0x10)},
      {"type 2", changed(1, 0x12)},
      {"type 4", changed(1, 0x14)},
      {"type 15", changed(1, 0x1F)},
      {"suite 2", changed(3, 2)},
      {"a Hello with a connection id", changed(4, 1)},
      {"a Hello with a packet number", changed(8, 1)},
      {"a Hello with padding that is not zero", changed(kLargest - 1, 1)},
      {"16 bytes", Bytes(bytes.begin(), bytes.begin() + 16)},
      {"one byte", Bytes(bytes.begin(), bytes.begin() + 1)}};
  for (const auto& [what, datagram] : all) guest.wire.send(port, datagram);
  if (guest.replies(port, kSilence).empty()) {
    guest.report.judge("bad-hello-silence", true, {}, {});
  } else {
    for (const auto& [what, datagram] : all) {
      guest.wire.send(port, datagram);
      guest.expect_silence("bad-hello-silence", port, what);
    }
  }
  guest.report.judge("bad-hello-silence", guest.cookie(port, good).has_value(),
                     "no Retry to the valid Hello after them", "a Retry");
}

void check_bad_bodies(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  const auto changed = [&](auto change) {
    pb::Hello out = guest.hello(pb::ROLE_OBSERVER);
    change(out);
    return bytes_of(out);
  };
  const std::vector<std::pair<std::string, Bytes>> all = {
      {"no role", changed([](pb::Hello& m) { m.clear_role(); })},
      {"role 3", changed([](pb::Hello& m) { m.set_role(static_cast<pb::Role>(3)); })},
      {"version_min 0", changed([](pb::Hello& m) { m.set_version_min(0); })},
      {"version_min above version_max", changed([](pb::Hello& m) { m.set_version_min(2); })},
      {"a name of 65 bytes", changed([](pb::Hello& m) { m.set_name(std::string(65, 'n')); })},
      {"a feature of 33 bytes", changed([](pb::Hello& m) { m.add_features(std::string(33, 'f')); })},
      {"17 features", changed([](pb::Hello& m) {
         for (int i = 0; i < 16; ++i) m.add_features("f");
       })},
      {"a name that is not UTF-8", bytes_of(guest.hello(pb::ROLE_OBSERVER)) + bytes_of("\x22\x02\xc3\x28")},
      {"data that is not protobuf", from_hex("ff ff ff")}};
  std::string named;
  std::vector<Bytes> hellos;
  for (const auto& [what, body] : all) {
    const Attempt bad = guest.attempt(body, guest.options.key);
    if (const auto its = guest.cookie(port, bad)) hellos.push_back(bad.hello(*its));
    named += (named.empty() ? "" : ", ") + what;
  }
  guest.report.judge("bad-body-silence", hellos.size() == all.size(), "no Retry",
                     "a Retry before a cookie, for any body");
  for (const Bytes& hello : hellos) guest.wire.send(port, hello);
  std::vector<Bytes> heard = guest.replies(port, kSilence);
  std::erase_if(heard, [](const Bytes& datagram) { return read_head(datagram)->type == kRetryType; });
  guest.report.judge("bad-body-silence", heard.empty(), heard.empty() ? "" : hex(heard.front()),
                     "silence after Hellos with a cookie and " + named);
}

void check_cookie(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  const int other_port = guest.wire.open_port();
  const Attempt ours = guest.attempt(guest.hello(pb::ROLE_OBSERVER));
  const Attempt others = guest.attempt(guest.hello(pb::ROLE_OBSERVER));
  const auto good = guest.cookie(port, ours);
  guest.report.judge("cookie-bound", good.has_value(), "no Retry", "a Retry");
  if (!good) return;
  Sixteen damaged = *good;
  damaged[15] ^= std::byte{1};
  const auto expect_retry = [&](int from, const Attempt& attempt, const Sixteen& its, const std::string& what) {
    guest.wire.send(from, attempt.hello(its));
    const auto heard = guest.replies(from, kSilence);
    const bool retried = heard.size() == 1 && read_head(heard[0])->type == kRetryType;
    guest.report.judge("cookie-bound", retried, heard.empty() ? "nothing" : hex(heard[0]), "a Retry to " + what);
  };
  expect_retry(port, others, *good, "another client random with this cookie");
  expect_retry(other_port, ours, *good, "this cookie from another port");
  expect_retry(port, ours, damaged, "a cookie with one bit changed");
}

void check_versions(ServerGuest& guest) {
  const auto offer = [&](std::uint32_t min, std::uint32_t max) {
    pb::Hello words = guest.hello(pb::ROLE_OBSERVER);
    words.set_version_min(min);
    words.set_version_max(max);
    return guest.ask(words);
  };
  const auto mismatch = offer(0x7FFFFFFE, 0x7FFFFFFF);
  const pb::Refused refused = mismatch ? mismatch->body.refused() : pb::Refused();
  const bool good = mismatch && mismatch->body.has_refused() && refused.code() == pb::CODE_UNSUPPORTED &&
                    refused.version_min() >= 1 && refused.version_min() <= refused.version_max() &&
                    refused.version_max() < 0x7FFFFFFE && refused.detail().size() <= 128 &&
                    mismatch->head == Head{.type = kAnswerType, .suite = guest.options.suite()};
  guest.report.judge("version-mismatch", good, mismatch ? hex(mismatch->datagram, 64) : "nothing",
                     "Refused, CODE_UNSUPPORTED with the range of the server, connection id 0");
  if (!good) return guest.report.not_applicable("version-highest", "the range of the server is unknown");

  const auto wide = offer(1, std::numeric_limits<std::uint32_t>::max());
  const std::uint32_t chosen = wide ? wide->body.welcome().version() : 0;
  guest.report.judge("version-highest", chosen == refused.version_max(), "version " + std::to_string(chosen),
                     "version " + std::to_string(refused.version_max()) + ", the highest common version");
}

void check_features(ServerGuest& guest) {
  pb::Hello words = guest.hello(pb::ROLE_OBSERVER);
  words.clear_features();
  words.add_features("no-server-knows-this");
  const auto answered = guest.ask(words);
  guest.report.judge("features",
                     answered && answered->body.has_welcome() && answered->body.welcome().features().empty(),
                     answered ? answered->body.ShortDebugString() : "no answer", "a Welcome without features");
}

void check_keys(ServerGuest& guest) {
  if (!guest.options.key) {
    for (const std::string_view check : {"plain-denied", "unknown-key-silence"}) {
      guest.report.not_applicable(check, "requires --key");
    }
    return;
  }
  const int port = guest.wire.open_port();
  if (!guest.options.loopback) {
    guest.report.not_applicable("plain-denied", "the server is on another machine");
  } else {
    const Attempt plain = guest.attempt(bytes_of(guest.hello(pb::ROLE_OBSERVER)), std::nullopt);
    const auto its = guest.cookie(port, plain);
    const auto answered = its ? guest.ask(port, plain, *its) : std::nullopt;
    guest.report.judge("plain-denied", answered && answered->body.refused().code() == pb::CODE_DENIED,
                       answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_DENIED");
  }

  const int other_port = guest.wire.open_port();
  const Bytes32 stranger = guest.random32();
  const Attempt unknown = guest.attempt(bytes_of(guest.hello(pb::ROLE_OBSERVER)), Key(stranger));
  const Attempt known = guest.attempt(guest.hello(pb::ROLE_OBSERVER));
  const auto silent = [&](const Attempt& attempt, std::size_t damaged, const std::string& what) {
    const auto its = guest.cookie(other_port, attempt);
    guest.report.judge("unknown-key-silence", its.has_value(), "nothing", "a Retry before a cookie, for any key");
    if (!its) return;
    Bytes bytes = attempt.hello(*its);
    if (damaged > 0) bytes[damaged] ^= std::byte{1};
    guest.wire.send(other_port, bytes);
    guest.expect_silence("unknown-key-silence", other_port, what);
  };
  silent(unknown, 0, "a Hello with an unknown key");
  silent(known, 50 + 8 + 40, "a Noise message 1 with one bit changed");
}

void check_half_open(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  const Attempt attempt = guest.attempt(guest.hello(pb::ROLE_CONTROLLER));
  const auto its = guest.cookie(port, attempt);
  const auto answered = its ? guest.ask(port, attempt, *its) : std::nullopt;
  guest.report.judge("half-open", answered.has_value(), "no answer", "a Welcome");
  const auto heard = guest.replies(port, kSilence);
  guest.report.judge("half-open", heard.empty(), heard.empty() ? "" : hex(heard.front()),
                     "silence until the first valid Data");
}

void check_stray_data(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  for (const std::uint32_t id : {0U, 0xFFFFFFFEU}) {
    pb::Datagram body;
    body.set_tx_time_ns(1);
    guest.wire.send(port, write({.suite = guest.options.suite(), .connection_id = id}) + bytes_of(body));
  }
  guest.expect_silence("stray-data-silence", port, "Data without a session");
}

void check_hello_limit(ServerGuest& guest) {
  const int port = guest.wire.open_port();
  pb::Hello words = guest.hello(pb::ROLE_OBSERVER);
  words.set_version_min(0x7FFFFFFE);
  words.set_version_max(0x7FFFFFFF);
  const Attempt refused = guest.attempt(words);
  const auto its = guest.cookie(port, refused);
  guest.report.judge("hello-limit", its.has_value(), "no Retry", "a Retry");
  if (!its) return;
  const LocalTime begin = guest.wire.now();
  for (int i = 0; i < 80; ++i) guest.wire.send(port, refused.hello(*its));
  const auto heard = guest.replies(port, kSilence);
  const auto answers =
      std::ranges::count_if(heard, [](const Bytes& datagram) { return read_head(datagram)->type == kAnswerType; });
  const double allowed = 41 + 20 * seconds(guest.wire.now() - begin);
  guest.report.judge("hello-limit", static_cast<double>(answers) <= allowed,
                     std::to_string(answers) + " answers to 80 Hellos at once", "at most 40, and 20 per second");
}

void check_answer_again(ServerGuest& guest, ServerGuest::Session& session) {
  Conversation& talk = session.talk;
  const auto answers = [&] {
    std::vector<Bytes> out;
    for (const Bytes& datagram : talk.strangers()) {
      if (session.attempt.read(datagram)) out.push_back(datagram);
    }
    return out;
  };
  guest.wire.send(talk.setup().port, session.attempt.hello(session.cookie));
  talk.listen_until(kPatience, [&] { return !answers().empty(); });
  const auto heard = answers();
  const auto again = heard.empty() ? std::nullopt : session.attempt.read(heard[0]);
  guest.report.judge("answer-again", again && again->head.connection_id == talk.setup().connection_id,
                     again ? hex(again->datagram) : "nothing",
                     "the previous Answer, with connection id " + std::to_string(talk.setup().connection_id));
  guest.report.judge("answer-again", talk.confirmed(talk.say()), "the session has ended", "the session continues");
}

void check_second_controller(ServerGuest& guest) {
  if (guest.options.key)
    return guest.report.not_applicable("one-controller", "the same key replaces its session, see the check replaced");
  const auto answered = guest.ask(guest.hello(pb::ROLE_CONTROLLER));
  guest.report.judge("one-controller", answered && answered->body.refused().code() == pb::CODE_BUSY,
                     answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_BUSY");
}

}  // namespace tendon::conformance
