// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/client_checks.h"

#include <algorithm>
#include <limits>
#include <map>
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

/// Allows for the start of an interpreter.
constexpr Duration kStart = std::chrono::seconds(30);
/// Time for a client to send a new Hello after the end of a session.
constexpr Duration kComeBack = milliseconds(1500);
/// The timeout of SESSION.md.
constexpr Duration kTimeout = std::chrono::seconds(2);

class ClientJudge {
 public:
  ClientJudge(Wire& wire, Guest& guest, const Options& options, Report& report)
      : wire_(wire), guest_(guest), options_(options), report_(report), port_(wire.open_port()) {}
  void judge();

 private:
  struct Session {
    pb::Hello hello;
    Conversation talk;
  };

  Sixteen random16();
  /// Returns the next Hello after judging it. Keeps Data received meanwhile in strays_.
  std::optional<Greeting> next_hello(Duration patience);
  std::vector<Greeting> hellos(Duration window);
  void start();
  std::optional<Greeting> first_hello();
  bool check_hellos();
  std::optional<Greeting> invite();
  void check_bad_answers();
  std::optional<Session> welcome();
  std::optional<Session> open();
  void check_conversation(Session& session);
  Evidence evidence_of(Session& session);
  void check_requests(Conversation& talk);
  void check_forces(const Session& session, const std::set<std::uint64_t>& ticks);
  void check_refused();
  bool comes_back();

  Wire& wire_;
  Guest& guest_;
  const Options& options_;
  Report& report_;
  int port_;
  std::uint32_t next_id_ = 0x11223344;
  std::set<Sixteen> issued_;
  std::map<Sixteen, Bytes> attempts_;  ///< client random → Hello without its cookie
  std::vector<Bytes> strays_;          ///< Data
  std::set<std::uint64_t> ticks_;      ///< of sent states
};

Sixteen ClientJudge::random16() {
  Sixteen out{};
  const std::uint64_t numbers[2] = {wire_.random(), wire_.random()};
  for (std::size_t i = 0; i < out.size(); ++i) out[i] = static_cast<std::byte>(numbers[i / 8] >> (8 * (i % 8)));
  return out;
}

std::optional<Greeting> ClientJudge::next_hello(Duration patience) {
  const LocalTime end = wire_.now() + patience;
  while (const auto arrival = wire_.receive(port_, end)) {
    const auto head = read_head(arrival->datagram);
    if (head && head->type == kDataType) {
      strays_.push_back(arrival->datagram);
      continue;
    }
    std::vector<Flaw> flaws;
    auto greeting = read_greeting(arrival->datagram, options_, flaws);
    for (const std::string_view check : {"hello-size", "hello-header", "hello-padding", "hello-body"}) {
      const auto flaw = std::ranges::find(flaws, check, &Flaw::check);
      const bool kept = flaw == flaws.end();
      report_.judge(check, kept, kept ? "" : flaw->seen, kept ? "" : flaw->expected);
    }
    if (!greeting) continue;
    Bytes without_cookie = greeting->datagram;
    std::fill_n(without_cookie.begin() + 32, 16, std::byte{});
    const auto [known, is_new] = attempts_.try_emplace(greeting->random, without_cookie);
    report_.judge("hello-unchanged", known->second == without_cookie, hex(without_cookie, 160),
                  hex(known->second, 160));
    if (is_new) {
      report_.judge("hello-first-cookie", greeting->cookie == Sixteen{}, hex(greeting->cookie), hex(Sixteen{}));
    }
    return greeting;
  }
  return std::nullopt;
}

std::vector<Greeting> ClientJudge::hellos(Duration window) {
  std::vector<Greeting> out;
  const LocalTime end = wire_.now() + window;
  while (auto greeting = next_hello(end - wire_.now())) out.push_back(std::move(*greeting));
  return out;
}

void ClientJudge::start() {
  guest_.kill();
  while (wire_.receive(port_, wire_.now())) {
  }
  guest_.start();
}

std::optional<Greeting> ClientJudge::first_hello() {
  for (const LocalTime end = wire_.now() + kStart; wire_.now() < end && guest_.running();) {
    if (auto greeting = next_hello(milliseconds(200))) return greeting;
  }
  return std::nullopt;
}

