// SPDX-License-Identifier: Apache-2.0
#include "server/log_loop.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <limits>
#include <string_view>
#include <utility>
#include <variant>

#include "server/build_info.h"
#include "server/machine/clock.h"
#include "server/recording/flight_file.h"

namespace tendon {
namespace {

using Level = LogLoop::Notice::Level;

const char* describe(HapticController::Fault fault) {
  switch (fault) {
    case HapticController::Fault::kNone:
      return "none";
    case HapticController::Fault::kPositionNotFinite:
      return "a measured position is not a finite number";
    case HapticController::Fault::kDeviceSilent:
      return "the device has stopped responding";
    case HapticController::Fault::kPositionJumped:
      return "the position has jumped further than a hand can move: the encoder has wrapped around or lost counts";
  }
  return "unknown";
}

std::string describe(Device::State state, const Scene& scene) {
  switch (state) {
    case Device::State::kAbsent:
      return "the device is not plugged in";
    case Device::State::kOpening:
      return "the device is being opened";
    case Device::State::kFirmware: {
      const auto* falcon = std::get_if<falcon::Config>(&scene.device);
      return falcon != nullptr && !falcon->firmware
                 ? "the device has no firmware, and no firmware file is set: use --falcon-firmware FILE"
                 : "the firmware is being loaded into the device";
    }
    case Device::State::kUnhomed:
      return "the device must be " + std::string(scene.driver().homing);
    case Device::State::kHomed:
      return scene.driver().moves_a_hand ? "the device is homed" : "the device is ready";
  }
  return "unknown";
}

Safety on_the_wire(SafetyState state) noexcept {
  static_assert(static_cast<int>(SafetyState::kAbsent) + 1 == static_cast<int>(Safety::kAbsent));
  static_assert(static_cast<int>(SafetyState::kHomed) + 1 == static_cast<int>(Safety::kHomed));
  static_assert(static_cast<int>(SafetyState::kFault) + 1 == static_cast<int>(Safety::kFault));
  return static_cast<Safety>(static_cast<int>(state) + 1);
}

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

std::unique_ptr<PartRecorder> recorder_of(const std::vector<LogLoop::Watched>& devices, LocalTime started) {
  const Scene& first = devices.front().scene;
  if (!first.recording) return nullptr;
  PartRecorder::Config config;
  config.path = first.recording->path;
  const auto is_coupled = [](const Scene& scene) { return scene.teleoperation.has_value(); };
  config.run = {
      .scene = scene_record(first), .ports = is_coupled(first), .fields = first.has_fields(), .started = started};
  for (std::size_t i = 1; i < devices.size(); ++i) {
    const Scene& scene = devices[i].scene;
    config.run.more_devices.push_back({scene.name, scene_record(scene), is_coupled(scene), scene.has_fields()});
  }
  config.rotate_bytes = static_cast<std::uint64_t>(first.recording->rotate_bytes);
  config.rotate_after = from_seconds(first.recording->rotate_after);
  config.budget_bytes = static_cast<std::uint64_t>(first.recording->budget_bytes.value_or(0));
  config.keep = first.recording->keep;
  config.one_in = first.recording->one_in.value_or(0);
  return std::make_unique<PartRecorder>(config);
}

}  // namespace

LogLoop::LogLoop(const std::vector<Watched>& devices, const std::vector<Mailboxes*>& recorded, LocalTime started,
                 Records records)
    : started_(started),
      trouble_due_(started + kTroublePeriod),
      takes_records_(records == Records::kTaken),
      recorder_(takes_records_ ? recorder_of(devices, started) : nullptr) {
  devices_.reserve(devices.size());  // threads_ points to its elements
  for (const Watched& device : devices) {
    DeviceLog& log = devices_.emplace_back(DeviceLog{.of = device});
    log.reported.phase.fill(PortPhase::kAlone);
    threads_.resize(std::max(threads_.size(), device.thread + 1));
    threads_[device.thread].devices.push_back(&log);
  }
  for (Mailboxes* const mail : recorded) networks_.push_back({.mail = mail});
}

LocalTime LogLoop::turn(LocalTime now, std::uint64_t unsent) {
  round(now, unsent, false);
  return now + kPeriod;
}

void LogLoop::close(LocalTime now, std::uint64_t unsent) {
  round(now, unsent, true);
  if (!recorder_) return;
  recorder_->close(now);
  take_notices_of_recorder();
}

void LogLoop::round(LocalTime now, std::uint64_t unsent, bool last) {
  for (DeviceLog& device : devices_) device.of.mail.flight.make_ready();
  if (takes_records_) record_all(now);
  for (DeviceLog& device : devices_) report_health(now, unsent, device);
  if (now < trouble_due_ && !last) return;
  for (ThreadLog& thread : threads_) report_overruns(now, thread);
  for (DeviceLog& device : devices_) report_trouble(device);
  record_left_out(now);
  trouble_due_ = now + kTroublePeriod;
}

std::vector<LogLoop::Notice> LogLoop::take_notices() { return std::exchange(notices_, {}); }

std::optional<PartRecorder::Status> LogLoop::recording() const {
  return recorder_ ? std::optional(recorder_->status()) : std::nullopt;
}

void LogLoop::say(Level level, const DeviceLog& device, const std::string& text) {
  say(level, devices_.size() == 1 ? text : device.of.scene.name + ": " + text);
}

/// Records the fields, and what their channels have received until step `until`.
void LogLoop::record_fields(std::size_t number, std::uint64_t until) {
  FieldTape& tape = *devices_[number].of.mail.field_tape;
  for (const FieldInput* input = tape.inputs.front(); input != nullptr && input->tick <= until;
       input = tape.inputs.front()) {
    // The data were pushed before the haptic thread could use the field.
    for (const FieldData* data = tape.data.front(); data != nullptr; data = tape.data.front()) {
      if (recorder_) recorder_->record(*data, number);
      tape.data.pop();
    }
    if (recorder_) recorder_->record(*input, number);
    tape.inputs.pop();
  }
}

/// Returns the number of steps lost since the last call, including steps with missing ports or inputs of fields, which
/// cannot be replayed.
std::uint64_t LogLoop::record_steps(std::size_t number) {
  DeviceLog& device = devices_[number];
  Mailboxes& mail = device.of.mail;
  const auto take_ports = [&](std::uint64_t until) {
    for (const PortRecord* port = mail.ports.front(); port != nullptr && port->tick <= until;
         port = mail.ports.front()) {
      report_phase(device, *port);
      if (recorder_) recorder_->record(*port, number);
      mail.ports.pop();
    }
  };
  if (!recorder_) take_ports(std::numeric_limits<std::uint64_t>::max());
  while (const StepRecord* step = mail.steps.front()) {
    take_ports(step->tick);  // the haptic thread pushes the ports of a step before the step
    if (mail.field_tape) record_fields(number, step->tick);
    if (recorder_) recorder_->record(*step, number, mail.ways.name_of(step->force_way));
    mail.steps.pop();
  }
  const std::uint64_t steps = news(mail.steps_lost, device.reported.steps_lost);
  const std::uint64_t ports = news(mail.ports_lost, device.reported.ports_lost);
  if (!mail.field_tape) return steps + ports;
  return steps + ports + news(mail.field_tape->inputs_lost, device.reported.inputs_lost) +
         news(mail.field_tape->data_lost, device.reported.field_data_lost);
}

void LogLoop::record_all(LocalTime now) {
  std::uint64_t steps_lost = 0;
  for (std::size_t i = 0; i < devices_.size(); ++i) steps_lost += record_steps(i);
  std::uint64_t datagrams_lost = 0;
  for (NetworkLog& network : networks_) {
    while (const DatagramRecord* datagram = network.mail->datagrams.front()) {
      if (recorder_) recorder_->record(*datagram);
      network.mail->datagrams.pop();
    }
    datagrams_lost += news(network.mail->datagrams_lost, network.datagrams_lost);
  }
  if (steps_lost > 0 || datagrams_lost > 0) {
    say(Level::kWarning, "the log thread is too slow: " + std::to_string(steps_lost) + " steps and " +
                             std::to_string(datagrams_lost) + " datagrams are missing");
    if (recorder_) recorder_->lost({.at = now, .steps = steps_lost, .datagrams = datagrams_lost});
  }
  if (!recorder_) return;
  recorder_->tick(now);
  take_notices_of_recorder();
}

void LogLoop::record_left_out(LocalTime now) {
  if (!recorder_) return;
  std::uint64_t unauthenticated = 0;
  std::uint64_t datagrams = 0;
  for (NetworkLog& network : networks_) {
    unauthenticated += news(network.mail->unauthenticated_left_out, network.unauthenticated);
    datagrams += news(network.mail->datagrams_over_budget, network.over_budget);
  }
  if (unauthenticated > 0)
    recorder_->lost({.at = now, .cause = LossRecord::Cause::kSample, .unauthenticated = unauthenticated});
  if (datagrams > 0) {
    say(Level::kWarning, std::to_string(datagrams) + " datagrams are not recorded: their rate exceeds " +
                             "[recording] datagrams_kb_per_s");
    recorder_->lost({.at = now, .datagrams = datagrams, .cause = LossRecord::Cause::kByteBudget});
  }
}

void LogLoop::take_notices_of_recorder() {
  for (auto& [warning, text] : recorder_->take_notices()) say(warning ? Level::kError : Level::kInfo, std::move(text));
  recording_ended_ = !recorder_->status().error.empty();
}

void LogLoop::report_health(LocalTime now, std::uint64_t unsent, DeviceLog& device) {
  Health health = device.of.haptic.health();
  health.at = now;
  health.steps_lost = device.reported.steps_lost + device.reported.ports_lost + device.reported.inputs_lost;
  const HapticLoop::Stats haptic = device.of.haptic.stats();
  if (haptic.fault != HapticController::Fault::kNone) health.fault = describe(haptic.fault);
  if (device.of.safe != nullptr) {
    const SafeDevice::Status safety = device.of.safe->status();
    health.safety = on_the_wire(safety.state);
    if (safety.state == SafetyState::kFault) health.fault = to_string(safety.last_fault);
  } else {
    const bool ready = haptic.device == Device::State::kHomed;
    health.safety = ready ? Safety::kUnguarded : on_the_wire(static_cast<SafetyState>(haptic.device));
  }
  health.device = device.of.device.counts();
  health.not_realtime = device.of.not_realtime.load(std::memory_order_relaxed);
  health.recording_ended = recording_ended_;
  health.unsent = unsent;
  device.of.mail.health.put(health);
}

/// Writes one line per thread, because its devices are late together. The number is the maximum of a device.
void LogLoop::report_overruns(LocalTime now, ThreadLog& thread) {
  std::uint64_t most = 0;
  Duration longest{};
  for (const DeviceLog* device : thread.devices) {
    const HapticLoop::Stats haptic = device->of.haptic.stats();
    most = std::max(most, haptic.overruns - device->reported.haptic.overruns);
    longest = std::max(longest, haptic.longest_interval);
  }
  const auto due = thread.overruns.add(now, most);
  if (!due) return;
  const std::size_t others = thread.devices.size() - 1;
  say(Level::kWarning, *thread.devices.front(),
      std::to_string(due->count) + " overruns in the last " + (due->of_a_minute ? "minute" : "second") +
          (others > 0 ? ", also of " + std::to_string(others) + " other devices on this thread" : "") +
          "; longest interval so far " +
          std::to_string(std::chrono::duration_cast<std::chrono::microseconds>(longest).count()) + " µs");
}

void LogLoop::report_trouble(DeviceLog& device) {
  report_safety(device);
  report_counts(device);
  const HapticLoop::Stats now = device.of.haptic.stats();
  if (now.device != device.reported.haptic.device) say(Level::kInfo, device, describe(now.device, device.of.scene));
  // Each fault freezes the recorder once, and saving thaws it. report_safety names the faults of the safety layer.
  if (takes_records_ && device.of.mail.flight.frozen()) {
    if (now.fault != HapticController::Fault::kNone) {
      say(Level::kError, device,
          std::string("fault: ") + describe(now.fault) + "; the force is zero until a client rearms the device");
    }
    save_flight(device);
  }
  device.reported.haptic = now;
}

void LogLoop::report_safety(DeviceLog& device) {
  if (device.of.safe == nullptr) return;
  const SafeDevice::Status now = device.of.safe->status();
  const SafeDevice::Status before = std::exchange(device.reported.safety, now);
  if (now.faults > before.faults) {
    say(Level::kError, device, "fault of the safety layer: " + std::string(to_string(now.last_fault)));
  }
  const bool armed = now.state == SafetyState::kArmed;
  const bool was_armed = before.state == SafetyState::kArmed;
  if (armed && !was_armed) say(Level::kInfo, device, "the device is armed");
  if (was_armed && now.state < SafetyState::kArmed) say(Level::kInfo, device, "the device is disarmed");
}

void LogLoop::report_counts(DeviceLog& device) {
  const DeviceCounts now = device.of.device.counts();
  const DeviceCounts before = std::exchange(device.reported.counts, now);
  for (const DeviceCounter& row : kDeviceCounters) {
    if (row.degraded.empty() || now[row.count] == before[row.count]) continue;
    say(Level::kWarning, device,
        std::string(row.name) + ": " + std::to_string(now[row.count] - before[row.count]) + " more (" +
            std::string(row.meaning) + ")");
  }
}

void LogLoop::report_phase(DeviceLog& device, const PortRecord& port) {
  const PortPhase phase = port.sent.phase;
  if (std::exchange(device.reported.phase[port.channel], phase) == phase) return;
  const bool trouble = phase == PortPhase::kLost || phase == PortPhase::kFault;
  const bool several = !device.of.scene.loop.control.leaders.empty();
  const std::string leader = several ? device.of.scene.channels[port.channel].name + ": " : "";
  say(trouble ? Level::kWarning : Level::kInfo, device, "teleoperation: " + leader + std::string(to_string(phase)));
}

void LogLoop::save_flight(DeviceLog& device) {
  try {
    const auto& recording = devices_.front().of.scene.recording;
    const auto sink = open_flight(recording ? std::optional(recording->path) : std::nullopt,
                                  devices_.size() == 1 ? "" : device.of.scene.name);
    Mailboxes& mail = device.of.mail;
    write_flight(mail.flight, {.scene = scene_record(device.of.scene), .started = started_}, mail.ways, *sink);
    say(Level::kError, "the steps before the fault are saved in " + sink->path().string());
  } catch (const std::exception& problem) {
    say(Level::kError, std::string("cannot save the steps before the fault: ") + problem.what());
  }
  device.of.mail.flight.thaw();
}

}  // namespace tendon
