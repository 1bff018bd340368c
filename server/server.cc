// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <unistd.h>

#include <algorithm>
#include <array>
#include <bit>
#include <climits>
#include <cmath>
#include <filesystem>
#include <limits>
#include <span>
#include <stdexcept>
#include <system_error>
#include <utility>
#include <variant>

#include "core/base/frames.h"
#include "protocol/discovery.h"
#include "protocol/wire/text.h"
#include "server/build_info.h"
#include "server/device_factory.h"
#include "server/guests/couple.h"
#include "server/machine/clock.h"
#include "server/machine/log.h"
#include "server/machine/randomness.h"
#include "server/machine/realtime.h"
#include "server/recording/flight_file.h"
#include "server/scene/key_folder.h"

namespace tendon {

namespace {

constexpr auto kLogPeriod = std::chrono::milliseconds(20);
/// Trouble is logged at most this often, with its count.
constexpr auto kTellPeriod = std::chrono::seconds(1);

/// The time that one thread has for each of its devices in a period. The dearest step that we ship takes half of it
/// (`tendond explain deploy/scenes/mechanism.toml`: 9.8 µs).
constexpr auto kStepBudget = std::chrono::microseconds(20);

std::uint32_t loop_hz(const Scene& scene) {
  return static_cast<std::uint32_t>(std::lround(1 / seconds(scene.loop.period)));
}

DeviceDescription description_of(const Scene& scene, const DeviceInfo& device) {
  DeviceDescription about;
  about.name = scene.name;
  about.model = device.name;
  about.max_force = scene.loop.control.max_force;
  if (!scene.driver().exerts_force) about.max_force = 0;
  if (scene.safety && device.max_force > 0) about.max_force = std::min(about.max_force, device.max_force);
  about.position_resolution = device.position_resolution;
  about.loop_hz = loop_hz(scene);
  for (const Scene::Channel& channel : scene.channels) {
    about.channels.push_back({.name = channel.name, .rule = channel.rule, .lease = channel.lease, .holder = {}});
  }
  return about;
}

HandleDescription handle_of(const Scene& scene, const DeviceInfo& device) {
  HandleDescription handle;
  const std::string_view axes = scene.axes.empty() ? scene.driver().axes : scene.axes;
  if (!axes.empty()) handle.operator_from_device = quaternion_of(operator_from_device(axes));
  handle.joints = device.joints;
  handle.outputs = device.outputs;
  handle.buttons.assign(scene.driver().buttons.begin(), scene.driver().buttons.end());
  handle.orientation_measured = device.measures_orientation;
  handle.max_torque = device.max_torque;
  if (device.gripper) {
    handle.gripper_open = device.gripper->open;
    handle.max_gripper_force = device.gripper->max_force;
  }
  handle.group = scene.group;
  handle.hand = scene.hand;
  return handle;
}

const char* describe(HapticController::Fault fault) {
  switch (fault) {
    case HapticController::Fault::kNone:
      return "none";
    case HapticController::Fault::kPositionNotFinite:
      return "the device measured a position that is not a number";
    case HapticController::Fault::kDeviceSilent:
      return "the device has stopped answering";
    case HapticController::Fault::kPositionJumped:
      return "the device's position has jumped further than a hand can move: its encoder has wrapped or lost count";
  }
  return "unknown";
}

Safety on_the_wire(SafetyState state) noexcept {
  static_assert(static_cast<int>(SafetyState::kAbsent) + 1 == static_cast<int>(Safety::kAbsent));
  static_assert(static_cast<int>(SafetyState::kHomed) + 1 == static_cast<int>(Safety::kHomed));
  static_assert(static_cast<int>(SafetyState::kFault) + 1 == static_cast<int>(Safety::kFault));
  return static_cast<Safety>(static_cast<int>(state) + 1);
}

/// The operator's message when a real device enters this state.
std::string describe(Device::State state, const Scene& scene) {
  switch (state) {
    case Device::State::kAbsent:
      return "the device is not plugged in";
    case Device::State::kOpening:
      return "the device is being opened";
    case Device::State::kFirmware: {
      const auto* falcon = std::get_if<falcon::Config>(&scene.device);
      return falcon != nullptr && !falcon->firmware
                 ? "the device has no firmware, and no file was named to give it: --falcon-firmware FILE"
                 : "the device is being given its firmware";
    }
    case Device::State::kUnhomed:
      return "the device has to be " + std::string(scene.driver().homing);
    case Device::State::kHomed:
      return scene.driver().moves_a_hand ? "the device is homed" : "the device is there";
  }
  return "unknown";
}

/// How far a counter has risen since it was last read.
std::uint64_t news(const std::atomic<std::uint64_t>& counter, std::uint64_t& told) {
  const std::uint64_t now = counter.load(std::memory_order_relaxed);
  return now - std::exchange(told, now);
}

SceneRecord scene_record(const Scene& scene) {
  return {.text = scene.text,
          .version = std::string(kVersion),
          .commit = std::string(kCommit),
          .unix_offset = clock::unix_offset()};
}

std::unique_ptr<PartRecorder> recorder_of(const std::vector<Scene>& scenes, LocalTime started) {
  const auto& recording = scenes.front().recording;
  if (!recording) return nullptr;
  PartRecorder::Config config;
  config.path = recording->path;
  const auto is_coupled = [](const Scene& scene) { return scene.teleoperation.has_value(); };
  config.run = {.scene = scene_record(scenes.front()), .ports = is_coupled(scenes.front()), .started = started};
  for (std::size_t i = 1; i < scenes.size(); ++i) {
    config.run.more_devices.push_back({scenes[i].name, scene_record(scenes[i]), is_coupled(scenes[i])});
  }
  config.rotate_bytes = static_cast<std::uint64_t>(recording->rotate_bytes);
  config.rotate_after = from_seconds(recording->rotate_after);
  config.budget_bytes = static_cast<std::uint64_t>(recording->budget_bytes.value_or(0));
  config.keep = recording->keep;
  config.one_in = recording->one_in.value_or(0);
  return std::make_unique<PartRecorder>(config);
}

std::string host_name() {
  std::array<char, HOST_NAME_MAX + 1> name{};
  ::gethostname(name.data(), name.size() - 1);
  const std::string whole = name.data();
  return whole.substr(0, whole.find('.'));
}

/// Of the scenes that ask for it. Null: there is nothing to announce.
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

/// Throws std::runtime_error, a sentence for the operator, when the machine has no processor for a thread that never
/// sleeps.
const std::vector<Scene>& checked(const std::vector<Scene>& scenes) {
  if (scenes.front().network.busy && processors_allowed() == 1) {
    throw std::runtime_error(
        "[network] busy = true takes a whole processor, and this server may run on one only: nothing else would get "
        "its turn");
  }
  return scenes;
}

/// So many devices keep a network thread at work for a third of the time or more (tests/tools/bench).
constexpr std::size_t kDevicesOfANetworkThread = 128;

/// How many share the devices: a power of two.
std::uint32_t network_threads_for(const std::vector<Scene>& scenes) {
  const Scene::Network& network = scenes.front().network;
  if (network.threads) return *network.threads;
  if (!needs_one_network_thread(scenes).empty()) return 1;
  const auto processors = static_cast<std::size_t>(processors_allowed());
  return static_cast<std::uint32_t>(std::bit_floor(
      std::clamp<std::size_t>(scenes.size() / kDevicesOfANetworkThread, 1, std::max<std::size_t>(processors, 1))));
}

Mailboxes::Capacities for_device(Mailboxes::Capacities capacities, const DeviceInfo& device) {
  capacities.flight_handles = !device.position_only();
  return capacities;
}

/// How many devices of that period one thread takes: whole banks, so that the states of a session leave together.
std::size_t devices_of_a_thread(Duration period) {
  const auto fit = static_cast<std::size_t>(period / kStepBudget);
  return fit < limits::kMaxDevices ? fit : fit - fit % limits::kMaxDevices;
}

/// Throws std::runtime_error, a sentence for the operator, when the system refuses the thread.
template <class Run>
std::thread thread_of(const std::string& name, Run run) {
  try {
    return std::thread(std::move(run));
  } catch (const std::system_error& refused) {
    throw std::runtime_error("cannot start the thread " + name + ": " + refused.code().message());
  }
}

}  // namespace

Server::DeviceRuntime::DeviceRuntime(const Scene& the_scene, const Mailboxes::Capacities& capacities,
                                     Guardian* guardian)
    : scene(the_scene),
      device(make_device(scene, guardian)),
      safe(scene.safety ? std::make_unique<SafeDevice>(*scene.safety, *device) : nullptr),
      mail(for_device(capacities, device->info())),
      haptic(scene.loop, safe ? *safe : *device, mail) {
  told_phase.fill(PortPhase::kAlone);
}

Server::DeviceRuntimes Server::runtimes_of(const std::vector<Scene>& scenes, Guardian* guardian) {
  Shard shard{.of = network_threads_for(scenes)};
  DeviceRuntimes devices;
  for (Scene scene : scenes) {
    // Above the epoch of every run before, as long as the time of day does not go back (Purse).
    if (auto& coupling = scene.loop.control.coupling) {
      coupling->spring.epoch =
          static_cast<std::uint64_t>((clock::now().time_since_epoch() + clock::unix_offset()).count());
    }
    scene.loop.record = scenes.front().recording.has_value();
    Mailboxes::Capacities capacities = scene.loop.record ? Mailboxes::Capacities::recorded(scenes.size())
                                                         : Mailboxes::Capacities::unrecorded(scene.loop.period);
    shard.number = shard.owner_of(devices.size(), scenes.size());
    if (devices.size() != shard.first_device(scenes.size())) capacities.datagrams = 1;  // all go to its first
    // A power of two.
    const std::size_t couplings = std::max<std::size_t>(scene.loop.control.leaders.size(), 1);
    capacities.ports = scene.teleoperation ? std::bit_ceil(couplings) * capacities.ports : 1;
    devices.push_back(std::make_unique<DeviceRuntime>(scene, capacities, guardian));
  }
  return devices;
}

std::string Server::HapticThread::name() const {
  return "haptic-" + std::to_string(devices.front()->scene.loop.device);
}

std::vector<Server::HapticThread> Server::haptic_threads_of(const DeviceRuntimes& devices,
                                                            const NetworkThreads& networks) {
  const Shard shard{.of = static_cast<std::uint32_t>(networks.size())};
  std::vector<HapticThread> threads;
  for (const auto& runtime : devices) {
    const Scene& scene = runtime->scene;
    const auto has_room = [&scene](const HapticThread& thread) {
      const Scene& other = thread.devices.front()->scene;
      return scene.shares_thread() && other.shares_thread() && other.loop.period == scene.loop.period &&
             other.cpu == scene.cpu && thread.devices.size() < devices_of_a_thread(scene.loop.period);
    };
    auto place = std::ranges::find_if(threads, has_room);
    if (place == threads.end()) place = threads.emplace(threads.end());
    place->devices.push_back(runtime.get());
    Doorbell* const bell = &networks[shard.owner_of(scene.loop.device, devices.size())]->bell;
    if (place->stepped.empty() || place->stepped.back() != bell) place->stepped.push_back(bell);
  }
  return threads;
}

Server::NetworkThread::NetworkThread(const NetworkLoop::Config& config, bool never_sleeps,
                                     std::unique_ptr<UdpLink> its_link, const std::vector<Mailboxes*>& mail)
    : first_device(config.shard.first_device(mail.size())),
      recorded(*mail[first_device]),
      busy(never_sleeps),
      link(std::move(its_link)),
      loop(config, never_sleeps ? static_cast<Link&>(busy_link) : *link, mail) {}

std::string Server::name_of(const NetworkThread& network) const {
  return networks_.size() == 1 ? "network" : "network-" + std::to_string(network.first_device);
}

Server::NetworkThreads Server::network_threads_of(const std::vector<Scene>& scenes, const DeviceRuntimes& devices) {
  const Scene::Network& network = scenes.front().network;
  const Reach reach = network.keys ? Reach::kAnywhere : Reach::kThisMachine;
  const std::uint32_t count = network_threads_for(scenes);
  std::vector<std::unique_ptr<UdpLink>> links;
  if (count == 1) {
    links.push_back(std::make_unique<UdpLink>(network.listen, reach, network.unix_path));
  } else {
    links = UdpLink::several(network.listen, reach, count);
  }
  NetworkLoop::Config config = network_config(devices);
  config.recorded.bytes_per_s /= count;
  config.shard.of = count;
  std::vector<Mailboxes*> mail;
  for (const auto& runtime : devices) mail.push_back(&runtime->mail);
  NetworkThreads threads;
  for (auto& link : links) {
    config.shard.number = static_cast<std::uint32_t>(threads.size());
    threads.push_back(std::make_unique<NetworkThread>(config, network.busy, std::move(link), mail));
  }
  return threads;
}

NetworkLoop::Config Server::network_config(const DeviceRuntimes& devices) {
  const Scene& scene = devices.front()->scene;
  NetworkLoop::Config config;
  fill_random(config.secret);
  fill_random(std::as_writable_bytes(std::span(&config.first_connection_id, 1)));
  config.first_connection_id |= 1;  // never 0
  if (scene.network.keys) config.keys = read_key_folder(*scene.network.keys);
  std::erase_if(config.suites, [&](Suite suite) { return !contains(scene.network.suites, suite); });
  if (config.suites.empty()) {
    throw std::invalid_argument("network.suites: this processor has no AES instructions, so it cannot seal by " +
                                names_of(scene.network.suites) + " only: expected chacha20-poly1305 besides");
  }
  if (scene.network.unix_path) config.needs_no_key = UnixSocket::is_peer;
  config.server_name = "tendond " + std::string(kVersion);
  for (const auto& runtime : devices) {
    const DeviceInfo info = runtime->safe ? runtime->safe->info() : runtime->device->info();
    config.devices.push_back(description_of(runtime->scene, info));
    config.handles.push_back(handle_of(runtime->scene, info));
  }
  for (std::uint32_t number = 0; number < devices.size(); ++number) {
    const Scene& of_device = devices[number]->scene;
    auto& coupling = config.couplings.emplace_back();
    auto& leaders = config.leaders.emplace_back();
    if (!of_device.teleoperation) continue;
    for (const CoupledLeader& leader : of_device.loop.control.leaders) leaders.push_back(leader.channel);
    coupling = couple_of(*of_device.loop.control.coupling);
    const Scene::Teleoperation& peer = *of_device.teleoperation;
    if (!peer.dial) continue;
    Peer::Config dialled{.server = *peer.dial,
                         .name = of_device.name,
                         .device = peer.device,
                         .channel = peer.channel,
                         .couple = *coupling};
    if (peer.key) dialled.key = read_key(*peer.key).key;
    fill_random(dialled.seed.bytes);
    config.dials.push_back({number, dialled});
  }
  config.takeover = scene.network.takeover;
  config.max_observers = scene.network.max_observers;
  config.controller_timeout = scene.network.controller_timeout;
  config.observer_timeout = scene.network.observer_timeout;
  config.adapt_state_rate = scene.network.adapt_state_rate;
  config.record = scene.recording.has_value();
  if (scene.recording) config.recorded.bytes_per_s = static_cast<std::uint64_t>(scene.recording->datagram_bytes_per_s);
  return config;
}

Server::Server(const std::vector<Scene>& scenes)
    : started_(clock::now()),
      guardian_(make_guardian(checked(scenes))),
      devices_(runtimes_of(scenes, guardian_.get())),
      networks_(network_threads_of(scenes, devices_)),
      tell_next_(started_ + kTellPeriod),
      haptic_threads_(haptic_threads_of(devices_, networks_)) {
  announcer_ = announcer_of(scenes, address());
  recorder_ = recorder_of(scenes, started_);  // last, so that a refusal before it leaves no file behind
}

std::optional<std::filesystem::path> Server::recording() const {
  return recorder_ ? std::optional(recorder_->status().path) : std::nullopt;
}

std::string Server::prefix(const DeviceRuntime& runtime) const {
  return devices_.size() == 1 ? "" : runtime.scene.name + ": ";
}

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
  for (const auto& runtime : devices_) {
    DeviceSummary& device = summary.devices.emplace_back(DeviceSummary{.name = runtime->scene.name,
                                                                       .haptic = runtime->haptic.stats(),
                                                                       .safety = std::nullopt,
                                                                       .counts = std::nullopt});
    if (runtime->safe) device.safety = runtime->safe->status();
    if (!runtime->scene.driver().ids.empty()) device.counts = runtime->device->counts();
  }
  for (const auto& network : networks_) summary.network += network->loop.stats();
  if (recorder_) summary.recording = recorder_->status();
  summary.uptime = clock::now() - started_;
  return summary;
}

