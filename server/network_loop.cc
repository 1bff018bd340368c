// SPDX-License-Identifier: Apache-2.0
#include "server/network_loop.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/wire/codec.h"
#include "protocol/wire/header.h"
#include "server/guests/requests.h"

namespace tendon {

namespace {

using enum DatagramSieve::Sender;

constexpr std::size_t kMaxNotices = 64;
constexpr std::size_t kMaxForeign = 64;
/// Between two times that an observer is told of both ends of a coupling: people look at them.
constexpr Duration kShowPortsEvery = std::chrono::milliseconds(20);

bool contains(const std::vector<std::string>& features, std::string_view feature) {
  return std::find(features.begin(), features.end(), feature) != features.end();
}

template <class Counts>
void add_dropped(NetworkLoop::Dropped& sum, const Counts& more, const RefusedForces& forces) {
  sum.duplicated += more.duplicated;
  sum.malformed += more.malformed;
  sum.forged += more.forged;
  sum.old_key += more.old_key;
  sum.invalid += more.invalid;
  sum.stale += more.stale;
  sum.forces.not_finite += forces.not_finite;
  sum.forces.out_of_bounds += forces.out_of_bounds;
  sum.forces.old_sequence += forces.old_sequence;
}

void add(NetworkLoop::Dropped& sum, const LinkStats& link) { add_dropped(sum, link, link.refused_forces); }

/// As the present controller, or the last one.
void remember(NetworkLoop::Stats& stats, const Guest& guest) {
  if (guest.role != Role::kController) return;
  stats.controller = guest.session.stats();
  stats.controller_clock = guest.session.peer_clock();
}

}  // namespace

NetworkLoop::Stats& NetworkLoop::Stats::operator+=(const Stats& more) {
  welcomed += more.welcomed;
  refused += more.refused;
  timed_out += more.timed_out;
  replaced += more.replaced;
  roamed += more.roamed;
  half_open_forgotten += more.half_open_forgotten;
  malformed += more.malformed;
  unknown_connection += more.unknown_connection;
  hellos += more.hellos;
  forces += more.forces;
  denied += more.denied;
  unanswerable += more.unanswerable;
  late_ours += more.late_ours;
  late_network += more.late_network;
  late_engine += more.late_engine;
  late_unknown += more.late_unknown;
  foretold += more.foretold;
  hopeless += more.hopeless;
  add_dropped(dropped, more.dropped, more.dropped.forces);
  channels.insert(channels.end(), more.channels.begin(), more.channels.end());
  if (controller.datagrams_received == 0) {
    controller = more.controller;
    controller_clock = more.controller_clock;
  }
  return *this;
}

NetworkLoop::NetworkLoop(const Config& config, Link& link, const std::vector<Mailboxes*>& mail)
    : config_(config),
      link_(link),
      sieve_(config.recorded),
      devices_(served_devices(config.devices, config.handles, mail, config.shard)),
      first_device_(config.shard.first_device(config.devices.size())),
      doorman_({.secret = config.secret, .keys = config.keys, .suites = config.suites, .number = config.shard.number}),
      admission_(
          {.keys = config.keys.size(), .needs_no_key = config.needs_no_key, .max_observers = config.max_observers}),
      next_connection_id_(config.first_connection_id / config.shard.of * config.shard.of + config.shard.number) {
  half_open_.reserve(config.max_half_open);
  for (std::size_t i = 0; i < devices_.size(); ++i) {
    ServedDevice& device = devices_[i];
    states_.push_back({&device.mail->state});
    const std::size_t place = first_device_ + i;
    if (place < config.leaders.size()) device.leaders = config.leaders[place];
    if (place < config.couplings.size()) device.coupling = config.couplings[place];
    if (device.coupling) coupled_.push_back(static_cast<std::uint32_t>(i));
  }
  const auto is_others = [&](const Config::Dial& dial) {
    return dial.device < first_device_ || dial.device >= first_device_ + devices_.size();
  };
  std::erase_if(config_.dials, is_others);
  config_.secret = {};  // the doorman has taken what it needs
}

LocalTime NetworkLoop::turn(LocalTime now) {
  if (!std::exchange(dials_, true)) {
    for (Config::Dial& dial : config_.dials) {
      const auto out = [this](LocalTime at, const Address& to, std::span<const std::byte> datagram) {
        send(at, kGuest, to, datagram);
      };
      dialled_.push_back(
          {static_cast<std::uint32_t>(dial.device - first_device_), std::make_unique<Peer>(dial.peer, out, now)});
      dial.peer.seed = {};
    }
  }
  // The newest states leave first: a state waits for no system call.
  publish(now);
  const bool more = drain(now);
  report(now);
  for (Guest& guest : guests_) {
    if (guest.session.open() && guest.session.next_tick() > now) continue;  // of many guests few have something to do
    if (!guest.gone) guest.session.tick(now);
    take_events(now, guest);
    send_all(now, guest);
  }
  std::erase_if(guests_, [](const Guest& guest) { return guest.gone; });
  stats_.half_open_forgotten +=
      std::erase_if(half_open_, [&](const Guest& guest) { return now - guest.arrived >= config_.half_open_timeout; });

  LocalTime next = turn_peers(now);
  if (more) return now;
  for (const Guest& guest : guests_) next = std::min(next, guest.session.next_tick());
  return next;
}

bool NetworkLoop::drain(LocalTime& now) {
  std::array<std::byte, kMaxDatagram> buffer;
  for (std::size_t i = 0; i < config_.max_datagrams; ++i) {
    Address from;
    const std::size_t size = link_.receive(from, buffer);
    if (size == 0) return false;
    now = link_.arrived(now);
    const auto datagram = std::span(buffer).first(std::min(size, buffer.size()));
    if (size > buffer.size()) {
      ++stats_.malformed;
      tap(now, DatagramRecord::Direction::kIn, kStranger, from, datagram, size);
    } else {
      receive(now, from, datagram);
    }
  }
  return true;
}

void NetworkLoop::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  const auto tap_from = [&](DatagramSieve::Sender sender) {
    tap(now, DatagramRecord::Direction::kIn, sender, from, datagram, datagram.size());
  };
  const auto header = decode_header(datagram);
  if (header && header->type == DatagramType::kHello) return greet(now, from, datagram);
  if (receive_of_peer(now, from, datagram)) return tap_from(kGuest);
  if (!header || header->type != DatagramType::kData) {
    ++stats_.malformed;
    return tap_from(kStranger);
  }
  const auto is_meant = [&](const Guest& guest) {
    return !guest.gone && guest.id() == header->connection_id && (guest.key != nullptr || guest.address == from);
  };
  if (const auto guest = std::find_if(guests_.begin(), guests_.end(), is_meant); guest != guests_.end()) {
    const std::uint64_t accepted = guest->session.stats().datagrams_received;
    const bool newest = guest->session.receive(now, datagram);
    tap_from(guest->session.stats().datagrams_received > accepted ? kGuest : kStranger);
    if (newest && guest->address != from) {
      guest->address = from;
      ++stats_.roamed;
    }
    if (newest) hear(now, *guest);
    take_refused(*guest);
    take_events(now, *guest);  // a force waits for no further system call, and for nothing that is only told later
    if (newest) measure(now, *guest);
  } else if (const auto waiting = std::find_if(half_open_.begin(), half_open_.end(), is_meant);
             waiting != half_open_.end()) {
    if (!waiting->session.receive(now, datagram)) return tap_from(kStranger);
    tap_from(kGuest);
    Guest arrived = std::move(*waiting);
    half_open_.erase(waiting);
    arrived.address = from;
    open(now, std::move(arrived));
  } else {
    ++stats_.unknown_connection;
    tap_from(kStranger);
  }
}

