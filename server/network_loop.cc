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

}  // namespace

NetworkLoop::NetworkLoop(const Config& config, Link& link, Mailboxes& mail)
    : config_(config),
      link_(link),
      mail_(mail),
      doorman_({.secret = config.secret}),
      next_connection_id_(config.first_connection_id) {
  guests_.reserve(config.max_observers + 1);
}

LocalTime NetworkLoop::turn(LocalTime now) {
  const bool more = drain(now);
  publish();
  for (Guest& guest : guests_) {
    guest.session.tick(now);
    serve(now, guest);
  }
  std::erase_if(guests_, [](const Guest& guest) { return guest.gone; });

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
  if (header && header->type == DatagramType::kData) {
    for (Guest& guest : guests_) {
      if (guest.address != from || guest.session.connection_id() != header->connection_id) continue;
      return guest.session.receive(now, datagram);
    }
  }
  ++stats_.malformed;
}

void NetworkLoop::greet(LocalTime now, const Address& from, std::span<const std::byte> datagram) {
  std::array<std::byte, kMaxDatagram> answer;
  const std::uint64_t malformed = doorman_.malformed();
  const Doorman::Reply reply = doorman_.receive(now, from, datagram, answer);
  stats_.malformed += doorman_.malformed() - malformed;
  if (reply.guest) return admit(now, from, *reply.guest);
  if (reply.size > 0) send(now, from, std::span(answer).first(reply.size));
}

std::string NetworkLoop::reason_to_refuse(const Address& from, const Doorman::Guest& guest, Code& code) const {
  if (guest.version == 0) {
    code = Code::kUnsupported;
    return "no protocol version in common";
  }
  code = Code::kBusy;
  std::size_t observers = 0;
  for (const Guest& present : guests_) {
    if (present.address == from || present.gone) continue;  // the same program, started again: it takes its own place
    if (present.role == Role::kObserver) ++observers;
    if (guest.hello.role == Role::kController && present.role == Role::kController) {
      return "the device is controlled by \"" + present.name + "\" at " + to_string(present.address) +
             "; observers are welcome";
    }
  }
  if (guest.hello.role == Role::kObserver && observers >= config_.max_observers) {
    return "there are " + std::to_string(observers) + " observers already";
  }
  return {};
}

void NetworkLoop::admit(LocalTime now, const Address& from, const Doorman::Guest& guest) {
  std::array<std::byte, kMaxDatagram> answer;
  // Our answer was lost and the guest asks again: the same answer.
  for (const Guest& present : guests_) {
    if (present.address != from || present.random != guest.random || present.gone) continue;
    const std::size_t size = Doorman::welcome(present.session.connection_id(), guest.random, present.welcome, answer);
    return send(now, from, std::span(answer).first(size));
  }

  Code code{};
  if (std::string reason = reason_to_refuse(from, guest, code); !reason.empty()) {
    ++stats_.refused;
    notice(true, "refused \"" + guest.hello.name + "\" at " + to_string(from) + ": " + reason);
    const Refused refused{code, std::move(reason), kProtocolVersion, kProtocolVersion};
    const std::size_t size = Doorman::refuse(guest.random, refused, answer);
    return send(now, from, std::span(answer).first(size));
  }
  for (Guest& present : guests_) {
    if (present.address == from && !present.gone) leave(present, "started again");
  }
  std::erase_if(guests_, [](const Guest& present) { return present.gone; });

  const bool controller = guest.hello.role == Role::kController;
  Session::Config session;
  session.connection_id = next_connection_id_++;
  if (next_connection_id_ == 0) next_connection_id_ = 1;  // 0 means none
  session.timeout = controller ? config_.controller_timeout : config_.observer_timeout;
  Welcome welcome;
  welcome.version = guest.version;
  welcome.features = in_common(guest.hello.features);
  welcome.role = guest.hello.role;
  welcome.device_name = config_.device_name;
  welcome.max_force = config_.max_force;
  welcome.position_resolution = config_.position_resolution;
  welcome.loop_hz = static_cast<std::uint32_t>(std::lround(1 / seconds(config_.haptic_period)));
  welcome.timeout = session.timeout;
  welcome.server = config_.server_name;
  const std::size_t size = Doorman::welcome(session.connection_id, guest.random, welcome, answer);
  send(now, from, std::span(answer).first(size));

  ++stats_.welcomed;
  notice(false, "welcomed " + std::string(controller ? "controller" : "observer") + " \"" + guest.hello.name +
                    "\" at " + to_string(from));
  guests_.push_back(
      {from, guest.random, guest.hello.name, guest.hello.role, std::move(welcome), Session(session, now)});
}

void NetworkLoop::publish() {
  const DeviceState* state = mail_.state.take();
  if (state == nullptr) return;
  sampled_[state->tick % kRemembered] = {state->tick, LocalTime(state->sampled.time_since_epoch())};
  for (Guest& guest : guests_) {
    if (state->tick - guest.last_state < guest.state_every) continue;
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
                   const auto loop_hz = static_cast<double>(guest.welcome.loop_hz);
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
             },
             request);
}

void NetworkLoop::leave(Guest& guest, const std::string& how) {
  guest.gone = true;
  notice(guest.role == Role::kController,
         "\"" + guest.name + "\" at " + to_string(guest.address) + " has left: " + how);
  // A full ring means 16 orders wait: the haptic thread stands still, and age will do the same a little later.
  if (guest.role == Role::kController) mail_.orders.try_push(HapticOrder::kRelease);
}

void NetworkLoop::close(LocalTime now) {
  std::array<std::byte, kMaxDatagram> buffer;
  for (Guest& guest : guests_) {
    guest.session.close(Code::kShutdown, "the server is going down");
    while (const std::size_t size = guest.session.next_datagram(now, buffer)) {
      send(now, guest.address, std::span(buffer).first(size));
    }
  }
  guests_.clear();
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
