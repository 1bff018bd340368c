// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <filesystem>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "protocol/discovery.h"
#include "protocol/wire/text.h"
#include "server/build_info.h"
#include "server/device_factory.h"
#include "server/machine/clock.h"
#include "server/machine/log.h"
#include "server/machine/randomness.h"
#include "server/machine/realtime.h"
#include "server/scene/key_folder.h"

namespace tendon {

namespace {

std::string host_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  ::gethostname(name.data(), name.size() - 1);
  const std::string whole = name.data();
  return whole.substr(0, whole.find('.'));
}

std::unique_ptr<Announcer> announcer_of(const std::vector<Scene>& scenes, const Address& listen) {
  std::vector<Announcer::Device> devices;
  for (const Scene& scene : scenes) {
    if (!scene.discovery || !scene.discovery->announce) continue;
    Announcer::Device& device = devices.emplace_back();
    const std::string& name = scene.discovery->name;
    device.name = name.empty() ? clip(scene.name + " at " + host_name(), dns_sd::kMaxName) : name;
    device.about = {.version = kProtocolVersion,
                    .device = scene.name,
                    .hz = loop_hz(scene),
                    .suite = scenes.front().network.keys ? 1U : 0U};
    for (const Scene::Channel& channel : scene.channels) device.about.channels.push_back(channel.name);
  }
  if (devices.empty()) return nullptr;
  return std::make_unique<Announcer>(std::move(devices), listen, [](bool warning, const std::string& sentence) {
    warning ? log::warn(sentence) : log::info(sentence);
  });
}

/// Throws std::runtime_error if there is no processor for a busy network thread.
const std::vector<Scene>& checked(const std::vector<Scene>& scenes) {
  if (scenes.front().network.busy && processors_allowed() == 1) {
    throw std::runtime_error(
        "[network] busy = true requires a whole processor, but this server can only use one processor, which its other "
        "threads also need");
  }
  return scenes;
}

/// With this number of devices, a network thread is busy for at least a third of the time (tests/tools/bench).
constexpr std::size_t kDevicesOfANetworkThread = 128;

/// Returns a power of two.
std::uint32_t network_threads_for(const std::vector<Scene>& scenes) {
  const Scene::Network& network = scenes.front().network;
  if (network.threads) return *network.threads;
  if (!needs_one_network_thread(scenes).empty()) return 1;
  const auto processors = static_cast<std::size_t>(processors_allowed());
  return static_cast<std::uint32_t>(std::bit_floor(
      std::clamp<std::size_t>(scenes.size() / kDevicesOfANetworkThread, 1, std::max<std::size_t>(processors, 1))));
}

/// Throws std::runtime_error with a message for the operator.
template <class Run>
std::thread thread_of(const std::string& name, Run run) {
  try {
    return std::thread(std::move(run));
  } catch (const std::system_error& refused) {
    throw std::runtime_error("cannot start the thread " + name + ": " + refused.code().message());
  }
}

Heartbeat* heart_of(const Scene& scene, Guardian* guardian) {
  if (guardian == nullptr || !scene.driver().moves_a_hand || scene.loop.device >= Guardian::kDevices) return nullptr;
  return &guardian->heartbeat(scene.loop.device);
}

std::unique_ptr<SafeDevice> safe_device(const Scene& scene, Device& device, const Guardian* guardian) {
  if (!scene.safety) return nullptr;
  SafeDevice::Config config = *scene.safety;
  if (scene.driver().moves_a_hand) config.guardian = &guardian->stands();
  return std::make_unique<SafeDevice>(config, device);
}

Assembly::Config config_of(const Scene::Network& scene, LocalTime now) {
  Assembly::Config config{.now = now};
  NetworkLoop::Config& network = config.network;
  fill_random(network.secret);
  fill_random(std::as_writable_bytes(std::span(&network.first_connection_id, 1)));
  network.first_connection_id |= 1;  // must not be 0
  if (scene.keys) network.keys = read_key_folder(*scene.keys);
  if (scene.unix_path) network.needs_no_key = UnixSocket::is_peer;
  network.server_name = "tendond " + std::string(kVersion);
  // Nanoseconds of Unix time, so it exceeds the epoch of all earlier runs unless the clock is set back (EnergyTank).
  config.epoch = static_cast<std::uint64_t>((now.time_since_epoch() + clock::unix_offset()).count());
  return config;
}

}  // namespace

Server::Hardware::Hardware(const Scene& scene, Guardian* guardian)
    : device(make_device(scene, guardian)), safe(safe_device(scene, *device, guardian)) {}

std::vector<Server::Hardware> Server::hardware_of(const std::vector<Scene>& scenes, Guardian* guardian) {
  std::vector<Hardware> all;
  all.reserve(scenes.size());
  for (const Scene& scene : scenes) all.emplace_back(scene, guardian);
  return all;
}

std::string Server::HapticThread::name() const {
  return "haptic-" + std::to_string(group.devices.front()->scene.loop.device);
}