void NetworkLoop::greet(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> answer;
  const Doorman::Reply reply = doorman_.receive(now, from, datagram, answer);
  const DatagramSieve::Sender sender = reply.guest ? sender_of(*reply.guest, from) : kStranger;
  tap(now, DatagramRecord::Direction::kIn, sender, from, datagram, datagram.size());
  if (reply.guest) return admit(now, from, *reply.guest, datagram);
  if (reply.size > 0) send(now, sender, from, std::span(answer).first(reply.size));
}

void NetworkLoop::receive_foreign(LocalTime now, const Address& from, std::span<const std::byte> hello) {
  std::array<std::byte, kMaxDatagram> answer;
  const Doorman::Reply reply = doorman_.receive(now, from, hello, answer);
  if (reply.guest) admit(now, from, *reply.guest, hello);  // else its cookie is too old by now: it asks again
}

/// With keys configured, a guest without a key is a stranger, unless it needs none.
DatagramSieve::Sender NetworkLoop::sender_of(const Doorman::Guest& guest, const Address& from) const {
  const bool let_in = config_.keys.empty() || (config_.needs_no_key != nullptr && config_.needs_no_key(from));
  return guest.key != nullptr || let_in ? kGuest : kStranger;
}

/// Sends the same answer again to a guest that asks again because the first one was lost. In suite 1 it may ask from
/// anywhere: the answer is of use only to the holder of the ephemeral key.
bool NetworkLoop::answer_again(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  for (const auto* list : {&guests_, &half_open_}) {
    for (const Guest& present : *list) {
      if (present.random != guest.random || present.key != guest.key || present.gone) continue;
      if (present.key == nullptr && present.address != from) continue;
      send(now, sender_of(guest, from), from, present.answer);
      return true;
    }
  }
  return false;
}

