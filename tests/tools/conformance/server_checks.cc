// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/server_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "tests/tools/conformance/conversation.h"
#include "tests/tools/conformance/golden.h"
#include "tests/tools/conformance/shared_checks.h"

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;

/// Whoever is silent for so long has nothing to say.
constexpr Duration kSilence = milliseconds(250);
/// A correct client's.
constexpr Duration kRepeat = milliseconds(100);

void say_bye(Conversation& talk) {
  pb::Datagram bye;
  bye.add_frames()->mutable_bye()->set_code(pb::CODE_OK);
  for (int i = 0; i < 3; ++i) talk.say(bye);
}

class ServerJudge {
 public:
  ServerJudge(Wire& wire, const Options& options, Report& report) : wire_(wire), options_(options), report_(report) {}
  void judge();

 private:
  struct Session {
    pb::Welcome welcome;
    Attempt attempt;
    Sixteen cookie;
    Conversation talk;
  };

  Bytes32 random32();
  Attempt attempt(const pb::Hello& hello) { return attempt(bytes_of(hello), options_.key); }
  Attempt attempt(Span hello, const std::optional<Key>& key);
  pb::Hello hello(pb::Role role) const;
  /// What comes back within `patience`.
  std::vector<Bytes> replies(int port, Duration patience);
  std::optional<Sixteen> cookie(int port, const Attempt& attempt);
  std::optional<Answered> ask(int port, const Attempt& attempt, const Sixteen& cookie);
  /// What is answered to these words, from a port of their own.
  std::optional<Answered> ask(const pb::Hello& words);
  std::optional<Session> enter(pb::Role role) { return enter(hello(role)); }
  std::optional<Session> enter(const pb::Hello& words);
  Conversation::Setup setup(int port, const Answered& answered) const;
  void expect_silence(std::string_view check, int port, const std::string& after);

  void check_retry();
  void check_bad_hellos();
  void check_bad_bodies();
  void check_cookie();
  void check_versions();
  void check_features();
  void check_keys();
  void check_half_open();
  void check_welcome(const pb::Hello& words, const Attempt& attempt, const Answered& answered);
  void check_answer_again(Session& session);
  void check_second_controller();
  void check_stray_data();
  void check_conversation(Session& session);
  void check_requests(Conversation& talk);
  std::optional<pb::ControlAck> request(Conversation& talk, const pb::Control& control);
  void check_observer(Conversation& controller);
  void check_roaming(Conversation& talk);
  void check_states(const Conversation& talk);
  void check_end();
  void check_hello_limit();
  pb::Hello claiming(const std::vector<pb::Claim>& claims) const;
  void check_claims();
  void check_from_outside(Conversation& observer, std::uint32_t id);
  void check_reports(const Conversation& talk);
  std::optional<Session> check_channels();
  void check_description(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);
  void check_lease(Conversation& talk, std::uint32_t& id);
  void check_deadband(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id);

  Wire& wire_;
  const Options& options_;
  Report& report_;
  bool channels_ = false;                       ///< it offers the feature
  std::optional<pb::DeviceDescription> about_;  ///< device 0
};

Bytes32 ServerJudge::random32() {
  Bytes32 out;
  for (std::size_t i = 0; i < out.size(); i += 8) {
    const std::uint64_t number = wire_.random();
    for (std::size_t j = 0; j < 8; ++j) out[i + j] = static_cast<std::byte>(number >> (8 * j));
  }
  return out;
}

Attempt ServerJudge::attempt(Span hello, const std::optional<Key>& key) {
  const Bytes32 bytes = random32();
  return {key, hello, sixteen(bytes, 0), Key(random32())};
}

pb::Hello ServerJudge::hello(pb::Role role) const {
  pb::Hello out;
  out.set_version_min(1);
  out.set_version_max(1);
  out.set_role(role);
  out.set_name("conformance");
  out.add_features("local-model");
  return out;
}

std::vector<Bytes> ServerJudge::replies(int port, Duration patience) {
  std::vector<Bytes> out;
  const LocalTime end = wire_.now() + patience;
  while (const auto arrival = wire_.receive(port, end)) out.push_back(arrival->datagram);
  return out;
}

std::optional<Sixteen> ServerJudge::cookie(int port, const Attempt& attempt) {
  const LocalTime end = wire_.now() + kPatience;
  while (wire_.now() < end) {
    wire_.send(port, attempt.hello({}));
    const LocalTime again = wire_.now() + kRepeat;
    while (const auto arrival = wire_.receive(port, again)) {
      const auto head = read_head(arrival->datagram);
      if (head && head->type == kRetryType && sixteen(arrival->datagram, 16) == attempt.random()) {
        return sixteen(arrival->datagram, 32);
      }
    }
  }
  return std::nullopt;
}

std::optional<Answered> ServerJudge::ask(int port, const Attempt& attempt, const Sixteen& cookie) {
  const LocalTime end = wire_.now() + kPatience;
  while (wire_.now() < end) {
    wire_.send(port, attempt.hello(cookie));
    const LocalTime again = wire_.now() + kRepeat;
    while (const auto arrival = wire_.receive(port, again)) {
      if (auto answered = attempt.read(arrival->datagram)) return answered;
    }
  }
  return std::nullopt;
}

Conversation::Setup ServerJudge::setup(int port, const Answered& answered) const {
  return {.port = port,
          .suite = options_.suite(),
          .connection_id = answered.head.connection_id,
          .send = answered.client_to_server,
          .receive = answered.server_to_client,
          .version = static_cast<std::uint8_t>(answered.body.welcome().version())};
}

std::optional<Answered> ServerJudge::ask(const pb::Hello& words) {
  const int port = wire_.open_port();
  const Attempt attempt = this->attempt(words);
  const auto its = cookie(port, attempt);
  return its ? ask(port, attempt, *its) : std::nullopt;
}

