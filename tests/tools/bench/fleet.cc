// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/fleet.h"

#include <netinet/in.h>
#include <poll.h>
#include <pthread.h>
#include <sys/epoll.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "protocol/handshake.h"
#include "protocol/session.h"
#include "server/haptic_loop.h"
#include "server/machine/clock.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/network_loop.h"
#include "tests/tools/bench/bench.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPeriod = milliseconds(1);
/// A server admits 20 handshakes a second from one address, 40 at once; guests come from as many addresses as it takes.
constexpr std::size_t kGuestsPerAddress = 16;
constexpr Duration kPatience = std::chrono::seconds(20);

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

Duration read(clockid_t clock) {
  timespec time{};
  clock_gettime(clock, &time);
  return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
}

std::string device_name(std::size_t i) { return "d" + std::to_string(i); }
std::string channel_name(std::size_t i) { return "c" + std::to_string(i); }

/// Who comes, and what for.
struct Plan {
  std::size_t server = 0;
  std::vector<Claim> claims;
  bool controls = true;
  std::optional<Key> key{};
};

std::vector<Plan> plans_of(const Fleet& fleet, Ratchet& secrets) {
  std::vector<Plan> plans;
  const std::size_t servers = (fleet.devices + limits::kMaxDevices - 1) / limits::kMaxDevices;
  if (fleet.one_session_for_16) {
    for (std::size_t s = 0; s < servers; ++s) {
      Plan plan{.server = s, .claims = {}};
      const std::size_t here = std::min<std::size_t>(limits::kMaxDevices, fleet.devices - s * limits::kMaxDevices);
      for (std::size_t d = 0; d < here; ++d) plan.claims.push_back({device_name(d), "", Role::kController});
      plans.push_back(plan);
    }
  } else {
    const std::size_t wanted = fleet.sessions > 0 ? fleet.sessions : fleet.devices * fleet.channels;
    for (std::size_t i = 0; i < wanted; ++i) {
      const std::size_t device = i % fleet.devices;
      const std::size_t channel = i / fleet.devices;
      const bool controls = channel < fleet.channels;
      plans.push_back({.server = device / limits::kMaxDevices,
                       .claims = {{device_name(device % limits::kMaxDevices), controls ? channel_name(channel) : "",
                                   controls ? Role::kController : Role::kObserver}},
                       .controls = controls});
    }
  }
  if (fleet.sealed) {
    for (Plan& plan : plans) plan.key = secrets.next();
  }
  return plans;
}

/// What both processes see.
struct Shared {
  enum Phase : int { kOpening, kMeasuring, kReporting, kQuit };
  std::atomic<int> phase{kOpening};
  std::atomic<int> at_work{kOpening};  ///< what the guests do
  std::atomic<std::size_t> open{0};    ///< sessions
  // Written by the guests before they are at kReporting.
  injector::DurationHistogram state_age;
  std::atomic<std::uint64_t> states{0};
  std::uint64_t lost = 0;
};

template <class T>
class SharedMemory {
 public:
  SharedMemory() {
    void* const memory = ::mmap(nullptr, sizeof(T), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
    if (memory == MAP_FAILED) fail("mmap");
    value_ = new (memory) T;
  }
  ~SharedMemory() { ::munmap(value_, sizeof(T)); }
  SharedMemory(const SharedMemory&) = delete;
  SharedMemory& operator=(const SharedMemory&) = delete;
  T* operator->() const { return value_; }
  T& operator*() const { return *value_; }

 private:
  T* value_;
};

/// Another process that runs `work`, until it has ended or this one wants no more of it.
class OtherProcess {
 public:
  template <class Work>
  explicit OtherProcess(Work work) : pid_(::fork()) {
    if (pid_ < 0) fail("fork");
    if (pid_ > 0) return;
    end_with_parent();
    try {
      work();
      ::_exit(0);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "tendon-lab bench: guests: %s\n", error.what());
      ::_exit(1);
    }
  }
  ~OtherProcess() { ::waitpid(pid_, nullptr, 0); }
  OtherProcess(const OtherProcess&) = delete;
  OtherProcess& operator=(const OtherProcess&) = delete;