bool Server::turning() {
  bool all = true;
  for (auto& runtime : devices_) {
    const std::uint64_t steps = runtime->haptic.stats().steps;
    all = std::exchange(runtime->steps_seen, steps) != steps && all;
  }
  return all;
}

void Server::run_haptic(const HapticThread& thread) {
  const std::vector<DeviceRuntime*>& devices = thread.devices;
  DeviceRuntime& first = *devices.front();
  for (const std::string& refused : enter_realtime(kHapticPriority)) {
    if (&first == devices_.front().get()) log::warn(refused);  // to all of them alike
    for (DeviceRuntime* runtime : devices) runtime->not_realtime.store(true, std::memory_order_relaxed);
  }
  if (first.scene.cpu) {
    if (const auto refused = stay_on(*first.scene.cpu)) log::warn(prefix(first) + *refused);
  }
  LocalTime due = clock::now();
  const LocalTime end = run_for_ ? due + *run_for_ : LocalTime::max();
  while (!stop_haptic_.load(std::memory_order_acquire) && due < end) {
    // With one instant for all, and one period, all are due together again: one wake-up, however late.
    const LocalTime now = clock::now();
    for (DeviceRuntime* runtime : devices) due = runtime->haptic.step(now);
    for (Doorbell* const stepped : thread.stepped) stepped->ring();
    clock::sleep_until(due);
  }
  for (DeviceRuntime* runtime : devices) runtime->haptic.stop();
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
    take_hellos(now, network);
    due = network.loop.turn(now);
    hand_on_hellos(network);
    tell_notices(network);
    if (!network.busy) now = clock::now();  // the turn has taken its time
  }
  network.loop.close(clock::now());
  tell_notices(network);
}