bool ClientJudge::check_hellos() {
  const auto first = first_hello();
  if (!first) {
    report_.judge("hello-size", false, guest_.running() ? "no Hello within 30 s" : "the client ended without a Hello",
                  "a Hello");
    return false;
  }
  const LocalTime begin = wire_.now();
  int same = 0;
  while (same < 5 && wire_.now() - begin < kPatience) {
    const auto next = next_hello(begin + kPatience - wire_.now());
    if (next && next->random != first->random) break;
    same += next ? 1 : 0;
  }
  const double elapsed_ms = 1e3 * seconds(wire_.now() - begin);
  report_.judge("hello-repeated", same == 5 && elapsed_ms >= 250,
                std::to_string(same) + " repetitions in " + std::to_string(elapsed_ms) + " ms",
                "5 in 500 ms, one every 100 ms");
  Sixteen foreign = first->random;
  foreign[0] ^= std::byte{1};
  const Sixteen foreign_cookie = random16();
  wire_.send(port_, retry(options_.suite(), foreign, foreign_cookie));
  for (const Greeting& next : hellos(milliseconds(220))) {
    report_.judge("foreign-retry", next.cookie != foreign_cookie, hex(next.cookie),
                  "no cookie, because the Retry was for another random");
  }

  // Sends the correct Retry, followed by too many others.
  const auto invited = invite();
  report_.judge("cookie-returned", invited.has_value(), "no Hello with the cookie", "the cookie of the Retry");
  if (!invited) return false;
  std::size_t count = 0;
  const LocalTime flood = wire_.now();
  Sixteen last{};
  for (int i = 0; i < 20; ++i) {
    last = random16();
    issued_.insert(last);
    wire_.send(port_, retry(options_.suite(), invited->random, last));
    count += hellos(milliseconds(10)).size();
  }
  const double flood_ms = 1e3 * seconds(wire_.now() - flood);
  report_.judge("retry-no-ping-pong", static_cast<double>(count) <= 4 + flood_ms / 80,
                std::to_string(count) + " Hellos while 20 Retries were received in " + std::to_string(flood_ms) + " ms",
                "one every 100 ms: only the first Retry is answered immediately");
  bool used = false;
  bool same_attempt = true;
  while (same_attempt && !used) {
    const auto next = next_hello(kPatience);
    if (!next) break;
    same_attempt = next->random == invited->random;
    used = next->cookie == last;
  }
  report_.judge("retry-no-ping-pong", used || !same_attempt, "no Hello with the newest cookie", hex(last));
  return true;
}

std::optional<Greeting> ClientJudge::invite() {
  for (const LocalTime end = wire_.now() + kStart; wire_.now() < end && guest_.running();) {
    auto greeting = first_hello();
    if (!greeting || issued_.contains(greeting->cookie)) return greeting;
    const Sixteen cookie = random16();
    issued_.insert(cookie);
    wire_.send(port_, retry(options_.suite(), greeting->random, cookie));
    const Sixteen random = greeting->random;
    const LocalTime answered = wire_.now() + std::chrono::seconds(2);
    while ((greeting = next_hello(answered - wire_.now()))) {
      if (greeting->cookie == cookie) return greeting;
      if (greeting->random != random) break;
    }
  }
  return std::nullopt;
}