std::optional<ServerJudge::Session> ServerJudge::enter(const pb::Hello& words) {
  const int port = wire_.open_port();
  const Attempt attempt = this->attempt(words);
  const auto cookie = this->cookie(port, attempt);
  const auto answered = cookie ? ask(port, attempt, *cookie) : std::nullopt;
  report_.judge("welcome", answered && answered->body.has_welcome(),
                answered ? answered->body.ShortDebugString() : "no answer", "a Welcome");
  if (!answered || !answered->body.has_welcome()) return std::nullopt;
  check_welcome(words, attempt, *answered);
  Session session{answered->body.welcome(), attempt, *cookie, Conversation(wire_, report_, setup(port, *answered))};
  const std::size_t before = session.talk.heard().size();
  session.talk.say();
  const bool spoke = session.talk.listen_until(
      kPatience, [&] { return session.talk.heard().size() > before; }, false);
  report_.judge("first-data", spoke, "nothing came", "Data 0");
  session.talk.listen_until(kPatience, [&] {
    return session.talk.count_frames(0, [](const pb::Frame& frame) { return frame.has_state(); }) > 0;
  });
  return session;
}

void ServerJudge::expect_silence(std::string_view check, int port, const std::string& after) {
  const auto heard = replies(port, kSilence);
  report_.judge(check, heard.empty(), heard.empty() ? "" : hex(heard.front()), "silence after " + after);
}

// ---- Opening ----

void ServerJudge::check_retry() {
  const int port = wire_.open_port();
  const Sixteen random = sixteen(from_hex(golden::kRandom), 0);
  wire_.send(port, conformance::hello(options_.suite(), random, {}, from_hex(golden::kHello)));
  const auto heard = replies(port, kSilence);
  report_.judge("retry-once", heard.size() <= 1, std::to_string(heard.size()) + " datagrams for one Hello", "one");
  const Bytes wanted = retry(options_.suite(), random, {});
  const bool good = !heard.empty() && heard[0].size() == wanted.size() &&
                    std::equal(wanted.begin(), wanted.begin() + 32, heard[0].begin());
  report_.judge("retry", good, heard.empty() ? "nothing" : hex(heard[0], 64),
                hex(wanted, 64) + " with the cookie at its end");
}

void ServerJudge::check_bad_hellos() {
  const Attempt good = attempt(hello(pb::ROLE_OBSERVER));
  const Bytes bytes = good.hello({});
  const int port = wire_.open_port();
  const auto changed = [&](std::size_t at, std::uint8_t value) {
    Bytes out = bytes;
    out[at] = std::byte{value};
    return out;
  };
  // One after the other would take seconds; where all are met with silence, none was answered.
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
  for (const auto& [what, datagram] : all) wire_.send(port, datagram);
  if (replies(port, kSilence).empty()) {
    report_.judge("bad-hello-silence", true, {}, {});
  } else {
    for (const auto& [what, datagram] : all) {
      wire_.send(port, datagram);
      expect_silence("bad-hello-silence", port, what);
    }
  }
  report_.judge("bad-hello-silence", cookie(port, good).has_value(), "no Retry to the good Hello after them",
                "a Retry");
}

void ServerJudge::check_bad_bodies() {
  const int port = wire_.open_port();
  const auto changed = [&](auto change) {
    pb::Hello out = hello(pb::ROLE_OBSERVER);
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
      {"a name that is not UTF-8", bytes_of(hello(pb::ROLE_OBSERVER)) + bytes_of("\x22\x02\xc3\x28")},
      {"what is not protobuf", from_hex("ff ff ff")}};
  std::string named;
  std::vector<Bytes> hellos;
  for (const auto& [what, body] : all) {
    const Attempt bad = attempt(body, options_.key);
    if (const auto its = cookie(port, bad)) hellos.push_back(bad.hello(*its));
    named += (named.empty() ? "" : ", ") + what;
  }
  report_.judge("bad-body-silence", hellos.size() == all.size(), "no Retry",
                "a Retry before a cookie, whatever the body");
  for (const Bytes& hello : hellos) wire_.send(port, hello);
  std::vector<Bytes> heard = replies(port, kSilence);
  std::erase_if(heard, [](const Bytes& datagram) { return read_head(datagram)->type == kRetryType; });
  report_.judge("bad-body-silence", heard.empty(), heard.empty() ? "" : hex(heard.front()),
                "silence after Hellos with a cookie and " + named);
}

void ServerJudge::check_cookie() {
  const int port = wire_.open_port();
  const int other_port = wire_.open_port();
  const Attempt ours = attempt(hello(pb::ROLE_OBSERVER));
  const Attempt others = attempt(hello(pb::ROLE_OBSERVER));
  const auto good = cookie(port, ours);
  report_.judge("cookie-bound", good.has_value(), "no Retry", "a Retry");
  if (!good) return;
  Sixteen damaged = *good;
  damaged[15] ^= std::byte{1};
  const auto expect_retry = [&](int from, const Attempt& attempt, const Sixteen& its, const std::string& what) {
    wire_.send(from, attempt.hello(its));
    const auto heard = replies(from, kSilence);
    const bool retried = heard.size() == 1 && read_head(heard[0])->type == kRetryType;
    report_.judge("cookie-bound", retried, heard.empty() ? "nothing" : hex(heard[0]), "a Retry to " + what);
  };
  expect_retry(port, others, *good, "another client random with this cookie");
  expect_retry(other_port, ours, *good, "this cookie from another port");
  expect_retry(port, ours, damaged, "a cookie with one bit changed");
}

void ServerJudge::check_versions() {
  const auto offer = [&](std::uint32_t min, std::uint32_t max) {
    pb::Hello words = hello(pb::ROLE_OBSERVER);
    words.set_version_min(min);
    words.set_version_max(max);
    return ask(words);
  };
  const auto mismatch = offer(0x7FFFFFFE, 0x7FFFFFFF);
  const pb::Refused refused = mismatch ? mismatch->body.refused() : pb::Refused();
  const bool good = mismatch && mismatch->body.has_refused() && refused.code() == pb::CODE_UNSUPPORTED &&
                    refused.version_min() >= 1 && refused.version_min() <= refused.version_max() &&
                    refused.version_max() < 0x7FFFFFFE && refused.detail().size() <= 128 &&
                    mismatch->head == Head{.type = kAnswerType, .suite = options_.suite()};
  report_.judge("version-mismatch", good, mismatch ? hex(mismatch->datagram, 64) : "nothing",
                "Refused, CODE_UNSUPPORTED with the server's range, connection id 0");
  if (!good) return report_.not_applicable("version-highest", "the server's range is not known");

  const auto wide = offer(1, std::numeric_limits<std::uint32_t>::max());
  const std::uint32_t chosen = wide ? wide->body.welcome().version() : 0;
  report_.judge("version-highest", chosen == refused.version_max(), "version " + std::to_string(chosen),
                "version " + std::to_string(refused.version_max()) + ", the highest that both speak");
}