void NetworkLoop::refuse(LocalTime now, const Address& from, const Doorman::Guest& guest, Refusal refusal) {
  std::array<std::byte, kMaxDatagram> answer;
  ++stats_.refused;
  notice(true, "refused \"" + guest.hello.name + "\" at " + to_string(from) + ": " + refusal.reason);
  const Refused refused{refusal.code, std::move(refusal.reason), kProtocolVersion, kProtocolVersion};
  const auto size = doorman_.refuse(guest, refused, answer).size;
  send(now, sender_of(guest, from), from, std::span(answer).first(size));
}

/// 0 means none, and is never one.
std::uint32_t NetworkLoop::take_connection_id() {
  if (next_connection_id_ == 0) next_connection_id_ = config_.shard.of;
  return std::exchange(next_connection_id_, next_connection_id_ + config_.shard.of);
}

void NetworkLoop::admit(LocalTime now, const Address& from, const Doorman::Guest& guest,
                        std::span<const std::byte> hello) {
  if (answer_again(now, from, guest)) return;
  if (guest.version == 0) return refuse(now, from, guest, {Code::kUnsupported, "no protocol version in common"});
  if (!guest.suite) {
    return refuse(
        now, from, guest,
        {Code::kUnsupported, "this server seals by " + names_of(config_.suites) + " only, and you do not offer it"});
  }
  auto claimed = Admission::seats_of(guest.hello, config_.devices);
  if (auto* const cannot_be = std::get_if<Refusal>(&claimed)) return refuse(now, from, guest, std::move(*cannot_be));
  auto& seats = std::get<std::vector<Seat>>(claimed);
  const std::uint32_t owner = config_.shard.owner_of(seats.front().device, config_.devices.size());
  if (owner != config_.shard.number) {
    if (foreign_.size() < kMaxForeign) foreign_.push_back({owner, from, {hello.begin(), hello.end()}});
    return;
  }
  for (Seat& seat : seats) seat.device -= static_cast<std::uint32_t>(first_device_);
  if (auto refusal = admission_.reason_to_refuse(from, guest.key, seats, devices_, guests_)) {
    return refuse(now, from, guest, std::move(*refusal));
  }

  const Role role = guest.hello.role;
  Session::Config session;
  session.connection_id = take_connection_id();
  session.timeout = role == Role::kController ? config_.controller_timeout : config_.observer_timeout;
  session.rekey = config_.rekey;
  session.life = config_.session_life;
  Welcome welcome = Admission::welcome_for(guest, from, seats, devices_, guests_);
  session.states_in_columns = contains(welcome.features, kFeatureStateColumns);
  welcome.timeout = session.timeout;
  welcome.server = config_.server_name;
  std::array<std::byte, kMaxDatagram> answer;
  const Doorman::Answered answered = doorman_.welcome(guest, session.connection_id, welcome, answer);
  if (answered.size == 0) return;
  const auto bytes = std::span(answer).first(answered.size);
  send(now, sender_of(guest, from), from, bytes);

  std::vector<View> views = Admission::views_of(seats);
  Guest arrived{from,
                guest.random,
                guest.key,
                guest.hello.name,
                role,
                contains(welcome.features, kFeatureChannels),
                contains(welcome.features, kFeatureDiagnostics),
                contains(welcome.features, kFeatureHandle),
                contains(welcome.features, kFeatureJoints),
                contains(welcome.features, kFeatureTeleoperation) && role == Role::kController,
                contains(welcome.features, kFeatureTeleoperation) && role == Role::kObserver,
                contains(welcome.features, kFeatureOutputs),
                session.states_in_columns,
                contains(welcome.features, kFeatureWays) ? guest.hello.ways : std::vector<std::string>(),
                std::move(seats),
                std::move(views),
                {bytes.begin(), bytes.end()},
                answered.keys ? Session(session, *answered.keys, now) : Session(session, now),
                now};
  if (half_open_.size() >= config_.max_half_open) {
    half_open_.erase(half_open_.begin());
    ++stats_.half_open_forgotten;
  }
  half_open_.push_back(std::move(arrived));
}