/// Those that another network thread has received for this one.
void Server::take_hellos(LocalTime now, NetworkThread& network) {
  while (const HandedHello* const hello = network.hellos.front()) {
    network.loop.receive_foreign(now, hello->from, std::span(hello->bytes).first(hello->size));
    network.hellos.pop();
  }
}

/// Only the first network thread receives Hellos (UdpLink::several). The owner takes one in its next turn, which a
/// haptic step begins. One that finds no room is lost: its client says it again.
void Server::hand_on_hellos(NetworkThread& network) {
  for (const NetworkLoop::Foreign& foreign : network.loop.take_foreign()) {
    NetworkThread& owner = *networks_[foreign.shard];
    HandedHello* const hello = owner.hellos.back();
    if (hello == nullptr) continue;
    hello->from = foreign.from;
    hello->size = static_cast<std::uint32_t>(foreign.hello.size());
    std::copy(foreign.hello.begin(), foreign.hello.end(), hello->bytes.begin());
    owner.hellos.push();
  }
}

/// Until a datagram can be received, the doorbell rings, or it is `due`; without a sleep. The present time.
LocalTime Server::watch_until(NetworkThread& network, LocalTime due) {
  LocalTime now = clock::now();
  while (now < due && !network.bell.rung() && !network.busy_link.look(now)) {
  }
  if (!network.bell.rung()) return now;
  network.bell.answer();
  return clock::now();  // not before the step that has rung
}

