// SPDX-License-Identifier: Apache-2.0
#include "server/network_loop.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "protocol/codec.h"

namespace tendon {

namespace {

constexpr std::size_t kMaxNotices = 64;

/// What this server can do beyond the version's minimum.
constexpr std::array<std::string_view, 1> kFeatures = {kFeatureLocalModel};

std::vector<std::string> in_common(const std::vector<std::string>& offered) {
  std::vector<std::string> both;
  for (const std::string_view feature : kFeatures) {
    if (std::find(offered.begin(), offered.end(), feature) != offered.end()) both.emplace_back(feature);
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

/// What a key lets its holder do.
bool may(const ClientKey* key, Role role) {
  return key == nullptr || key->role == Role::kController || role == Role::kObserver;
}

}  // namespace

NetworkLoop::NetworkLoop(const Config& config, Link& link, Mailboxes& mail)
    : config_(config),
      link_(link),
      mail_(mail),
      doorman_({.secret = config.secret, .keys = config.keys}),
      next_connection_id_(config.first_connection_id) {
  guests_.reserve(config.max_observers + 1);
  half_open_.reserve(config.max_half_open);
  config_.secret = {};  // the doorman has what it needs of it
}

LocalTime NetworkLoop::turn(LocalTime now) {
  const bool more = drain(now);
  publish(now);
  for (Guest& guest : guests_) {
    guest.session.tick(now);
    serve(now, guest);
  }
  std::erase_if(guests_, [](const Guest& guest) { return guest.gone; });
  stats_.half_open_forgotten +=
      std::erase_if(half_open_, [&](const Guest& guest) { return now - guest.arrived >= config_.half_open_timeout; });

  report_lateness(now);

  if (more) return now;
  LocalTime next = LocalTime::max();
  for (const Guest& guest : guests_) next = std::min(next, guest.session.next_tick());
  return next;
}

bool NetworkLoop::drain(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer;
  for (std::size_t i = 0; i < config_.max_datagrams; ++i) {
    Address from;
    const std::size_t size = link_.receive(from, buffer);
    if (size == 0) return false;
    const auto datagram = std::span(buffer).first(std::min(size, buffer.size()));
    tap(now, DatagramRecord::Direction::kIn, from, datagram, size);
    if (size > buffer.size()) {
      ++stats_.malformed;
    } else {
      receive(now, from, datagram);
    }
  }
  return true;
}

void NetworkLoop::receive(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  const auto header = decode_header(datagram);
  if (header && header->type == DatagramType::kHello) return greet(now, from, datagram);
  if (!header || header->type != DatagramType::kData) {
    ++stats_.malformed;
    return;
  }
  const auto is_meant = [&](const Guest& guest) {
    return guest.session.connection_id() == header->connection_id && (guest.key != nullptr || guest.address == from);
  };
  if (const auto guest = std::find_if(guests_.begin(), guests_.end(), is_meant); guest != guests_.end()) {
    const bool newest = guest->session.receive(now, datagram);
    if (newest && guest->address != from) {
      guest->address = from;
      ++stats_.roamed;
    }
    if (newest && guest->role == Role::kController) lateness_.heard(now);
    if (newest) adapt(now, *guest);
  } else if (const auto waiting = std::find_if(half_open_.begin(), half_open_.end(), is_meant);
             waiting != half_open_.end()) {
    if (!waiting->session.receive(now, datagram)) return;
    Guest arrived = std::move(*waiting);
    half_open_.erase(waiting);
    arrived.address = from;
    open(now, std::move(arrived));
  } else {
    ++stats_.unknown_connection;
  }
}

void NetworkLoop::greet(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> answer;
  const Doorman::Reply reply = doorman_.receive(now, from, datagram, answer);
  if (reply.guest) return admit(now, from, *reply.guest);
  if (reply.size > 0) send(now, from, std::span(answer).first(reply.size));
}

std::optional<NetworkLoop::Refusal> NetworkLoop::reason_to_refuse(const Address& from, const ClientKey* key,
                                                                  Role role) const {
  if (key == nullptr && !config_.keys.empty()) {
    return Refusal{Code::kDenied, "this server lets in those who have a key: --key FILE"};
  }
  if (!may(key, role)) return Refusal{Code::kDenied, "the key \"" + key->name + "\" is an observer's"};
  std::size_t observers = 0;
  for (const Guest& present : guests_) {
    if (present.gone) continue;
    // The same program, started again: it takes its own place.
    const bool itself = key == present.key && (present.address == from ||
                                               (key != nullptr && role == present.role && role == Role::kController));
    if (itself) continue;
    if (present.role == Role::kObserver) ++observers;
    if (role == Role::kController && present.role == Role::kController) {
      return Refusal{Code::kBusy, "the device is controlled by \"" + present.name + "\" at " +
                                      to_string(present.address) + "; observers are welcome"};
    }
  }
  if (role == Role::kObserver && observers >= config_.max_observers) {
    return Refusal{Code::kBusy, "there are " + std::to_string(observers) + " observers already"};
  }
  return std::nullopt;
}

/// Our answer was lost and the guest asks again: the same answer. In suite 1 it may come from anywhere, it is of
/// use to one who holds the ephemeral key only.
bool NetworkLoop::answer_again(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  for (const auto* list : {&guests_, &half_open_}) {
    for (const Guest& present : *list) {
      if (present.random != guest.random || present.key != guest.key || present.gone) continue;
      if (present.key == nullptr && present.address != from) continue;
      send(now, from, present.answer);
      return true;
    }
  }
  return false;
}

void NetworkLoop::admit(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  if (answer_again(now, from, guest)) return;

  std::array<std::byte, kMaxDatagram> answer;
  const Role role = guest.hello.role;
  std::optional<Refusal> refusal = guest.version == 0 ? Refusal{Code::kUnsupported, "no protocol version in common"}
                                                      : reason_to_refuse(from, guest.key, role);
  if (refusal) {
    ++stats_.refused;
    notice(true, "refused \"" + guest.hello.name + "\" at " + to_string(from) + ": " + refusal->reason);
    const Refused refused{refusal->code, std::move(refusal->reason), kProtocolVersion, kProtocolVersion};
    return send(now, from, std::span(answer).first(doorman_.refuse(guest, refused, answer).size));
  }

  Session::Config session;
  session.connection_id = next_connection_id_++;
  if (next_connection_id_ == 0) next_connection_id_ = 1;  // 0 means none
  session.timeout = role == Role::kController ? config_.controller_timeout : config_.observer_timeout;
  session.rekey = config_.rekey;
  session.life = config_.session_life;
  Welcome welcome;
  welcome.version = guest.version;
  welcome.features = in_common(guest.hello.features);
  welcome.role = role;
  welcome.device_name = config_.device_name;
  welcome.max_force = config_.max_force;
  welcome.position_resolution = config_.position_resolution;
  welcome.loop_hz = static_cast<std::uint32_t>(std::lround(1 / seconds(config_.haptic_period)));
  welcome.timeout = session.timeout;
  welcome.server = config_.server_name;
  const Doorman::Answered answered = doorman_.welcome(guest, session.connection_id, welcome, answer);
  if (answered.size == 0) return;
  const auto bytes = std::span(answer).first(answered.size);
  send(now, from, bytes);

  Guest arrived{from,
                guest.random,
                guest.key,
                guest.hello.name,
                role,
                welcome.loop_hz,
                {bytes.begin(), bytes.end()},
                answered.keys ? Session(session, *answered.keys, now) : Session(session, now),
                now};
  if (!answered.keys) return open(now, std::move(arrived));
  if (half_open_.size() >= config_.max_half_open) {
    half_open_.erase(half_open_.begin());
    ++stats_.half_open_forgotten;
  }
  half_open_.push_back(std::move(arrived));
}

/// From here on the guest is one of ours.
void NetworkLoop::open(LocalTime now, Guest guest) {
  // While it was half-open somebody else may have come.
  if (const auto refusal = reason_to_refuse(guest.address, guest.key, guest.role)) {
    ++stats_.refused;
    notice(true, "refused \"" + guest.name + "\" at " + to_string(guest.address) + ": " + refusal->reason);
    guest.session.close(refusal->code, refusal->reason);
    return send_all(now, guest);
  }
  for (Guest& present : guests_) {
    if (present.gone || present.key != guest.key) continue;
    if (present.address == guest.address) {
      leave(present, "started again");
    } else if (guest.key != nullptr && guest.role == Role::kController && present.role == Role::kController) {
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
  if (guest.role == Role::kController) lateness_.begin(now);
  if (config_.adapt_state_rate) guest.adaptation.emplace(RateAdaptation::Config{}, now);
  guests_.push_back(std::move(guest));
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

void NetworkLoop::report_lateness(LocalTime now) {
  if (now < report_next_) return;
  report_next_ = now + std::chrono::seconds(1);
  Lateness::Report report = lateness_.report(now);
  stats_.late += report.late;
  if (!report.text.empty()) notice(true, std::move(report.text));
}

void NetworkLoop::publish(LocalTime now) {
  const DeviceState* state = mail_.state.take();
  if (state == nullptr) return;
  sampled_[state->tick % kRemembered] = {state->tick, LocalTime(state->sampled.time_since_epoch()), now};
  for (Guest& guest : guests_) {
    const std::uint64_t one_in = guest.adaptation ? guest.adaptation->one_in() : 1;
    if (state->tick - guest.last_state < std::max(guest.state_every, one_in)) continue;
    guest.last_state = state->tick;
    guest.session.send(*state);
  }
}

void NetworkLoop::serve(LocalTime now, Guest& guest) {
  while (const auto event = guest.session.next_event()) {
    std::visit(Overloaded{
                   [&](const Session::ForceArrived& arrived) { take_force(now, guest, arrived.command); },
                   [&](const Session::RequestArrived& arrived) { answer(guest, arrived.id, arrived.request); },
                   [&](const Session::Closed& closed) {
                     if (closed.code == Code::kTimedOut) ++stats_.timed_out;
                     leave(guest, closed.reason);
                   },
                   [](const auto&) {},  // states and answers are not a server's to receive
               },
               *event);
  }
  if (guest.role == Role::kController) stats_.controller = guest.session.stats();
  send_all(now, guest);
}

void NetworkLoop::send_all(LocalTime now, Guest& guest) {
  std::array<std::byte, kMaxDatagram> buffer;
  while (const std::size_t size = guest.session.next_datagram(now, buffer)) {
    send(now, guest.address, std::span(buffer).first(size));
  }
}

void NetworkLoop::take_force(LocalTime now, Guest& guest, const ForceCommand& command) {
  if (guest.role != Role::kController) {
    ++stats_.denied;
    return;
  }
  const Sampled& answered = sampled_[command.based_on_tick % kRemembered];
  if (answered.tick != command.based_on_tick || command.based_on_tick == 0) {
    ++stats_.unanswerable;
    return;
  }
  if (guest.adaptation && guest.adaptation->hopeless()) {
    ++stats_.hopeless;
    return;
  }
  lateness_.observe({.sampled = answered.at,
                     .sent = answered.sent,
                     .received = now,
                     .round_trip = guest.session.stats().round_trip,
                     .valid_for = command.valid_for});
  RemoteForce force;
  force.sequence = command.sequence;
  force.answers_tick = command.based_on_tick;
  force.answers = answered.at;
  force.received = now;
  force.force = command.force;
  force.model = command.model;
  force.valid_for = command.valid_for;
  mail_.force.put(force);
  ++stats_.forces;
}

void NetworkLoop::answer(Guest& guest, std::uint32_t id, const Request& request) {
  std::visit(Overloaded{
                 [&](const SetStateRate& rate) {
                   const auto loop_hz = static_cast<double>(guest.loop_hz);
                   if (rate.hz == 0) return guest.session.answer(id, Code::kInvalid, "a state rate must be above zero");
                   guest.state_every = static_cast<std::uint64_t>(std::max(1.0, std::round(loop_hz / rate.hz)));
                   guest.session.answer(id, Code::kOk, {});
                 },
                 [&](const Rearm&) {
                   if (guest.role != Role::kController) {
                     ++stats_.denied;
                     return guest.session.answer(id, Code::kDenied, "only the controller may rearm");
                   }
                   if (!mail_.orders.try_push(HapticOrder::kRearm)) return guest.session.answer(id, Code::kBusy, {});
                   notice(true, "rearmed by \"" + guest.name + "\"");
                   guest.session.answer(id, Code::kOk, {});
                 },
                 [&](const auto&) { guest.session.answer(id, Code::kUnsupported, "there is nothing to choose from"); },
             },
             request);
}

void NetworkLoop::leave(Guest& guest, const std::string& how) {
  guest.gone = true;
  add(stats_.dropped, guest.session.stats());
  notice(guest.role == Role::kController,
         "\"" + guest.name + "\" at " + to_string(guest.address) + " has left: " + how);
  // A full ring means 16 orders wait: the haptic thread stands still, and age will do the same a little later.
  if (guest.role != Role::kController) return;
  mail_.orders.try_push(HapticOrder::kRelease);
  lateness_.end();
  stats_.controller_clock = guest.session.peer_clock();
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
  for (const Guest& guest : guests_) {
    add(stats.dropped, guest.session.stats());
    if (guest.role == Role::kController) stats.controller_clock = guest.session.peer_clock();
  }
  return stats;
}

void NetworkLoop::send(LocalTime now, const Address& to, std::span<const std::byte> datagram) {
  link_.send(to, datagram);
  tap(now, DatagramRecord::Direction::kOut, to, datagram, datagram.size());
}

void NetworkLoop::tap(LocalTime now, DatagramRecord::Direction direction, const Address& peer,
                      std::span<const std::byte> datagram, std::size_t size) {
  DatagramRecord* const record = mail_.datagrams.back();
  if (record == nullptr) {
    mail_.datagrams_lost.fetch_add(1, std::memory_order_relaxed);
    return;
  }
  record->at = now;
  record->direction = direction;
  record->peer = peer;
  record->size = static_cast<std::uint32_t>(std::min<std::size_t>(size, std::numeric_limits<std::uint32_t>::max()));
  std::copy(datagram.begin(), datagram.end(), record->bytes.begin());
  mail_.datagrams.push();
}

void NetworkLoop::notice(bool warning, std::string text) {
  if (notices_.size() < kMaxNotices) notices_.push_back({warning, std::move(text)});
}

std::vector<NetworkLoop::Notice> NetworkLoop::take_notices() { return std::exchange(notices_, {}); }

}  // namespace tendon