void ServerJudge::check_features() {
  pb::Hello words = hello(pb::ROLE_OBSERVER);
  words.clear_features();
  words.add_features("no-server-knows-this");
  const auto answered = ask(words);
  report_.judge("features", answered && answered->body.has_welcome() && answered->body.welcome().features().empty(),
                answered ? answered->body.ShortDebugString() : "no answer", "a Welcome without features");
}

void ServerJudge::check_keys() {
  if (!options_.key) {
    for (const std::string_view check : {"plain-denied", "unknown-key-silence"}) {
      report_.not_applicable(check, "this server was talked to without a key");
    }
    return;
  }
  const int port = wire_.open_port();
  if (!options_.loopback) {
    report_.not_applicable("plain-denied", "the server is on another machine");
  } else {
    const Attempt plain = attempt(bytes_of(hello(pb::ROLE_OBSERVER)), std::nullopt);
    const auto its = cookie(port, plain);
    const auto answered = its ? ask(port, plain, *its) : std::nullopt;
    report_.judge("plain-denied", answered && answered->body.refused().code() == pb::CODE_DENIED,
                  answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_DENIED");
  }

  const int other_port = wire_.open_port();
  const Bytes32 stranger = random32();
  const Attempt unknown = attempt(bytes_of(hello(pb::ROLE_OBSERVER)), Key(stranger));
  const Attempt known = attempt(hello(pb::ROLE_OBSERVER));
  const auto silent = [&](const Attempt& attempt, std::size_t damaged, const std::string& what) {
    const auto its = cookie(other_port, attempt);
    report_.judge("unknown-key-silence", its.has_value(), "nothing", "a Retry before a cookie, whatever the key");
    if (!its) return;
    Bytes bytes = attempt.hello(*its);
    if (damaged > 0) bytes[damaged] ^= std::byte{1};
    wire_.send(other_port, bytes);
    expect_silence("unknown-key-silence", other_port, what);
  };
  silent(unknown, 0, "a Hello of a key that nobody has");
  silent(known, 50 + 8 + 40, "a Noise message 1 with one bit changed");
}

void ServerJudge::check_half_open() {
  const int port = wire_.open_port();
  const Attempt attempt = this->attempt(hello(pb::ROLE_CONTROLLER));
  const auto its = cookie(port, attempt);
  const auto answered = its ? ask(port, attempt, *its) : std::nullopt;
  report_.judge("half-open", answered.has_value(), "no answer", "a Welcome");
  const auto heard = replies(port, kSilence);
  report_.judge("half-open", heard.empty(), heard.empty() ? "" : hex(heard.front()),
                "silence until the first good Data");
}

void ServerJudge::check_welcome(const pb::Hello& words, const Attempt& attempt, const Answered& answered) {
  const pb::Welcome& welcome = answered.body.welcome();
  const Head& head = answered.head;
  const Head wanted{.type = kAnswerType, .suite = options_.suite(), .connection_id = head.connection_id};
  const auto expect = [&](bool kept, const std::string& expected) {
    report_.judge("welcome", kept, hex(Span(answered.datagram).first(kHeadSize)) + ", " + welcome.ShortDebugString(),
                  expected);
  };
  expect(head == wanted && head.connection_id != 0, hex(write(wanted)) + ", with a connection id");
  expect(answered.datagram.size() < kLargest, "shorter than a Hello");
  expect(sixteen(answered.datagram, 16) == attempt.random(), "the client random of the Hello");
  expect(welcome.version() == 1, "a version within the client's range, 1");
  expect(welcome.role() == pb::ROLE_OBSERVER || welcome.role() == pb::ROLE_CONTROLLER, "a role");
  expect(welcome.device_name().size() <= 64 && welcome.server().size() <= 64, "names of at most 64 bytes");
  expect(welcome.max_force_n() >= 0 && welcome.max_force_n() <= 1e12, "max_force_n in 0 … 1e12");
  expect(welcome.position_resolution_m() >= 0 && welcome.position_resolution_m() <= 1e12,
         "position_resolution_m in 0 … 1e12");
  expect(welcome.loop_hz() >= 1 && welcome.loop_hz() <= 1'000'000, "loop_hz in 1 … 1e6");
  expect(welcome.timeout_ms() >= 1 && welcome.timeout_ms() <= 3'600'000, "timeout_ms in 1 … 3 600 000");
  const auto offered = [&](const std::string& feature) { return std::ranges::count(words.features(), feature) > 0; };
  expect(welcome.features_size() <= words.features_size() && std::ranges::all_of(welcome.features(), offered),
         "no feature that was not offered");
}

void ServerJudge::check_answer_again(Session& session) {
  Conversation& talk = session.talk;
  const auto answers = [&] {
    std::vector<Bytes> out;
    for (const Bytes& datagram : talk.strangers()) {
      if (session.attempt.read(datagram)) out.push_back(datagram);
    }
    return out;
  };
  wire_.send(talk.setup().port, session.attempt.hello(session.cookie));
  talk.listen_until(kPatience, [&] { return !answers().empty(); });
  const auto heard = answers();
  const auto again = heard.empty() ? std::nullopt : session.attempt.read(heard[0]);
  report_.judge("answer-again", again && again->head.connection_id == talk.setup().connection_id,
                again ? hex(again->datagram) : "nothing",
                "the Answer that was given before, with connection id " + std::to_string(talk.setup().connection_id));
  report_.judge("answer-again", talk.confirmed(talk.say()), "the session is gone", "the session goes on");
}

void ServerJudge::check_second_controller() {
  if (options_.key) return report_.not_applicable("one-controller", "the same key takes its own place: see replaced");
  const auto answered = ask(hello(pb::ROLE_CONTROLLER));
  report_.judge("one-controller", answered && answered->body.refused().code() == pb::CODE_BUSY,
                answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_BUSY");
}

void ServerJudge::check_stray_data() {
  const int port = wire_.open_port();
  for (const std::uint32_t id : {0U, 0xFFFFFFFEU}) {
    pb::Datagram body;
    body.set_tx_time_ns(1);
    wire_.send(port, write({.suite = options_.suite(), .connection_id = id}) + bytes_of(body));
  }
  expect_silence("stray-data-silence", port, "Data for nobody");
}

// ---- The conversation ----

void damage_force(std::vector<std::function<void(pb::Frame&)>>& out, void (*change)(pb::ForceCommand&)) {
  out.push_back([change](pb::Frame& frame) { change(*frame.mutable_force()); });
}

/// Sound as they are made.
pb::Contact& contact(pb::ForceCommand& force) {
  force.mutable_model()->add_stiffness_npm(0);
  pb::Contact& made = *force.mutable_model()->mutable_contact();
  made.mutable_normal()->set_x(-1);
  return made;
}
pb::ForceTable& table(pb::ForceCommand& force) {
  pb::ForceTable& made = *contact(force).mutable_table();
  made.set_step_m(0.001);
  made.mutable_force_n()->Resize(2, 0.0);
  return made;
}

void ServerJudge::check_conversation(Session& session) {
  Conversation& talk = session.talk;
  Evidence forces;
  std::uint64_t newest_tick = 0;
  std::size_t looked_at = 0;
  std::set<std::uint64_t> rendered;
  const auto look = [&] {
    talk.for_each_frame(looked_at, [&](const pb::Frame& frame) {
      if (!frame.has_state()) return;
      newest_tick = std::max(newest_tick, frame.state().tick());
      rendered.insert(frame.state().force_sequence());
    });
    looked_at = talk.heard().size();
  };
  forces.frame = [&](std::uint64_t sequence) {
    look();
    pb::Frame frame;
    pb::ForceCommand& force = *frame.mutable_force();
    force.set_sequence(sequence);
    force.set_based_on_tick(newest_tick);
    force.set_valid_for_us(200'000);
    return frame;
  };
  forces.shown = [&](std::uint64_t sequence) {
    look();
    return rendered.contains(sequence);
  };

  check_rekey(talk);
  const LocalTime rekeyed = talk.now();
  check_reordering(talk, forces);
  check_bad_datagrams(talk, forces);
  check_replay(talk);
  check_unknown(talk, forces);
  std::vector<std::function<void(pb::Frame&)>> damages;
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  damage_force(damages, [](pb::ForceCommand& force) { force.mutable_force_n()->set_y(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { force.mutable_force_n()->set_x(1.1e12); });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_valid_for_us(0); });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_valid_for_us(10'000'001); });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(1);
    force.mutable_model()->add_stiffness_npm(1);
  });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(std::numeric_limits<double>::infinity());
  });
  damage_force(damages, [](pb::ForceCommand& force) { force.set_error_n(-1); });
  damage_force(damages, [](pb::ForceCommand& force) {
    force.mutable_model()->add_stiffness_npm(1);
    force.mutable_model()->set_valid_radius_m(-1);
  });
  damage_force(damages, [](pb::ForceCommand& force) { contact(force).mutable_normal()->set_x(2); });
  damage_force(damages, [](pb::ForceCommand& force) { contact(force).set_gap_m(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_step_m(0); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_first_depth_m(kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).set_force_n(1, kNaN); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).mutable_force_n()->RemoveLast(); });
  damage_force(damages, [](pb::ForceCommand& force) { table(force).mutable_force_n()->Resize(17, 0.0); });
  check_out_of_bounds(talk, forces, damages);
  check_newest_wins(talk, forces);
  check_window(talk, forces);
  check_answer_again(session);
  check_second_controller();
  check_requests(talk);
  // More than a second after the others: there is one more report to come.
  pb::Datagram last_force;
  *last_force.add_frames() = forces.frame(forces.next++);
  talk.confirmed(talk.say(last_force));
  check_observer(talk);
  check_roaming(talk);
  check_old_key(talk, rekeyed);
  check_rekey_sent(talk, options_.long_checks);
  if (session.welcome.timeout_ms() > 10'000) {
    report_.not_applicable("timeout", "this server waits for " + std::to_string(session.welcome.timeout_ms()) + " ms");
  } else {
    check_timeout(talk, milliseconds(session.welcome.timeout_ms()));
    say_bye(talk);  // should it still be there
  }
  check_states(talk);
  check_reports(talk);
}