  /// Throws when it has ended by itself.
  void check() const {
    int status = 0;
    if (::waitpid(pid_, &status, WNOHANG) == pid_) throw std::runtime_error("the guests' process has ended");
  }
  Duration processor_time() const {
    clockid_t clock{};
    ::clock_getcpuclockid(pid_, &clock);
    return read(clock);
  }

 private:
  pid_t pid_;
};

// ---- The guests
// ------------------------------------------------------------------------------------------------------

/// A guest's socket, connected, from an address of its own kind; tells when the kernel got a datagram.
class GuestSocket {
 public:
  GuestSocket(const Address& server, std::size_t number)
      : fd_(::socket(AF_INET, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0)) {
    if (fd_ < 0) fail("socket");
    sockaddr_in from{};
    from.sin_family = AF_INET;
    from.sin_addr.s_addr = htonl(INADDR_LOOPBACK + 256 + static_cast<std::uint32_t>(number / kGuestsPerAddress));
    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_port = htons(server.port);
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    ::setsockopt(fd_, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
    const int bytes = 1 << 20;
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &bytes, sizeof bytes);
    if (::bind(fd_, reinterpret_cast<const sockaddr*>(&from), sizeof from) != 0) fail("bind a guest");
    if (::connect(fd_, reinterpret_cast<const sockaddr*>(&to), sizeof to) != 0) fail("connect a guest");
  }
  ~GuestSocket() { ::close(fd_); }
  GuestSocket(const GuestSocket&) = delete;
  GuestSocket& operator=(const GuestSocket&) = delete;

  int fd() const { return fd_; }
  void send(std::span<const std::byte> datagram) { ::send(fd_, datagram.data(), datagram.size(), 0); }
  /// 0: none is there. `at`: Unix time.
  std::size_t receive(std::span<std::byte> buffer, Duration& at) {
    iovec piece{buffer.data(), buffer.size()};
    alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(timespec))> control;
    msghdr message{nullptr, 0, &piece, 1, control.data(), control.size(), 0};
    const ssize_t size = ::recvmsg(fd_, &message, 0);
    if (size <= 0) return 0;
    for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
      if (part->cmsg_level != SOL_SOCKET || part->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec time{};
      std::memcpy(&time, CMSG_DATA(part), sizeof time);
      at = std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
    }
    return static_cast<std::size_t>(size);
  }

 private:
  int fd_;
};

/// One guest: a handshake, then a session that answers states with the force of a spring.
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
    while (const std::size_t size = next()) socket_.send(std::span<const std::byte>(buffer).first(size));
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
    if (state_hz_ == 1000) return;  // as it comes
    for (const Grant& grant : grants_) session_->request(SetStateRate{.hz = state_hz_, .device = grant.device});
  }

  void take_events(Duration at) {
    while (const auto event = session_->next_event()) {
      if (const auto* arrived = std::get_if<Session::StateArrived>(&*event)) {
        if (measuring) {
          ++shared_.states;
          shared_.state_age.observe(at - unix_offset - arrived->state.sampled.time_since_epoch());
        }
        if (plan_.controls) answer(arrived->state);
      } else if (const auto* closed = std::get_if<Session::Closed>(&*event)) {
        if (measuring) throw std::runtime_error("a session has ended: " + closed->reason);
      }
    }
  }

  void answer(const DeviceState& state) {
    std::uint64_t& last = answered_.at(state.device);
    if (state.tick < last + every_) return;
    last = state.tick;
    ForceCommand force;
    force.sequence = ++sequence_;
    force.based_on_tick = state.tick;
    force.force = -300 * state.position;
    force.valid_for = milliseconds(50);
    force.device = state.device;
    force.channel = grants_.front().channel;
    session_->send(force);
  }

  Plan plan_;
  Shared& shared_;
  GuestSocket socket_;
  Ratchet secrets_;
  std::uint64_t every_ = 1;
  std::uint32_t state_hz_ = 1000;
  std::optional<ClientHandshake> handshake_;
  std::unique_ptr<Session> session_;
  std::vector<Grant> grants_;
  std::vector<std::uint64_t> answered_;  ///< tick, by device
  std::uint64_t sequence_ = 0;
};