/// Sends Answers that must be ignored. Each has its own connection id, so that Data would show which one was accepted.
void ClientJudge::check_bad_answers() {
  const auto greeting = invite();
  if (!greeting) return;
  std::map<std::uint32_t, std::string_view> whose;
  const auto say = [&](std::string_view check, const Bytes& datagram, std::uint32_t id) {
    whose[id] = check;
    wire_.send(port_, datagram);
  };
  const auto good = [&](const pb::Answer& body, std::uint32_t id) {
    return answer_to(*greeting, id, body, Key(Bytes32{random16()[0], random16()[1], std::byte{7}})).datagram;
  };
  const pb::Answer yes = welcome_to(greeting->hello, 1);
  const auto changed = [&](auto change) {
    pb::Answer out = yes;
    change(*out.mutable_welcome());
    return out;
  };

  Bytes foreign = good(yes, 101);
  foreign[16] ^= std::byte{1};
  say("foreign-answer", foreign, 101);
  const std::uint32_t max = greeting->hello.version_max();
  if (max == std::numeric_limits<std::uint32_t>::max()) {
    report_.not_applicable("version-not-offered", "the client offers all versions");
  } else {
    say("version-not-offered", good(changed([&](pb::Welcome& m) { m.set_version(max + 1); }), 102), 102);
  }
  say("bad-answer", good(changed([](pb::Welcome& m) { m.set_loop_hz(0); }), 103), 103);
  say("bad-answer", good(changed([](pb::Welcome& m) { m.set_timeout_ms(0); }), 104), 104);
  say("bad-answer", good(changed([](pb::Welcome& m) { m.clear_role(); }), 105), 105);
  say("bad-answer", good(changed([](pb::Welcome& m) { m.set_max_force_n(-1); }), 106), 106);
  say("bad-answer", good(pb::Answer(), 107), 107);
  say("bad-answer", answer(options_.suite(), 108, greeting->random, from_hex("ff ff ff")), 108);
  if (options_.key) {
    Bytes damaged = good(yes, 109);
    damaged.back() ^= std::byte{1};
    say("bad-answer", damaged, 109);
    say("plain-answer", answer(0, 110, greeting->random, bytes_of(yes)), 110);
  } else {
    report_.not_applicable("plain-answer", "this client has no key");
  }

  strays_.clear();
  const bool goes_on = !hellos(milliseconds(400)).empty() || next_hello(kPatience).has_value();
  for (const auto& [id, check] : whose) {
    report_.judge(check, goes_on, "no more Hellos", "wrong Answers are ignored, and the Hello is repeated");
  }
  for (const Bytes& data : strays_) {
    const auto believed = whose.find(read_head(data)->connection_id);
    if (believed != whose.end())
      report_.judge(believed->second, false, hex(data), "no Data, because this Answer must be ignored");
  }
}

std::optional<ClientJudge::Session> ClientJudge::welcome() {
  const auto greeting = invite();
  if (!greeting) return std::nullopt;
  const std::uint32_t id = next_id_++;
  Bytes32 ephemeral{};
  std::ranges::copy(random16(), ephemeral.begin());
  std::ranges::copy(random16(), ephemeral.begin() + 16);
  const Answered answered = answer_to(*greeting, id, welcome_to(greeting->hello, 1, options_.aes), Key(ephemeral));
  if (options_.aes) {
    report_.judge("suite-2", answered.suite == 2, greeting->hello.ShortDebugString(),
                  "a Hello that offers aes-256-gcm");
  } else {
    report_.not_applicable("suite-2", "suite 2 is not selected (--suite 2)");
  }
  wire_.send(port_, answered.datagram);
  return Session{greeting->hello, Conversation(wire_, report_,
                                               {.port = port_,
                                                .suite = answered.suite,
                                                .connection_id = id,
                                                .send = answered.server_to_client,
                                                .receive = answered.client_to_server})};
}

std::optional<ClientJudge::Session> ClientJudge::open() {
  auto session = welcome();
  const bool spoke = session && session->talk.listen_until(
                                    kPatience, [&] { return !session->talk.heard().empty(); }, false);
  report_.judge("first-data", spoke, "nothing after the Welcome", "Data 0");
  if (!spoke) return std::nullopt;
  session->talk.say();
  return session;
}

Evidence ClientJudge::evidence_of(Session& session) {
  Evidence out;
  out.any = session.hello.role() == pb::ROLE_CONTROLLER;
  out.frame = [this](std::uint64_t tick) {
    ticks_.insert(tick);
    pb::Frame frame;
    pb::DeviceState& state = *frame.mutable_state();
    state.set_tick(tick);
    state.set_sampled_ns(wire_.now().time_since_epoch().count());
    state.mutable_position_m()->set_x(1e-5 * static_cast<double>(tick % 1000));
    state.set_permitted_force_n(8);
    state.set_mode(pb::MODE_ACTIVE);
    return frame;
  };
  out.shown = [&talk = session.talk](std::uint64_t tick) {
    return talk.count_frames(0, [tick](const pb::Frame& frame) {
      return frame.has_force() && frame.force().based_on_tick() == tick;
    }) > 0;
  };
  return out;
}