/// From here on the guest counts as connected.
void NetworkLoop::open(LocalTime now, Guest guest) {
  // Somebody else may have come while it was half-open.
  if (const auto refusal = admission_.reason_to_refuse(guest.address, guest.key, guest.seats, devices_, guests_)) {
    ++stats_.refused;
    notice(true, "refused \"" + guest.name + "\" at " + to_string(guest.address) + ": " + refusal->reason);
    guest.session.close(refusal->code, refusal->reason);
    return send_all(now, guest);
  }
  for (Guest& present : guests_) {
    if (present.gone || !Admission::takes_the_place_of(present, guest.address, guest.key, guest.seats)) continue;
    if (present.address == guest.address) {
      leave(present, "started again");
    } else {
      present.session.close(Code::kReplaced, "a program with the same key has taken this place");
      send_all(now, present);
      ++stats_.replaced;
      leave(present, "replaced by a program with the same key");
    }
  }
  std::erase_if(guests_, [](const Guest& present) { return present.gone; });
  ++stats_.welcomed;
  notice(false,
         "welcomed " + std::string(guest.role == Role::kController ? "controller" : "observer") + " \"" + guest.name +
             "\" at " + to_string(guest.address) +
             (guest.key != nullptr
                  ? " with the key \"" + guest.key->name + "\", sealed by " + names_of({guest.session.suite()})
                  : ""),
         change_of(guest, true, ""));
  if (guest.role == Role::kController) guest.meter.emplace(now);
  if (config_.adapt_state_rate) guest.adaptation.emplace(RateAdaptation::Config{}, now);
  guests_.push_back(std::move(guest));
  Guest& arrived = guests_.back();
  for (const Seat& seat : arrived.seats) {
    if (seat.role != Role::kController) continue;
    const Guest* const holder = guest_of(guests_, leases_.holder(seat.device, seat.channel));
    if (holder == nullptr) {
      leases_.hold(now, seat.device, seat.channel, arrived);
    } else if (arrived.can_lose) {  // needed only when somebody has come while it was half-open
      arrived.session.request(LeaseLost{.device = number_of(seat.device), .channel = seat.channel, .to = holder->name});
    }
  }
}

bool NetworkLoop::may_take_over(const Guest& guest) const {
  const std::string& name = guest.key != nullptr ? guest.key->name : guest.name;
  return std::find(config_.takeover.begin(), config_.takeover.end(), name) != config_.takeover.end();
}

/// Tells the loser of a lease, or ends its session when it cannot be told.
void NetworkLoop::dispossess(LocalTime now, Guest& loser, const Guest& winner, const TakeLease& lost) {
  const DeviceDescription& about = devices_[lost.device].about;
  notice(false, "\"" + winner.name + "\" takes " + about.name + "/" + about.channels[lost.channel].name + " from \"" +
                    loser.name + "\"");
  loser.uncouple(lost.device, lost.channel);
  const LeaseLost news{.device = number_of(lost.device), .channel = lost.channel, .to = winner.name};
  if (loser.can_lose && loser.session.request(news)) return;
  // The guest does not know the request, or does not answer.
  loser.session.close(Code::kReplaced, "\"" + winner.name + "\" has taken this place");
  send_all(now, loser);
  ++stats_.replaced;
  leave(loser, "replaced by \"" + winner.name + "\"");
}

void NetworkLoop::adapt(LocalTime now, Guest& guest) {
  const LinkStats& link = guest.session.stats();
  if (!guest.adaptation || link.round_trip == Duration::zero()) return;
  const std::uint32_t before = guest.adaptation->one_in();
  guest.adaptation->observe(now, link.round_trip, link.seen_outgoing, link.lost_outgoing);
  const std::uint32_t one_in = guest.adaptation->one_in();
  if (one_in != before) {
    notice(one_in > before, "\"" + guest.name + "\" is sent one state in " + std::to_string(one_in) +
                                (one_in > before ? ": the way to it is full" : " again"));
  }
  if (std::exchange(guest.hopeless, guest.adaptation->hopeless()) != guest.hopeless) {
    notice(guest.hopeless,
           "the link of \"" + guest.name +
               (guest.hopeless ? "\" loses too much to be of use: its forces are not taken" : "\" is of use again"));
  }
}

namespace {

/// The exchange that the datagram of this instant has ended; null when it had no echo.
const ClockExchange* exchange_of(LocalTime now, const Guest& guest) {
  const auto& exchange = guest.session.newest_exchange();
  return exchange && exchange->answered_at == now ? &*exchange : nullptr;
}

}  // namespace

/// What the forces of the newest datagram are judged by.
void NetworkLoop::hear(LocalTime now, Guest& guest) {
  const ClockExchange* const exchange = exchange_of(now, guest);
  const auto sent = exchange != nullptr ? std::optional(exchange->answered) : std::nullopt;
  for (const Seat& seat : guest.seats) {
    ServedChannel& channel = devices_[seat.device].channels[seat.channel];
    if (channel.holder == guest.id()) channel.lateness.heard(now, sent, guest.session.stats().lost);
  }
  adapt(now, guest);
}

void NetworkLoop::measure(LocalTime now, Guest& guest) {
  if (!guest.meter) return;
  guest.meter->heard(now);
  const ClockExchange* const exchange = exchange_of(now, guest);
  if (exchange == nullptr) return;
  if (const auto clock = guest.session.peer_clock()) guest.meter->observe(*exchange, *clock);
}

void NetworkLoop::report(LocalTime now) {
  Reports::Told told = reports_.turn(now, devices_, guests_);
  stats_.late_ours += told.late_ours;
  stats_.late_network += told.late_network;
  stats_.late_engine += told.late_engine;
  stats_.late_unknown += told.late_unknown;
  for (std::string& warning : told.warnings) notice(true, std::move(warning));
}