void Server::tell_notices(NetworkThread& network) {
  for (const auto& [warning, text, session] : network.loop.take_notices()) {
    warning ? log::warn(text) : log::info(text);
    if (!session || !tell_session_) continue;
    const std::lock_guard lock(telling_);
    tell_session_(*session);
  }
}

void Server::run_log() {
  name_thread("log");
  bool last = false;
  while (!last) {
    // Everything pushed before this flag was set is drained below, so nothing is lost.
    last = stop_log_.load(std::memory_order_acquire);
    const LocalTime now = clock::now();
    drain_to_recorder(now);
    for (auto& runtime : devices_) report_health(now, *runtime);
    if (now >= tell_next_ || last) {
      for (const HapticThread& thread : haptic_threads_) report_overruns(thread);
      for (auto& runtime : devices_) report_trouble(*runtime);
      record_left_out(now);
      tell_next_ = now + kTellPeriod;
    }
    if (!last) clock::sleep_until(now + kLogPeriod);
  }
  if (recorder_) {
    recorder_->close(clock::now());
    tell_of_recording();
  }
}

void Server::drain_to_recorder(LocalTime now) {
  std::uint64_t steps_lost = 0;
  for (std::size_t device = 0; device < devices_.size(); ++device) {
    DeviceRuntime& runtime = *devices_[device];
    const auto take_ports = [&](std::uint64_t until) {
      for (const PortRecord* port = runtime.mail.ports.front(); port != nullptr && port->tick <= until;
           port = runtime.mail.ports.front()) {
        report_phase(runtime, *port);
        if (recorder_) recorder_->record(*port, device);
        runtime.mail.ports.pop();
      }
    };
    if (!recorder_) take_ports(std::numeric_limits<std::uint64_t>::max());
    while (const StepRecord* step = runtime.mail.steps.front()) {
      take_ports(step->tick);  // the haptic thread pushes what the coupling did before the step
      recorder_->record(*step, device, runtime.mail.ways.name_of(step->force_way));
      runtime.mail.steps.pop();
    }
    steps_lost += news(runtime.mail.steps_lost, runtime.told_steps_lost);
    steps_lost += news(runtime.mail.ports_lost, runtime.told_ports_lost);  // such a step cannot be replayed
  }
  std::uint64_t datagrams_lost = 0;
  for (const auto& network : networks_) {
    Mailboxes& mail = network->recorded;
    while (const DatagramRecord* datagram = mail.datagrams.front()) {
      if (recorder_) recorder_->record(*datagram);
      mail.datagrams.pop();
    }
    datagrams_lost += news(mail.datagrams_lost, network->told_datagrams_lost);
  }
  if (steps_lost > 0 || datagrams_lost > 0) {
    log::warn("the log thread could not follow: " + std::to_string(steps_lost) + " steps and " +
              std::to_string(datagrams_lost) + " datagrams are missing");
    if (recorder_) recorder_->lost({.at = now, .steps = steps_lost, .datagrams = datagrams_lost});
  }
  if (!recorder_) return;
  recorder_->tick(now);
  tell_of_recording();
}