std::optional<pb::ControlAck> ServerJudge::request(Conversation& talk, const pb::Control& control) {
  const std::size_t before = talk.heard().size();
  std::optional<pb::ControlAck> found;
  pb::Datagram body;
  *body.add_frames()->mutable_control() = control;
  for (const LocalTime end = talk.now() + kPatience; !found && talk.now() < end;) {
    talk.say(body);
    talk.listen_until(kRepeat, [&] {
      talk.for_each_frame(before, [&](const pb::Frame& frame) {
        if (frame.has_control_ack() && frame.control_ack().id() == control.id()) found = frame.control_ack();
      });
      return found.has_value();
    });
  }
  return found;
}

void ServerJudge::check_requests(Conversation& talk) {
  const auto rate = [](std::uint32_t id, std::uint32_t hz) {
    pb::Control control;
    control.set_id(id);
    control.mutable_set_state_rate()->set_hz(hz);
    return control;
  };
  const auto say = [&](const pb::Control& control) {
    pb::Datagram body;
    *body.add_frames()->mutable_control() = control;
    return talk.say(body);
  };
  const auto acks = [&](std::size_t since, std::uint32_t id) {
    return talk.count_frames(
        since, [id](const pb::Frame& frame) { return frame.has_control_ack() && frame.control_ack().id() == id; });
  };
  const auto states_in = [&](Duration window) {
    talk.confirmed(talk.say());
    const std::size_t before = talk.heard().size();
    talk.listen(window);
    return talk.count_frames(before, [](const pb::Frame& frame) { return frame.has_state(); });
  };
  constexpr Duration kWindow = milliseconds(600);
  constexpr std::size_t kBetween = 120;  // states in the window: 30 at 50 Hz, 300 at 500 Hz

  // 2 before 1.
  std::size_t before = talk.heard().size();
  talk.confirmed(say(rate(2, 50)));
  talk.listen(milliseconds(120));
  report_.judge("request-order", acks(before, 2) == 0, "request 2 was answered before request 1 had come",
                "no answer to 2 before 1");
  const auto first = request(talk, rate(1, 500));
  const bool second = acks(before, 2) > 0 || request(talk, rate(2, 50)).has_value();
  report_.judge("request-order", first && second, "no answer", "answers to 1 and 2");
  report_.judge("request-order", states_in(kWindow) < kBetween,
                "more than " + std::to_string(kBetween) + " states in 600 ms",
                "about 30: request 2, 50 per second, was delivered last");

  // 1 again: an old answer, and nothing else.
  const auto again = request(talk, rate(1, 500));
  report_.judge("answer-kept", again && first && again->code() == first->code() && again->detail() == first->detail(),
                again ? again->ShortDebugString() : "nothing", first ? first->ShortDebugString() : "an answer");
  if (report_.failed("request-order")) {
    report_.not_applicable("request-once", "what it delivered last is not known: it does not keep the order");
  } else {
    report_.judge("request-once", states_in(kWindow) < kBetween,
                  "more than " + std::to_string(kBetween) + " states in 600 ms after request 1 was repeated",
                  "about 30: request 1, 500 per second, is delivered once");
  }

  pb::Control unknown;
  unknown.set_id(3);
  unknown.GetReflection()->MutableUnknownFields(&unknown)->AddLengthDelimited(1000, "");
  const auto refused = request(talk, unknown);
  report_.judge("request-unknown", refused && refused->code() == pb::CODE_UNSUPPORTED,
                refused ? refused->ShortDebugString() : "nothing", "CODE_UNSUPPORTED");

  // Sixteen in the wrong order, the first answers lost on the way to us; 7 is WIRE.md's golden one.
  before = talk.heard().size();
  for (std::uint32_t id = 19; id >= 4; --id) {
    pb::Datagram body;
    if (id == 7) {
      report_.judge("golden-frame", read(from_hex(golden::kControl), *body.add_frames()), "unreadable", "a frame");
    } else {
      *body.add_frames()->mutable_control() = rate(id, 50);
    }
    talk.say(body);
  }
  const auto all_of = [&](std::size_t since) {
    for (std::uint32_t id = 4; id <= 19; ++id) {
      if (acks(since, id) == 0) return false;
    }
    return true;
  };
  const bool all = talk.listen_until(kPatience, [&] { return all_of(before); });
  report_.judge("request-order", all, "not all of 4 … 19 were answered", "all, whatever order they came in");
  report_.judge("golden-frame", acks(before, 7) > 0, "no answer to " + std::string(golden::kControl), "an answer to 7");
  before = talk.heard().size();
  pb::Datagram sixteen_again;
  for (std::uint32_t id = 4; id <= 19; ++id) *sixteen_again.add_frames()->mutable_control() = rate(id, 50);
  talk.say(sixteen_again);
  report_.judge("answer-kept", talk.listen_until(kPatience, [&] { return all_of(before); }),
                "not all of 4 … 19 were answered again", "the last 16 answers are kept");

  before = talk.heard().size();
  say(rate(0, 50));
  talk.confirmed(say(rate(20 + 16, 50)));
  talk.listen(milliseconds(120));
  report_.judge("request-bounds", acks(before, 0) == 0 && acks(before, 36) == 0, "an answer to request 0 or 36",
                "dropped: 0 is no id, and 36 is more than 16 after 19, the last answered");

  // Nothing to say but once a second.
  report_.judge("request-order", request(talk, rate(20, 1)).has_value(), "no answer to 20", "an answer");
  check_keep_alive(talk);
  request(talk, rate(21, 1'000'000));
}