void raise_file_limit() {
  rlimit files{};
  ::getrlimit(RLIMIT_NOFILE, &files);
  files.rlim_cur = files.rlim_max;
  ::setrlimit(RLIMIT_NOFILE, &files);
}

void serve_guests(const std::vector<Plan>& plans, const std::vector<Address>& servers, const Fleet& fleet,
                  Shared& shared) {
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
    // A server answers 16 half-open ones at a time.
    if (guests.size() < plans.size() && guests.size() < open + 8) {
      const std::size_t number = guests.size();
      guests.push_back(std::make_unique<Guest>(plans[number], servers[plans[number].server], number, fleet, shared));
      epoll_event event{};
      event.events = EPOLLIN;
      event.data.u32 = static_cast<std::uint32_t>(number);
      if (::epoll_ctl(epoll, EPOLL_CTL_ADD, guests.back()->fd(), &event) != 0) fail("epoll_ctl");
    }
  }
  ::close(epoll);
}

// ---- The host
// --------------------------------------------------------------------------------------------------------

SimulatedDevice::Config device_config(std::size_t number) {
  SimulatedDevice::Config device = find_device_profile("falcon")->device();
  device.hand = OperatorHand::Config{.stiffness = 300,
                                     .damping = 3,
                                     .mass = 0.05,
                                     .motion = ScriptedMotion(ScriptedMotion::Sine{
                                         .amplitude = 0.015, .frequency = 0.5 + 0.001 * static_cast<double>(number)})};
  device.max_substep = kPeriod;
  return device;
}

/// What passes in 100 ms, five rounds of the thread that takes them out.
std::size_t datagrams_of(const Fleet& fleet) { return fleet.sessions > 16 ? 32768 : 512; }

struct Lane {
  Lane(std::size_t number, const Fleet& fleet)
      : device(device_config(number)),
        // 64 steps are three rounds of the thread that takes them out; a flight of a quarter of a second.
        mail({.steps = 64, .flight = 256, .datagrams = number % limits::kMaxDevices == 0 ? datagrams_of(fleet) : 1}),
        haptic(loop_config(device, number, fleet), device, mail) {}

  static HapticLoop::Config loop_config(const SimulatedDevice& device, std::size_t number, const Fleet& fleet) {
    HapticLoop::Config config;
    config.device = static_cast<std::uint32_t>(number % limits::kMaxDevices);
    config.period = kPeriod;
    config.control.limiter.friction = {0.3, 0.8};
    config.control.limiter.longest_hold = milliseconds(2);
    config.control.max_force = device.info().max_force;
    config.control.max_slew = 1000;
    config.control.channels.assign(fleet.channels, ChannelRule::kSum);
    return config;
  }

  SimulatedDevice device;
  Mailboxes mail;
  HapticLoop haptic;
};

class Host {
 public:
  explicit Host(const Fleet& fleet)
      : fleet_(fleet), secrets_(fleet.seed), plans_(plans_of(fleet, secrets_)), links_(links_of(fleet)) {
    std::vector<Address> addresses;
    for (const auto& link : links_) addresses.push_back(link->local_address());
    // Before there are threads, and before there is memory to copy.
    guests_.emplace([&] { serve_guests(plans_, addresses, fleet_, *shared_); });
    for (std::size_t i = 0; i < fleet.devices; ++i) lanes_.push_back(std::make_unique<Lane>(i, fleet));
    for (std::size_t s = 0; s < links_.size(); ++s) networks_.push_back(network_of(s));
  }
  ~Host() {
    shared_->phase.store(Shared::kQuit, std::memory_order_release);
    guests_.reset();
  }
  Host(const Host&) = delete;
  Host& operator=(const Host&) = delete;