/// Records how much the network threads have left out of the recording since the last call.
void Server::record_left_out(LocalTime now) {
  if (!recorder_) return;
  std::uint64_t strangers = 0;
  std::uint64_t datagrams = 0;
  for (const auto& network : networks_) {
    strangers += news(network->recorded.strangers_left_out, network->told_strangers);
    datagrams += news(network->recorded.datagrams_over_budget, network->told_over_budget);
  }
  if (strangers > 0) recorder_->lost({.at = now, .cause = LossRecord::Cause::kSample, .strangers = strangers});
  if (datagrams > 0) {
    log::warn(std::to_string(datagrams) + " datagrams are not recorded: more bytes came in a second than [recording] " +
              "datagrams_kb_per_s");
    recorder_->lost({.at = now, .datagrams = datagrams, .cause = LossRecord::Cause::kByteBudget});
  }
}

void Server::tell_of_recording() {
  for (const auto& [warning, text] : recorder_->take_notices()) warning ? log::error(text) : log::info(text);
  recording_stopped_ = !recorder_->status().error.empty();
}

/// Hands the device's health to the network thread, for observers that ask.
void Server::report_health(LocalTime now, DeviceRuntime& runtime) {
  Health health = runtime.haptic.health();
  health.at = now;
  health.steps_lost = runtime.told_steps_lost + runtime.told_ports_lost;
  const HapticLoop::Stats haptic = runtime.haptic.stats();
  if (haptic.fault != HapticController::Fault::kNone) health.fault = describe(haptic.fault);
  if (runtime.safe) {
    const SafeDevice::Status safety = runtime.safe->status();
    health.safety = on_the_wire(safety.state);
    if (safety.state == SafetyState::kFault) health.fault = to_string(safety.last_fault);
  } else {
    const bool ready = haptic.device == Device::State::kHomed;
    health.safety = ready ? Safety::kUnguarded : on_the_wire(static_cast<SafetyState>(haptic.device));
  }
  health.device = runtime.device->counts();
  health.not_realtime = runtime.not_realtime.load(std::memory_order_relaxed);
  health.recording_ended = recording_stopped_;
  health.unsent = 0;
  for (const auto& network : networks_) health.unsent += network->link->send_failures();
  runtime.mail.health.put(health);
}