namespace {

/// Engines ask for bounded forces, but their combination in the device's loop may exceed what a frame can carry; and a
/// sensor may measure anything.
void leave_out_what_no_frame_carries(DeviceState& state) {
  for (auto* const vector : {&state.force_wanted, &state.hand_force}) {
    if (*vector && !((*vector)->array().abs() <= limits::kMaxValue).all()) vector->reset();
  }
  std::optional<Mat3>& stiffness = state.stiffness_wanted;
  const bool tells =
      state.force_wanted && stiffness && !stiffness->isZero(0) && (stiffness->array().abs() <= limits::kMaxValue).all();
  if (!tells) stiffness.reset();
  const auto fits = [](double value) { return std::abs(value) <= limits::kMaxValue; };
  if (state.joints &&
      !(std::ranges::all_of(state.joints->angle, fits) && std::ranges::all_of(state.joints->velocity, fits)))
    state.joints.reset();
}

/// An observer has seen no Couple: the leader's end tells it the scales.
void tell_scales(PortState& leader, const Couple& coupling) {
  if (leader.position_scale == 0) leader.position_scale = coupling.position_scale;
  if (leader.force_scale == 0) leader.force_scale = coupling.force_scale;
}

/// But for the buttons.
void leave_out_handle(DeviceState& state) {
  state.turning.reset();
  state.torque_applied.reset();
  state.grip.reset();
  state.grip_applied.reset();
  state.hand_force.reset();
}

}  // namespace

/// The states of a guest leave before those of the next one are looked at.
void NetworkLoop::publish(LocalTime now) {
  for (const std::uint32_t place : coupled_) publish_ports(now, place);
  for (std::size_t place = 0; place < states_.size(); ++place) {
    const DeviceState* const fresh = states_[place].fresh = states_[place].box->take();
    if (fresh == nullptr) continue;
    devices_[place].sampled.observe(fresh->tick, LocalTime(fresh->sampled.time_since_epoch()), now);
  }
  for (Guest& guest : guests_) {
    for (View& view : guest.views) {
      if (const DeviceState* const state = states_[view.device].fresh) tell_state(guest, view, *state);
    }
    send_all(now, guest);
  }
}

void NetworkLoop::tell_state(Guest& guest, View& view, const DeviceState& state) {
  if (guest.coupled && guest.coupled->device == view.device) return;
  if (guest.sees_handle) view.pressed |= state.buttons;
  const std::uint64_t one_in = guest.adaptation ? guest.adaptation->one_in() : 1;
  if (state.tick - view.last_state < std::max(view.state_every, one_in)) return;
  DeviceState told = state;
  told.device = number_of(view.device);
  leave_out_what_no_frame_carries(told);
  if (!guest.diagnoses) {
    told.force_wanted.reset();
    told.stiffness_wanted.reset();
  }
  if (!guest.sees_handle) leave_out_handle(told);
  if (!guest.sees_joints) told.joints.reset();
  told.buttons = view.pressed;
  // The guest foretells from the rounded values that it is sent.
  if (guest.sees_columns && fits_columns(told)) round_to_columns(told);
  if (view.deadband && !view.deadband->passes(told)) {
    ++stats_.foretold;
    view.pressed = 0;  // it believes just these to be held: a release that comes next is news
    return;
  }
  view.last_state = state.tick;
  view.pressed = 0;
  guest.session.send(told);
}

void NetworkLoop::take_events(LocalTime now, Guest& guest) {
  while (const Session::Event* const event = guest.session.next_event()) {
    if (const auto* force = std::get_if<Session::ForceArrived>(event)) {
      take_force(now, guest, force->command);
    } else if (const auto* port = std::get_if<Session::PortArrived>(event)) {
      take_port(now, guest, port->port);
    } else if (const auto* asked = std::get_if<Session::RequestArrived>(event)) {
      answer(now, guest, asked->id, asked->request);
    } else if (const auto* closed = std::get_if<Session::Closed>(event)) {
      if (closed->code == Code::kTimedOut) ++stats_.timed_out;
      leave(guest, closed->reason);
    }  // a server receives no states and no answers
  }
}

void NetworkLoop::send_all(LocalTime now, Guest& guest) {
  std::array<std::byte, kMaxDatagram> buffer;
  while (const std::size_t size = guest.session.next_datagram(now, buffer)) {
    send(now, kGuest, guest.address, std::span(buffer).first(size));
  }
}