void ServerJudge::check_observer(Conversation& controller) {
  auto session = enter(pb::ROLE_OBSERVER);
  if (!session) return;
  Conversation& talk = session->talk;
  const auto is_state = [](const pb::Frame& frame) { return frame.has_state(); };
  std::uint64_t tick = 0;
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (frame.has_state()) tick = frame.state().tick();
  });
  report_.judge("observer-only-looks", tick > 0, "no state", "states");
  constexpr std::uint64_t kSequence = 999'983;
  pb::Datagram body;
  pb::ForceCommand& force = *body.add_frames()->mutable_force();
  force.set_sequence(kSequence);
  force.set_based_on_tick(tick);
  force.set_valid_for_us(1'000'000);
  talk.confirmed(talk.say(body));
  const std::size_t before = talk.heard().size();
  talk.listen_until(kPatience, [&] { return talk.count_frames(before, is_state) >= 20; });
  const std::size_t rendered = talk.count_frames(
      before, [](const pb::Frame& frame) { return frame.has_state() && frame.state().force_sequence() == kSequence; });
  report_.judge("observer-only-looks", rendered == 0, "an observer's force was rendered", "only the controller's");

  pb::Control rearm;
  rearm.set_id(1);
  rearm.mutable_rearm();
  const auto ack = request(talk, rearm);
  report_.judge("rearm-by-controller", ack && ack->code() == pb::CODE_DENIED, ack ? ack->ShortDebugString() : "nothing",
                "CODE_DENIED to an observer");
  pb::Control disarm;
  disarm.set_id(2);
  disarm.mutable_disarm();
  const auto refused = request(talk, disarm);
  // A server may be older than this request.
  const bool not_done = refused && (refused->code() == pb::CODE_DENIED || refused->code() == pb::CODE_UNSUPPORTED);
  report_.judge("disarm-by-controller", not_done, refused ? refused->ShortDebugString() : "nothing",
                "CODE_DENIED to an observer");
  check_from_outside(talk, 3);
  controller.say();
  say_bye(talk);
}

void ServerJudge::check_roaming(Conversation& talk) {
  const int before = talk.setup().port;
  const int elsewhere = wire_.open_port();
  const std::uint64_t late = talk.next_number();
  talk.skip_to(late + 1);
  if (options_.suite() == 0) {
    pb::Datagram body;
    talk.stamp(body);
    talk.move_to(elsewhere);
    talk.say_bad("roaming", late, talk.seal(talk.head(late), bytes_of(body)), "an older number, from another port");
    talk.move_to(before);
    const bool stays = talk.confirmed(talk.say());
    report_.judge("roaming", stays && replies(elsewhere, kSilence).empty(),
                  "it answers a plain datagram from elsewhere", "in suite 0 the address never changes");
    return;
  }
  talk.move_to(elsewhere);
  report_.judge("roaming", talk.confirmed(talk.say()), "nothing comes to the new address", "the session goes on there");
  // What comes late from the old address does not bring it back.
  talk.move_to(before);
  talk.attribute(late, "reordering");
  talk.say_at(late, {});
  talk.move_to(elsewhere);
  replies(before, milliseconds(60));
  const auto strays = replies(before, kSilence);
  report_.judge("roaming", strays.empty(), "a datagram with a lower packet number brought it back to the old address",
                "the address of the highest packet number");
  report_.judge("roaming", talk.confirmed(talk.say()), "nothing comes to the new address", "the session goes on there");
}