Server::NetworkThread::NetworkThread(std::size_t its_number, bool never_sleeps, std::unique_ptr<UdpLink> its_link)
    : number(its_number), busy(never_sleeps), link(std::move(its_link)) {}

std::string Server::name_of(const NetworkThread& network) const {
  return networks_.size() == 1 ? "network" : "network-" + std::to_string(assembly_.first_device(network.number));
}

Server::NetworkThreads Server::network_threads_of(const std::vector<Scene>& scenes) {
  const Scene::Network& network = scenes.front().network;
  const Reach reach = network.keys ? Reach::kAnywhere : Reach::kThisMachine;
  const std::uint32_t count = network_threads_for(scenes);
  std::vector<std::unique_ptr<UdpLink>> links;
  if (count == 1) {
    links.push_back(std::make_unique<UdpLink>(network.listen, reach, network.unix_path, network.dscp));
  } else {
    links = UdpLink::several(network.listen, reach, count, network.dscp);
  }
  NetworkThreads threads;
  for (auto& link : links) {
    threads.push_back(std::make_unique<NetworkThread>(threads.size(), network.busy, std::move(link)));
  }
  return threads;
}

std::vector<Link*> Server::links() {
  std::vector<Link*> links;
  for (const auto& network : networks_) {
    links.push_back(network->busy ? static_cast<Link*>(&network->busy_link) : network->link.get());
  }
  return links;
}

std::vector<Assembly::Part> Server::parts_of(const std::vector<Scene>& scenes) {
  std::vector<Assembly::Part> parts;
  parts.reserve(scenes.size());
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    const Scene& scene = scenes[i];
    parts.push_back({.scene = scene,
                     .device = *hardware_[i].device,
                     .safe = hardware_[i].safe.get(),
                     .heart = heart_of(scene, guardian_.get())});
    if (!scene.dials()) continue;
    if (scene.teleoperation->key) parts.back().dial_key = read_key(*scene.teleoperation->key).key;
    fill_random(parts.back().dial_seed.bytes);
  }
  return parts;
}

std::vector<Server::HapticThread> Server::haptic_threads() {
  std::vector<HapticThread> threads;
  for (Assembly::HapticGroup& group : assembly_.haptic_groups()) {
    HapticThread& thread = threads.emplace_back(HapticThread{.group = group});
    for (const std::size_t network : group.networks) thread.stepped.push_back(&networks_[network]->bell);
  }
  return threads;
}

Server::Server(const std::vector<Scene>& scenes)
    : started_(clock::now()),
      guardian_(make_guardian(checked(scenes))),
      hardware_(hardware_of(scenes, guardian_.get())),
      networks_(network_threads_of(scenes)),
      announcer_(announcer_of(scenes, address())),
      assembly_{parts_of(scenes), config_of(scenes.front().network, started_), links()},
      steps_seen_(scenes.size()),
      haptic_threads_(haptic_threads()) {}

std::optional<std::filesystem::path> Server::recording() const {
  const auto status = assembly_.log().recording();
  return status ? std::optional(status->path) : std::nullopt;
}

std::string Server::prefix(const Scene& scene) const { return hardware_.size() == 1 ? "" : scene.name + ": "; }

Server::~Server() { end_threads(); }

void Server::start(std::optional<Duration> run_for) {
  run_for_ = run_for;
  if (const auto& refused = wakeful_.emplace().refused()) log::warn(*refused);
  try {
    log_thread_ = thread_of("log", [this] { run_log(); });
    if (announcer_) {
      announce_thread_ = thread_of("announce", [this] {
        name_thread("announce");
        announcer_->run();
      });
    }
    for (const auto& network : networks_) {
      network->thread = thread_of(name_of(*network), [this, &network] { run_network(*network); });
    }
    for (HapticThread& haptic : haptic_threads_) {
      haptic.thread = thread_of(haptic.name(), [this, &haptic] {
        name_thread(haptic.name());
        run_haptic(haptic);
      });
    }
  } catch (...) {
    end_threads();
    throw;
  }
}

void Server::end_threads() {
  const auto join = [](std::thread& thread) {
    if (thread.joinable()) thread.join();
  };
  if (announcer_) announcer_->stop();
  stop_haptic_.store(true, std::memory_order_release);
  for (HapticThread& haptic : haptic_threads_) join(haptic.thread);
  stop_network_.store(true, std::memory_order_release);
  for (const auto& network : networks_) {
    network->bell.ring();
    join(network->thread);
  }
  join(announce_thread_);
  stop_log_.store(true, std::memory_order_release);
  join(log_thread_);
  wakeful_.reset();
}

Server::Summary Server::stop() {
  end_threads();

  Summary summary;
  for (const Assembly::DeviceLoop& of : assembly_.devices()) {
    DeviceSummary& device = summary.devices.emplace_back(DeviceSummary{
        .name = of.scene.name, .haptic = of.haptic.stats(), .safety = std::nullopt, .counts = std::nullopt});
    if (of.safe != nullptr) device.safety = of.safe->status();
    if (!of.scene.driver().ids.empty()) device.counts = of.device.counts();
  }
  for (std::size_t i = 0; i < assembly_.networks(); ++i) summary.network += assembly_.network(i).stats();
  for (const auto& network : networks_) summary.network.refused_stamps += network->link->refused_stamps();
  summary.recording = assembly_.log().recording();
  summary.uptime = clock::now() - started_;
  return summary;
}