/// What the engine says of how good the force is, and the number of the way by which it was made.
std::uint8_t NetworkLoop::note(const ForceCommand& command, const Guest& guest, ServedDevice& device) {
  ServedChannel& channel = device.channels[command.channel];
  const bool named = command.way > 0 && command.way <= guest.ways.size();
  const std::uint8_t way = named ? device.mail->ways.number_of(guest.ways[command.way - 1]) : std::uint8_t{0};
  channel.doubt.observe(command.error, way);
  channel.worst_error = std::max(channel.worst_error, command.error);
  if (way > 0) {
    channel.by_way.resize(std::max<std::size_t>(channel.by_way.size(), way + 1U));
    ++channel.by_way[way];
  }
  return way;
}

void NetworkLoop::take_force(LocalTime now, Guest& guest, const ForceCommand& command) {
  const std::uint32_t place = guest.device_of(command.device);
  const bool there = place < devices_.size() && command.channel < devices_[place].channels.size();
  if (!there || leases_.holder(place, command.channel) != guest.id()) {
    ++stats_.denied;
    return;
  }
  ServedDevice& device = devices_[place];
  ServedChannel& channel = device.channels[command.channel];
  const auto answered = device.sampled.find(command.based_on_tick);
  if (!answered) {
    ++stats_.unanswerable;
    ++guest.refused.unknown_tick;
    channel.lateness.refused(Lateness::Cause::kUnknownTick, 1);
    return;
  }
  if (guest.adaptation && guest.adaptation->hopeless()) {
    ++stats_.hopeless;
    return;
  }
  leases_.renew(now, place, command.channel);
  const double bound = device.about.max_force;  // N; 0: the device has not said it
  if (bound > 0 && command.force.squaredNorm() > bound * bound) channel.lateness.cut();
  const LinkStats& link = guest.session.stats();
  const std::uint64_t lost = link.lost + link.lost_outgoing;
  channel.lateness.observe({.sampled = answered->at,
                            .sent = answered->sent,
                            .received = now,
                            .round_trip = link.round_trip,
                            .valid_for = command.valid_for,
                            .lost = lost > std::exchange(guest.lost, lost)});
  RemoteForce& force = device.mail->forces[command.channel].back();  // an older one: each member is written
  force.sequence = command.sequence;
  force.answers_tick = command.based_on_tick;
  force.answers = answered->at;
  force.received = now;
  force.force = command.force;
  force.model = command.model;
  force.valid_for = command.valid_for;
  force.source = channel.holder;
  force.topology_changed = command.topology_changed;
  force.error = command.error;
  force.way = note(command, guest, device);
  force.torque = command.torque;
  force.grip_force = command.grip_force;
  device.mail->forces[command.channel].put();
  ++channel.forces;
  ++stats_.forces;
}

/// The other end of a device, while its client holds the channel.
void NetworkLoop::take_port(LocalTime now, Guest& guest, const PortFrame& port) {
  const std::uint32_t place = guest.device_of(port.device);
  const bool coupled = guest.coupled && guest.coupled->device == place && guest.coupled->channel == port.channel;
  if (!coupled || leases_.holder(place, port.channel) != guest.id()) {
    ++stats_.denied;
    return;
  }
  leases_.renew(now, place, port.channel);
  const auto coupling = coupling_by(devices_[place], port.channel);
  if (coupling) arrived(now, place, *coupling, port.channel, port);
}

/// For the haptic thread; and for observers, when they are told next.
void NetworkLoop::arrived(LocalTime now, std::uint32_t place, std::uint32_t coupling, std::uint32_t channel,
                          const PortState& port) {
  ServedDevice& device = devices_[place];
  device.mail->port_in[coupling].put({port, now, device.peers[coupling]});
  const auto waits = [&](Guest& guest) {
    View* const view = guest.sees_ports ? view_of(guest, place) : nullptr;
    if (view != nullptr) view->ports[coupling].peer_waits = true;
    return view != nullptr;
  };
  if (std::count_if(guests_.begin(), guests_.end(), waits) == 0) return;
  PortFrame& frame = device.peer_ports[coupling];
  static_cast<PortState&>(frame) = port;
  frame.device = number_of(place);
  frame.channel = channel;
  frame.of_peer = true;
}

void NetworkLoop::publish_ports(LocalTime now, std::uint32_t device) {
  for (std::uint32_t coupling = 0; coupling < Shares::kMost; ++coupling) {
    const PortState* const port = devices_[device].mail->port_out[coupling].take();
    if (port != nullptr) publish_port(now, device, coupling, *port);
  }
}

/// Our end of a coupling goes to whoever has the other one.
void NetworkLoop::publish_port(LocalTime now, std::uint32_t device, std::uint32_t coupling, const PortState& port) {
  devices_[device].phase = port.phase;
  for (const Dialled& dialled : dialled_) {
    if (dialled.device == device) dialled.peer->send(now, port);
  }
  PortFrame frame;
  static_cast<PortState&>(frame) = port;
  frame.device = number_of(device);
  const auto& leaders = devices_[device].leaders;
  if (coupling < leaders.size()) frame.channel = leaders[coupling];
  for (Guest& guest : guests_) {
    if (guest.gone || !guest.coupled || guest.coupled->device != device) continue;
    if (coupling_by(devices_[device], guest.coupled->channel) != coupling) continue;
    frame.channel = guest.coupled->channel;
    guest.session.send(frame);
  }
  show_ports(now, device, coupling, frame);
}