// ---- Devices and channels ----

pb::Claim claim(pb::Role role, const std::string& device = {}, const std::string& channel = {}) {
  pb::Claim out;
  out.set_role(role);
  out.set_device(device);
  out.set_channel(channel);
  return out;
}

pb::Hello ServerJudge::claiming(const std::vector<pb::Claim>& claims) const {
  const bool controls = std::ranges::count(claims, pb::ROLE_CONTROLLER, &pb::Claim::role) > 0;
  pb::Hello out = hello(controls ? pb::ROLE_CONTROLLER : pb::ROLE_OBSERVER);
  out.add_features("channels");
  *out.mutable_claims() = {claims.begin(), claims.end()};
  return out;
}

/// Whether these are the grants to an observer of device 0 who also controls its channel 0, which is free.
bool first_of_both(const pb::Welcome& welcome) {
  if (welcome.grants_size() != 2) return false;
  const pb::Grant& sees = welcome.grants(0);
  const pb::Grant& controls = welcome.grants(1);
  return sees.device() == 0 && sees.role() == pb::ROLE_OBSERVER && controls.device() == 0 && controls.channel() == 0 &&
         controls.role() == pb::ROLE_CONTROLLER;
}

/// Nobody controls the device, and nobody does afterwards: each Hello stays half-open.
void ServerJudge::check_claims() {
  const auto without = ask(claiming({}));
  const pb::Welcome welcome = without ? without->body.welcome() : pb::Welcome();
  channels_ = std::ranges::count(welcome.features(), "channels") > 0;
  if (!channels_) {
    for (const std::string_view check : {"claims-granted", "claim-refused", "describe", "describe-unknown",
                                         "lease-denied", "lease-kept", "deadband-bounds", "deadband", "link-report"}) {
      report_.not_applicable(check, "this server does not offer the feature \"channels\"");
    }
    return;
  }
  report_.judge("claims-granted", welcome.grants().empty(), welcome.ShortDebugString(),
                "no grants to a Hello without claims");

  pb::Hello lower_role = claiming({claim(pb::ROLE_CONTROLLER)});
  lower_role.set_role(pb::ROLE_OBSERVER);
  const std::vector<std::pair<std::string, pb::Hello>> all = {
      {"a device that is not there", claiming({claim(pb::ROLE_OBSERVER, "no-server-has-this")})},
      {"a channel that is not there", claiming({claim(pb::ROLE_CONTROLLER, "", "no-device-has-this")})},
      {"the same claim twice", claiming({claim(pb::ROLE_CONTROLLER), claim(pb::ROLE_CONTROLLER)})},
      {"a role that is not the highest of the claims'", lower_role}};
  for (const auto& [what, words] : all) {
    const auto answered = ask(words);
    report_.judge("claim-refused", answered && answered->body.refused().code() == pb::CODE_INVALID,
                  answered ? answered->body.ShortDebugString() : "nothing", "Refused, CODE_INVALID, to " + what);
  }
}

/// Of one who has not claimed the channel as a controller. `id`: its next request.
void ServerJudge::check_from_outside(Conversation& observer, std::uint32_t id) {
  if (!channels_) return;
  pb::Control take;
  take.set_id(id);
  take.mutable_take_lease();
  const auto denied = request(observer, take);
  report_.judge("lease-denied", denied && denied->code() == pb::CODE_DENIED,
                denied ? denied->ShortDebugString() : "nothing", "CODE_DENIED to an observer");

  pb::Control describe;
  describe.set_id(id + 1);
  describe.mutable_describe();
  const auto described = request(observer, describe);
  report_.judge("describe", described && described->code() == pb::CODE_OK && described->has_device(),
                described ? described->ShortDebugString() : "nothing",
                "CODE_OK with a description of device 0, to an observer too");
  if (described && described->has_device()) about_ = described->device();
}

/// A session that has claimed by name, and still goes on.
std::optional<ServerJudge::Session> ServerJudge::check_channels() {
  if (!channels_) return enter(pb::ROLE_CONTROLLER);
  const bool named = about_ && about_->channels_size() > 0;
  const std::string device = named ? about_->name() : "";
  const std::string channel = named ? about_->channels(0).name() : "";
  auto session = enter(claiming({claim(pb::ROLE_OBSERVER, device), claim(pb::ROLE_CONTROLLER, device, channel)}));
  if (!session) return session;
  report_.judge("claims-granted", first_of_both(session->welcome), session->welcome.ShortDebugString(),
                "two grants, first an observer's of device 0, then the controller's of its channel 0, which is free");
  std::uint32_t id = 0;
  check_description(session->talk, session->welcome, id);
  check_lease(session->talk, id);
  check_deadband(session->talk, session->welcome, id);
  return session;
}

/// Whether all that a description tells is within its bounds.
bool within_bounds(const pb::DeviceDescription& device) {
  const auto size = [](double value) { return value >= 0 && value <= 1e12; };
  const auto dof = [](std::uint32_t count) { return count >= 1 && count <= 6; };
  const pb::Vec3& low = device.workspace_min_m();
  const pb::Vec3& high = device.workspace_max_m();
  const bool box = device.has_workspace_min_m() == device.has_workspace_max_m() && !far(low) && !far(high) &&
                   low.x() <= high.x() && low.y() <= high.y() && low.z() <= high.z();
  const auto channel_good = [](const pb::ChannelDescription& channel) {
    return channel.name().size() <= 24 && (channel.rule() == 1 || channel.rule() == 2) &&
           channel.lease_ms() <= 3'600'000 && channel.holder().size() <= 24;
  };
  return device.name().size() <= 24 && device.model().size() <= 64 && dof(device.position_dof()) &&
         dof(device.force_dof()) && box && size(device.max_force_n()) && size(device.continuous_force_n()) &&
         size(device.max_stiffness_npm()) && size(device.position_resolution_m()) && device.loop_hz() >= 1 &&
         device.loop_hz() <= 1'000'000 && device.channels_size() >= 1 && device.channels_size() <= 8 &&
         std::ranges::all_of(device.channels(), channel_good);
}