void ClientJudge::check_conversation(Session& session) {
  Conversation& talk = session.talk;
  Evidence states = evidence_of(session);

  pb::Datagram golden;
  report_.judge("golden-frame", read(from_hex(golden::kState), *golden.add_frames()), "unreadable", "a frame");
  ticks_.insert(1000);
  const bool lives = talk.confirmed(talk.say(golden));
  report_.judge("golden-frame", lives, "no echo of golden.md's state", "an echo");
  report_.judge("golden-frame", !states.any || talk.listen_until(kPatience, [&] { return states.shown(1000); }),
                "no force that answers tick 1000", "golden.md's state is read");
  states.next = 1001;

  check_rekey(talk);
  const LocalTime rekeyed = talk.now();
  check_reordering(talk, states);
  check_bad_datagrams(talk, states);
  check_replay(talk);
  check_unknown(talk, states);
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  const auto damage = [](void (*change)(pb::DeviceState&)) {
    return [change](pb::Frame& frame) { change(*frame.mutable_state()); };
  };
  check_out_of_bounds(talk, states,
                      {damage([](pb::DeviceState& state) { state.mutable_position_m()->set_z(kNaN); }),
                       damage([](pb::DeviceState& state) { state.mutable_velocity_mps()->set_x(-1.1e12); }),
                       damage([](pb::DeviceState& state) { state.clear_mode(); }),
                       damage([](pb::DeviceState& state) { state.set_mode(static_cast<pb::Mode>(7)); }),
                       damage([](pb::DeviceState& state) { state.set_permitted_force_n(-1); }),
                       damage([](pb::DeviceState& state) { state.set_energy_j(kNaN); })});
  check_newest_wins(talk, states);
  check_window(talk, states);
  check_requests(talk);
  if (std::ranges::count(session.hello.features(), "channels") > 0) {
    check_bad_requests(talk, 1);
  } else {
    report_.not_applicable("request-invalid", "this client has no feature with requests of a server");
  }
  check_keep_alive(talk);
  check_old_key(talk, rekeyed);
  check_rekey_sent(talk, options_);
  const std::size_t before = talk.heard().size();
  guest_.ask_to_end();
  check_byes(talk, before);
  check_forces(session, ticks_);
}

void ClientJudge::check_requests(Conversation& talk) {
  std::map<std::uint32_t, std::size_t> times;
  std::string first_words;
  talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (frame.has_control()) ++times[frame.control().id()];
  });
  if (times.empty()) {
    for (const std::string_view check :
         {"request-numbers", "request-repeated", "request-resend-rate", "request-stops"}) {
      report_.not_applicable(check, "this client sends no requests");
    }
    return;
  }
  const std::size_t asked = times.size();
  report_.judge("request-numbers", times.begin()->first == 1 && times.rbegin()->first == asked && asked <= 16,
                std::to_string(asked) + " requests, from " + std::to_string(times.begin()->first) + " to " +
                    std::to_string(times.rbegin()->first),
                "1, 2, 3 …, at most 16");
  for (const auto& [id, count] : times) {
    report_.judge("request-repeated", count >= 2, "request " + std::to_string(id) + " was sent once",
                  "repeated until it is answered");
    // Resend intervals of 20, 40, 80 … 640 ms, then 1 s.
    const double open_s = seconds(talk.now() - talk.heard().front().at);
    const double most = 2 * (6 + open_s) + 2;
    report_.judge("request-resend-rate", static_cast<double>(count) <= most,
                  "request " + std::to_string(id) + " was sent " + std::to_string(count) + " times in " +
                      std::to_string(open_s) + " s",
                  "6 times in the first 1.3 s, then once a second");
  }
  pb::Datagram body;
  for (const auto& [id, count] : times) {
    pb::ControlAck& ack = *body.add_frames()->mutable_control_ack();
    ack.set_id(id);
    ack.set_code(pb::CODE_OK);
  }
  talk.confirmed(talk.say(body));
  const std::size_t before = talk.heard().size();
  talk.listen(milliseconds(1200));
  const std::size_t after = talk.count_frames(
      before, [&](const pb::Frame& frame) { return frame.has_control() && times.contains(frame.control().id()); });
  report_.judge("request-stops", after == 0, std::to_string(after) + " repetitions after the answer arrived", "none");
}

