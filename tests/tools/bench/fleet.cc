// SPDX-License-Identifier: Apache-2.0
#include "tests/tools/bench/fleet.h"

#include <poll.h>
#include <pthread.h>
#include <sys/prctl.h>

#include <algorithm>
#include <atomic>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <variant>
#include <vector>

#include "devices/simulated/profiles.h"
#include "devices/simulated/simulated_device.h"
#include "protocol/session.h"
#include "server/haptic_loop.h"
#include "server/machine/clock.h"
#include "server/machine/doorbell.h"
#include "server/machine/realtime.h"
#include "server/machine/udp_link.h"
#include "server/network_loop.h"
#include "tests/tools/bench/bench.h"
#include "tests/tools/bench/fleet_guests.h"
#include "tests/tools/bench/other_process.h"

namespace tendon::bench {
namespace {

using std::chrono::milliseconds;

constexpr Duration kPatience = std::chrono::seconds(20);

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
          if (counts) ++result_.steps_owed;
          if (counts && step->mode == Mode::kActive) {
            result_.loop_age.observe(step->loop_age);
            if (step->loop_age < kPeriod * 3 / 2) ++result_.answered_in_time;
          }
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
    result_.steps_owed += result_.missed * fleet_.devices;
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

}  // namespace tendon::bench
