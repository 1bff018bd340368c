// SPDX-License-Identifier: Apache-2.0
#include "protocol/session.h"

#include <algorithm>
#include <bit>
#include <stdexcept>
#include <utility>

#include "protocol/codec.h"
#include "protocol/limits.h"
#include "protocol/replay_window.h"
#include "protocol/requests.h"
#include "protocol/round_trip.h"

namespace tendon {

struct Session::State {
  State(const Config& the_config, const SessionKeys* keys, LocalTime the_opening)
      : config(the_config), opened(the_opening), latest(the_opening), last_heard(the_opening) {
    if (keys == nullptr) return;
    sealer.emplace(keys->send, config.rekey, opened);
    opener.emplace(keys->receive, config.rekey);
  }

  Config config;
  LocalTime opened;
  LocalTime latest;  ///< the newest `now` we were told
  bool open = true;
  LinkStats stats;

  // In suite 1.
  std::optional<Sealer> sealer;
  std::optional<Opener> opener;
  std::array<std::byte, kMaxDatagram> opened_body{};

  // Out.
  DataWriter writer;
  std::uint64_t next_packet = 0;
  std::optional<LocalTime> last_sent;
  std::optional<DeviceState> state_to_send;
  std::optional<ForceCommand> force_to_send;
  OutgoingRequests asked;
  Bye bye;
  int byes_left = 0;

  // In.
  DataReader reader;
  LocalTime last_heard;
  ReplayWindow seen;
  std::optional<OutgoingEcho> echo;
  std::optional<std::uint64_t> newest_tick;
  std::optional<std::uint64_t> newest_sequence;
  std::optional<std::uint64_t> newest_echoed;  ///< newest packet of ours that the peer has told of
  IncomingRequests answering;
  RoundTrip round_trip;
  ClockOffsetEstimator peer_clock;

  // To tell.
  std::optional<DeviceState> state_arrived;
  std::optional<ForceCommand> force_arrived;
  std::optional<Closed> closed;

  Suite suite() const noexcept { return sealer ? Suite::kNoise : Suite::kPlain; }
  std::optional<std::span<const std::byte>> open_body(LocalTime now, const Header& header,
                                                      std::span<const std::byte> datagram);
  bool accept(LocalTime now, std::uint64_t number, const DataContent& content);
  void observe(LocalTime now, PeerTime sent, const IncomingEcho& told);
  void count_lost_outgoing(const IncomingEcho& told);

  void take(const DeviceState& state);
  void take(const ForceCommand& command);
  void take(const Control& control) { stats.invalid += answering.take(control) ? 0 : 1; }
  void take(const ControlAck& ack) { stats.invalid += asked.acknowledge(ack) ? 0 : 1; }
  void take(const Bye& said);