  FleetResult run() {
    std::thread log([this] { run_log(); });
    std::thread network([this] { run_network(); });
    std::thread haptic([this] { run_haptic(); });
    try {
      measure(haptic, network, log);
    } catch (...) {
      end(haptic, network, log);
      throw;
    }
    end(haptic, network, log);
    return result_;
  }

 private:
  static std::vector<std::unique_ptr<UdpLink>> links_of(const Fleet& fleet) {
    std::vector<std::unique_ptr<UdpLink>> links;
    for (std::size_t d = 0; d < fleet.devices; d += limits::kMaxDevices) {
      links.push_back(std::make_unique<UdpLink>(parse_address("127.0.0.1:0")));
    }
    return links;
  }

  std::unique_ptr<NetworkLoop> network_of(std::size_t server) {
    NetworkLoop::Config config;
    const Key secret = secrets_.next();
    std::copy(secret.bytes().begin(), secret.bytes().end(), config.secret.begin());
    config.max_observers = 1000;
    config.recorded.bytes_per_s = UINT64_MAX;  // run_log counts all
    std::vector<Mailboxes*> mail;
    for (std::size_t d = server * limits::kMaxDevices; d < std::min(fleet_.devices, (server + 1) * limits::kMaxDevices);
         ++d) {
      DeviceDescription about;
      about.name = device_name(d % limits::kMaxDevices);
      about.model = lanes_[d]->device.info().name;
      about.max_force = lanes_[d]->device.info().max_force;
      about.loop_hz = 1000;
      about.channels.clear();
      for (std::size_t c = 0; c < fleet_.channels; ++c) about.channels.push_back({.name = channel_name(c)});
      config.devices.push_back(about);
      mail.push_back(&lanes_[d]->mail);
    }
    for (std::size_t i = 0; i < plans_.size(); ++i) {
      if (plans_[i].key && plans_[i].server == server) {
        config.keys.push_back({.name = "k" + std::to_string(i), .role = Role::kController, .key = *plans_[i].key});
      }
    }
    return std::make_unique<NetworkLoop>(config, *links_[server], mail);
  }

  void run_haptic() {
    enter_realtime(kHapticPriority);
    LocalTime due = clock::now();
    while (!stop_.load(std::memory_order_acquire)) {
      const LocalTime now = clock::now();
      const bool counts = measuring_.load(std::memory_order_acquire);
      for (const auto& lane : lanes_) lane->haptic.step(now);
      stepped_.ring();
      const LocalTime done = clock::now();
      if (counts) {
        result_.late.observe(now - due);
        result_.round.observe(done - now);
        ++result_.rounds;
      }
      due += kPeriod;
      if (due <= done) {
        const auto behind = (done - due) / kPeriod + 1;
        if (counts) result_.missed += static_cast<std::uint64_t>(behind);
        due += behind * kPeriod;
      }
      clock::sleep_until(due);
    }
    for (const auto& lane : lanes_) lane->haptic.stop();
  }

