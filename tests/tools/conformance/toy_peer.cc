// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy_peer.h"

#include <algorithm>
#include <limits>
#include <utility>

namespace tendon::conformance {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

constexpr std::uint64_t kRemembered = 1984;

std::int64_t ns(LocalTime time) { return time.time_since_epoch().count(); }

bool within_bounds(const pb::DeviceState& state) {
  return !far(state.position_m()) && !far(state.velocity_mps()) && !far(state.force_applied_n()) &&
         !far(state.energy_j()) && state.permitted_force_n() >= 0 && state.mode() >= 1 && state.mode() <= 6;
}

bool within_bounds(const pb::Frame& frame) {
  if (frame.has_state()) return within_bounds(frame.state());
  if (frame.has_force()) return frame.force().sequence() > 0 && conformance::within_bounds(frame.force());
  return true;
}

bool has_unknown(const pb::Datagram& body) {
  const auto unknown = [](const auto& message) { return !message.GetReflection()->GetUnknownFields(message).empty(); };
  return unknown(body) || std::ranges::any_of(body.frames(), unknown);
}

/// A toy has one device with one channel.
constexpr std::string_view kDevice = "arm";
constexpr std::string_view kChannel = "wall";

/// Whether a toy has what is claimed, and the role is the highest of it.
bool claims_good(const pb::Hello& hello) {
  std::set<pb::Role> roles;
  for (const pb::Claim& claim : hello.claims()) {
    const bool channel_good =
        claim.role() == pb::ROLE_OBSERVER || claim.channel().empty() || claim.channel() == kChannel;
    if (!(claim.device().empty() || claim.device() == kDevice) || !channel_good) return false;
    if (!roles.insert(claim.role()).second) return false;
  }
  return roles.empty() || *roles.rbegin() == hello.role();
}

Key key_from(std::uint8_t first) { return Key(Bytes32{std::byte{first}, std::byte{0x5A}}); }

}  // namespace

// ---- Session ----

ToySession::ToySession(std::uint8_t suite, std::uint32_t connection_id, const Key& send, const Key& receive,
                       Fault fault, LocalTime now)
    : suite_(suite),
      connection_id_(connection_id),
      send_(send),
      receive_(receive),
      renewed_(now),
      fault_(fault),
      last_heard_(now) {}

bool ToySession::good_header(const Head& head) const {
  if (is(Fault::kTakesForeignHeaders)) return head.connection_id == connection_id_ && head.number < 1ULL << 60;
  return head.magic == 0x54 && head.version == 1 && head.type == kDataType && head.suite == suite_ &&
         head.connection_id == connection_id_ && head.number < std::uint64_t{1} << 60;
}

bool ToySession::seen(std::uint64_t number) const {
  if (seen_.empty()) return false;
  const std::uint64_t newest = *seen_.rbegin();
  const std::uint64_t window = is(Fault::kLongWindow) ? 100'000 : is(Fault::kShortWindow) ? 1000 : kRemembered;
  if (number < newest && newest - number >= window) return true;
  return (seen_.contains(number) && !is(Fault::kTakesReplays)) || (is(Fault::kDropsTheLate) && number < newest);
}

std::optional<Bytes> ToySession::open(LocalTime now, const Head& head, Span datagram) {
  if (suite_ == 0) return Bytes(datagram.begin() + kHeadSize, datagram.end());
  if (datagram.size() < kHeadSize + crypto::kTagSize) return std::nullopt;
  if (previous_ && !is(Fault::kOldKeyForEver) && now - moved_on_ >= seconds(2)) previous_.reset();
  const auto ahead = static_cast<std::uint8_t>(head.epoch - receive_epoch_);
  Key key = receive_;
  if (ahead == 1 && !is(Fault::kDoesNotFollowRekey)) {
    key = crypto::renewed(receive_);
  } else if (ahead == 0xFF && previous_ && !is(Fault::kNoOverlap)) {
    key = *previous_;
  } else if (ahead != 0) {
    return std::nullopt;
  }
  Bytes text(datagram.size() - kHeadSize - crypto::kTagSize);
  const Span sealed = datagram.subspan(kHeadSize);
  if (!crypto::open(key, head.number, datagram.first(kHeadSize), sealed, text)) {
    if (is(Fault::kTakesForged)) return Bytes();
    return std::nullopt;
  }
  if (ahead == 1) {
    previous_ = receive_;
    receive_ = key;
    ++receive_epoch_;
    moved_on_ = now;
  }
  return text;
}

