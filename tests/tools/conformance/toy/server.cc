// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/conformance/toy/server.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "tests/tools/conformance/request_bounds.h"

namespace tendon::conformance {

using std::chrono::milliseconds;
using std::chrono::seconds;

namespace {

constexpr std::string_view kDevice = "arm";
constexpr std::string_view kChannel = "wall";

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

std::string difference(const pb::Couple& theirs) {
  if (theirs.role() != pb::PORT_ROLE_LEADER) return "role: follower in both scenes";
  if (theirs.method() != pb::COUPLING_METHOD_POSITION_POSITION) return "method: mine position-position";
  if (theirs.position_scale() != 1) return "map.position_scale: mine 1";
  if (theirs.axes() != 7) return "map.axes: mine xyz";
  if (theirs.stiffness_npm() != 1000) return "coupling.stiffness_n_per_m: mine 1000";
  return theirs.purse() ? "" : "purse: mine true";
}

}  // namespace

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
  pb::Answer yes = welcome_to(hello, version, !plain && !is(Fault::kKnowsNoAes));
  if (knows_channels) {
    if (std::ranges::count(hello.features(), "channels") > 0) yes.mutable_welcome()->add_features("channels");
    for (const pb::Claim& claim : hello.claims()) yes.mutable_welcome()->add_grants()->set_role(claim.role());
  }
  for (const std::string feature : {"teleoperation", "outputs"}) {
    const bool asked = std::ranges::count(hello.features(), feature) > 0;
    if (asked && !is(Fault::kKnowsNoCoupling)) yes.mutable_welcome()->add_features(feature);
  }
  if (std::ranges::count(hello.features(), "state-columns") > 0 && !is(Fault::kKnowsNoColumns)) {
    yes.mutable_welcome()->add_features("state-columns");
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
      .session = ToySession(answered.suite, id, answered.server_to_client, answered.client_to_server, fault_, now),
      .open = false,
      .waiting = {},
      .answered = {}};
  member.features.assign(yes.welcome().features().begin(), yes.welcome().features().end());
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
  if (!stays && !is(Fault::kSendsThePredicted)) member.silence = silence_us / 1000;
  return pb::CODE_OK;
}

void ToyServer::couple(Member& member, const pb::Couple& theirs, pb::ControlAck& ack) const {
  if (std::ranges::count(member.features, "teleoperation") == 0 && !is(Fault::kCouplesUnasked)) {
    return ack.set_code(pb::CODE_UNSUPPORTED);
  }
  const std::string what = is(Fault::kNeverCouples) && difference(theirs).empty() ? "the weather" : difference(theirs);
  if (!what.empty() && !is(Fault::kCouplesWhatDiffers)) {
    if (!is(Fault::kDiffersWithoutAWord)) ack.set_detail(what);
    return ack.set_code(pb::CODE_INVALID);
  }
  member.coupled = what.empty();
}

pb::Frame ToyServer::in_columns(const pb::DeviceState& state) const {
  pb::Frame frame;
  pb::DeviceStates& columns = *frame.mutable_states();
  columns.set_tick(state.tick());
  columns.set_sampled_ns(state.sampled_ns());
  columns.set_devices(1);
  const double x = state.position_m().x();
  columns.add_position_m(is(Fault::kPositionsInSingle) ? static_cast<float>(x) : x);
  columns.add_velocity_mps(static_cast<float>(state.velocity_mps().x()) * (is(Fault::kCoarseColumns) ? 1.000001F : 1));
  columns.mutable_position_m()->Resize(3, 0);
  columns.mutable_velocity_mps()->Resize(3, 0);
  columns.mutable_force_applied_n()->Resize(is(Fault::kShortColumns) ? 2 : 3, 0);
  columns.add_energy_j(0);
  columns.add_permitted_force_n(0);
  columns.add_mode(state.mode());
  if (state.force_sequence() > 0) columns.add_force_sequence(state.force_sequence());
  if (state.buttons() > 0) columns.add_buttons(state.buttons());
  return frame;
}