  bool silent_too_long(LocalTime now) const noexcept { return !last_sent || now - *last_sent >= config.keep_alive; }
  bool something_to_say(LocalTime now) const noexcept {
    return state_to_send || force_to_send || answering.next_due() || asked.next_due(now) || silent_too_long(now);
  }
  bool too_old(LocalTime now) const noexcept {
    return sealer && (now - opened >= config.life || next_packet >= config.max_datagrams);
  }
  void close(Code code, std::string reason);
  Header begin(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  std::size_t sent(LocalTime now, const Header& header, std::span<std::byte, kMaxDatagram> buffer) noexcept;
  void fill(LocalTime now);
};

Session::Session(const Config& config, LocalTime opened) : Session(config, nullptr, opened) {}
Session::Session(const Config& config, const SessionKeys& keys, LocalTime opened) : Session(config, &keys, opened) {}
Session::Session(const Config& config, const SessionKeys* keys, LocalTime opened) {
  const auto positive = [](Duration d, const char* message) {
    if (d <= Duration::zero()) throw std::invalid_argument(message);
  };
  positive(config.keep_alive, "session: keep_alive must be positive");
  positive(config.timeout, "session: timeout must be positive");
  positive(config.min_resend, "session: min_resend must be positive");
  positive(config.life, "session: life must be positive");
  positive(config.rekey.age, "session: rekey.age must be positive");
  positive(config.rekey.overlap, "session: rekey.overlap must be positive");
  state_ = std::make_unique<State>(config, keys, opened);
}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

// ---- In ----

bool Session::receive(LocalTime now, std::span<const std::byte> datagram) {
  State& my = *state_;
  my.latest = now;
  if (!my.open) return false;

  const std::optional<Header> header = decode_header(datagram);
  if (header && header->type != DatagramType::kData) {
    ++my.stats.duplicated;  // a copy of the handshake that took its time
    return false;
  }
  if (!header || header->suite != my.suite() || header->connection_id != my.config.connection_id ||
      header->packet_number >= limits::kMaxPacketNumber) {
    ++my.stats.malformed;
    return false;
  }
  if (my.seen.contains(header->packet_number)) {
    ++my.stats.duplicated;
    return false;
  }
  const auto body = my.open_body(now, *header, datagram);
  if (!body) return false;
  const DataContent* content = my.reader.read(*body);
  if (!content) {
    // Its number is used up when it was authentic. In suite 0 nobody knows: a damaged copy must not shut
    // out the good one.
    if (my.opener) my.seen.insert(header->packet_number);
    ++my.stats.malformed;
    return false;
  }
  return my.accept(now, header->packet_number, *content);
}

/// What follows the header, in the clear; empty, and counted, when it is not authentic.
std::optional<std::span<const std::byte>> Session::State::open_body(LocalTime now, const Header& header,
                                                                    std::span<const std::byte> datagram) {
  if (!opener) return datagram.subspan(kHeaderSize);
  switch (opener->open(now, header, datagram, opened_body)) {
    case Opener::Verdict::kOpened:
      return std::span(opened_body).first(datagram.size() - kHeaderSize - crypto::kTagSize);
    case Opener::Verdict::kForged:
      ++stats.forged;
      break;
    case Opener::Verdict::kOldKey:
      ++stats.old_key;
      break;
  }
  return std::nullopt;
}

bool Session::State::accept(LocalTime now, std::uint64_t number, const DataContent& content) {
  ++stats.datagrams_received;
  stats.invalid += content.invalid;
  last_heard = now;
  const bool newest = seen.empty() || number > seen.highest();
  stats.reordered += newest ? 0 : 1;
  seen.insert(number);
  stats.lost = seen.missing();
  if (newest) {
    echo = {.sent = content.sent, .received = now, .packet_number = number, .received_mask = 0};
  }
  if (content.echo) observe(now, content.sent, *content.echo);
  for (const Frame& frame : content.frames) {
    std::visit([this](const auto& body) { take(body); }, frame);
  }
  return newest;
}

void Session::State::observe(LocalTime now, PeerTime sent, const IncomingEcho& told) {
  const bool possible =
      told.packet_number < next_packet && told.sent >= opened && told.sent <= now && sent >= told.received;
  if (!possible) {
    ++stats.invalid;
    return;
  }
  count_lost_outgoing(told);
  peer_clock.observe({.sent = told.sent, .received = told.received, .answered = sent, .answered_at = now});
  const Duration sample = (now - told.sent) - (sent - told.received);
  if (sample < Duration::zero()) return;  // two clocks of different rates, and a peer that held the echo for long
  round_trip.observe(sample);
  stats.round_trip = round_trip.newest();
  stats.smoothed_round_trip = round_trip.smoothed();
  stats.round_trip_variation = round_trip.variation();
}

void Session::State::count_lost_outgoing(const IncomingEcho& told) {
  if (newest_echoed && told.packet_number <= *newest_echoed) return;
  // Of the packets since the last echo, those the vector reaches: itself and at most 32 before.
  const std::uint64_t since = newest_echoed ? told.packet_number - *newest_echoed : told.packet_number + 1;
  const std::uint64_t before = std::min<std::uint64_t>(since - 1, 32);
  const std::uint64_t reached = (std::uint64_t{1} << before) - 1;
  const auto seen_before = static_cast<std::uint64_t>(std::popcount(told.received_mask & reached));
  stats.lost_outgoing += before - seen_before;
  stats.seen_outgoing += 1 + seen_before;
  newest_echoed = told.packet_number;
}

void Session::State::take(const DeviceState& state) {
  if (newest_tick && state.tick <= *newest_tick) {
    ++stats.stale;
    return;
  }
  newest_tick = state.tick;
  state_arrived = state;
}

void Session::State::take(const ForceCommand& command) {
  if (newest_sequence && command.sequence <= *newest_sequence) {
    ++stats.stale;
    return;
  }
  newest_sequence = command.sequence;
  force_arrived = command;
}

void Session::State::take(const Bye& said) {
  open = false;
  closed = Closed{.code = said.code, .reason = said.reason};
}

void Session::send(const DeviceState& state) { state_->state_to_send = state; }

void Session::send(const ForceCommand& command) { state_->force_to_send = command; }

std::optional<std::uint32_t> Session::request(const Request& request) { return state_->asked.add(request); }

void Session::answer(std::uint32_t id, Code code, std::string detail) {
  state_->answering.answer(id, code, std::move(detail));
}

void Session::close(Code code, std::string reason) { state_->close(code, std::move(reason)); }

void Session::State::close(Code code, std::string reason) {
  if (!open) return;
  open = false;
  bye = {.code = code, .reason = std::move(reason)};
  byes_left = limits::kByes;
}

void Session::tick(LocalTime now) {
  State& my = *state_;
  my.latest = now;
  if (!my.open) return;
  if (now - my.last_heard >= my.config.timeout) {
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(my.config.timeout).count();
    my.open = false;
    my.closed = Closed{.code = Code::kTimedOut, .reason = "nothing heard for " + std::to_string(ms) + " ms"};
  } else if (my.too_old(now)) {
    const std::string reason = "the session has reached its age";
    my.close(Code::kExpired, reason);
    my.closed = Closed{.code = Code::kExpired, .reason = reason};
  }
}

// ---- Out ----

Header Session::State::begin(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  if (echo) echo->received_mask = seen.mask_before(echo->packet_number);
  const Header header{.type = DatagramType::kData,
                      .suite = suite(),
                      .epoch = sealer ? sealer->next_epoch(now) : std::uint8_t{0},
                      .connection_id = config.connection_id,
                      .packet_number = next_packet};
  writer.begin(buffer.first(sealer ? kMaxDatagram - crypto::kTagSize : kMaxDatagram), header, now, echo);
  return header;
}

std::size_t Session::State::sent(LocalTime now, const Header& header,
                                 std::span<std::byte, kMaxDatagram> buffer) noexcept {
  ++next_packet;
  ++stats.datagrams_sent;
  last_sent = now;
  return sealer ? sealer->seal(header, buffer, writer.size()) : writer.size();
}

/// As much as fits, what ages fastest first. The rest stays due and goes into the next datagram; state
/// and force always fit together.
void Session::State::fill(LocalTime now) {
  if (state_to_send && writer.add(*state_to_send)) state_to_send.reset();
  if (force_to_send && writer.add(*force_to_send)) force_to_send.reset();
  for (const ControlAck* ack = answering.next_due(); ack && writer.add(*ack); ack = answering.next_due()) {
    answering.sent(ack->id);
  }
  const Duration timeout = round_trip.timeout(config.min_resend);
  for (const Control* due = asked.next_due(now); due && writer.add(*due); due = asked.next_due(now)) {
    asked.sent(due->id, now, timeout);
  }
}

std::size_t Session::next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  State& my = *state_;
  my.latest = now;
  if (my.byes_left > 0) {
    --my.byes_left;
    const Header header = my.begin(now, buffer);
    my.writer.add(my.bye);
    return my.sent(now, header, buffer);
  }
  if (!my.open || !my.something_to_say(now)) return 0;
  const Header header = my.begin(now, buffer);
  my.fill(now);
  return my.sent(now, header, buffer);
}

std::optional<Session::Event> Session::next_event() {
  State& my = *state_;
  if (const auto control = my.answering.next()) return RequestArrived{.id = control->id, .request = *control->request};
  if (auto ack = my.asked.next_answer()) {
    return RequestAnswered{.id = ack->id, .code = ack->code, .detail = std::move(ack->detail)};
  }
  if (my.force_arrived) return ForceArrived{.command = *std::exchange(my.force_arrived, std::nullopt)};
  if (my.state_arrived) return StateArrived{.state = *std::exchange(my.state_arrived, std::nullopt)};
  if (my.closed) return *std::exchange(my.closed, std::nullopt);
  return {};
}

LocalTime Session::next_tick() const noexcept {
  const State& my = *state_;
  if (!my.open) return my.byes_left > 0 ? my.latest : LocalTime::max();
  if (my.something_to_say(my.latest)) return my.latest;
  if (my.too_old(my.latest)) return my.latest;
  return std::min({my.last_heard + my.config.timeout, *my.last_sent + my.config.keep_alive, my.asked.next_due_time()});
}

bool Session::open() const noexcept { return state_->open; }
std::uint32_t Session::connection_id() const noexcept { return state_->config.connection_id; }
const LinkStats& Session::stats() const noexcept { return state_->stats; }
std::optional<ClockOffsetEstimator::Estimate> Session::peer_clock() const noexcept {
  return state_->peer_clock.estimate(state_->latest);
}

}  // namespace tendon