  void run_network() {
    enter_punctual();
    const AtPriority high(fleet_.priority);
    std::vector<pollfd> fds;
    for (const auto& link : links_) fds.push_back({link->fd(), POLLIN, 0});
    fds.push_back({stepped_.fd(), POLLIN, 0});
    std::vector<LocalTime> due(links_.size(), clock::now());
    const auto forces = [&] {
      std::uint64_t sum = 0;
      for (const auto& network : networks_) sum += network->stats().forces;
      return sum;
    };
    bool counted = false;
    std::uint64_t taken_before = 0;
    const auto count = [&](bool counts) {
      if (counts && !counted) taken_before = forces();
      if (!counts && counted) result_.forces_taken = forces() - taken_before;
      counted = counts;
    };
    while (!stop_.load(std::memory_order_acquire)) {
      const LocalTime before = clock::now();
      count(measuring_.load(std::memory_order_acquire));
      const Duration left =
          std::clamp<Duration>(*std::min_element(due.begin(), due.end()) - before, Duration::zero(), milliseconds(100));
      const timespec time{0, static_cast<long>(left.count())};
      ::ppoll(fds.data(), fds.size(), &time, nullptr);
      const bool stepped = fds.back().revents != 0;
      if (stepped) stepped_.answer();
      for (std::size_t s = 0; s < links_.size(); ++s) {
        const LocalTime now = clock::now();
        if (stepped || fds[s].revents != 0 || due[s] <= now) due[s] = networks_[s]->turn(now);
      }
    }
    count(false);  // the fleet may have been stopped before this thread saw that the measurement had ended
    for (const auto& network : networks_) network->close(clock::now());
  }

  /// Takes records out, as the log thread of a server that records nothing.
  void run_log() {
    const AtPriority high(fleet_.priority);
    while (!stop_.load(std::memory_order_acquire)) {
      const bool counts = measuring_.load(std::memory_order_acquire);
      for (std::size_t i = 0; i < lanes_.size(); ++i) {
        Mailboxes& mail = lanes_[i]->mail;
        while (const StepRecord* step = mail.steps.front()) {
          if (counts && step->mode == Mode::kActive) result_.loop_age.observe(step->loop_age);
          mail.steps.pop();
        }
        while (const DatagramRecord* record = mail.datagrams.front()) {
          const bool out = record->direction == DatagramRecord::Direction::kOut;
          (out ? out_datagrams_ : in_datagrams_) += 1;
          (out ? out_bytes_ : in_bytes_) += record->size;
          mail.datagrams.pop();
        }
      }
      clock::sleep_until(clock::now() + milliseconds(20));
    }
  }

  void wait_for(int phase) {
    shared_->phase.store(phase, std::memory_order_release);
    for (const LocalTime began = clock::now(); shared_->at_work.load(std::memory_order_acquire) != phase;) {
      guests_->check();
      if (clock::now() - began > kPatience) throw std::runtime_error("the guests do not answer");
      clock::sleep_until(clock::now() + milliseconds(1));
    }
  }