void Server::report_safety(DeviceRuntime& runtime) {
  if (!runtime.safe) return;
  const SafeDevice::Status now = runtime.safe->status();
  if (now.faults > runtime.told_safety.faults) {
    log::error(prefix(runtime) + "no force any more: " + std::string(to_string(now.last_fault)));
  }
  const bool armed = now.state == SafetyState::kArmed;
  const bool was_armed = runtime.told_safety.state == SafetyState::kArmed;
  if (armed && !was_armed) log::info(prefix(runtime) + "the device is armed");
  if (was_armed && now.state < SafetyState::kArmed) log::info(prefix(runtime) + "the device is no longer armed");
  runtime.told_safety = now;
}

/// Logs each of the driver's trouble counters that has risen.
void Server::report_counts(DeviceRuntime& runtime) {
  const DeviceCounts now = runtime.device->counts();
  const DeviceCounts before = std::exchange(runtime.told_counts, now);
  for (const DeviceCounter& row : kDeviceCounters) {
    if (row.degraded.empty() || now[row.count] == before[row.count]) continue;
    log::warn(prefix(runtime) + std::string(row.name) + ": " + std::to_string(now[row.count] - before[row.count]) +
              " more (" + std::string(row.meaning) + ")");
  }
}

/// Says where its end of a coupling stands, when that has changed.
void Server::report_phase(DeviceRuntime& runtime, const PortRecord& port) {
  const PortPhase phase = port.sent.phase;
  if (std::exchange(runtime.told_phase[port.channel], phase) == phase) return;
  const bool trouble = phase == PortPhase::kLost || phase == PortPhase::kFault;
  const bool several = !runtime.scene.loop.control.leaders.empty();
  const std::string leader = several ? runtime.scene.channels[port.channel].name + ": " : "";
  const std::string text = prefix(runtime) + "teleoperation: " + leader + std::string(to_string(phase));
  trouble ? log::warn(text) : log::info(text);
}

