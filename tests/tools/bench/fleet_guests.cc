// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/fleet_guests.h"

#include <sys/epoll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>
#include <span>
#include <utility>
#include <variant>

#include "server/machine/clock.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/guest_socket.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {

using std::chrono::milliseconds;

std::string device_name(const Fleet& fleet, std::size_t i) {
  return fleet.devices == 1 ? kFleetName : kFleetName + ("-" + std::to_string(i));
}
std::string channel_name(std::size_t i) { return "c" + std::to_string(i); }

std::vector<Plan> plans_of(const Fleet& fleet, Ratchet& secrets) {
  std::vector<Plan> plans;
  if (fleet.one_session_for_16) {
    for (std::size_t d = 0; d < fleet.devices; ++d) {
      if (d % limits::kMaxDevices == 0) plans.push_back({});
      plans.back().claims.push_back({device_name(fleet, d), "", Role::kController});
    }
  } else {
    const std::size_t wanted = fleet.sessions > 0 ? fleet.sessions : fleet.devices * fleet.channels;
    for (std::size_t i = 0; i < wanted; ++i) {
      const std::size_t device = i % fleet.devices;
      const std::size_t channel = i / fleet.devices;
      const bool controls = channel < fleet.channels;
      plans.push_back({.claims = {{device_name(fleet, device), controls ? channel_name(channel) : "",
                                   controls ? Role::kController : Role::kObserver}},
                       .controls = controls});
    }
  }
  for (Plan& plan : plans) plan.key = secrets.next();
  return plans;
}

namespace {

class Guest {
 public:
  Guest(const Plan& plan, const Address& server, std::size_t number, const Fleet& fleet, Shared& shared)
      : plan_(plan), shared_(shared), socket_(server, number), secrets_(fleet.seed + 1000 + number) {
    every_ = std::max<std::uint64_t>(1, 1000 / fleet.force_hz);
    state_hz_ = fleet.state_hz;
    answered_.resize(limits::kMaxDevices);
  }

  int fd() const { return socket_.fd(); }

  void receive(LocalTime now) {
    std::array<std::byte, kMaxDatagram> buffer;
    Duration at{};
    while (const std::size_t size = socket_.receive(buffer, at)) {
      const auto datagram = std::span<const std::byte>(buffer).first(size);
      if (measuring) {
        ++shared_.out_datagrams;
        shared_.out_bytes += size;
      }
      if (session_) {
        session_->receive(now, datagram);
        take_events(at);
      } else if (handshake_) {
        handshake_->receive(now, datagram);
        settle(now);
      }
    }
    tick(now);
  }

  void tick(LocalTime now) {
    if (session_) {
      session_->tick(now);
      take_events({});
    } else if (handshake_) {
      handshake_->tick(now);
    } else {
      greet(now);
    }
    std::array<std::byte, kMaxDatagram> buffer;
    const auto next = [&] {
      if (session_) return session_->next_datagram(now, buffer);
      return handshake_ ? handshake_->next_datagram(now, buffer) : std::size_t{0};
    };
    while (const std::size_t size = next()) {
      socket_.send(std::span<const std::byte>(buffer).first(size));
      if (!measuring) continue;
      ++shared_.in_datagrams;
      shared_.in_bytes += size;
    }
  }

  LocalTime next_tick() const {
    if (session_) return session_->next_tick();
    return handshake_ ? handshake_->next_tick() : LocalTime::min();
  }
  bool open() const { return session_ && session_->open(); }
  std::uint64_t lost() const { return session_ ? session_->stats().lost : 0; }

  static inline bool measuring = false;
  static inline Duration unix_offset{};

 private:
  void greet(LocalTime now) {
    ClientHandshake::Config config;
    config.hello.role = plan_.controls ? Role::kController : Role::kObserver;
    config.hello.name = "guest";
    config.hello.features = {std::string(kFeatureChannels)};
    if (plan_.claims.size() > 7) config.hello.features.emplace_back(kFeatureStateColumns);
    config.hello.claims = plan_.claims;
    const Key random = secrets_.next();
    std::copy_n(random.bytes().begin(), config.random.size(), config.random.begin());
    if (plan_.key) config.secret = {.key = *plan_.key, .ephemeral = secrets_.next()};
    handshake_.emplace(config, now);
  }

  void settle(LocalTime now) {
    if (!handshake_->outcome()) return;
    const ClientHandshake::Outcome outcome = *handshake_->outcome();
    handshake_.reset();
    if (const auto* refused = std::get_if<Refused>(&outcome)) throw std::runtime_error("refused: " + refused->detail);
    const auto& accepted = std::get<ClientHandshake::Accepted>(outcome);
    grants_ = accepted.welcome.grants;
    Session::Config config;
    config.connection_id = accepted.connection_id;
    session_ =
        accepted.keys ? std::make_unique<Session>(config, *accepted.keys, now) : std::make_unique<Session>(config, now);
    if (state_hz_ == 1000) return;  // every state
    for (const Grant& grant : grants_) session_->request(SetStateRate{.hz = state_hz_, .device = grant.device});
  }