  void measure(std::thread& haptic, std::thread& network, std::thread& log) {
    const LocalTime began = clock::now();
    while (shared_->open.load(std::memory_order_acquire) < plans_.size() && clock::now() - began < kPatience) {
      guests_->check();
      clock::sleep_until(clock::now() + milliseconds(10));
    }
    result_.sessions = shared_->open;
    result_.all_came = result_.sessions == plans_.size();
    if (!result_.all_came) return;
    clock::sleep_until(clock::now() + fleet_.settle);

    std::array<clockid_t, 3> clocks{};
    pthread_getcpuclockid(haptic.native_handle(), &clocks[0]);
    pthread_getcpuclockid(network.native_handle(), &clocks[1]);
    pthread_getcpuclockid(log.native_handle(), &clocks[2]);
    const auto processor = [&] {
      return std::array{read(clocks[0]), read(clocks[1]), read(clocks[2]), guests_->processor_time()};
    };
    wait_for(Shared::kMeasuring);
    const auto before = processor();
    const auto counts = [&] {
      return std::array{out_datagrams_.load(), out_bytes_.load(), in_datagrams_.load(), in_bytes_.load()};
    };
    const auto counted = counts();
    measuring_.store(true, std::memory_order_release);
    const LocalTime start = clock::now();
    clock::sleep_until(start + fleet_.length);
    while (shared_->states == 0 && clock::now() - start < kPatience) clock::sleep_until(clock::now() + milliseconds(1));
    measuring_.store(false, std::memory_order_release);
    result_.seconds = seconds(clock::now() - start);
    const auto after = processor();
    const auto now_counted = counts();
    wait_for(Shared::kReporting);
    result_.haptic = after[0] - before[0];
    result_.network = after[1] - before[1];
    result_.log = after[2] - before[2];
    result_.guests = after[3] - before[3];
    result_.out_datagrams = now_counted[0] - counted[0];
    result_.out_bytes = now_counted[1] - counted[1];
    result_.in_datagrams = now_counted[2] - counted[2];
    result_.in_bytes = now_counted[3] - counted[3];
    result_.state_age = shared_->state_age;
    result_.states_received = shared_->states;
    result_.lost = shared_->lost;
    std::size_t seen = 0;
    std::size_t controlled = 0;
    for (const Plan& plan : plans_) {
      seen += plan.claims.size();
      controlled += plan.controls ? plan.claims.size() : 0;
      result_.controllers += plan.controls ? 1 : 0;
    }
    result_.states_owed = static_cast<std::uint64_t>(result_.seconds * static_cast<double>(seen) * fleet_.state_hz);
    result_.forces_owed = static_cast<std::uint64_t>(result_.seconds * static_cast<double>(controlled) *
                                                     std::min(fleet_.force_hz, fleet_.state_hz));
  }

  void end(std::thread& haptic, std::thread& network, std::thread& log) {
    stop_.store(true, std::memory_order_release);
    haptic.join();
    stepped_.ring();
    network.join();
    log.join();
    ::munlockall();  // of enter_realtime
  }

  Fleet fleet_;
  Ratchet secrets_;
  std::vector<Plan> plans_;
  SharedMemory<Shared> shared_;
  std::vector<std::unique_ptr<UdpLink>> links_;
  std::optional<OtherProcess> guests_;
  std::vector<std::unique_ptr<Lane>> lanes_;
  std::vector<std::unique_ptr<NetworkLoop>> networks_;
  Doorbell stepped_;
  std::atomic<bool> stop_{false};
  std::atomic<bool> measuring_{false};
  FleetResult result_;
  std::atomic<std::uint64_t> out_datagrams_{0};
  std::atomic<std::uint64_t> out_bytes_{0};
  std::atomic<std::uint64_t> in_datagrams_{0};
  std::atomic<std::uint64_t> in_bytes_{0};
};

}  // namespace

FleetResult run_fleet(const Fleet& fleet) {
  raise_file_limit();
  return Host(fleet).run();
}

// ---- Its floor
// -------------------------------------------------------------------------------------------------------

namespace {

struct BareShared {
  std::atomic<bool> quit{false};
  std::atomic<bool> ready{false};
  injector::DurationHistogram age;
};

void answer_bare(const BareTraffic& traffic, const std::vector<std::unique_ptr<GuestSocket>>& sockets,
                 BareShared& shared) {
  const AtPriority high(traffic.priority);
  const Duration unix_offset = clock::unix_offset();
  const int epoll = ::epoll_create1(EPOLL_CLOEXEC);
  if (epoll < 0) fail("epoll");
  for (std::size_t i = 0; i < sockets.size(); ++i) {
    epoll_event event{};
    event.events = EPOLLIN;
    event.data.u32 = static_cast<std::uint32_t>(i);
    if (::epoll_ctl(epoll, EPOLL_CTL_ADD, sockets[i]->fd(), &event) != 0) fail("epoll_ctl");
  }
  std::vector<std::size_t> got(sockets.size());
  std::array<epoll_event, 64> ready{};
  std::array<std::byte, kMaxDatagram> buffer{};
  shared.ready = true;
  while (!shared.quit) {
    const int n = ::epoll_wait(epoll, ready.data(), static_cast<int>(ready.size()), 10);
    for (int e = 0; e < n; ++e) {
      const std::size_t i = ready[static_cast<std::size_t>(e)].data.u32;
      for (Duration at{}; sockets[i]->receive(buffer, at) > 0;) {
        Duration sent{};
        std::memcpy(&sent, buffer.data(), sizeof sent);
        shared.age.observe(at - unix_offset - sent);
        if (++got[i] % traffic.out_per_round != 0) continue;
        for (std::size_t k = 0; k < traffic.in_per_round; ++k) {
          sockets[i]->send(std::span<const std::byte>(buffer).first(traffic.in_bytes));
        }
      }
    }
  }
  ::close(epoll);
}

}  // namespace