/// All devices of a thread are late together: one line says it, with the most that one of them has had.
void Server::report_overruns(const HapticThread& thread) const {
  std::uint64_t most = 0;
  Duration longest{};
  for (const DeviceRuntime* runtime : thread.devices) {
    const HapticLoop::Stats now = runtime->haptic.stats();
    most = std::max(most, now.overruns - runtime->told.overruns);
    longest = std::max(longest, now.longest_interval);
  }
  if (most == 0) return;
  const std::size_t others = thread.devices.size() - 1;
  log::warn(prefix(*thread.devices.front()) + std::to_string(most) + " overruns in the last second" +
            (others > 0 ? ", as of " + std::to_string(others) + " more on its thread" : "") +
            "; longest interval so far " +
            std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(longest).count()) + " µs");
}

void Server::report_trouble(DeviceRuntime& runtime) {
  report_safety(runtime);
  report_counts(runtime);
  const HapticLoop::Stats now = runtime.haptic.stats();
  if (now.device != runtime.told.device) log::info(prefix(runtime) + describe(now.device, runtime.scene));
  // Each fault of the controller or of the safety layer freezes the flight recorder once, and saving thaws it.
  // report_safety names the faults of the safety layer.
  if (runtime.mail.flight.frozen()) {
    if (now.fault != HapticController::Fault::kNone) {
      log::error(prefix(runtime) + "fault: " + describe(now.fault) + "; force is zero until a controller rearms");
    }
    save_flight(runtime);
  }
  runtime.told = now;
}

void Server::save_flight(DeviceRuntime& runtime) {
  try {
    const auto& recording = devices_.front()->scene.recording;
    const auto sink = open_flight(recording ? std::optional(recording->path) : std::nullopt,
                                  devices_.size() == 1 ? "" : runtime.scene.name);
    write_flight(runtime.mail.flight, {.scene = scene_record(runtime.scene), .started = started_}, runtime.mail.ways,
                 *sink);
    log::error("the steps before the fault are in " + sink->path().string());
  } catch (const std::exception& problem) {
    log::error(std::string("the steps before the fault are lost: ") + problem.what());
  }
  runtime.mail.flight.thaw();
}

}  // namespace tendon