/// Both ends of a coupling go to the observers that want them, as often as they want states and at most 50 times a
/// second. `mine` is our end, with the channel of the other one.
void NetworkLoop::show_ports(LocalTime now, std::uint32_t place, std::uint32_t coupling, PortFrame mine) {
  ServedDevice& device = devices_[place];
  PortFrame& theirs = device.peer_ports[coupling];
  tell_scales(device.coupling->role == PortRole::kLeader ? mine : theirs, *device.coupling);
  for (Guest& guest : guests_) {
    View* const view = guest.sees_ports && !guest.gone ? view_of(guest, place) : nullptr;
    if (view == nullptr || now < view->ports[coupling].due) continue;
    const std::uint64_t every =
        std::max<std::uint64_t>(view->state_every, guest.adaptation ? guest.adaptation->one_in() : 1);
    const Duration period =
        static_cast<std::int64_t>(every) * Duration(std::chrono::seconds(1)) / std::max(device.about.loop_hz, 1U);
    view->ports[coupling].due = now + std::max(kShowPortsEvery, period);
    guest.session.send(mine);
    if (std::exchange(view->ports[coupling].peer_waits, false)) guest.session.send(theirs);
  }
}

/// Whether the datagram is of a server that this one has dialled.
bool NetworkLoop::receive_of_peer(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  for (Dialled& dialled : dialled_) {
    if (!dialled.peer->is_from_server(from, datagram)) continue;
    dialled.peer->receive(now, from, datagram);
    look_at(dialled);
    const auto port = dialled.peer->take();
    if (port && dialled.coupled) arrived(now, dialled.device, 0, 0, *port);
    return true;
  }
  return false;
}

/// Each time that it couples the device's loop forgets whom it was coupled with before.
void NetworkLoop::look_at(Dialled& dialled) {
  if (!dialled.peer->coupled()) {
    dialled.coupled = false;
  } else if (!dialled.coupled) {
    dialled.coupled = renew_peer(devices_[dialled.device], 0);
  }
}

LocalTime NetworkLoop::turn_peers(LocalTime now) {
  LocalTime next = LocalTime::max();
  for (Dialled& dialled : dialled_) {
    next = std::min(next, dialled.peer->turn(now));
    look_at(dialled);
    for (Peer::Notice& said : dialled.peer->take_notices()) notice(said.warning, std::move(said.text));
  }
  return next;
}

/// Notices the forces that the session has refused. A refused force names no channel, so it counts for every channel
/// that the guest holds.
void NetworkLoop::take_refused(Guest& guest) {
  const RefusedForces& all = guest.session.stats().refused_forces;
  const auto take = [&](std::uint64_t RefusedForces::*count, Lateness::Cause cause) {
    if (const std::uint64_t before = std::exchange(guest.refused.*count, all.*count); before != all.*count) {
      blame(guest, cause, all.*count - before);
    }
  };
  take(&RefusedForces::not_finite, Lateness::Cause::kNotFinite);
  take(&RefusedForces::out_of_bounds, Lateness::Cause::kOutOfBounds);
  take(&RefusedForces::old_sequence, Lateness::Cause::kOldSequence);
}

void NetworkLoop::blame(const Guest& guest, Lateness::Cause cause, std::uint64_t count) {
  for (const Seat& seat : guest.seats) {
    ServedChannel& channel = devices_[seat.device].channels[seat.channel];
    if (channel.holder == guest.id()) channel.lateness.refused(cause, count);
  }
}

void NetworkLoop::answer(LocalTime now, Guest& guest, std::uint32_t id, Request request) {
  const auto find_device = [&guest](auto& wanted) {
    if constexpr (requires { wanted.device; }) wanted.device = guest.device_of(wanted.device);
  };
  std::visit(find_device, request);
  const Asker asker{
      .guest = guest, .may_take_over = may_take_over(guest), .devices = devices_, .guests = guests_, .leases = leases_};
  Outcome outcome = tendon::answer(now, asker, request);
  if (outcome.code == Code::kDenied) ++stats_.denied;
  if (!outcome.warning.empty()) notice(true, std::move(outcome.warning));
  if (Guest* const loser = guest_of(guests_, outcome.loser)) {
    dispossess(now, *loser, guest, std::get<TakeLease>(request));
  }
  if (outcome.device) return guest.session.answer(id, std::move(*outcome.device));
  if (outcome.handle) return guest.session.answer(id, std::move(*outcome.handle));
  guest.session.answer(id, outcome.code, std::move(outcome.detail), outcome.wait);
}