bool Server::turning() {
  bool all = true;
  for (std::size_t i = 0; i < steps_seen_.size(); ++i) {
    const std::uint64_t steps = assembly_.devices()[i].haptic.stats().steps;
    all = std::exchange(steps_seen_[i], steps) != steps && all;
  }
  return all;
}

void Server::suspend() {
  suspended_.store(0, std::memory_order_relaxed);
  suspend_.store(true, std::memory_order_release);
  constexpr Duration kPatience = std::chrono::milliseconds(100);
  const LocalTime end = clock::now() + kPatience;
  while (suspended_.load(std::memory_order_acquire) < haptic_threads_.size() && clock::now() < end) {
    clock::sleep_until(clock::now() + std::chrono::milliseconds(1));
  }
}

void Server::resume() { suspend_.store(false, std::memory_order_release); }

void Server::stand_still(const HapticThread& thread) {
  thread.group.stand_still();
  suspended_.fetch_add(1, std::memory_order_release);
  while (suspend_.load(std::memory_order_acquire) && !stop_haptic_.load(std::memory_order_acquire)) {
    clock::sleep_until(clock::now() + std::chrono::milliseconds(1));
  }
}

void Server::run_haptic(const HapticThread& thread) {
  Assembly::HapticGroup& group = thread.group;
  const Scene& first = group.devices.front()->scene;
  for (const std::string& refused : enter_realtime(kHapticPriority)) {
    if (&group == &assembly_.haptic_groups().front()) log::warn(refused);  // the same message applies to all threads
    group.not_realtime.store(true, std::memory_order_relaxed);
  }
  if (first.cpu) {
    if (const auto refused = stay_on(*first.cpu)) log::warn(prefix(first) + *refused);
  }
  LocalTime due = clock::now();
  const LocalTime end = run_for_ ? due + *run_for_ : LocalTime::max();
  while (!stop_haptic_.load(std::memory_order_acquire) && due < end) {
    due = group.turn(clock::now());
    for (Doorbell* const stepped : thread.stepped) stepped->ring();
    if (suspend_.load(std::memory_order_acquire)) stand_still(thread);
    clock::sleep_until(due);
  }
  group.stop();
}

void Server::run_network(NetworkThread& network) {
  name_thread(name_of(network));
  enter_punctual();
  LocalTime now = clock::now();
  LocalTime due = now;
  while (!stop_network_.load(std::memory_order_acquire)) {
    if (network.busy) {
      now = watch_until(network, due);
    } else {
      if (due > now) network.link->wait(std::min<Duration>(due - now, std::chrono::seconds(1)), &network.bell);
      now = clock::now();
    }
    due = assembly_.turn_network(network.number, now);
    publish_notices(network);
    if (!network.busy) now = clock::now();
  }
  assembly_.network(network.number).close(clock::now());
  publish_notices(network);
}

/// Polls until a datagram is available, the doorbell has rung, or `due` has been reached. Returns the current time.
LocalTime Server::watch_until(NetworkThread& network, LocalTime due) {
  LocalTime now = clock::now();
  while (now < due && !network.bell.rung() && !network.busy_link.look(now)) {
  }
  if (!network.bell.rung()) return now;
  network.bell.answer();
  return clock::now();  // not earlier than the step that rang the bell
}

void Server::publish_notices(NetworkThread& network) {
  NetworkLoop& loop = assembly_.network(network.number);
  for (const auto& [warning, text, session] : loop.take_notices()) {
    if (network.unknown_keys.take(text)) continue;
    warning ? log::warn(text) : log::info(text);
    if (!session || !on_session_) continue;
    const std::lock_guard lock(publishing_);
    on_session_(*session);
  }
  if (const LocalTime now = clock::now(); network.unknown_keys.due(now)) {
    log::warn(network.unknown_keys.line(now, loop.stats().hellos.unknown_key));
  }
}

void Server::run_log() {
  name_thread("log");
  while (!stop_log_.load(std::memory_order_acquire)) {
    const LocalTime due = assembly_.log().turn(clock::now(), unsent());
    print_log();
    clock::sleep_until(due);
  }
  assembly_.log().close(clock::now(), unsent());  // all other threads have ended
  print_log();
}

std::uint64_t Server::unsent() const {
  std::uint64_t sum = 0;
  for (const auto& network : networks_) sum += network->link->send_failures();
  return sum;
}

void Server::print_log() {
  for (const auto& [level, text] : assembly_.log().take_notices()) {
    switch (level) {
      case LogLoop::Notice::Level::kInfo:
        log::info(text);
        break;
      case LogLoop::Notice::Level::kWarning:
        log::warn(text);
        break;
      case LogLoop::Notice::Level::kError:
        log::error(text);
        break;
    }
  }
}

}  // namespace tendon