pb::Frame ToyServer::port(LocalTime now, Member& member) const {
  pb::Frame frame;
  pb::PortState& port = *frame.mutable_port_state();
  port.set_epoch(1);
  port.set_sequence(is(Fault::kPortsOfOneSequence) ? 1 : ++member.ports);
  port.set_time_ns(ns(now));
  port.set_phase(pb::PORT_PHASE_COUPLED);
  if (is(Fault::kPortsBeyondBounds)) port.set_account_j(1001);
  return frame;
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
  if (!head || head->magic != 0x54 || head->version != 1 || head->suite > 2) {
    if (!is(Fault::kTakesForeignHeaders) || !head) return;
  }
  if (head->type == kHelloType) return greet(now, port, datagram);
  for (Member& member : members_) {
    if (member.session.connection_id() != head->connection_id) continue;
    const bool roams = head->suite != 0 || is(Fault::kRoamsByAnything);
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
  if (is(Fault::kSilentToBadRequests) && !field_out_of_bounds(control).empty()) return;
  if (is(Fault::kTakesAnyRequestId) && (id == 0 || id >= member.next_request + 16)) return execute(member, control);
  std::uint32_t next = member.next_request;
  if (is(Fault::kRequestsAsTheyCome) && !member.answered.empty()) next = member.answered.rbegin()->first + 1;
  if (id == 0 || id >= next + 16) return;
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
  if (const std::string field = field_out_of_bounds(control); !field.empty()) {
    ack.set_code(pb::CODE_INVALID);
    ack.set_detail(field);
  } else if (control.has_set_state_rate()) {
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
  } else if (control.has_couple() && !is(Fault::kKnowsNoCoupling)) {
    couple(member, control.couple(), ack);
  } else if (control.has_set_output() && std::ranges::count(member.features, "outputs") > 0) {
    if (!is(Fault::kSetsAnyOutput)) ack.set_code(pb::CODE_INVALID);
  } else if (control.has_couple() || control.has_set_output() || control.has_engage() || control.has_set_scale() ||
             control.has_set_share()) {
    const bool done = (is(Fault::kSetsOutputsUnasked) && control.has_set_output()) ||
                      (is(Fault::kEngagesAFollower) && control.has_engage()) ||
                      (is(Fault::kScalesAFollower) && control.has_set_scale()) ||
                      (is(Fault::kSharesOneLeader) && control.has_set_share());
    if (!done) ack.set_code(pb::CODE_UNSUPPORTED);
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
    if (member.coupled && !is(Fault::kCoupledInSilence)) frames.push_back(port(now, member));
    const bool predicted = tick_ - member.said_at < member.silence;  // the simulated hand does not move
    const bool sees = !member.coupled || is(Fault::kStatesWhileCoupled);
    if (sees && tick_ % member.every == 0 && !predicted && !(member.silence > 0 && is(Fault::kSilentWithDeadband))) {
      member.said_at = tick_;
      frames.emplace_back();
      pb::DeviceState& state = *frames.back().mutable_state();
      state.set_tick(is(Fault::kTicksGoBack) ? 1'000'000 - tick_ : tick_);
      state.set_sampled_ns(ns(now));
      state.set_mode(pb::MODE_ACTIVE);
      state.set_force_sequence(rendered_);
      if (is(Fault::kDiagnosesUnasked)) state.mutable_force_wanted_n()->set_x(1);
      if (is(Fault::kTellsOfTheHandleUnasked)) state.set_buttons(1);
      if (is(Fault::kTellsTheOrientationUnasked)) state.mutable_orientation()->set_w(1);
      state.mutable_position_m()->set_x(1.0 / 3);
      state.mutable_velocity_mps()->set_x(1.0 / 3);
      const bool asked = std::ranges::count(member.features, "state-columns") > 0;
      if (asked && !is(Fault::kNoColumns)) frames.back() = in_columns(state);
      if (!asked && is(Fault::kColumnsUnasked)) frames.push_back(in_columns(state));
    }
    do {
      const auto count = std::min<std::ptrdiff_t>(8, std::ssize(frames));
      const std::vector<pb::Frame> some(frames.begin(), frames.begin() + count);
      frames.erase(frames.begin(), frames.begin() + count);
      if (!some.empty() || member.session.silent_too_long(now)) send(member.port, member.session.say(now, some));
    } while (!frames.empty());
  }
}

}  // namespace tendon::conformance
