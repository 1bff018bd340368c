// SPDX-License-Identifier: Apache-2.0
#include "protocol/session.h"

#include <algorithm>
#include <array>
#include <bit>
#include <type_traits>
#include <utility>
#include <vector>

#include "core/base/expect.h"
#include "protocol/field/newest_brick.h"
#include "protocol/limits.h"
#include "protocol/reliable/replay_window.h"
#include "protocol/reliable/requests.h"
#include "protocol/reliable/round_trip.h"
#include "protocol/wire/codec.h"

namespace tendon {
namespace {

constexpr std::size_t kMostStatuses = 8;

/// The newest value of each stream. A stream consists of the states or reports of a device or channel, so the codec
/// limits the number of streams to kMaxDevices or kMaxDevices · kMaxChannels. `Told` is the event that wraps a value,
/// or void. Memory is only allocated for the first value of a stream and for the text of a report.
template <class Value, class Told = void>
class Newest {
 public:
  using Kept = std::conditional_t<std::is_void_v<Told>, Value, Session::Event>;

  void put(const Value& value) { put(stream(value), value); }
  /// Returns false if the value is not newer than all earlier ones of its stream.
  bool put_if_newer(const Value& value) {
    Stream& mine = stream(value);
    const auto order = order_of(value);
    if (mine.order && order <= *mine.order) return false;
    mine.order = order;
    put(mine, value);
    return true;
  }

  bool empty() const noexcept { return waiting_ == 0; }

  /// Streams are sorted by the time of their first value.
  const Kept* first() const noexcept { return empty() ? nullptr : &next_waiting()->value; }
  /// The value is valid until the next `put`.
  const Kept* take() noexcept {
    const auto next = streams_.begin() + (next_waiting() - streams_.cbegin());
    next->waiting = false;
    --waiting_;
    return &next->value;
  }

  void for_each_waiting(auto visit) const {
    for (const Stream& stream : streams_) {
      if (stream.waiting) visit(stream.value);
    }
  }
  /// Removes a value visited by for_each_waiting().
  void take(const Value* value) {
    for (Stream& stream : streams_) {
      if (&stream.value != value) continue;
      stream.waiting = false;
      --waiting_;
      return;
    }
  }

 private:
  using Order = std::pair<std::uint64_t, std::uint64_t>;  ///< epoch, number
  struct Stream {
    Kept value;
    bool waiting = false;
    std::optional<Order> order{};
  };

  static Order order_of(const DeviceState& state) noexcept { return {0, state.tick}; }
  static Order order_of(const ForceCommand& force) noexcept { return {0, force.sequence}; }
  static Order order_of(const PortFrame& port) noexcept { return {port.epoch, port.sequence}; }
  static Order order_of(const PeerReport& report) noexcept { return {0, report.link.number}; }
  static Order order_of(const FieldPose& pose) noexcept { return {0, pose.sequence}; }
  static Order order_of(const auto& report) noexcept { return {0, report.number}; }

  static const Value& in(const Value& kept) noexcept { return kept; }
  static const Value& in(const Session::Event& kept) noexcept {
    const auto& [value] = *std::get_if<Told>(&kept);
    return value;
  }
  void put(Stream& mine, const Value& value) {
    waiting_ += mine.waiting ? 0 : 1;
    if constexpr (std::is_void_v<Told>) {
      mine.value = value;
    } else {
      auto& [kept] = *std::get_if<Told>(&mine.value);
      kept = value;
    }
    mine.waiting = true;
  }
  static bool same(const LinkReport&, const LinkReport&) noexcept { return true; }
  static bool same(const DeviceState& a, const DeviceState& b) noexcept { return a.device == b.device; }
  static bool same(const DeviceReport& a, const DeviceReport& b) noexcept { return a.device == b.device; }
  static bool same(const PortFrame& a, const PortFrame& b) noexcept {
    return a.device == b.device && a.channel == b.channel && a.of_peer == b.of_peer;
  }
  static bool same(const FieldStatus& a, const FieldStatus& b) noexcept { return a.field == b.field; }
  static bool same(const auto& a, const auto& b) noexcept { return a.device == b.device && a.channel == b.channel; }
  typename std::vector<Stream>::const_iterator next_waiting() const noexcept {
    return std::find_if(streams_.begin(), streams_.end(), [](const Stream& s) { return s.waiting; });
  }
  Stream& stream(const Value& value) {
    const auto found =
        std::find_if(streams_.begin(), streams_.end(), [&](const Stream& s) { return same(in(s.value), value); });
    if (found != streams_.end()) return *found;
    if constexpr (std::is_same_v<Value, FieldStatus>) {  // the number of names has no limit
      const auto unused = std::ranges::find(streams_, false, &Stream::waiting);
      if (unused != streams_.end()) return *unused;
      if (streams_.size() == kMostStatuses) return streams_.front();
    }
    if constexpr (std::is_void_v<Told>) {
      return streams_.emplace_back(Stream{.value = value});
    } else {
      return streams_.emplace_back(Stream{.value = Told{value}});
    }
  }

