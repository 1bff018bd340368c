// SPDX-License-Identifier: Apache-2.0
#include "server/assembly.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <span>
#include <stdexcept>
#include <string_view>
#include <utility>

#include "core/base/frames.h"
#include "server/clients/couple.h"

namespace tendon {

namespace {

/// For one step of a device. The most expensive scene uses half (tendond explain deploy/scenes/mechanism.toml: 9.8 µs).
constexpr auto kStepBudget = std::chrono::microseconds(20);

/// Returns the number of devices per thread. These are whole banks, so that all states of a session are sent together.
std::size_t devices_of_a_thread(Duration period) {
  const auto fit = static_cast<std::size_t>(period / kStepBudget);
  return fit < limits::kMaxDevices ? fit : fit - fit % limits::kMaxDevices;
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

ServedDevice::Config served_config(const Assembly::Part& part, Mailboxes& mail) {
  const Scene& scene = part.scene;
  const DeviceInfo info = part.safe != nullptr ? part.safe->info() : part.device.info();
  ServedDevice::Config served{.about = description_of(scene, info),
                              .handle = part.handle ? *part.handle : handle_of(scene, info),
                              .mail = &mail};
  if (const auto& renderer = scene.loop.control.hold.field) {
    FieldLimits& limits = served.fields.emplace();
    for (const Scene::Channel& channel : scene.channels) limits.allowed.push_back(scene.may_use_fields(channel));
    limits.max_stiffness = renderer->max_stiffness;
    limits.cache_bytes = static_cast<std::size_t>(scene.fields.cache_bytes);
  }
  if (!scene.teleoperation) return served;
  for (const CoupledLeader& leader : scene.loop.control.leaders) served.leaders.push_back(leader.channel);
  served.coupling = couple_of(*scene.loop.control.coupling);
  const Scene::Teleoperation& peer = *scene.teleoperation;
  if (!peer.dial) return served;
  served.dial = Peer::Config{.server = *peer.dial,
                             .name = scene.name,
                             .key = part.dial_key,
                             .seed = part.dial_seed,
                             .device = peer.device,
                             .channel = peer.channel,
                             .couple = *served.coupling};
  return served;
}

NetworkLoop::Config network_config(const Assembly::Config& assembly, const Scene& scene, std::uint32_t count) {
  NetworkLoop::Config config = assembly.network;
  std::erase_if(config.suites, [&](Suite suite) { return !contains(scene.network.suites, suite); });
  if (config.suites.empty()) {
    throw std::invalid_argument("network.suites: this processor has no AES instructions, which are required for " +
                                names_of(scene.network.suites) + ": add chacha20-poly1305");
  }
  config.takeover = scene.network.takeover;
  config.max_observers = scene.network.max_observers;
  config.controller_timeout = scene.network.controller_timeout;
  config.observer_timeout = scene.network.observer_timeout;
  config.adapt_state_rate = scene.network.adapt_state_rate;
  config.record = assembly.watched ? assembly.watched->datagrams > 1 : scene.recording.has_value();
  if (scene.recording) config.recorded.bytes_per_s = static_cast<std::uint64_t>(scene.recording->datagram_bytes_per_s);
  config.recorded.bytes_per_s /= count;
  config.shard.of = count;
  return config;
}

}  // namespace

std::uint32_t loop_hz(const Scene& scene) {
  return static_cast<std::uint32_t>(std::lround(1 / seconds(scene.loop.period)));
}

Assembly::DeviceLoop::DeviceLoop(const Part& part, const Mailboxes::Capacities& capacities)
    : scene(part.scene),
      device(part.device),
      safe(part.safe),
      mail(capacities),
      haptic(scene.loop, safe != nullptr ? *safe : device, mail, part.heart) {}

LocalTime Assembly::HapticGroup::turn(LocalTime now) noexcept {
  // All devices have the same period and get the same `now`, so they stay due at the same time.
  LocalTime due = now;
  for (DeviceLoop* const device : devices) due = device->haptic.step(now);
  return due;
}

void Assembly::HapticGroup::stop() noexcept {
  for (DeviceLoop* const device : devices) device->haptic.stop();
}

void Assembly::HapticGroup::stand_still() noexcept {
  for (DeviceLoop* const device : devices) {
    if (device->safe != nullptr) device->safe->stand_still();
    device->haptic.stop();
  }
}

Assembly::Assembly(std::vector<Part> parts, const Config& config, const std::vector<Link*>& links) {
  add_devices(parts, config, links.size());
  add_networks(parts, config, links);
  open_log(config);  // last, so that no file is created if something else fails
}

void Assembly::add_devices(std::vector<Part>& parts, const Config& config, std::size_t networks) {
  const bool records = parts.front().scene.recording.has_value();
  Shard shard{.of = static_cast<std::uint32_t>(networks)};
  for (Part& part : parts) {
    HapticLoop::Config& loop = part.scene.loop;
    if (loop.control.coupling) loop.control.coupling->spring.epoch = config.epoch;
    loop.record = config.watched || records;
    Mailboxes::Capacities capacities = config.watched ? *config.watched
                                       : records      ? Mailboxes::Capacities::recorded(parts.size())
                                                      : Mailboxes::Capacities::unrecorded(loop.period);
    shard.number = shard.owner_of(devices_.size(), parts.size());
    // The datagrams of a shard are only stored in the mailboxes of the first device.
    if (devices_.size() != shard.first_device(parts.size())) capacities.datagrams = 1;
    if (!config.watched) {
      capacities.flight = Mailboxes::Capacities::flight_of(parts.size());
      capacities.channels = loop.control.channels.size();
      capacities.couplings = loop.control.coupling ? std::max<std::size_t>(loop.control.leaders.size(), 1) : 0;
      capacities.ports = capacities.couplings > 0 ? std::bit_ceil(capacities.couplings) * capacities.ports : 1;
    }
    capacities.flight_handles = !part.device.info().position_only();
    capacities.fields = part.scene.has_fields();
    add_group_of(devices_.emplace_back(part, capacities), shard.number);
  }
}

void Assembly::add_group_of(DeviceLoop& device, std::size_t network) {
  const Scene& scene = device.scene;
  const auto has_room = [&scene](const HapticGroup& group) {
    const Scene& other = group.devices.front()->scene;
    return scene.shares_thread() && other.shares_thread() && other.loop.period == scene.loop.period &&
           other.cpu == scene.cpu && group.devices.size() < devices_of_a_thread(scene.loop.period);
  };
  const auto place = std::ranges::find_if(groups_, has_room);
  HapticGroup& group = place != groups_.end() ? *place : groups_.emplace_back();
  group.devices.push_back(&device);
  if (group.networks.empty() || group.networks.back() != network) group.networks.push_back(network);
}

void Assembly::add_networks(const std::vector<Part>& parts, const Config& config, const std::vector<Link*>& links) {
  const auto count = static_cast<std::uint32_t>(links.size());
  NetworkLoop::Config network = network_config(config, parts.front().scene, count);
  network.devices.reserve(parts.size());
  for (std::size_t i = 0; i < parts.size(); ++i) network.devices.push_back(served_config(parts[i], devices_[i].mail));
  for (Link* const link : links) {
    network.shard.number = static_cast<std::uint32_t>(networks_.size());
    networks_.emplace_back(network, *link, config.now);
  }
}

void Assembly::open_log(const Config& config) {
  std::vector<LogLoop::Watched> watched;
  for (DeviceLoop& device : devices_) {
    const auto steps_it = [&](const HapticGroup& group) {
      return std::ranges::find(group.devices, &device) != group.devices.end();
    };
    const auto group = std::ranges::find_if(groups_, steps_it);
    watched.push_back({.scene = device.scene,
                       .device = device.device,
                       .safe = device.safe,
                       .haptic = device.haptic,
                       .mail = device.mail,
                       .not_realtime = group->not_realtime,
                       .thread = static_cast<std::size_t>(group - groups_.begin())});
  }
  std::vector<Mailboxes*> datagrams;
  for (std::size_t i = 0; i < networks_.size(); ++i) datagrams.push_back(&devices_[first_device(i)].mail);
  log_.emplace(watched, datagrams, config.now, config.watched ? LogLoop::Records::kLeft : LogLoop::Records::kTaken);
}

std::size_t Assembly::first_device(std::size_t network) const noexcept {
  const Shard shard{.number = static_cast<std::uint32_t>(network), .of = static_cast<std::uint32_t>(networks_.size())};
  return shard.first_device(devices_.size());
}

/// Only the first network loop receives Hellos (UdpLink::several). It passes them to the others, which have a turn at
/// least after each haptic step. If the queue is full, the client must repeat the Hello.
LocalTime Assembly::turn_network(std::size_t number, LocalTime now) {
  Network& network = networks_.at(number);
  while (const HandedHello* const hello = network.hellos.front()) {
    network.loop.receive_foreign(now, hello->from, std::span(hello->bytes).first(hello->size));
    network.hellos.pop();
  }
  const LocalTime due = network.loop.turn(now);
  for (const NetworkLoop::Foreign& foreign : network.loop.take_foreign()) {
    SpscRing<HandedHello>& hellos = networks_.at(foreign.shard).hellos;
    HandedHello* const hello = hellos.back();
    if (hello == nullptr) continue;
    hello->from = foreign.from;
    hello->size = static_cast<std::uint32_t>(foreign.hello.size());
    std::copy(foreign.hello.begin(), foreign.hello.end(), hello->bytes.begin());
    hellos.push();
  }
  return due;
}

}  // namespace tendon
