// SPDX-License-Identifier: Apache-2.0
#include "server/network_loop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <utility>

#include "protocol/wire/header.h"

namespace tendon {

namespace {

using enum DatagramSieve::Sender;

constexpr std::size_t kMaxNotices = 64;

/// What this server can do beyond the version's minimum.
constexpr std::array<std::string_view, 3> kFeatures = {kFeatureLocalModel, kFeatureChannels, kFeatureDiagnostics};

bool contains(const std::vector<std::string>& features, std::string_view feature) {
  return std::find(features.begin(), features.end(), feature) != features.end();
}

std::vector<std::string> in_common(const std::vector<std::string>& offered, Role role) {
  std::vector<std::string> both;
  for (const std::string_view feature : kFeatures) {
    const bool not_for_it = feature == kFeatureDiagnostics && role != Role::kObserver;
    if (contains(offered, feature) && !not_for_it) both.emplace_back(feature);
  }
  return both;
}

template <class... Ts>
struct Overloaded : Ts... {
  using Ts::operator()...;
};
template <class... Ts>
Overloaded(Ts...) -> Overloaded<Ts...>;  // clang 14 does not deduce it

void add(NetworkLoop::Dropped& sum, const LinkStats& link) {
  sum.duplicated += link.duplicated;
  sum.malformed += link.malformed;
  sum.forged += link.forged;
  sum.old_key += link.old_key;
  sum.invalid += link.invalid;
  sum.stale += link.stale;
}

}  // namespace

NetworkLoop::NetworkLoop(const Config& config, Link& link, std::vector<Mailboxes*> mail)
    : config_(config),
      link_(link),
      sieve_(config.recorded),
      doorman_({.secret = config.secret, .keys = config.keys}),
      admission_({.keys = config.keys.size(), .max_observers = config.max_observers}, devices_, guests_),
      leases_(devices_, config.takeover),
      reports_(devices_, guests_),
      next_connection_id_(config.first_connection_id) {
  half_open_.reserve(config.max_half_open);
  config_.secret = {};  // the doorman has what it needs of it
  check_devices(config.devices);
  if (mail.size() != config.devices.size()) throw std::invalid_argument("expected mailboxes for each device");
  for (std::size_t i = 0; i < mail.size(); ++i) {
    ServedDevice& device = devices_.emplace_back(ServedDevice{.about = config.devices[i], .mail = mail[i]});
    device.about.device = static_cast<std::uint32_t>(i);
    device.channels.resize(device.about.channels.size());
  }
}

LocalTime NetworkLoop::turn(LocalTime now) {
  // What is newest leaves before anything else is looked at: a state waits for no system call.
  publish(now);
  const bool more = drain(now);
  report(now);
  for (Guest& guest : guests_) {
    if (!guest.gone) guest.session.tick(now);
    take_events(now, guest);
    if (guest.role == Role::kController) stats_.controller = guest.session.stats();
    send_all(now, guest);
  }
  std::erase_if(guests_, [](const Guest& guest) { return guest.gone; });
  stats_.half_open_forgotten +=
      std::erase_if(half_open_, [&](const Guest& guest) { return now - guest.arrived >= config_.half_open_timeout; });

  if (more) return now;
  LocalTime next = LocalTime::max();
  for (const Guest& guest : guests_) next = std::min(next, guest.session.next_tick());
  return next;
}

bool NetworkLoop::drain(LocalTime& now) {
  std::array<std::byte, kMaxDatagram> buffer;
  for (std::size_t i = 0; i < config_.max_datagrams; ++i) {
    Address from;
    const std::size_t size = link_.receive(from, buffer);
    if (size == 0) return false;
    now = link_.received_by(now);
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
    if (newest) measure(now, *guest);
    take_events(now, *guest);  // a force waits for no further system call
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
  const DatagramSieve::Sender sender = reply.guest ? sender_of(*reply.guest) : kStranger;
  tap(now, DatagramRecord::Direction::kIn, sender, from, datagram, datagram.size());
  if (reply.guest) return admit(now, from, *reply.guest);
  if (reply.size > 0) send(now, sender, from, std::span(answer).first(reply.size));
}

/// Where there are keys, only who has one is no stranger.
DatagramSieve::Sender NetworkLoop::sender_of(const Doorman::Guest& guest) const {
  return guest.key != nullptr || config_.keys.empty() ? kGuest : kStranger;
}

/// Our answer was lost and the guest asks again: the same answer. In suite 1 it may come from anywhere, it is of
/// use to one who holds the ephemeral key only.
bool NetworkLoop::answer_again(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  for (const auto* list : {&guests_, &half_open_}) {
    for (const Guest& present : *list) {
      if (present.random != guest.random || present.key != guest.key || present.gone) continue;
      if (present.key == nullptr && present.address != from) continue;
      send(now, sender_of(guest), from, present.answer);
      return true;
    }
  }
  return false;
}

void NetworkLoop::admit(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  if (answer_again(now, from, guest)) return;

  std::array<std::byte, kMaxDatagram> answer;
  const Role role = guest.hello.role;
  auto claimed = admission_.seats_of(guest.hello);
  std::optional<Refusal> refusal;
  if (guest.version == 0) {
    refusal = Refusal{Code::kUnsupported, "no protocol version in common"};
  } else if (auto* const cannot_be = std::get_if<Refusal>(&claimed)) {
    refusal = std::move(*cannot_be);
  } else {
    refusal = admission_.reason_to_refuse(from, guest.key, std::get<std::vector<Seat>>(claimed));
  }
  if (refusal) {
    ++stats_.refused;
    notice(true, "refused \"" + guest.hello.name + "\" at " + to_string(from) + ": " + refusal->reason);
    const Refused refused{refusal->code, std::move(refusal->reason), kProtocolVersion, kProtocolVersion};
    const auto size = doorman_.refuse(guest, refused, answer).size;
    return send(now, sender_of(guest), from, std::span(answer).first(size));
  }
  const auto& seats = std::get<std::vector<Seat>>(claimed);

  Session::Config session;
  session.connection_id = next_connection_id_++;
  if (next_connection_id_ == 0) next_connection_id_ = 1;  // 0 means none
  session.timeout = role == Role::kController ? config_.controller_timeout : config_.observer_timeout;
  session.rekey = config_.rekey;
  session.life = config_.session_life;
  Welcome welcome;
  welcome.version = guest.version;
  welcome.features = in_common(guest.hello.features, role);
  welcome.role = role;
  const DeviceDescription& first = devices_[seats.front().device].about;
  welcome.device_name = first.model;
  welcome.max_force = first.max_force;
  welcome.position_resolution = first.position_resolution;
  welcome.loop_hz = first.loop_hz;
  welcome.timeout = session.timeout;
  welcome.server = config_.server_name;
  welcome.grants = admission_.grants_of(from, guest.key, seats);
  std::vector<View> views;
  for (const Seat& seat : seats) {
    const bool seen =
        std::any_of(views.begin(), views.end(), [&](const View& view) { return view.device == seat.device; });
    if (!seen) views.push_back({.device = seat.device});
  }
  const Doorman::Answered answered = doorman_.welcome(guest, session.connection_id, welcome, answer);
  if (answered.size == 0) return;
  const auto bytes = std::span(answer).first(answered.size);
  send(now, sender_of(guest), from, bytes);

  Guest arrived{from,
                guest.random,
                guest.key,
                guest.hello.name,
                role,
                contains(welcome.features, kFeatureChannels),
                contains(welcome.features, kFeatureDiagnostics),
                seats,
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

/// From here on the guest is one of ours.
void NetworkLoop::open(LocalTime now, Guest guest) {
  // While it was half-open somebody else may have come.
  if (const auto refusal = admission_.reason_to_refuse(guest.address, guest.key, guest.seats)) {
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
  notice(false, "welcomed " + std::string(guest.role == Role::kController ? "controller" : "observer") + " \"" +
                    guest.name + "\" at " + to_string(guest.address) +
                    (guest.key != nullptr ? " with the key \"" + guest.key->name + "\"" : ""));
  if (guest.role == Role::kController) guest.meter.emplace(now);
  if (config_.adapt_state_rate) guest.adaptation.emplace(RateAdaptation::Config{}, now);
  guests_.push_back(std::move(guest));
  Guest& arrived = guests_.back();
  for (const Seat& seat : arrived.seats) {
    if (seat.role != Role::kController) continue;
    const Guest* const holder = holder_of(guests_, devices_[seat.device].channels[seat.channel]);
    if (holder == nullptr) {
      leases_.hold(now, arrived, seat.device, seat.channel);
    } else if (arrived.can_lose) {  // to one that was half-open for a while, this may be news
      arrived.session.request(LeaseLost{.device = seat.device, .channel = seat.channel, .to = holder->name});
    }
  }
}

/// The guest with the connection id `loser` has lost a channel to the guest of the name `to`.
void NetworkLoop::dispossess(LocalTime now, std::uint32_t loser, const TakeLease& lost, const std::string& to) {
  const auto guest =
      std::find_if(guests_.begin(), guests_.end(), [&](const Guest& one) { return !one.gone && one.id() == loser; });
  if (guest == guests_.end()) return;
  const DeviceDescription& about = devices_[lost.device].about;
  notice(false, "\"" + to + "\" takes " + about.name + "/" + about.channels[lost.channel].name + " from \"" +
                    guest->name + "\"");
  const LeaseLost news{.device = lost.device, .channel = lost.channel, .to = to};
  if (guest->can_lose && guest->session.request(news)) return;
  // It cannot be told otherwise, or does not answer.
  guest->session.close(Code::kReplaced, "\"" + to + "\" has taken this place");
  send_all(now, *guest);
  ++stats_.replaced;
  leave(*guest, "replaced by \"" + to + "\"");
}

void NetworkLoop::take_lease(LocalTime now, Guest& guest, std::uint32_t id, const TakeLease& wanted) {
  const Guest* const holder = holder_of(guests_, devices_[wanted.device].channels[wanted.channel]);
  const Leases::Answer answer = leases_.take(now, guest, holder, wanted);
  if (answer.loser != 0) dispossess(now, answer.loser, wanted, guest.name);
  guest.session.answer(id, answer.code, answer.reason, answer.wait);
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

void NetworkLoop::measure(LocalTime now, Guest& guest) {
  for (const Seat& seat : guest.seats) {
    ServedChannel& channel = devices_[seat.device].channels[seat.channel];
    if (channel.holder == guest.id()) channel.lateness.heard(now);
  }
  if (guest.meter) {
    guest.meter->heard(now);
    const auto& exchange = guest.session.newest_exchange();
    if (exchange && exchange->answered_at == now) {  // this datagram had an echo
      if (const auto clock = guest.session.peer_clock()) guest.meter->observe(*exchange, *clock);
    }
  }
  adapt(now, guest);
}

void NetworkLoop::report(LocalTime now) {
  Reports::News news = reports_.turn(now);
  stats_.late_ours += news.late_ours;
  stats_.late_network += news.late_network;
  stats_.late_engine += news.late_engine;
  for (std::string& warning : news.warnings) notice(true, std::move(warning));
}

void NetworkLoop::publish(LocalTime now) {
  for (std::uint32_t number = 0; number < devices_.size(); ++number) {
    const DeviceState* state = devices_[number].mail->state.take();
    if (state == nullptr) continue;
    devices_[number].sampled.observe(state->tick, LocalTime(state->sampled.time_since_epoch()), now);
    // What an engine asks for is bounded, what a device's loop makes of it need not be: no frame is lost for that.
    DeviceState diagnosed = *state;
    if (diagnosed.force_wanted && !(diagnosed.force_wanted->array().abs() <= limits::kMaxValue).all()) {
      diagnosed.force_wanted.reset();
    }
    DeviceState plain = *state;
    plain.force_wanted.reset();
    for (Guest& guest : guests_) {
      const auto view =
          std::find_if(guest.views.begin(), guest.views.end(), [&](const View& seen) { return seen.device == number; });
      if (view == guest.views.end()) continue;
      const std::uint64_t one_in = guest.adaptation ? guest.adaptation->one_in() : 1;
      if (state->tick - view->last_state < std::max(view->state_every, one_in)) continue;
      if (view->deadband && !view->deadband->passes(*state)) {
        ++stats_.foretold;
        continue;
      }
      view->last_state = state->tick;
      guest.session.send(guest.diagnoses ? diagnosed : plain);
    }
  }
  for (Guest& guest : guests_) send_all(now, guest);
}

void NetworkLoop::take_events(LocalTime now, Guest& guest) {
  while (!guest.gone) {
    const auto event = guest.session.next_event();
    if (!event) return;
    std::visit(Overloaded{
                   [&](const Session::ForceArrived& arrived) { take_force(now, guest, arrived.command); },
                   [&](const Session::RequestArrived& arrived) { answer(now, guest, arrived.id, arrived.request); },
                   [&](const Session::Closed& closed) {
                     if (closed.code == Code::kTimedOut) ++stats_.timed_out;
                     leave(guest, closed.reason);
                   },
                   [](const auto&) {},  // states and answers are not a server's to receive
               },
               *event);
  }
}

void NetworkLoop::send_all(LocalTime now, Guest& guest) {
  std::array<std::byte, kMaxDatagram> buffer;
  while (const std::size_t size = guest.session.next_datagram(now, buffer)) {
    send(now, kGuest, guest.address, std::span(buffer).first(size));
  }
}

void NetworkLoop::take_force(LocalTime now, Guest& guest, const ForceCommand& command) {
  const bool there = command.device < devices_.size() && command.channel < devices_[command.device].channels.size();
  if (!there || devices_[command.device].channels[command.channel].holder != guest.id()) {
    ++stats_.denied;
    return;
  }
  ServedDevice& device = devices_[command.device];
  ServedChannel& channel = device.channels[command.channel];
  const auto answered = device.sampled.find(command.based_on_tick);
  if (!answered) {
    ++stats_.unanswerable;
    channel.lateness.refuse(Lateness::Refused::kTick);
    return;
  }
  if (guest.adaptation && guest.adaptation->hopeless()) {
    ++stats_.hopeless;
    return;
  }
  // Only a force that the hand can feel keeps the lease.
  channel.renewed = now;
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
  RemoteForce force;
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
  device.mail->forces[command.channel].put(force);
  ++channel.forces;
  ++stats_.forces;
}

/// To arm or to disarm a device is for those who control it, whether they hold its channel now or not.
void NetworkLoop::order(Guest& guest, std::uint32_t id, std::uint32_t device, HapticOrder::Kind kind) {
  const std::string verb = kind == HapticOrder::Kind::kDisarm ? "disarm" : "rearm";
  const bool controls = std::any_of(guest.seats.begin(), guest.seats.end(), [&](const Seat& seat) {
    return seat.device == device && seat.role == Role::kController;
  });
  if (!controls) {
    ++stats_.denied;
    return guest.session.answer(id, Code::kDenied, "only a controller may " + verb);
  }
  if (!devices_[device].mail->orders.try_push({kind})) return guest.session.answer(id, Code::kBusy, {});
  notice(true, verb + "ed by \"" + guest.name + "\"");
  guest.session.answer(id, Code::kOk, {});
}

void NetworkLoop::answer(LocalTime now, Guest& guest, std::uint32_t id, const Request& request) {
  const auto no_such_device = [&] {
    guest.session.answer(id, Code::kInvalid, "there are " + std::to_string(devices_.size()) + " devices");
  };
  std::visit(Overloaded{
                 [&](const SetStateRate& rate) {
                   if (rate.hz == 0) return guest.session.answer(id, Code::kInvalid, "a state rate must be above zero");
                   const auto view = std::find_if(guest.views.begin(), guest.views.end(),
                                                  [&](const View& seen) { return seen.device == rate.device; });
                   if (view == guest.views.end())
                     return guest.session.answer(id, Code::kInvalid, "that device is not claimed");
                   const auto loop_hz = static_cast<double>(devices_[rate.device].about.loop_hz);
                   view->state_every = static_cast<std::uint64_t>(std::max(1.0, std::round(loop_hz / rate.hz)));
                   guest.session.answer(id, Code::kOk, {});
                 },
                 [&](const SetStateDeadband& asked) {
                   const std::string objection = StateDeadband::objection(asked);
                   if (!objection.empty()) return guest.session.answer(id, Code::kInvalid, objection);
                   for (View& view : guest.views) {
                     view.deadband.reset();
                     if (asked.max_silence > Duration::zero()) view.deadband.emplace(asked);
                   }
                   guest.session.answer(id, Code::kOk, {});
                 },
                 [&](const Rearm& rearm) { order(guest, id, rearm.device, HapticOrder::Kind::kRearm); },
                 [&](const Disarm& disarm) { order(guest, id, disarm.device, HapticOrder::Kind::kDisarm); },
                 [&](const Describe& describe) {
                   if (describe.device >= devices_.size()) return no_such_device();
                   const ServedDevice& device = devices_[describe.device];
                   DeviceDescription about = device.about;
                   for (std::size_t i = 0; i < device.channels.size(); ++i) {
                     const Guest* const holder = holder_of(guests_, device.channels[i]);
                     about.channels[i].holder = holder != nullptr ? holder->name : std::string();
                   }
                   guest.session.answer(id, std::move(about));
                 },
                 [&](const TakeLease& wanted) {
                   if (guest.sits_on(wanted.device, wanted.channel)) return take_lease(now, guest, id, wanted);
                   ++stats_.denied;
                   guest.session.answer(id, Code::kDenied, "only for one that has claimed it as a controller");
                 },
                 [&](const GiveLease& given) {
                   if (!guest.sits_on(given.device, given.channel)) {
                     ++stats_.denied;
                     return guest.session.answer(id, Code::kDenied, "only for one that has claimed it as a controller");
                   }
                   const bool holds = devices_[given.device].channels[given.channel].holder == guest.id();
                   if (holds) leases_.free(given.device, given.channel);
                   guest.session.answer(id, Code::kOk, {});
                 },
                 [&](const LeaseLost&) { guest.session.answer(id, Code::kUnsupported, "that is the server's to say"); },
             },
             request);
}

void NetworkLoop::leave(Guest& guest, const std::string& how) {
  guest.gone = true;
  add(stats_.dropped, guest.session.stats());
  notice(guest.role == Role::kController,
         "\"" + guest.name + "\" at " + to_string(guest.address) + " has left: " + how);
  leases_.free_all(guest);
  if (guest.role == Role::kController) stats_.controller_clock = guest.session.peer_clock();
}

void NetworkLoop::close(LocalTime now) {
  for (Guest& guest : guests_) {
    guest.session.close(Code::kShutdown, "the server is going down");
    send_all(now, guest);
    add(stats_.dropped, guest.session.stats());
    if (guest.role == Role::kController) stats_.controller_clock = guest.session.peer_clock();
  }
  guests_.clear();
  half_open_.clear();
}

NetworkLoop::Stats NetworkLoop::stats() const {
  Stats stats = stats_;
  stats.hellos = doorman_.stats();
  for (const ServedDevice& device : devices_) {
    for (std::size_t i = 0; i < device.channels.size(); ++i) {
      const ServedChannel& channel = device.channels[i];
      const Guest* const holder = holder_of(guests_, channel);
      stats.channels.push_back({.device = device.about.name,
                                .channel = device.about.channels[i].name,
                                .holder = holder != nullptr ? holder->name : std::string(),
                                .forces = channel.forces,
                                .handovers = channel.handovers,
                                .late = channel.late});
    }
  }
  for (const Guest& guest : guests_) {
    add(stats.dropped, guest.session.stats());
    if (guest.role == Role::kController) stats.controller_clock = guest.session.peer_clock();
  }
  return stats;
}

void NetworkLoop::send(LocalTime now, DatagramSieve::Sender partner, const Address& to,
                       std::span<const std::byte> datagram) {
  link_.send(to, datagram);
  tap(now, DatagramRecord::Direction::kOut, partner, to, datagram, datagram.size());
}

/// Into the recording, unless the sieve leaves it out. `partner` is the one at the other end.
void NetworkLoop::tap(LocalTime now, DatagramRecord::Direction direction, DatagramSieve::Sender partner,
                      const Address& peer, std::span<const std::byte> datagram, std::size_t size) {
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

void NetworkLoop::notice(bool warning, std::string text) {
  if (notices_.size() < kMaxNotices) notices_.push_back({warning, std::move(text)});
}

std::vector<NetworkLoop::Notice> NetworkLoop::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tendon