void ClientJudge::check_forces(const Session& session, const std::set<std::uint64_t>& ticks) {
  std::size_t count = 0;
  std::uint64_t sequence = 0;
  std::uint64_t tick = 0;
  const bool observer = session.hello.role() == pb::ROLE_OBSERVER;
  session.talk.for_each_frame(0, [&](const pb::Frame& frame) {
    if (!frame.has_force()) return;
    ++count;
    const pb::ForceCommand& force = frame.force();
    if (observer) return;
    report_.judge("forces", force.sequence() > sequence, force.ShortDebugString(),
                  "a sequence above " + std::to_string(sequence));
    sequence = force.sequence();
    report_.judge(
        "force-answers",
        ticks.contains(force.based_on_tick()) && (force.based_on_tick() >= tick || report_.failed("newest-wins")),
        force.ShortDebugString(), "the tick of a received state, at least " + std::to_string(tick));
    tick = std::max(tick, force.based_on_tick());
    report_.judge("force-bounds", within_bounds(force), force.ShortDebugString(),
                  "values within bounds, valid_for_us 1 … 10 000 000");
    report_.judge("force-granted", force.way() == 0 && !force.has_torque_nm() && !force.has_gripper_force_n(),
                  force.ShortDebugString(),
                  "no way, torque or gripper force, because ways and handle were not granted");
  });
  if (observer) {
    for (const std::string_view check : {"forces", "force-answers", "force-bounds", "force-granted"}) {
      report_.not_applicable(check, "this client is an observer");
    }
    report_.judge("observer-sends-none", count == 0, std::to_string(count) + " forces", "none");
  } else {
    report_.not_applicable("observer-sends-none", "this client is a controller");
    report_.judge("forces", count > 0, "no force", "forces");
  }
}

bool ClientJudge::comes_back() { return next_hello(kComeBack).has_value(); }

void ClientJudge::check_refused() {
  const auto greeting = invite();
  if (!greeting) return;
  pb::Answer no;
  no.mutable_refused()->set_code(pb::CODE_DENIED);
  no.mutable_refused()->set_detail("conformance test of refusals");
  no.mutable_refused()->set_version_min(1);
  no.mutable_refused()->set_version_max(1);
  Bytes32 ephemeral{};
  std::ranges::copy(random16(), ephemeral.begin());
  const Bytes datagram = answer_to(*greeting, 0, no, Key(ephemeral)).datagram;
  wire_.send(port_, datagram);
  hellos(milliseconds(100));
  strays_.clear();
  const auto after = hellos(milliseconds(500));
  const bool again = std::ranges::any_of(after, [&](const Greeting& next) { return next.random == greeting->random; });
  report_.judge("refused", strays_.empty() && !again, strays_.empty() ? "the same Hello again" : "Data",
                "the attempt ends: neither Data nor the same Hello");
}

void ClientJudge::judge() {
  crypto::start();
  start();
  if (check_hellos()) {
    check_bad_answers();
    if (auto session = open()) check_conversation(*session);
  }
  if (report_.count(Outcome::kFailed) > 0 && report_.count(Outcome::kUnreached) > 20) return guest_.kill();

  start();
  if (auto session = open()) check_timeout(session->talk, kTimeout);
  if (!comes_back()) start();
  if (auto session = open()) {
    pb::Datagram body;
    *body.add_frames() = evidence_of(*session).frame(1);
    session->talk.confirmed(session->talk.say(body));
    check_bye_silence(session->talk);
  }
  if (!comes_back()) start();
  check_refused();
  guest_.kill();
  report_.judge("hello-new-random", attempts_.size() >= 2, "the same client random in every attempt",
                "a new one for each");
}

}  // namespace

void judge_client(Wire& wire, Guest& guest, const Options& options, Report& report) {
  ClientJudge(wire, guest, options, report).judge();
}

}  // namespace tendon::conformance