std::optional<ToySession::Content> ToySession::receive(LocalTime now, Span datagram) {
  if (is(Fault::kAnythingIsALifeSign)) last_heard_ = now;
  const auto head = read_head(datagram);
  if (closed || !head || !good_header(*head)) return std::nullopt;
  if (datagram.size() > kLargest && !is(Fault::kTakesForeignHeaders)) return std::nullopt;
  if (seen(head->number) || spoilt_.contains(head->number)) return std::nullopt;
  const bool newest_number = seen_.empty() || head->number > *seen_.rbegin();
  const bool again = seen_.contains(head->number);
  const auto bytes = open(now, *head, datagram);
  if (!bytes) {
    if (is(Fault::kDamagedUsesNumber)) spoilt_.insert(head->number);
    return std::nullopt;
  }
  pb::Datagram body;
  const bool well_formed = read(*bytes, body) && body.frames_size() <= 64 &&
                           body.tx_time_ns() <= std::int64_t{1} << 60 && body.tx_time_ns() >= -(std::int64_t{1} << 60);
  bool good = well_formed || is(Fault::kTakesMalformed);
  if (is(Fault::kDropsTheUnknown) && has_unknown(body)) good = false;
  if (!good) {
    if (is(Fault::kDamagedUsesNumber)) spoilt_.insert(head->number);
    return std::nullopt;
  }

  seen_.insert(head->number);
  if (!again && well_formed) last_heard_ = now;
  if (newest_number || is(Fault::kEchoOfTheLast) || (again && head->number == *seen_.rbegin())) {
    echo_number_ = head->number;
    echo_sent_ = body.tx_time_ns();
    echo_at_ = now;
  }
  Content content{.frames = {}, .newest = newest_number};
  for (const pb::Frame& frame : body.frames()) {
    if (within_bounds(frame) || is(Fault::kTakesAnyValue)) content.frames.push_back(frame);
    if (frame.has_bye() && !is(Fault::kTalksAfterBye)) closed = true;
  }
  return content;
}