void ServerJudge::check_description(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id) {
  const auto describe = [&](std::uint32_t device) {
    pb::Control control;
    control.set_id(++id);
    control.mutable_describe()->set_device(device);
    return request(talk, control).value_or(pb::ControlAck());
  };
  const pb::ControlAck first = describe(0);
  const pb::DeviceDescription& device = first.device();
  report_.judge("describe", first.code() == pb::CODE_OK && device.device() == 0 && within_bounds(device),
                first.ShortDebugString(), "CODE_OK with a description of device 0, values within bounds");
  const bool agrees = device.model() == welcome.device_name() && device.max_force_n() == welcome.max_force_n() &&
                      device.position_resolution_m() == welcome.position_resolution_m() &&
                      device.loop_hz() == welcome.loop_hz();
  // Of a Welcome that is wrong itself nothing follows.
  report_.judge("describe", agrees || report_.failed("welcome"), device.ShortDebugString(),
                "as in the Welcome: " + welcome.ShortDebugString());

  const pb::ControlAck last = describe(15);
  if (last.code() == pb::CODE_OK && last.device().device() == 15) {
    report_.not_applicable("describe-unknown", "this server has all 16 devices");
  } else {
    report_.judge("describe-unknown", last.code() == pb::CODE_INVALID, last.ShortDebugString(), "CODE_INVALID");
  }
}

void ServerJudge::check_lease(Conversation& talk, std::uint32_t& id) {
  const auto ok = [&](bool take, const std::string& to) {
    pb::Control control;
    control.set_id(++id);
    if (take) {
      control.mutable_take_lease();
    } else {
      control.mutable_give_lease();
    }
    const auto ack = request(talk, control);
    report_.judge("lease-kept", ack && ack->code() == pb::CODE_OK, ack ? ack->ShortDebugString() : "nothing",
                  "CODE_OK to " + to);
  };
  const auto holder_is = [&](const std::string& name, const std::string& after) {
    pb::Control control;
    control.set_id(++id);
    control.mutable_describe();
    const auto ack = request(talk, control);
    if (!ack || ack->device().channels().empty()) return;  // "describe" has failed
    const std::string& told = ack->device().channels(0).holder();
    report_.judge("lease-kept", told == name, "held by \"" + told + "\" " + after, "held by \"" + name + "\"");
  };
  ok(true, "take_lease of the holder");
  holder_is("conformance", "after take_lease");
  ok(false, "give_lease of the holder");
  holder_is("", "after give_lease");
  ok(false, "give_lease of one who claimed it, but holds it no more");
  ok(true, "take_lease of a free channel");
  holder_is("conformance", "after take_lease");
}