  std::vector<Stream> streams_;
  std::size_t waiting_ = 0;
};

template <class... Newests>
struct Streams : Newests... {
  bool empty() const noexcept { return (Newests::empty() && ...); }
  const auto* take() noexcept {
    const std::common_type_t<typename Newests::Kept...>* taken = nullptr;
    ((!taken && !Newests::empty() ? void(taken = Newests::take()) : void()), ...);
    return taken;
  }
};

/// For example, of<DeviceState>(streams).
template <class Value, class Told>
Newest<Value, Told>& of(Newest<Value, Told>& streams) noexcept {
  return streams;
}

/// The frames of the feature "fields", which are only allocated if they are used.
struct FieldFrames {
  Streams<Newest<FieldPose>, Newest<FieldStatus>> to_send;
  NewestBrick brick_to_send;
  Streams<Newest<FieldPose, Session::FieldPoseArrived>, Newest<FieldStatus, Session::FieldStatusArrived>> arrived;
  NewestBrick brick;  ///< that has arrived

  bool anything_to_send() const noexcept { return !to_send.empty() || brick_to_send.waiting; }
};

}  // namespace

struct Session::State {
  State(const Config& the_config, const SessionKeys* keys, LocalTime the_opening)
      : config(the_config), opened(the_opening), latest(the_opening), last_heard(the_opening) {
    if (keys == nullptr) return;
    suite = keys->suite;
    sealer.emplace(SealingKey(suite, keys->send), config.rekey, opened);
    opener.emplace(SealingKey(suite, keys->receive), config.rekey);
  }

  Config config;
  LocalTime opened;
  LocalTime latest;
  bool open = true;
  LinkStats stats;

  // Only used in suites 1 and 2.
  Suite suite = Suite::kPlain;
  std::optional<Sealer> sealer;
  std::optional<Opener> opener;
  std::array<std::byte, kMaxDatagram> opened_body{};

  DataWriter writer;
  std::uint64_t next_packet = 0;
  std::optional<LocalTime> last_sent;
  Streams<Newest<DeviceState>, Newest<ForceCommand>, Newest<PortFrame>, Newest<LinkReport>, Newest<DeviceReport>,
          Newest<PeerReport>>
      to_send;
  OutgoingRequests asked;
  Bye bye;
  int byes_left = 0;
  LocalTime silent_until = LocalTime::min();  ///< min: must be computed

  DataReader reader;
  LocalTime last_heard;
  ReplayWindow seen;
  std::optional<OutgoingEcho> echo;
  std::optional<std::uint64_t> newest_echoed;
  IncomingRequests answering;
  RoundTrip round_trip;
  std::optional<ClockExchange> exchange;
  ClockOffsetEstimator peer_clock;

  // Pending events, in the order of next_event().
  Streams<Newest<ForceCommand, ForceArrived>, Newest<PortFrame, PortArrived>, Newest<LinkReport, ReportArrived>,
          Newest<DeviceReport, DeviceReportArrived>, Newest<PeerReport, PeerReportArrived>,
          Newest<DeviceState, StateArrived>>
      arrived;
  std::unique_ptr<FieldFrames> fields;  ///< null until the first frame for fields
  std::optional<Closed> closed;
  bool untold = false;  ///< some event may be pending
  Event rare;           ///< other events returned by next_event()

  std::optional<std::span<const std::byte>> open_body(LocalTime now, const Header& header,
                                                      std::span<const std::byte> datagram);
  bool accept(LocalTime now, LocalTime reached, std::uint64_t number, const DataContent& content);
  void observe(LocalTime now, LocalTime reached, PeerTime sent, const IncomingEcho& told);
  void count_lost_outgoing(const IncomingEcho& told);

