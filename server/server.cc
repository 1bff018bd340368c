// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <span>
#include <utility>
#include <variant>

#include "server/build_info.h"
#include "server/device_factory.h"
#include "server/machine/clock.h"
#include "server/machine/log.h"
#include "server/machine/randomness.h"
#include "server/machine/realtime.h"
#include "server/recording/flight_file.h"
#include "server/scene/key_folder.h"

namespace tendon {

namespace {

constexpr auto kLogPeriod = std::chrono::milliseconds(20);
/// Trouble is told at most this often, with how much of it there was.
constexpr auto kTellPeriod = std::chrono::seconds(1);

DeviceDescription description_of(const Scene& scene, const DeviceInfo& device) {
  DeviceDescription about;
  about.name = scene.name;
  about.model = device.name;
  about.max_force = scene.loop.control.max_force;
  if (!scene.driver().exerts_force) about.max_force = 0;
  if (scene.safety && device.max_force > 0) about.max_force = std::min(about.max_force, device.max_force);
  about.position_resolution = device.position_resolution;
  about.loop_hz = static_cast<std::uint32_t>(std::lround(1 / seconds(scene.loop.period)));
  for (const Scene::Channel& channel : scene.channels) {
    about.channels.push_back({.name = channel.name, .rule = channel.rule, .lease = channel.lease, .holder = {}});
  }
  return about;
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

/// What the operator is told when a real device comes to this state.
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

/// How far a counter has come since the last look at it.
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
  config.run = {.scene = scene_record(scenes.front()), .started = started};
  for (std::size_t i = 1; i < scenes.size(); ++i) {
    config.run.more_devices.push_back({scenes[i].name, scene_record(scenes[i])});
  }
  config.rotate_bytes = static_cast<std::uint64_t>(recording->rotate_bytes);
  config.rotate_after = from_seconds(recording->rotate_after);
  config.budget_bytes = static_cast<std::uint64_t>(recording->budget_bytes.value_or(0));
  return std::make_unique<PartRecorder>(config);
}

}  // namespace

Server::Lane::Lane(const Scene& the_scene, const Mailboxes::Capacities& capacities, Guardian* guardian)
    : scene(the_scene),
      device(make_device(scene, guardian)),
      safe(scene.safety ? std::make_unique<SafeDevice>(*scene.safety, *device) : nullptr),
      mail(capacities),
      haptic(scene.loop, safe ? *safe : *device, mail),
      meter(scene.loop.period) {}

Server::Lanes Server::lanes_of(const std::vector<Scene>& scenes, Guardian* guardian) {
  Lanes lanes;
  for (const Scene& scene : scenes) {
    Mailboxes::Capacities capacities;
    if (!lanes.empty()) capacities.datagrams = 1;  // all go to the first
    lanes.push_back(std::make_unique<Lane>(scene, capacities, guardian));
  }
  return lanes;
}

std::vector<Mailboxes*> Server::mail_of(const Lanes& lanes) {
  std::vector<Mailboxes*> mail;
  for (const auto& lane : lanes) mail.push_back(&lane->mail);
  return mail;
}

NetworkLoop::Config Server::network_config(const Lanes& lanes) {
  const Scene& scene = lanes.front()->scene;
  NetworkLoop::Config config;
  fill_random(config.secret);
  fill_random(std::as_writable_bytes(std::span(&config.first_connection_id, 1)));
  config.first_connection_id |= 1;  // never 0
  if (scene.network.keys) config.keys = read_key_folder(*scene.network.keys);
  config.server_name = "tendond " + std::string(kVersion);
  for (const auto& lane : lanes) {
    config.devices.push_back(description_of(lane->scene, lane->safe ? lane->safe->info() : lane->device->info()));
  }
  config.takeover = scene.network.takeover;
  config.max_observers = scene.network.max_observers;
  config.controller_timeout = scene.network.controller_timeout;
  config.observer_timeout = scene.network.observer_timeout;
  config.adapt_state_rate = scene.network.adapt_state_rate;
  if (scene.recording) config.recorded.bytes_per_s = static_cast<std::uint64_t>(scene.recording->datagram_bytes_per_s);
  return config;
}

Server::Server(const std::vector<Scene>& scenes)
    : started_(clock::now()),
      guardian_(make_guardian(scenes)),
      lanes_(lanes_of(scenes, guardian_.get())),
      link_(scenes.front().network.listen, scenes.front().network.keys ? Reach::kAnywhere : Reach::kThisMachine),
      network_(network_config(lanes_), link_, mail_of(lanes_)),
      tell_next_(started_ + kTellPeriod) {
  recorder_ = recorder_of(scenes, started_);  // last: what is refused before leaves no file behind
}

std::optional<std::filesystem::path> Server::recording() const {
  return recorder_ ? std::optional(recorder_->status().path) : std::nullopt;
}

std::string Server::prefix(const Lane& lane) const { return lanes_.size() == 1 ? "" : lane.scene.name + ": "; }

Server::~Server() {
  if (network_thread_.joinable()) stop();
}

void Server::start(std::optional<Duration> run_for) {
  run_for_ = run_for;
  if (const auto& refused = wakeful_.emplace().refused()) log::warn(*refused);
  log_thread_ = std::thread([this] { run_log(); });
  network_thread_ = std::thread([this] { run_network(); });
  for (auto& lane : lanes_) lane->thread = std::thread([this, &lane = *lane] { run_haptic(lane); });
}

Server::Summary Server::stop() {
  stop_haptic_.store(true, std::memory_order_release);
  for (auto& lane : lanes_) lane->thread.join();
  stop_network_.store(true, std::memory_order_release);
  stepped_.ring();
  network_thread_.join();
  stop_log_.store(true, std::memory_order_release);
  log_thread_.join();
  wakeful_.reset();

  Summary summary;
  for (const auto& lane : lanes_) {
    DeviceSummary& device = summary.devices.emplace_back(DeviceSummary{
        .name = lane->scene.name, .haptic = lane->haptic.stats(), .safety = std::nullopt, .counts = std::nullopt});
    if (lane->safe) device.safety = lane->safe->status();
    if (!lane->scene.driver().ids.empty()) device.counts = lane->device->counts();
  }
  summary.network = network_.stats();
  if (recorder_) summary.recording = recorder_->status();
  summary.uptime = clock::now() - started_;
  return summary;
}

bool Server::turning() {
  bool all = true;
  for (auto& lane : lanes_) {
    const std::uint64_t steps = lane->haptic.stats().steps;
    all = std::exchange(lane->steps_seen, steps) != steps && all;
  }
  return all;
}

void Server::run_haptic(Lane& lane) {
  name_thread("haptic-" + std::to_string(lane.scene.loop.device));
  const bool first = &lane == lanes_.front().get();
  for (const std::string& refused : enter_realtime(kHapticPriority)) {
    if (first) log::warn(refused);  // to all of them alike
    lane.not_realtime.store(true, std::memory_order_relaxed);
  }
  if (lane.scene.cpu) {
    if (const auto refused = stay_on(*lane.scene.cpu)) log::warn(prefix(lane) + *refused);
  }
  LocalTime due = clock::now();
  const LocalTime end = run_for_ ? due + *run_for_ : LocalTime::max();
  while (!stop_haptic_.load(std::memory_order_acquire) && due < end) {
    due = lane.haptic.step(clock::now());
    stepped_.ring();
    clock::sleep_until(due);
  }
  lane.haptic.stop();
}

void Server::run_network() {
  name_thread("network");
  enter_punctual();
  LocalTime due = clock::now();
  while (!stop_network_.load(std::memory_order_acquire)) {
    const LocalTime before = clock::now();
    if (due > before) link_.wait(std::min<Duration>(due - before, std::chrono::seconds(1)), &stepped_);
    due = network_.turn(clock::now());
    for (const auto& [warning, text] : network_.take_notices()) warning ? log::warn(text) : log::info(text);
  }
  network_.close(clock::now());
}

void Server::run_log() {
  name_thread("log");
  bool last = false;
  while (!last) {
    // What was pushed before this flag was set is drained below: nothing is left behind.
    last = stop_log_.load(std::memory_order_acquire);
    const LocalTime now = clock::now();
    drain_to_recorder(now);
    for (auto& lane : lanes_) report_health(now, *lane);
    if (now >= tell_next_ || last) {
      for (auto& lane : lanes_) report_trouble(*lane);
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
  for (std::size_t device = 0; device < lanes_.size(); ++device) {
    Lane& lane = *lanes_[device];
    while (const StepRecord* step = lane.mail.steps.front()) {
      lane.meter.observe(*step);
      if (recorder_) recorder_->record(*step, device);
      lane.mail.steps.pop();
    }
    steps_lost += news(lane.mail.steps_lost, lane.told_steps_lost);
  }
  Mailboxes& first = lanes_.front()->mail;
  while (const DatagramRecord* datagram = first.datagrams.front()) {
    if (recorder_) recorder_->record(*datagram);
    first.datagrams.pop();
  }
  const std::uint64_t datagrams_lost = news(first.datagrams_lost, told_datagrams_lost_);
  if (steps_lost > 0 || datagrams_lost > 0) {
    log::warn("the log thread could not follow: " + std::to_string(steps_lost) + " steps and " +
              std::to_string(datagrams_lost) + " datagrams are missing");
    if (recorder_) recorder_->lost({.at = now, .steps = steps_lost, .datagrams = datagrams_lost});
  }
  if (!recorder_) return;
  recorder_->tick(now);
  tell_of_recording();
}

/// What the network thread has left out of the recording since the last call.
void Server::record_left_out(LocalTime now) {
  if (!recorder_) return;
  Mailboxes& mail = lanes_.front()->mail;
  if (const std::uint64_t strangers = news(mail.strangers_left_out, told_strangers_); strangers > 0) {
    recorder_->lost({.at = now, .cause = LossRecord::Cause::kSample, .strangers = strangers});
  }
  if (const std::uint64_t datagrams = news(mail.datagrams_over_budget, told_over_budget_); datagrams > 0) {
    log::warn(std::to_string(datagrams) + " datagrams are not recorded: more bytes came in a second than [recording] " +
              "datagrams_kb_per_s");
    recorder_->lost({.at = now, .datagrams = datagrams, .cause = LossRecord::Cause::kByteBudget});
  }
}

void Server::tell_of_recording() {
  for (const auto& [warning, text] : recorder_->take_notices()) warning ? log::error(text) : log::info(text);
  recording_stopped_ = !recorder_->status().error.empty();
}

/// To the network thread, for observers that ask.
void Server::report_health(LocalTime now, Lane& lane) {
  Health health = lane.meter.counted();
  health.at = now;
  const HapticLoop::Stats haptic = lane.haptic.stats();
  if (haptic.fault != HapticController::Fault::kNone) health.fault = describe(haptic.fault);
  if (lane.safe) {
    const SafeDevice::Status safety = lane.safe->status();
    health.safety = on_the_wire(safety.state);
    if (safety.state == SafetyState::kFault) health.fault = to_string(safety.last_fault);
  } else {
    const bool ready = haptic.device == Device::State::kHomed;
    health.safety = ready ? Safety::kUnguarded : on_the_wire(static_cast<SafetyState>(haptic.device));
  }
  health.device = lane.device->counts();
  health.not_realtime = lane.not_realtime.load(std::memory_order_relaxed);
  health.recording_ended = recording_stopped_;
  lane.mail.health.put(health);
}

void Server::report_safety(Lane& lane) {
  if (!lane.safe) return;
  const SafeDevice::Status now = lane.safe->status();
  if (now.faults > lane.told_safety.faults) {
    log::error(prefix(lane) + "no force any more: " + std::string(to_string(now.last_fault)));
  }
  const bool armed = now.state == SafetyState::kArmed;
  const bool was_armed = lane.told_safety.state == SafetyState::kArmed;
  if (armed && !was_armed) log::info(prefix(lane) + "the device is armed");
  if (was_armed && now.state < SafetyState::kArmed) log::info(prefix(lane) + "the device is no longer armed");
  lane.told_safety = now;
}

/// The counters of its driver that mean trouble, when they have risen.
void Server::report_counts(Lane& lane) {
  const DeviceCounts now = lane.device->counts();
  const DeviceCounts before = std::exchange(lane.told_counts, now);
  for (const DeviceCounter& row : kDeviceCounters) {
    if (row.degraded.empty() || now[row.count] == before[row.count]) continue;
    log::warn(prefix(lane) + std::string(row.name) + ": " + std::to_string(now[row.count] - before[row.count]) +
              " more (" + std::string(row.meaning) + ")");
  }
}

void Server::report_trouble(Lane& lane) {
  report_safety(lane);
  report_counts(lane);
  const HapticLoop::Stats now = lane.haptic.stats();
  if (now.overruns > lane.told.overruns) {
    log::warn(prefix(lane) + std::to_string(now.overruns - lane.told.overruns) +
              " overruns in the last second; longest interval so far " +
              std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(now.longest_interval).count()) +
              " µs");
  }
  if (now.device != lane.told.device) log::info(prefix(lane) + describe(now.device, lane.scene));
  // Each fault freezes it once, and saving thaws it: the controller's, and the safety layer's, which report_safety
  // names.
  if (lane.mail.flight.frozen()) {
    if (now.fault != HapticController::Fault::kNone) {
      log::error(prefix(lane) + "fault: " + describe(now.fault) + "; force is zero until a controller rearms");
    }
    save_flight(lane);
  }
  lane.told = now;
}

void Server::save_flight(Lane& lane) {
  try {
    const auto& recording = lanes_.front()->scene.recording;
    const auto sink = open_flight(recording ? std::optional(recording->path) : std::nullopt,
                                  lanes_.size() == 1 ? "" : lane.scene.name);
    write_flight(lane.mail.flight, {.scene = scene_record(lane.scene), .started = started_}, *sink);
    log::error("the steps before the fault are in " + sink->path().string());
  } catch (const std::exception& problem) {
    log::error(std::string("the steps before the fault are lost: ") + problem.what());
  }
  lane.mail.flight.thaw();
}

}  // namespace tendon