void ServerJudge::check_deadband(Conversation& talk, const pb::Welcome& welcome, std::uint32_t& id) {
  constexpr double kShare = 0.1;
  constexpr double kFloor = 0.1;
  constexpr Duration kLongest = milliseconds(20);
  const auto set = [&](double share, double floor, std::uint32_t silence_us) {
    pb::Control control;
    control.set_id(++id);
    pb::SetStateDeadband& band = *control.mutable_set_state_deadband();
    band.set_share(share);
    band.set_floor_mps(floor);
    band.set_max_silence_us(silence_us);
    return request(talk, control).value_or(pb::ControlAck());
  };
  const std::vector<std::pair<std::string, pb::ControlAck>> refused = {
      {"a share of 0.51", set(0.51, kFloor, 20'000)},
      {"a share of −0.1", set(-0.1, kFloor, 20'000)},
      {"a floor of 0.11 m/s", set(kShare, 0.11, 20'000)},
      {"999 µs of silence", set(kShare, kFloor, 999)},
      {"20 001 µs of silence", set(kShare, kFloor, 20'001)}};
  for (const auto& [what, ack] : refused) {
    report_.judge("deadband-bounds", ack.code() == pb::CODE_INVALID, ack.ShortDebugString(), "CODE_INVALID to " + what);
  }

  // Of the states heard from index `since` on: all, and those that the one before foretells. No clock of ours is in it.
  struct Count {
    std::size_t all = 0;
    std::size_t foretold = 0;
  };
  const auto count = [&](std::size_t since) {
    Count out;
    std::optional<pb::DeviceState> sent;
    talk.for_each_frame(since, [&](const pb::Frame& frame) {
      if (!frame.has_state()) return;
      const pb::DeviceState& state = frame.state();
      ++out.all;
      if (sent) {
        const pb::Vec3& v = sent->velocity_mps();
        const pb::Vec3& w = state.velocity_mps();
        const double changed = std::hypot(w.x() - v.x(), w.y() - v.y(), w.z() - v.z());
        const bool in_band = changed <= std::max(kShare * std::hypot(v.x(), v.y(), v.z()), kFloor);
        const bool in_time = state.sampled_ns() - sent->sampled_ns() < kLongest.count();
        out.foretold += in_band && in_time && state.mode() == sent->mode() ? 1 : 0;
      }
      sent = state;
    });
    return out;
  };
  const auto said = [](const Count& states) {
    return std::to_string(states.all) + " states, " + std::to_string(states.foretold) + " of them foretold";
  };

  const pb::ControlAck on = set(kShare, kFloor, 20'000);
  report_.judge("deadband", on.code() == pb::CODE_OK, on.ShortDebugString(), "CODE_OK to what is within bounds");
  std::size_t before = talk.heard().size();
  talk.listen(milliseconds(500));
  const Count with = count(before);
  // 25, or as many as there are steps.
  const std::size_t least = std::min<std::size_t>(12, welcome.loop_hz() / 4);
  report_.judge("deadband", with.all >= least, said(with) + ", in 500 ms",
                "one at least each 20 ms; at least " + std::to_string(least));
  // One that was replaced before it left is one that we do not see, so the next may look foretold.
  report_.judge("deadband", 10 * with.foretold <= with.all, said(with), "none that the one before foretells");

  const pb::ControlAck off = set(0, 0, 0);
  report_.judge("deadband", off.code() == pb::CODE_OK, off.ShortDebugString(), "CODE_OK to 0, every state is sent");
  before = talk.heard().size();
  constexpr std::size_t kMany = 20;
  if (welcome.loop_hz() < 100) return;  // the states are too far apart for any to be foretold
  const bool all = talk.listen_until(kPatience, [&] { return count(before).foretold >= kMany; });
  report_.judge("deadband", all, said(count(before)) + ", after it was switched off",
                "every state, also " + std::to_string(kMany) + " that the one before foretells");
}

void ServerJudge::check_reports(const Conversation& talk) {
  if (!channels_) return;
  const pb::LinkReport* previous = nullptr;
  std::size_t count = 0;
  std::uint64_t forces = 0;
  const auto size = [](std::uint64_t ns) { return ns <= std::uint64_t{1} << 60; };
  const auto time = [](std::int64_t ns) { return ns >= -(std::int64_t{1} << 60) && ns <= std::int64_t{1} << 60; };
  const auto delays = [&](const pb::Delays& of) { return time(of.median_ns()) && time(of.p99_ns()); };
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (!frame.has_report()) return;
    const pb::LinkReport& report = frame.report();
    const auto expect = [&](bool kept, const std::string& expected) {
      report_.judge("link-report", kept, report.ShortDebugString(), expected);
    };
    expect(size(report.span_ns()) && size(report.worst_late_ns()) && size(report.longest_gap_ns()) &&
               size(report.clock_error_ns()) && time(report.until_ns()) && time(report.clock_offset_ns()) &&
               !far(report.clock_drift_ppm()) && delays(report.round_trip()) && delays(report.to_server()) &&
               delays(report.to_client()) && report.words().size() <= 128,
           "values within bounds");
    expect(report.forces() <= report.received() && report.received() <= talk.next_number(),
           "no more forces than datagrams, and no more datagrams than were sent");
    expect(report.number() > (previous == nullptr ? 0 : previous->number()), "a higher number");
    if (previous != nullptr) {
      expect(report.until_ns() - previous->until_ns() >= 500'000'000, "once a second, never more often");
    }
    ++count;
    forces += report.forces();
    previous = &report;
  });
  report_.judge("link-report", count >= 2 && forces > 0,
                std::to_string(count) + " reports of " + std::to_string(forces) + " forces",
                "two at least: forces were sent in different seconds");
}

void ServerJudge::check_states(const Conversation& talk) {
  const pb::DeviceState* previous = nullptr;
  std::size_t count = 0;
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    report_.judge("states", !frame.has_force() && !frame.has_control(), frame.ShortDebugString(),
                  "only frames that a server sends");
    const bool diagnosed = frame.has_device_report() || frame.has_peer_report() || frame.state().has_force_wanted_n();
    report_.judge("diagnostics-unasked", !diagnosed, frame.ShortDebugString(),
                  "nothing of it: nobody named the feature");
    if (!frame.has_state()) return;
    const pb::DeviceState& state = frame.state();
    ++count;
    const bool goes_on =
        previous == nullptr || (state.tick() > previous->tick() && state.sampled_ns() >= previous->sampled_ns());
    report_.judge("states", goes_on, state.ShortDebugString(), "a higher tick, not sampled before the last");
    const double permitted = state.permitted_force_n();
    const bool good = !far(state.position_m()) && !far(state.velocity_mps()) && !far(state.force_applied_n()) &&
                      !far(state.energy_j()) && permitted >= 0 && (std::isinf(permitted) || permitted <= 1e12) &&
                      state.mode() >= 1 && state.mode() <= 6 && state.force_age_ns() <= std::uint64_t{1} << 60;
    report_.judge("states", good, state.ShortDebugString(), "values within bounds");
    previous = &state;
  });
  report_.judge("states", count > 0, "no state", "states");
}

void ServerJudge::check_end() {
  auto first = check_channels();
  if (!first) return;
  if (options_.suite() == 0) {
    report_.not_applicable("replaced", "suite 0 has no keys");
    report_.not_applicable("bye-thrice", "a server of suite 0 says Bye when it goes down");
    return check_bye_silence(first->talk);
  }
  auto second = enter(pb::ROLE_CONTROLLER);
  if (!second) return;
  check_byes(first->talk, 0);
  const std::size_t told = first->talk.count_frames(
      0, [](const pb::Frame& frame) { return frame.has_bye() && frame.bye().code() == pb::CODE_REPLACED; });
  report_.judge("replaced", told > 0, "no Bye with CODE_REPLACED to the one before", "a Bye, CODE_REPLACED");
  check_bye_silence(second->talk);
}

void ServerJudge::check_hello_limit() {
  const int port = wire_.open_port();
  pb::Hello words = hello(pb::ROLE_OBSERVER);
  words.set_version_min(0x7FFFFFFE);
  words.set_version_max(0x7FFFFFFF);
  const Attempt refused = attempt(words);
  const auto its = cookie(port, refused);
  report_.judge("hello-limit", its.has_value(), "no Retry", "a Retry");
  if (!its) return;
  const LocalTime begin = wire_.now();
  for (int i = 0; i < 80; ++i) wire_.send(port, refused.hello(*its));
  const auto heard = replies(port, kSilence);
  const auto answers =
      std::ranges::count_if(heard, [](const Bytes& datagram) { return read_head(datagram)->type == kAnswerType; });
  const double allowed = 41 + 20 * seconds(wire_.now() - begin);
  report_.judge("hello-limit", static_cast<double>(answers) <= allowed,
                std::to_string(answers) + " answers to 80 Hellos at once", "at most 40, and 20 for each second");
}

void ServerJudge::judge() {
  crypto::start();
  check_retry();
  if (report_.count(Outcome::kFailed) > 0) return;  // nobody is there, or nobody of ours
  check_bad_hellos();
  check_bad_bodies();
  check_cookie();
  check_versions();
  check_features();
  check_keys();
  check_half_open();
  check_stray_data();
  check_claims();
  if (auto session = enter(pb::ROLE_CONTROLLER)) check_conversation(*session);
  check_end();
  check_hello_limit();
}

}  // namespace

void judge_server(Wire& wire, const Options& options, Report& report) { ServerJudge(wire, options, report).judge(); }

}  // namespace tendon::conformance