  // `newest` is true if this datagram is the newest so far.
  template <class Value>
  void take(const Value& value, bool newest) {
    if (of<Value>(arrived).put_if_newer(value)) return;
    ++stats.stale;
    // In an older datagram, this is due to the network.
    if constexpr (std::is_same_v<Value, ForceCommand>) stats.refused_forces.old_sequence += newest ? 1 : 0;
  }
  void take(const Control& control, bool /*newest*/) { stats.invalid += news().answering.take(control) ? 0 : 1; }
  void take(const ControlAck& ack, bool /*newest*/) { stats.invalid += news().asked.acknowledge(ack) ? 0 : 1; }
  void take(const Bye& said, bool newest);
  void take(const FieldBrick& brick, bool /*newest*/) { of_fields().brick.put(brick); }
  void take(const FieldStatus& status, bool newest) {
    if (newest) return of<FieldStatus>(of_fields().arrived).put(status);
    ++stats.stale;
  }
  void take(const FieldPose& pose, bool /*newest*/) {
    stats.stale += of<FieldPose>(of_fields().arrived).put_if_newer(pose) ? 0 : 1;
  }
  FieldFrames& of_fields() {
    if (!fields) fields = std::make_unique<FieldFrames>();
    return *fields;
  }

  bool silent_too_long(LocalTime now) const noexcept { return !last_sent || now - *last_sent >= config.keep_alive; }
  /// Must be called before data to be sent are changed.
  State& news() noexcept {
    silent_until = LocalTime::min();
    return *this;
  }
  bool something_to_say(LocalTime now) noexcept {
    if (now < silent_until) return false;
    if (!to_send.empty() || (fields && fields->anything_to_send()) || answering.next_due() || asked.next_due(now) ||
        silent_too_long(now))
      return true;
    silent_until = std::min(*last_sent + config.keep_alive, asked.next_due_time());
    return false;
  }
  bool too_old(LocalTime now) const noexcept {
    return sealer &&
           (now - opened >= config.life || next_packet >= config.max_datagrams || stats.forged >= config.max_forged);
  }
  template <class Value>
  void send(const Value& value) {
    of<Value>(news().to_send).put(value);
  }
  const Event* tell();
  void close(Code code, std::string reason);
  std::size_t say(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  Header begin(LocalTime now, std::span<std::byte, kMaxDatagram> buffer);
  std::size_t sent(LocalTime now, const Header& header, std::span<std::byte, kMaxDatagram> buffer) noexcept;
  void fill(LocalTime now);
  template <class Value>
  void fill_from(Newest<Value>& waiting);
  template <class... Value>
  void fill_with();
  void fill_with_fields();
  void fill_columns();
};

Session::Session(const Config& config, LocalTime opened) : Session(config, nullptr, opened) {}
Session::Session(const Config& config, const SessionKeys& keys, LocalTime opened) : Session(config, &keys, opened) {}
Session::Session(const Config& config, const SessionKeys* keys, LocalTime opened) {
  expect_above_zero(seconds(config.keep_alive), "keep_alive_s");
  expect_above_zero(seconds(config.timeout), "timeout_s");
  expect_above_zero(seconds(config.min_resend), "min_resend_s");
  expect_above_zero(seconds(config.life), "life_s");
  expect_above_zero(seconds(config.rekey.age), "rekey.age_s");
  expect_above_zero(seconds(config.rekey.overlap), "rekey.overlap_s");
  expect(config.rekey.datagrams <= limits::kMaxDatagramsOfKey, "rekey.datagrams",
         static_cast<double>(config.rekey.datagrams), "at most 2^23, the limit of AES-256-GCM");
  state_ = std::make_unique<State>(config, keys, opened);
}
Session::~Session() = default;
Session::Session(Session&&) noexcept = default;
Session& Session::operator=(Session&&) noexcept = default;

bool Session::receive(LocalTime now, std::span<const std::byte> datagram, LocalTime reached) {
  State& my = *state_;
  my.latest = now;
  if (!my.open) return false;

  const std::optional<Header> header = decode_header(datagram);
  if (header && header->type != DatagramType::kData) {
    ++my.stats.duplicated;
    return false;
  }
  if (!header || header->suite != my.suite || header->connection_id != my.config.connection_id ||
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
    // An authentic datagram uses up its number. In suite 0, a damaged copy must not block the original.
    if (my.opener) my.seen.insert(header->packet_number);
    ++my.stats.malformed;
    return false;
  }
  return my.accept(now, reached, header->packet_number, *content);
}

/// Returns the plaintext, or nullopt if the datagram is not authentic, which is counted.
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

bool Session::State::accept(LocalTime now, LocalTime reached, std::uint64_t number, const DataContent& content) {
  ++stats.datagrams_received;
  stats.invalid += content.invalid;
  stats.refused_forces.not_finite += content.forces_not_finite;
  stats.refused_forces.out_of_bounds += content.forces_out_of_bounds;
  last_heard = now;
  const bool newest = seen.empty() || number > seen.highest();
  stats.reordered += newest ? 0 : 1;
  seen.insert(number);
  stats.lost = seen.missing();
  if (newest) echo = {.sent = content.sent, .received = reached, .packet_number = number, .received_mask = 0};
  exchange.reset();
  if (content.echo) observe(now, reached, content.sent, *content.echo);
  untold |= !content.frames.empty();
  for (const Frame& frame : content.frames) {
    std::visit([&](const auto& body) { take(body, newest); }, frame);
  }
  return newest;
}

void Session::State::observe(LocalTime now, LocalTime reached, PeerTime sent, const IncomingEcho& told) {
  const bool possible =
      told.packet_number < next_packet && told.sent >= opened && told.sent <= now && sent >= told.received;
  if (!possible) {
    ++stats.invalid;
    return;
  }
  count_lost_outgoing(told);
  // The answer cannot arrive before the question is sent, so an earlier time stamp must be wrong.
  const LocalTime answered_at = reached >= told.sent ? reached : now;
  exchange = {.sent = told.sent, .received = told.received, .answered = sent, .answered_at = answered_at};
  peer_clock.observe(*exchange);
  const Duration sample = (answered_at - told.sent) - (sent - told.received);
  if (sample < Duration::zero()) return;  // different clock rates, and a long delay at the peer
  round_trip.observe(sample);
  stats.round_trip = round_trip.newest();
  stats.smoothed_round_trip = round_trip.smoothed();
  stats.round_trip_variation = round_trip.variation();
}

void Session::State::count_lost_outgoing(const IncomingEcho& told) {
  if (newest_echoed && told.packet_number <= *newest_echoed) return;
  // The vector contains 32 packets before the echoed one.
  const std::uint64_t since = newest_echoed ? told.packet_number - *newest_echoed : told.packet_number + 1;
  const std::uint64_t before = std::min<std::uint64_t>(since - 1, 32);
  const std::uint64_t reached = (std::uint64_t{1} << before) - 1;
  const auto seen_before = static_cast<std::uint64_t>(std::popcount(told.received_mask & reached));
  stats.lost_outgoing += before - seen_before;
  stats.seen_outgoing += 1 + seen_before;
  newest_echoed = told.packet_number;
}

void Session::State::take(const Bye& said, bool /*newest*/) {
  open = false;
  closed = Closed{.code = said.code, .reason = said.reason};
}

void Session::send(const DeviceState& state) { state_->send(state); }
void Session::send(const ForceCommand& command) { state_->send(command); }
void Session::send(const LinkReport& report) { state_->send(report); }
void Session::send(const DeviceReport& report) { state_->send(report); }
void Session::send(const PeerReport& report) { state_->send(report); }
void Session::send(const PortFrame& port) { state_->send(port); }
void Session::send(const FieldStatus& status) { of<FieldStatus>(state_->news().of_fields().to_send).put(status); }
void Session::send(const FieldPose& pose) { of<FieldPose>(state_->news().of_fields().to_send).put(pose); }
bool Session::send(const FieldBrick& brick) {
  NewestBrick& mine = state_->news().of_fields().brick_to_send;
  if (mine.waiting) return false;
  mine.put(brick);
  return true;
}

std::optional<std::uint32_t> Session::request(const Request& request) { return state_->news().asked.add(request); }

void Session::answer(std::uint32_t id, Code code, std::string detail, Duration wait) {
  state_->news().answering.answer({.id = id, .code = code, .detail = std::move(detail), .wait = wait});
}

void Session::answer(std::uint32_t id, DeviceDescription device) {
  state_->news().answering.answer({.id = id, .code = Code::kOk, .detail = {}, .wait = {}, .device = std::move(device)});
}

void Session::answer(std::uint32_t id, HandleDescription handle) {
  ControlAck ack{.id = id, .code = Code::kOk, .detail = {}};
  ack.handle = std::move(handle);
  state_->news().answering.answer(std::move(ack));
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
    my.untold = true;
    my.closed = Closed{.code = Code::kTimedOut, .reason = "nothing received for " + std::to_string(ms) + " ms"};
  } else if (my.too_old(now)) {
    const std::string reason = "the session has reached its maximum age";
    my.close(Code::kExpired, reason);
    my.untold = true;
    my.closed = Closed{.code = Code::kExpired, .reason = reason};
  }
}

Header Session::State::begin(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  if (echo) echo->received_mask = seen.mask_before(echo->packet_number);
  const Header header{.type = DatagramType::kData,
                      .suite = suite,
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

/// Adds the states that can be sent in columns, using one frame per instant.
void Session::State::fill_columns() {
  for (;;) {
    std::array<const DeviceState*, limits::kMaxDevices> together{};
    const DeviceState* first = nullptr;
    of<DeviceState>(to_send).for_each_waiting([&](const DeviceState& state) {
      if (!fits_columns(state) || state.device >= together.size()) return;
      if (first == nullptr) first = &state;
      if (state.tick == first->tick && state.sampled == first->sampled) together[state.device] = &state;
    });
    if (first == nullptr) return;
    const std::span states(together.begin(), std::remove(together.begin(), together.end(), nullptr));
    const std::size_t taken = writer.add(states);
    if (taken == 0) return;
    for (const DeviceState* state : states.first(taken)) of<DeviceState>(to_send).take(state);
  }
}

template <class Value>
void Session::State::fill_from(Newest<Value>& waiting) {
  while (waiting.first() && writer.add(*waiting.first())) waiting.take();
}

template <class... Value>
void Session::State::fill_with() {
  (fill_from(of<Value>(to_send)), ...);
}

/// Adds as much as possible, most urgent first, and the rest to the next datagram. A state
/// always fits, and a force always fits together with a pose.
void Session::State::fill(LocalTime now) {
  if (config.states_in_columns) fill_columns();
  fill_with<DeviceState, PortFrame, ForceCommand>();
  for (const ControlAck* ack = answering.next_due(); ack && writer.add(*ack); ack = answering.next_due()) {
    answering.sent(ack->id);
  }
  const Duration timeout = round_trip.timeout(config.min_resend);
  for (const Control* due = asked.next_due(now); due && writer.add(*due); due = asked.next_due(now)) {
    asked.sent(due->id, now, timeout);
  }
  fill_with<LinkReport, DeviceReport, PeerReport>();
  if (fields) fill_with_fields();
}

void Session::State::fill_with_fields() {
  fill_from(of<FieldPose>(fields->to_send));
  fill_from(of<FieldStatus>(fields->to_send));
  NewestBrick& brick = fields->brick_to_send;
  if (brick.waiting && writer.add(brick.value())) brick.waiting = false;
}

std::size_t Session::next_datagram(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  State& my = *state_;
  my.latest = now;
  if (now < my.silent_until && my.byes_left == 0) return 0;  // fast path for the usual case
  return my.say(now, buffer);
}

std::size_t Session::State::say(LocalTime now, std::span<std::byte, kMaxDatagram> buffer) {
  if (byes_left > 0) {
    --byes_left;
    const Header header = begin(now, buffer);
    writer.add(bye);
    return sent(now, header, buffer);
  }
  if (!open || !something_to_say(now)) return 0;
  const Header header = begin(now, buffer);
  fill(now);
  return sent(now, header, buffer);
}

const Session::Event* Session::next_event() {
  State& my = *state_;
  if (!my.untold) return nullptr;
  const Event* const event = my.tell();
  my.untold = event != nullptr;
  return event;
}

const Session::Event* Session::State::tell() {
  const auto keep = [&](auto event) {
    rare = std::move(event);
    return &rare;
  };
  if (answering.has_next()) {
    const Control* const control = news().answering.next();  // also answers unknown and invalid requests
    if (control != nullptr) return keep(RequestArrived{.id = control->id, .request = *control->request});
  }
  if (asked.has_answer()) {
    ControlAck ack = *asked.next_answer();
    return keep(RequestAnswered{.id = ack.id,
                                .code = ack.code,
                                .detail = std::move(ack.detail),
                                .wait = ack.wait,
                                .device = std::move(ack.device),
                                .handle = std::move(ack.handle)});
  }
  if (const Event* const event = arrived.take()) return event;
  if (fields) {
    if (const Event* const event = fields->arrived.take()) return event;
    if (std::exchange(fields->brick.waiting, false)) return keep(BrickArrived{fields->brick.value()});
  }
  if (closed) return keep(*std::exchange(closed, std::nullopt));
  return nullptr;
}

LocalTime Session::next_tick() const noexcept {
  State& my = *state_;
  if (!my.open) return my.byes_left > 0 ? my.latest : LocalTime::max();
  if (my.something_to_say(my.latest)) return my.latest;
  if (my.too_old(my.latest)) return my.latest;
  return std::min(my.last_heard + my.config.timeout, my.silent_until);
}

bool Session::open() const noexcept { return state_->open; }
std::uint32_t Session::connection_id() const noexcept { return state_->config.connection_id; }
Suite Session::suite() const noexcept { return state_->suite; }
const LinkStats& Session::stats() const noexcept { return state_->stats; }
const std::optional<ClockExchange>& Session::exchange() const noexcept { return state_->exchange; }
std::optional<ClockOffsetEstimator::Estimate> Session::peer_clock() const noexcept {
  return state_->peer_clock.estimate(state_->latest);
}

}  // namespace tendon