BareResult run_bare(const BareTraffic& traffic) {
  raise_file_limit();
  std::vector<std::unique_ptr<UdpLink>> host;
  for (std::size_t s = 0; s < traffic.sockets; ++s) {
    host.push_back(std::make_unique<UdpLink>(parse_address("127.0.0.1:0")));
  }
  std::vector<std::unique_ptr<GuestSocket>> sockets;
  std::vector<sockaddr_in> addresses(traffic.sessions);
  for (std::size_t i = 0; i < traffic.sessions; ++i) {
    sockets.push_back(std::make_unique<GuestSocket>(host[i % host.size()]->local_address(), i));
    socklen_t size = sizeof addresses[i];
    if (::getsockname(sockets[i]->fd(), reinterpret_cast<sockaddr*>(&addresses[i]), &size) != 0) fail("getsockname");
  }
  const SharedMemory<BareShared> shared;
  std::optional<OtherProcess> guests(std::in_place, [&] { answer_bare(traffic, sockets, *shared); });
  sockets.clear();
  while (!shared->ready) {
    guests->check();
    clock::sleep_until(clock::now() + milliseconds(1));
  }

  BareResult result;
  std::thread thread([&] {
    enter_punctual();
    const AtPriority high(traffic.priority);
    std::vector<pollfd> fds;
    for (const auto& link : host) fds.push_back({link->fd(), POLLIN, 0});
    std::array<std::byte, kMaxDatagram> buffer{};
    const Duration began = clock::processor_time();
    const Duration guests_began = guests->processor_time();
    LocalTime due = clock::now();
    for (const LocalTime end = due + traffic.length; due < end; due += traffic.period) {
      const Duration stamp = due.time_since_epoch();
      std::memcpy(buffer.data(), &stamp, sizeof stamp);
      for (std::size_t i = 0; i < traffic.sessions; ++i) {
        for (std::size_t k = 0; k < traffic.out_per_round; ++k) {
          result.sent += ::sendto(fds[i % host.size()].fd, buffer.data(), traffic.out_bytes, 0,
                                  reinterpret_cast<const sockaddr*>(&addresses[i]), sizeof addresses[i]) > 0
                             ? 1
                             : 0;
        }
      }
      ++result.rounds;
      for (LocalTime now = clock::now(); now < due + traffic.period; now = clock::now()) {
        const timespec left{0, static_cast<long>((due + traffic.period - now).count())};
        if (::ppoll(fds.data(), fds.size(), &left, nullptr) <= 0) continue;
        for (const pollfd& fd : fds) {
          if (fd.revents == 0) continue;
          sockaddr_in from{};
          socklen_t size = sizeof from;
          while (::recvfrom(fd.fd, buffer.data(), buffer.size(), MSG_DONTWAIT, reinterpret_cast<sockaddr*>(&from),
                            &size) > 0) {
            ++result.received;
          }
        }
      }
    }
    result.host = clock::processor_time() - began;
    result.guests = guests->processor_time() - guests_began;
  });
  thread.join();
  shared->quit = true;
  guests.reset();
  result.age = shared->age;
  result.seconds = static_cast<double>(result.rounds) * seconds(traffic.period);
  return result;
}

}  // namespace tendon::bench
