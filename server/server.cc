// SPDX-License-Identifier: Apache-2.0
#include "server/server.h"

#include <algorithm>
#include <filesystem>
#include <span>
#include <utility>

#include "devices/simulated/simulated_device.h"
#include "server/build_info.h"
#include "server/clock.h"
#include "server/flight_file.h"
#include "server/key_folder.h"
#include "server/log.h"
#include "server/randomness.h"
#include "server/realtime.h"

namespace tendon {

namespace {

constexpr int kHapticPriority = 70;
constexpr auto kLogPeriod = std::chrono::milliseconds(20);
/// Trouble is told at most this often, with how much of it there was.
constexpr auto kTellPeriod = std::chrono::seconds(1);

NetworkLoop::Config network_config(const Scene& scene, const DeviceInfo& device) {
  NetworkLoop::Config config;
  fill_random(config.secret);
  fill_random(std::as_writable_bytes(std::span(&config.first_connection_id, 1)));
  config.first_connection_id |= 1;  // never 0
  if (scene.network.keys) config.keys = read_key_folder(*scene.network.keys);
  config.server_name = "tendond " + std::string(kVersion);
  config.device_name = device.name;
  config.max_force = scene.loop.control.max_force;
  config.position_resolution = device.position_resolution;
  config.haptic_period = scene.loop.period;
  config.max_observers = scene.network.max_observers;
  config.controller_timeout = scene.network.controller_timeout;
  config.observer_timeout = scene.network.observer_timeout;
  config.adapt_state_rate = scene.network.adapt_state_rate;
  return config;
}

const char* describe(HapticController::Fault fault) {
  switch (fault) {
    case HapticController::Fault::kNone:
      return "none";
    case HapticController::Fault::kPositionNotFinite:
      return "the device measured a position that is not a number";
    case HapticController::Fault::kDeviceSilent:
      return "the device has stopped answering";
  }
  return "unknown";
}

}  // namespace

Server::Server(const Scene& scene)
    : scene_(scene),
      started_(clock::now()),
      device_(std::make_unique<SimulatedDevice>(scene.device)),
      mail_(std::make_unique<Mailboxes>()),
      link_(scene.network.listen, scene.network.keys ? Reach::kAnywhere : Reach::kThisMachine),
      haptic_(scene.loop, *device_, *mail_),
      network_(network_config(scene, device_->info()), link_, *mail_),
      tell_next_(started_ + kTellPeriod) {
  if (scene.recording) {
    sink_ = std::make_unique<FileSink>(*scene.recording);
    recorder_ = std::make_unique<Recorder>(recorder_config(), *sink_);
  }
}

Recorder::Config Server::recorder_config() const {
  Recorder::Config config;
  config.scene = {.text = scene_.text,
                  .version = std::string(kVersion),
                  .commit = std::string(kCommit),
                  .unix_offset = clock::unix_offset()};
  config.started = started_;
  return config;
}

Server::~Server() {
  if (haptic_thread_.joinable()) stop();
}

void Server::start() {
  log_thread_ = std::thread([this] { run_log(); });
  network_thread_ = std::thread([this] { run_network(); });
  haptic_thread_ = std::thread([this] { run_haptic(); });
}

Server::Summary Server::stop() {
  stop_haptic_.store(true, std::memory_order_release);
  haptic_thread_.join();
  stop_network_.store(true, std::memory_order_release);
  stepped_.ring();
  network_thread_.join();
  stop_log_.store(true, std::memory_order_release);
  log_thread_.join();

  Summary summary;
  summary.haptic = haptic_.stats();
  summary.network = network_.stats();
  if (recorder_) summary.recording = recorder_->status();
  summary.uptime = clock::now() - started_;
  return summary;
}

void Server::run_haptic() {
  for (const std::string& refused : enter_realtime(kHapticPriority)) log::warn(refused);
  LocalTime due = clock::now();
  while (!stop_haptic_.load(std::memory_order_acquire)) {
    due = haptic_.step(clock::now());
    stepped_.ring();
    clock::sleep_until(due);
  }
  haptic_.stop();
}

void Server::run_network() {
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
  bool last = false;
  while (!last) {
    // What was pushed before this flag was set is drained below: nothing is left behind.
    last = stop_log_.load(std::memory_order_acquire);
    const LocalTime now = clock::now();
    drain_to_recorder(now);
    if (now >= tell_next_ || last) {
      report_trouble();
      tell_next_ = now + kTellPeriod;
    }
    if (!last) clock::sleep_until(now + kLogPeriod);
  }
  if (recorder_) recorder_->close();
}

void Server::drain_to_recorder(LocalTime now) {
  while (const StepRecord* step = mail_->steps.front()) {
    if (recorder_) recorder_->record(*step);
    mail_->steps.pop();
  }
  while (const DatagramRecord* datagram = mail_->datagrams.front()) {
    if (recorder_) recorder_->record(*datagram);
    mail_->datagrams.pop();
  }
  const std::uint64_t steps = mail_->steps_lost.load(std::memory_order_relaxed);
  const std::uint64_t datagrams = mail_->datagrams_lost.load(std::memory_order_relaxed);
  if (steps != told_steps_lost_ || datagrams != told_datagrams_lost_) {
    log::warn("the log thread could not follow: " + std::to_string(steps - told_steps_lost_) + " steps and " +
              std::to_string(datagrams - told_datagrams_lost_) + " datagrams are missing");
    if (recorder_) recorder_->lost(now, steps - told_steps_lost_, datagrams - told_datagrams_lost_);
    told_steps_lost_ = steps;
    told_datagrams_lost_ = datagrams;
  }
  if (!recorder_) return;
  recorder_->tick(now);
  if (const auto status = recorder_->status(); !status.error.empty() && !told_recording_ended_) {
    told_recording_ended_ = true;
    log::error("recording has ended, the device runs on: " + status.error);
  }
}

void Server::report_trouble() {
  const HapticLoop::Stats now = haptic_.stats();
  if (now.overruns > told_.overruns) {
    log::warn(std::to_string(now.overruns - told_.overruns) + " overruns in the last second; longest interval so far " +
              std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(now.longest_interval).count()) +
              " µs");
  }
  if (mail_->flight.frozen()) {  // each fault freezes it once, and saving thaws it
    log::error(std::string("fault: ") + describe(now.fault) + "; force is zero until a controller rearms");
    save_flight();
  }
  told_ = now;
}

void Server::save_flight() {
  std::filesystem::path path = scene_.recording.value_or("tendon.mcap");
  path.replace_extension(".fault-" + std::to_string(++flights_) + ".mcap");
  try {
    FileSink sink(path);
    write_flight(mail_->flight, recorder_config(), sink);
    log::error("the steps before the fault are in " + path.string());
  } catch (const std::exception& problem) {
    log::error(std::string("the steps before the fault are lost: ") + problem.what());
    mail_->flight.thaw();
  }
}

}  // namespace tendon