  void take_events(Duration at) {
    while (const auto event = session_->next_event()) {
      if (const auto* arrived = std::get_if<Session::StateArrived>(&*event)) {
        if (measuring) {
          ++shared_.states;
          shared_.state_age.observe(at - unix_offset - arrived->state.sampled.time_since_epoch());
        }
        if (!plan_.controls) continue;
        if (measuring) judge(arrived->state);
        answer(arrived->state);
      } else if (const auto* closed = std::get_if<Session::Closed>(&*event)) {
        if (measuring) throw std::runtime_error("a session has ended: " + closed->reason);
      }
    }
  }

  /// The sequence number of a force is the tick of the state that it answers, and a state contains it.
  void judge(const DeviceState& state) {
    if (state.mode != Mode::kActive) return;
    shared_.loop_age.observe(kPeriod * static_cast<Duration::rep>(state.tick - state.force_sequence));
    const Answered& last = answered_.at(state.device);
    const bool of_step_before = state.force_sequence == last.tick && state.tick == last.tick + 1;
    if (of_step_before && state.sampled - last.sampled < kPeriod * 3 / 2) ++shared_.answered_in_time;
  }

  void answer(const DeviceState& state) {
    Answered& last = answered_.at(state.device);
    if (state.tick < last.tick + every_) return;
    last = {state.tick, state.sampled};
    ForceCommand force;
    force.sequence = state.tick;
    force.based_on_tick = state.tick;
    force.force = -300 * state.position;
    force.valid_for = milliseconds(50);
    force.device = state.device;
    force.channel = grants_.front().channel;
    session_->send(force);
    ++shared_.forces_sent;
  }

  struct Answered {
    std::uint64_t tick = 0;
    PeerTime sampled{};
  };

  Plan plan_;
  Shared& shared_;
  GuestSocket socket_;
  Ratchet secrets_;
  std::uint64_t every_ = 1;
  std::uint32_t state_hz_ = 1000;
  std::optional<ClientHandshake> handshake_;
  std::unique_ptr<Session> session_;
  std::vector<Grant> grants_;
  std::vector<Answered> answered_;
};

}  // namespace

void serve_guests(const std::vector<Plan>& plans, const Address& server, const Fleet& fleet, Shared& shared) {
  const AtPriority high(fleet.priority);
  ::prctl(PR_SET_TIMERSLACK, 1UL, 0UL, 0UL, 0UL);
  std::vector<std::unique_ptr<Guest>> guests;
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  if (epoll < 0) fail("epoll");
  std::array<epoll_event, 64> ready{};
  LocalTime sweep{};
  std::uint64_t lost_before = 0;
  const auto lost = [&] {
    std::uint64_t sum = 0;
    for (const auto& guest : guests) sum += guest->lost();
    return sum;
  };
  for (;;) {
    const int phase = shared.phase.load(std::memory_order_acquire);
    if (phase == Shared::kQuit) break;
    if (phase != shared.at_work.load(std::memory_order_relaxed)) {
      Guest::unix_offset = clock::unix_offset();
      Guest::measuring = phase == Shared::kMeasuring;
      (phase == Shared::kMeasuring ? shared.from : shared.until) = clock::now();
      if (phase == Shared::kMeasuring) lost_before = lost();
      if (phase == Shared::kReporting) shared.lost = lost() - lost_before;
      shared.at_work.store(phase, std::memory_order_release);
    }
    const int n = ::epoll_wait(epoll, ready.data(), static_cast<int>(ready.size()), 1);
    const LocalTime now = clock::now();
    for (int i = 0; i < n; ++i) guests[ready[static_cast<std::size_t>(i)].data.u32]->receive(now);
    if (now < sweep) continue;
    sweep = now + kPeriod;
    std::size_t open = 0;
    for (const auto& guest : guests) {
      if (guest->next_tick() <= now) guest->tick(now);
      open += guest->open() ? 1 : 0;
    }
    shared.open.store(open, std::memory_order_release);
    // A server handles 16 half-open handshakes at a time.
    if (guests.size() < plans.size() && guests.size() < open + 8) {
      const std::size_t number = guests.size();
      guests.push_back(std::make_unique<Guest>(plans[number], server, number, fleet, shared));
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.u32 = static_cast<std::uint32_t>(number);
      if (::epoll_ctl(epoll, EPOLL_CTL_ADD, guests.back()->fd(), &event) != 0) fail("epoll_ctl");
    }
  }
  ::close(epoll);
}

}  // namespace tendon::bench