Bytes ToySession::say(LocalTime now, const std::vector<pb::Frame>& frames) {
  pb::Datagram body;
  body.set_tx_time_ns(ns(now) + (is(Fault::kTimeGoesBack) && next_ == 2 ? 1'000'000'000 : 0));
  if (!seen_.empty()) {
    pb::Echo& echo = *body.mutable_echo();
    echo.set_peer_tx_time_ns(echo_sent_);
    echo.set_rx_time_ns(is(Fault::kEchoTimeIsNow) ? ns(now) : ns(echo_at_));
    echo.set_peer_packet_number(echo_number_);
    std::uint32_t mask = 0;
    for (std::uint64_t i = 0; i < 32 && i < echo_number_; ++i) {
      if (seen_.contains(echo_number_ - 1 - i)) mask |= 1U << i;
    }
    echo.set_received_mask(is(Fault::kEmptyMask) ? 0 : mask);
  }
  for (const pb::Frame& frame : frames) *body.add_frames() = frame;
  if (suite_ == 1 && !is(Fault::kNeverRenews) && now - renewed_ >= seconds(600)) {
    send_ = crypto::renewed(send_);
    ++send_epoch_;
    renewed_ = now;
  }
  const Bytes head = write({.version = static_cast<std::uint8_t>(is(Fault::kWrongVersion) ? 2 : 1),
                            .epoch = send_epoch_,
                            .suite = suite_,
                            .connection_id = connection_id_,
                            .number = next_});
  const Bytes text = is(Fault::kBodyIsNoMessage) && frames.empty() && next_ % 2 == 1 ? from_hex("ff") : bytes_of(body);
  Bytes sealed(text.size() + crypto::kTagSize);
  crypto::seal(send_, next_, head, text, sealed);
  next_ += is(Fault::kSkipsNumbers) && next_ == 3 ? 2 : 1;
  last_sent_ = now;
  return head + (suite_ == 0 ? text : sealed);
}

std::vector<Bytes> ToySession::say_bye(LocalTime now, pb::Code code) {
  pb::Frame bye;
  bye.mutable_bye()->set_code(code);
  std::vector<Bytes> out;
  for (int i = 0; i < (is(Fault::kOneBye) ? 1 : 3); ++i) out.push_back(say(now, {bye}));
  closed = true;
  return out;
}

bool ToySession::silent_too_long(LocalTime now) const {
  if (is(Fault::kNoKeepAlive)) return !last_sent_ || now - *last_sent_ >= seconds(1);
  return !last_sent_ || now - *last_sent_ >= milliseconds(50);
}

bool ToySession::over(LocalTime now, Duration timeout) const {
  return !is(Fault::kNoTimeout) && now - last_heard_ >= timeout;
}

// ---- Server ----

ToyServer::ToyServer(const std::optional<Key>& key, Fault fault) : key_(key), fault_(fault) {}

void ToyServer::refuse(int port, const Greeting& greeting, pb::Code code) {
  pb::Answer no;
  no.mutable_refused()->set_code(code);
  no.mutable_refused()->set_version_min(1);
  no.mutable_refused()->set_version_max(2);
  send(port, answer_to(greeting, 0, no, key_from(1)).datagram);
}

void ToyServer::greet(LocalTime now, int port, Span datagram) {
  const auto head = read_head(datagram);
  const bool plain = head->suite == 0;
  const Options options{.key = plain ? std::nullopt : key_};
  if (!plain && !key_) return;
  std::vector<Flaw> flaws;
  auto greeting = read_greeting(datagram, options, flaws);
  const bool body_good =
      greeting && std::ranges::none_of(flaws, [](const Flaw& flaw) { return flaw.check == "hello-body"; });
  const bool frame_good = std::ranges::all_of(
      flaws, [](const Flaw& flaw) { return flaw.check == "hello-body" && !flaw.seen.starts_with("n = "); });
  if (!frame_good && !(is(Fault::kAnswersShortHellos) && datagram.size() == kLargest - 1)) return;

  const Sixteen random = sixteen(datagram, 16);
  Sixteen cookie{std::byte{1}};
  if (!is(Fault::kOneCookieForAll)) {
    for (std::size_t i = 0; i < cookie.size(); ++i) cookie[i] = random[i] ^ static_cast<std::byte>(port + 77);
  }
  if (sixteen(datagram, 32) != cookie) {
    Bytes out = retry(head->suite, random, cookie);
    if (is(Fault::kLongRetry)) out.push_back({});
    send(port, out);
    if (is(Fault::kTwoRetries)) send(port, out);
    return;
  }
  hellos_ = std::min(40.0, hellos_ + 20 * tendon::seconds(now - hellos_at_));
  hellos_at_ = now;
  if (hellos_ < 1 && !is(Fault::kNoHelloLimit)) return;
  hellos_ -= 1;
  if (!body_good) {
    const bool key_unknown =
        std::ranges::any_of(flaws, [](const Flaw& flaw) { return flaw.expected.starts_with("the key id"); });
    if (is(Fault::kRefusesUnknownKeys) && key_unknown) {
      send(port, answer(1, 0, random, Bytes(60)));
    }
    if (!is(Fault::kTakesAnyHello) || !greeting) return;
  }
  if (plain && key_ && !is(Fault::kWelcomesPlain)) return refuse(port, *greeting, pb::CODE_DENIED);
  const pb::Hello& hello = greeting->hello;
  std::uint32_t version = std::min(hello.version_max(), 2U);
  if (is(Fault::kLowestVersion)) version = std::max(hello.version_min(), 1U);
  if (hello.version_min() > 2 && !is(Fault::kWelcomesAnyVersion)) return refuse(port, *greeting, pb::CODE_UNSUPPORTED);

  bool again = false;
  for (const Member& member : members_) {
    if (member.random != random || member.session.closed) continue;
    again = true;
    if (!is(Fault::kSecondSession)) return send(port, member.answer);
  }
  const bool taken = std::ranges::any_of(members_, [](const Member& member) {
    return member.role == pb::ROLE_CONTROLLER && member.open && !member.session.closed;
  });
  if (taken && !key_ && hello.role() == pb::ROLE_CONTROLLER && !is(Fault::kTwoControllers) && !again) {
    return refuse(port, *greeting, pb::CODE_BUSY);
  }
  const bool knows_channels = !is(Fault::kKnowsNoChannels);
  if (knows_channels && !claims_good(hello) && !is(Fault::kGrantsAnything))
    return refuse(port, *greeting, pb::CODE_INVALID);
  pb::Answer yes = welcome_to(hello, version);
  if (knows_channels) {
    if (std::ranges::count(hello.features(), "channels") > 0) yes.mutable_welcome()->add_features("channels");
    for (const pb::Claim& claim : hello.claims()) yes.mutable_welcome()->add_grants()->set_role(claim.role());
  }
  if (is(Fault::kGrantsUnasked) && hello.claims().empty()) {
    yes.mutable_welcome()->add_grants()->set_role(hello.role());
  }
  if (is(Fault::kGrantsBackwards)) {
    auto& grants = *yes.mutable_welcome()->mutable_grants();
    std::reverse(grants.begin(), grants.end());
  }
  if (is(Fault::kBadWelcome)) yes.mutable_welcome()->set_loop_hz(0);
  if (is(Fault::kInventsFeatures) && yes.welcome().features().empty()) yes.mutable_welcome()->add_features("telepathy");
  const std::uint32_t id = next_id_++;
  const Answered answered = answer_to(*greeting, id, yes, key_from(static_cast<std::uint8_t>(id)));
  send(port, answered.datagram);
  Member member{
      .port = port,
      .name = hello.name(),
      .role = hello.role(),
      .random = random,
      .answer = answered.datagram,
      .session = ToySession(head->suite, id, answered.server_to_client, answered.client_to_server, fault_, now),
      .open = false,
      .waiting = {},
      .answered = {}};
  members_.push_back(std::move(member));
}

void ToyServer::open(LocalTime now, Member& member) {
  member.open = true;
  member.reported = now;
  for (Member& other : members_) {
    if (&other == &member || !other.open || other.session.closed || other.role != pb::ROLE_CONTROLLER ||
        member.role != pb::ROLE_CONTROLLER) {
      continue;
    }
    const pb::Code code = is(Fault::kWrongReplacedCode) ? pb::CODE_OK : pb::CODE_REPLACED;
    for (Bytes& bye : other.session.say_bye(now, code)) send(other.port, std::move(bye));
  }
  if (member.role == pb::ROLE_CONTROLLER && holder() == nullptr) holder_ = member.session.connection_id();
}

const ToyServer::Member* ToyServer::holder() const {
  const auto found = std::ranges::find_if(members_, [&](const Member& member) {
    return member.session.connection_id() == holder_ && !member.session.closed;
  });
  return found == members_.end() ? nullptr : &*found;
}

pb::DeviceDescription ToyServer::describe() const {
  const pb::Answer answer = welcome_to({}, 1);
  const pb::Welcome& welcome = answer.welcome();
  pb::DeviceDescription out;
  out.set_name(std::string(kDevice));
  out.set_model(welcome.device_name());
  out.set_position_dof(3);
  out.set_force_dof(3);
  out.set_max_force_n(welcome.max_force_n());
  out.set_loop_hz(is(Fault::kDescribesAnother) ? 500 : welcome.loop_hz());
  pb::ChannelDescription& channel = *out.add_channels();
  channel.set_name(std::string(kChannel));
  channel.set_rule(pb::CHANNEL_RULE_SUM);
  if (const Member* const member = holder()) channel.set_holder(member->name);
  return out;
}

pb::Code ToyServer::set_deadband(Member& member, const pb::SetStateDeadband& asked) const {
  const std::uint32_t silence_us = asked.max_silence_us();
  const bool good = silence_us == 0 || (silence_us >= 1000 && silence_us <= 20'000 && asked.share() >= 0 &&
                                        asked.share() <= 0.5 && asked.floor_mps() >= 0 && asked.floor_mps() <= 0.1);
  if (!good && !is(Fault::kTakesAnyDeadband)) return pb::CODE_INVALID;
  const bool stays = is(Fault::kDeadbandForEver) && silence_us == 0;
  if (!stays && !is(Fault::kSendsTheForetold)) member.silence = silence_us / 1000;
  return pb::CODE_OK;
}

std::optional<pb::Frame> ToyServer::report(LocalTime now, Member& member) const {
  const Duration period = is(Fault::kReportsAllTheTime) ? milliseconds(50) : Duration(seconds(1));
  if (member.forces == 0 || now - member.reported < period || is(Fault::kTellsNothing)) return std::nullopt;
  pb::Frame frame;
  pb::LinkReport& report = *frame.mutable_report();
  report.set_number(is(Fault::kReportsOfOneNumber) ? 1 : ++member.reports);
  report.set_until_ns(ns(now));
  report.set_span_ns(is(Fault::kReportsBeyondBounds) ? 1ULL << 61 : static_cast<std::uint64_t>(period.count()));
  report.set_forces(std::exchange(member.forces, is(Fault::kReportsAllTheTime) ? 1 : 0));
  report.set_received(member.session.received());
  member.reported = now;
  return frame;
}

void ToyServer::receive(LocalTime now, int port, Span datagram) {
  const auto head = read_head(datagram);
  if (!head || head->magic != 0x54 || head->version != 1 || head->suite > 1) {
    if (!is(Fault::kTakesForeignHeaders) || !head) return;
  }
  if (head->type == kHelloType) return greet(now, port, datagram);
  for (Member& member : members_) {
    if (member.session.connection_id() != head->connection_id) continue;
    const bool roams = head->suite == 1 || is(Fault::kRoamsByAnything);
    if (!roams && member.port != port) return;
    const auto content = member.session.receive(now, datagram);
    if (!content) return;
    if (content->newest || is(Fault::kRoamsByAnything)) member.port = port;
    if (!member.open) open(now, member);
    for (const pb::Frame& frame : content->frames) take(member, frame);
    return;
  }
  if (is(Fault::kAnswersStrays) && head->connection_id == 0xFFFFFFFE)
    send(port, write({.connection_id = head->connection_id}));
}

void ToyServer::take(Member& member, const pb::Frame& frame) {
  const bool controls = member.role == pb::ROLE_CONTROLLER || is(Fault::kObserversPush);
  if (frame.has_force() && controls && (frame.force().sequence() > member.sequence || is(Fault::kOlderWins))) {
    member.sequence = frame.force().sequence();
    rendered_ = member.sequence;
    ++member.forces;
  }
  if (!frame.has_control()) return;
  const pb::Control& control = frame.control();
  const std::uint32_t id = control.id();
  if (is(Fault::kTakesAnyRequestId) && (id == 0 || id >= member.next_request + 16)) return execute(member, control);
  const std::uint32_t window = is(Fault::kRequestsAsTheyCome) ? 32 : 16;  // it never counts on
  if (id == 0 || id >= member.next_request + window) return;
  if (id < member.next_request) {
    if (is(Fault::kRequestsAgain)) execute(member, control);
    if (is(Fault::kForgetsAnswers)) return;
    member.due.emplace_back();
    *member.due.back().mutable_control_ack() = member.answered[id];
    return;
  }
  if (is(Fault::kRequestsAsTheyCome)) {
    if (!member.answered.contains(id)) return execute(member, control);
    member.due.emplace_back();
    *member.due.back().mutable_control_ack() = member.answered[id];
    return;
  }
  member.waiting[id] = control;
  while (member.waiting.contains(member.next_request)) execute(member, member.waiting[member.next_request++]);
}

void ToyServer::execute(Member& member, const pb::Control& control) {
  pb::ControlAck ack;
  ack.set_id(control.id());
  ack.set_code(pb::CODE_OK);
  if (control.has_set_state_rate()) {
    member.every = std::max(1U, 1000 / std::max(1U, std::min(1000U, control.set_state_rate().hz())));
  } else if (control.has_rearm()) {
    if (member.role != pb::ROLE_CONTROLLER && !is(Fault::kObserversRearm)) ack.set_code(pb::CODE_DENIED);
  } else if (control.has_disarm()) {
    if (member.role != pb::ROLE_CONTROLLER && !is(Fault::kObserversDisarm)) ack.set_code(pb::CODE_DENIED);
  } else if (control.has_describe()) {
    if (control.describe().device() == 0 || is(Fault::kDescribesAnyNumber)) {
      *ack.mutable_device() = describe();
    } else {
      ack.set_code(pb::CODE_INVALID);
    }
  } else if (control.has_take_lease()) {
    const bool may = is(Fault::kDeniesTheHolder)
                         ? member.session.connection_id() != holder_
                         : is(Fault::kAnybodyTakesTheLease) || holder() == nullptr || holder() == &member;
    if (member.role != pb::ROLE_CONTROLLER && !is(Fault::kAnybodyTakesTheLease)) {
      ack.set_code(pb::CODE_DENIED);
    } else if (may) {
      holder_ = member.session.connection_id();
    } else {
      ack.set_code(pb::CODE_BUSY);
    }
  } else if (control.has_give_lease()) {
    if (holder() == &member && !is(Fault::kKeepsTheLease)) holder_ = 0;
  } else if (control.has_set_state_deadband()) {
    ack.set_code(set_deadband(member, control.set_state_deadband()));
  } else {
    ack.set_code(pb::CODE_UNSUPPORTED);
    if (is(Fault::kSilentToUnknownRequests)) return;
  }
  member.answered[control.id()] = ack;
  member.due.emplace_back();
  *member.due.back().mutable_control_ack() = ack;
}

void ToyServer::tick(LocalTime now) {
  ++tick_;
  std::erase_if(members_, [&](const Member& member) { return member.session.over(now, seconds(2)); });
  for (Member& member : members_) {
    if (member.session.closed || !(member.open || is(Fault::kStatesWhileHalfOpen))) continue;
    std::vector<pb::Frame> frames = std::exchange(member.due, {});
    if (auto told = report(now, member)) frames.push_back(std::move(*told));
    const bool foretold = tick_ - member.said_at < member.silence;  // its hand rests
    if (tick_ % member.every == 0 && !foretold && !(member.silence > 0 && is(Fault::kSilentWithDeadband))) {
      member.said_at = tick_;
      frames.emplace_back();
      pb::DeviceState& state = *frames.back().mutable_state();
      state.set_tick(is(Fault::kTicksGoBack) ? 1'000'000 - tick_ : tick_);
      state.set_sampled_ns(ns(now));
      state.set_mode(pb::MODE_ACTIVE);
      state.set_force_sequence(rendered_);
      if (is(Fault::kDiagnosesUnasked)) state.mutable_force_wanted_n()->set_x(1);
    }
    // What is due may be more than fits: eight frames a time.
    do {
      const auto count = std::min<std::ptrdiff_t>(8, std::ssize(frames));
      const std::vector<pb::Frame> some(frames.begin(), frames.begin() + count);
      frames.erase(frames.begin(), frames.begin() + count);
      if (!some.empty() || member.session.silent_too_long(now)) send(member.port, member.session.say(now, some));
    } while (!frames.empty());
  }
}

// ---- Client ----

ToyClient::ToyClient(const std::optional<Key>& key, pb::Role role, bool asks, Fault fault)
    : key_(key), role_(role), asks_(asks), fault_(fault) {}

void ToyClient::start() {
  running_ = true;
  ending_ = false;
  begin();
}

void ToyClient::begin() {
  ++attempts_;
  pb::Hello hello;
  hello.set_version_min(1);
  hello.set_version_max(1);
  if (!is(Fault::kNoRole)) hello.set_role(role_);
  hello.set_name("toy");
  const Sixteen random{std::byte{0xAA}, is(Fault::kRandomStays) ? std::byte{1} : std::byte{attempts_}};
  const Key ephemeral = key_from(is(Fault::kRandomStays) ? 100 : static_cast<std::uint8_t>(100 + attempts_));
  attempt_.emplace(key_, bytes_of(hello), random, ephemeral);
  cookie_.reset();
  if (is(Fault::kCookieFromTheStart)) cookie_ = Sixteen{std::byte{9}};
  hello_at_.reset();
  hellos_ = 0;
  refused_ = false;
  session_.reset();
  tick_.reset();
  tick_is_new_ = false;
  sequence_ = 0;
  answered_ = false;
  asked_ = 0;
}

void ToyClient::say_hello() {
  Bytes out = attempt_->hello(cookie_.value_or(Sixteen{}));
  if (is(Fault::kShortHello)) out.pop_back();
  if (is(Fault::kHelloWithConnection)) out[4] = std::byte{1};
  if (is(Fault::kDirtyPadding)) out.back() = std::byte{1};
  if (is(Fault::kHelloChanges) && hellos_ % 2 == 1) {
    // The same random, other words: in suite 1 the same ephemeral key seals two texts.
    pb::Hello hello;
    hello.set_version_min(1);
    hello.set_version_max(1);
    hello.set_role(role_);
    hello.set_name("changed");
    out = Attempt(key_, bytes_of(hello), attempt_->random(), key_from(99)).hello(cookie_.value_or(Sixteen{}));
  }
  ++hellos_;
  send(0, out);
}

void ToyClient::settle(LocalTime now, Span datagram) {
  const auto head = read_head(datagram);
  const bool plain_taken = is(Fault::kTakesPlainAnswer) && head->suite == 0;
  if (head->suite != (key_ ? 1 : 0) && !plain_taken) return;
  Bytes bytes(datagram.begin(), datagram.end());
  if (is(Fault::kTakesForeignAnswer)) std::ranges::copy(attempt_->random(), bytes.begin() + 16);
  const auto answered = attempt_->read(bytes);
  if (!answered) return;
  if (answered->body.has_refused()) {
    refused_ = true;
    return;
  }
  const pb::Welcome& welcome = answered->body.welcome();
  const bool good = answered->body.has_welcome() && welcome.loop_hz() >= 1 && welcome.timeout_ms() >= 1 &&
                    welcome.role() != 0 && welcome.max_force_n() >= 0;
  if (welcome.version() != 1 && !(is(Fault::kTakesAnyVersion) && good)) return;
  if (!good && !is(Fault::kTakesBadWelcome)) return;
  session_.emplace(key_ && head->suite == 1 ? 1 : 0, head->connection_id, answered->client_to_server,
                   answered->server_to_client, fault_, now);
}

void ToyClient::receive(LocalTime now, int, Span datagram) {
  if (!running_) return;
  const auto head = read_head(datagram);
  if (!session_) {
    if (!head || refused_) return;
    const bool ours = sixteen(datagram, 16) == attempt_->random() || is(Fault::kTakesForeignRetry);
    if (head->type == kRetryType && ours && !is(Fault::kIgnoresRetries)) {
      if (!cookie_ || is(Fault::kPingPong)) hello_at_.reset();
      cookie_ = sixteen(datagram, 32);
    }
    if (head->type == kAnswerType) settle(now, datagram);
    return;
  }
  const auto content = session_->receive(now, datagram);
  if (!content) return;
  for (const pb::Frame& frame : content->frames) {
    if (frame.has_state() && (!tick_ || frame.state().tick() > *tick_ || is(Fault::kOlderWins))) {
      tick_ = frame.state().tick();
      tick_is_new_ = true;
    }
    if (frame.has_control_ack()) answered_ = true;
  }
}

void ToyClient::tick(LocalTime now) {
  if (!running_) return;
  if (!session_) {
    if (refused_ && !is(Fault::kGoesOnWhenRefused)) return;
    if (hello_at_ && now - *hello_at_ < milliseconds(is(Fault::kSlowHellos) ? 900 : 100)) return;
    hello_at_ = now;
    return say_hello();
  }
  ToySession& session = *session_;
  if (session.closed || session.over(now, seconds(2))) return begin();
  if (ending_) {
    for (Bytes& bye : session.say_bye(now, pb::CODE_OK)) send(0, std::move(bye));
    running_ = false;
    return;
  }
  std::vector<pb::Frame> frames;
  if (std::exchange(tick_is_new_, false) && (role_ == pb::ROLE_CONTROLLER || is(Fault::kObserverPushes))) {
    frames.emplace_back();
    pb::ForceCommand& force = *frames.back().mutable_force();
    force.set_sequence(is(Fault::kSequenceStays) ? 1 : ++sequence_);
    force.set_based_on_tick(*tick_);
    force.set_valid_for_us(is(Fault::kValidForAnHour) ? 3'600'000'000U : 20'000);
    if (is(Fault::kAnswersNoState) && sequence_ == 3) {
      frames.push_back(frames.back());
      frames.back().mutable_force()->set_sequence(++sequence_);
      frames.back().mutable_force()->set_based_on_tick(*tick_ + 7'000'000);
    }
  }
  const Duration wait = is(Fault::kAsksAllTheTime) ? milliseconds(20) : milliseconds(20) * (1 << std::min(asked_, 6));
  const bool done = (answered_ && !is(Fault::kAsksForEver)) || (is(Fault::kAsksOnce) && asked_ > 0);
  if (asks_ && !done && now >= ask_at_) {
    ask_at_ = now + std::min<Duration>(wait, seconds(1));
    ++asked_;
    frames.emplace_back();
    pb::Control& control = *frames.back().mutable_control();
    control.set_id(is(Fault::kRequestsFromTwo) ? 2 : 1);
    control.mutable_set_state_rate()->set_hz(100);
  }
  if (!frames.empty() || session.silent_too_long(now)) send(0, session.say(now, frames));
}

// ---- The way between ----

void ToyWire::send(int port, Span datagram) {
  to_peer_.push_back({now_ + milliseconds(1), port, {datagram.begin(), datagram.end()}});
}

void ToyWire::step() {
  now_ += milliseconds(1);
  std::vector<Letter> later;
  for (Letter& letter : std::exchange(to_peer_, {})) {
    if (letter.at <= now_) {
      peer_.receive(now_, letter.port, letter.datagram);
    } else {
      later.push_back(std::move(letter));
    }
  }
  to_peer_ = std::move(later);
  peer_.tick(now_);
  for (auto& [port, datagram] : peer_.take()) to_us_[port].push_back({now_, std::move(datagram)});
}

std::optional<Wire::Arrival> ToyWire::receive(int port, LocalTime deadline) {
  auto& arrived = to_us_[port];
  while (arrived.empty()) {
    if (now_ >= deadline) return std::nullopt;
    step();
  }
  Arrival first = std::move(arrived.front());
  arrived.erase(arrived.begin());
  return first;
}

std::uint64_t ToyWire::random() {
  // splitmix64
  std::uint64_t z = (state_ += 0x9E3779B97F4A7C15U);
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9U;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBU;
  return z ^ (z >> 31U);
}

}  // namespace tendon::conformance