void NetworkLoop::leave(Guest& guest, const std::string& how) {
  guest.gone = true;
  add(stats_.dropped, guest.session.stats());
  notice(guest.role == Role::kController, "\"" + guest.name + "\" at " + to_string(guest.address) + " has left: " + how,
         change_of(guest, false, how));
  leases_.give_all(guest.id());
  remember(stats_, guest);
}

void NetworkLoop::close(LocalTime now) {
  for (Dialled& dialled : dialled_) dialled.peer->close(now);
  const std::string why = "the server is going down";
  for (Guest& guest : guests_) {
    guest.session.close(Code::kShutdown, why);
    send_all(now, guest);
    add(stats_.dropped, guest.session.stats());
    remember(stats_, guest);
    notice(false, "\"" + guest.name + "\" is sent away: " + why, change_of(guest, false, why));
  }
  guests_.clear();
  half_open_.clear();
}

namespace {

std::vector<std::pair<std::string, std::uint64_t>> counts_of(const ServedChannel& channel, const Ways& ways) {
  std::vector<std::pair<std::string, std::uint64_t>> counts;
  for (std::size_t way = 1; way < channel.by_way.size(); ++way) {
    if (channel.by_way[way] > 0) counts.emplace_back(ways.name_of(static_cast<std::uint8_t>(way)), channel.by_way[way]);
  }
  return counts;
}

}  // namespace

NetworkLoop::Stats NetworkLoop::stats() const {
  Stats stats = stats_;
  stats.hellos = doorman_.stats();
  for (const ServedDevice& device : devices_) {
    for (std::size_t i = 0; i < device.channels.size(); ++i) {
      const ServedChannel& channel = device.channels[i];
      const Guest* const holder = guest_of(guests_, channel.holder);
      stats.channels.push_back({.device = device.about.name,
                                .channel = device.about.channels[i].name,
                                .holder = holder != nullptr ? holder->name : std::string(),
                                .forces = channel.forces,
                                .handovers = channel.handovers,
                                .late = channel.late,
                                .worst_error = channel.worst_error,
                                .ways = counts_of(channel, device.mail->ways)});
    }
  }
  for (const Guest& guest : guests_) {
    add(stats.dropped, guest.session.stats());
    remember(stats, guest);
  }
  return stats;
}

void NetworkLoop::send(LocalTime now, DatagramSieve::Sender partner, const Address& to,
                       std::span<const std::byte> datagram) {
  link_.send(to, datagram);
  tap(now, DatagramRecord::Direction::kOut, partner, to, datagram, datagram.size());
}

/// Puts the datagram into the recording unless the sieve leaves it out. `partner` is the other end's address.
void NetworkLoop::tap(LocalTime now, DatagramRecord::Direction direction, DatagramSieve::Sender partner,
                      const Address& peer, std::span<const std::byte> datagram, std::size_t size) {
  if (!config_.record) return;
  Mailboxes& mail = *devices_.front().mail;
  const auto left_out = [](std::atomic<std::uint64_t>& count) { count.fetch_add(1, std::memory_order_relaxed); };
  switch (sieve_.judge(now, partner, size)) {
    case DatagramSieve::Verdict::kRecord:
      break;
    case DatagramSieve::Verdict::kStranger:
      return left_out(mail.strangers_left_out);
    case DatagramSieve::Verdict::kOverBudget:
      return left_out(mail.datagrams_over_budget);
  }
  DatagramRecord* const record = mail.datagrams.back();
  if (record == nullptr) return left_out(mail.datagrams_lost);
  record->at = now;
  record->direction = direction;
  record->peer = peer;
  record->size = static_cast<std::uint32_t>(std::min<std::size_t>(size, std::numeric_limits<std::uint32_t>::max()));
  std::copy(datagram.begin(), datagram.end(), record->bytes.begin());
  mail.datagrams.push();
}

NetworkLoop::SessionChange NetworkLoop::change_of(const Guest& guest, bool came, const std::string& why) const {
  SessionChange change{.connection = guest.id(),
                       .came = came,
                       .client = guest.name,
                       .role = guest.role,
                       .address = guest.address,
                       .why = why};
  if (!guest.views.empty()) {
    const ServedDevice& device = devices_[guest.views.front().device];
    change.device = device.about.name;
    change.tick = device.sampled.newest();
  }
  return change;
}

void NetworkLoop::notice(bool warning, std::string text, std::optional<SessionChange> session) {
  if (notices_.size() < kMaxNotices) notices_.push_back({warning, std::move(text), std::move(session)});
}

std::vector<NetworkLoop::Notice> NetworkLoop::take_notices() { return std::exchange(notices_, {}); }

std::vector<NetworkLoop::Foreign> NetworkLoop::take_foreign() { return std::exchange(foreign_, {}); }

}  // namespace tendon
