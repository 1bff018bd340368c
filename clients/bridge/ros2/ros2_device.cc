// SPDX-License-Identifier: Apache-2.0
#include "clients/bridge/ros2/ros2_device.h"

#include <algorithm>
#include <charconv>
#include <chrono>
#include <utility>

namespace tendon::bridge {
namespace {

using std::chrono::milliseconds;

constexpr Duration kLeastFresh = milliseconds(20);
constexpr Duration kMostFresh = milliseconds(200);
constexpr std::size_t kGapsNeeded = 3;
constexpr Duration kJoyEvery = milliseconds(20);
constexpr Duration kSayEvery = std::chrono::seconds(1);  ///< for each program, in case it alternates between two errors
constexpr std::size_t kMaxSentences = 16;

std::string number(double value) {
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), value, std::chars_format::general, 4).ptr;
  return {text.data(), end};
}

double ms(Duration d) { return std::chrono::duration<double, std::milli>(d).count(); }

std::string_view words(Mode mode) {
  switch (mode) {
    case Mode::kIdle:
      return "no force received yet";
    case Mode::kActive:
      return "a fresh force";
    case Mode::kHolding:
      return "an old force, which is held";
    case Mode::kDecaying:
      return "an old force, which decays";
    case Mode::kSafeStop:
      return "none: the newest force is too old";
    case Mode::kFault:
      return "none: fault";
  }
  return "?";
}

std::string_view words(Safety safety) {
  switch (safety) {
    case Safety::kAbsent:
      return "the device is not plugged in";
    case Safety::kOpening:
      return "the device is being opened";
    case Safety::kFirmware:
      return "the device has no firmware yet";
    case Safety::kUnhomed:
      return "the device must be homed";
    case Safety::kHomed:
      return "the device is ready to be armed";
    case Safety::kArmed:
      return "armed";
    case Safety::kFault:
      return "the device exerts no force until it is armed again";
    case Safety::kUnguarded:
      return "ready, without a safety layer";
  }
  return "?";
}

}  // namespace

void Freshness::came(LocalTime now) {
  if (newest_) gaps_[count_++ % kGaps] = now - *newest_;
  newest_ = now;
}

Duration Freshness::good_for() const {
  if (count_ < kGapsNeeded) return kMostFresh;
  auto sorted = gaps_;
  const auto middle = static_cast<std::ptrdiff_t>(std::min(count_, kGaps) / 2);
  const auto end = sorted.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kGaps));
  std::nth_element(sorted.begin(), sorted.begin() + middle, end);
  return std::clamp(3 * *(sorted.begin() + middle), kLeastFresh, kMostFresh);
}

bool RosDevice::is_due(LocalTime now) {
  if (config_.rate_hz <= 0) return true;
  if (now < next_) return false;
  const Duration period = from_seconds(1 / config_.rate_hz);
  next_ += period;
  if (next_ <= now) next_ = now + period;
  return true;
}

bool RosDevice::joy_is_due(LocalTime now) {
  const std::uint32_t before = std::exchange(buttons_, bridged_.state()->buttons);
  if (buttons_ == before && now < next_joy_) return false;
  next_joy_ = now + kJoyEvery;
  return true;
}

void RosDevice::learn() {
  if (bridged_.lost()) knows_ = false;
  if (knows_ || !bridged_.handle()) return;
  knows_ = true;
  if (!bridged_.handle()->operator_from_device) {
    say("the scene does not specify the orientation of the device (axes = …): assuming x right, y up, z to the user");
  }
  if (!config_.servo) return;
  const auto& names = bridged_.handle()->buttons;
  const auto found = std::ranges::find(names, config_.clutch);
  clutch_.reset();
  if (found != names.end()) {
    clutch_ = static_cast<std::size_t>(found - names.begin());
  } else if (config_.clutch.size() == 1 && config_.clutch[0] >= '0' && config_.clutch[0] <= '9') {
    clutch_ = static_cast<std::size_t>(config_.clutch[0] - '0');
  } else {
    std::string known;
    for (const std::string& name : names) known += (known.empty() ? "" : ", ") + name;
    say("--clutch " + printable(config_.clutch) + ": the device has no such button, so nothing is sent to servo_…; " +
        (known.empty() ? "expected its number, 0 to 9" : "it has " + known));
  }
}

bool RosDevice::clutch_held() const { return clutch_ && (bridged_.state()->buttons >> *clutch_ & 1U) != 0; }

RosDevice::Messages RosDevice::messages(LocalTime now, Duration since_1970) {
  Messages due;
  learn();
  if (crtk_) {
    due.operating_state = crtk_->message(now, {ros_time(now.time_since_epoch() + since_1970), config_.name + "_base"});
  }
  if (!bridged_.state()) {
    if (config_.servo) config_.servo->lose();
    return due;
  }
  if (std::exchange(states_, bridged_.states()) == bridged_.states()) return due;
  const DeviceState& state = *bridged_.state();
  const auto& handle = bridged_.handle();
  const RosView view(config_.name, handle ? handle->operator_from_device : std::nullopt);
  const RosTime stamp = ros_time(bridged_.sampled().time_since_epoch() + since_1970);
  if (joy_is_due(now)) due.joy = joy_of(state, handle, {stamp, view.base_id()});
  if (!is_due(now)) return due;
  due.pose = view.pose(state, stamp);
  due.twist = view.twist(state, stamp);
  due.wrench = view.wrench(state, stamp);
  if (crtk_) {
    due.measured_cf = due.wrench;
    if (config_.negate_measured) {
      due.measured_cf->force *= -1;
      due.measured_cf->torque *= -1;
    }
  }
  due.joints = joints_of(state, handle, {stamp, view.base_id()});
  if (config_.servo) due.servo = config_.servo->take(*due.pose, *due.twist, clutch_held());
  return due;
}

RosDevice::Program* RosDevice::program_of(const RosInput& input) {
  const auto found = programs_.find(input.writer);
  if (found != programs_.end()) return &found->second;
  if (programs_.size() == kMostPrograms) return nullptr;
  const Program program{.number = ++numbers_, .called = printable(input.called), .topic = input.topic};
  return &programs_.emplace(input.writer, program).first->second;
}

void RosDevice::drop(Program& program, const std::string& why, LocalTime now) {
  refusal_ = "a " + std::string(topic_name(program.topic)) + " of " + program.called + " was dropped: " + why;
  say_of(program, refusal_, now);
}

/// Each message once, and at most one per second and program.
void RosDevice::say_of(Program& program, const std::string& sentence, LocalTime now) {
  if (sentence == program.said || (!program.said.empty() && now < program.said_at + kSayEvery)) return;
  program.said = sentence;
  program.said_at = now;
  say(sentence);
}

void RosDevice::take(const RosInput& input, LocalTime now) {
  Program* program = program_of(input);
  if (crtk_ && input.topic == RosInput::Topic::kStateCommand) {  // anybody can disarm the device
    const std::string sentence = crtk_->take(printable(input.called), input.text, now);
    if (program != nullptr) say_of(*program, sentence, now);
    return;
  }
  if (program == nullptr) {
    ++refused_;
    refusal_ = "a " + std::string(topic_name(input.topic)) + " was dropped: " + std::to_string(kMostPrograms) +
               " publishers already send commands";
    return;
  }
  if (input.topic == RosInput::Topic::kServoCp) {
    ++refused_;
    drop(*program, "the device has no position control; expected a force, servo_cf", now);
    return;
  }
  take_wrench(*program, input, now);
}

void RosDevice::take_wrench(Program& program, const RosInput& input, LocalTime now) {
  const auto& handle = bridged_.handle();
  const RosView view(config_.name, handle ? handle->operator_from_device : std::nullopt);
  const bool negate = config_.negate && input.topic == RosInput::Topic::kWrenchCommand;
  const auto wish = view.wish(input.wrench, negate);
  if (const auto* why = std::get_if<std::string>(&wish)) {
    ++refused_;
    drop(program, *why, now);
    return;
  }
  program.freshness.came(now);
  Touch touch(std::get<RosView::Wish>(wish).force);
  if (handle && handle->max_torque > 0) touch.torque = std::get<RosView::Wish>(wish).torque;
  touch.valid_for = program.freshness.good_for();
  const auto answer = bridged_.push(program.number, now, now + *touch.valid_for, touch);
  switch (answer) {
    case BridgedDevice::Answer::kTaken: {
      const std::string sentence =
          program.called + " controls the device: the hand feels its " + std::string(topic_name(program.topic));
      if (program.said != sentence) say(sentence);
      program.said = sentence;
      program.said_at = now;
      break;
    }
    case BridgedDevice::Answer::kOwned:
      drop(program, "another program controls the device until it leaves or is silent for 1 s", now);
      break;
    case BridgedDevice::Answer::kObserving:
      drop(program, "--observe", now);
      break;
  }
}

void RosDevice::keep(std::span<const std::uint64_t> writers) {
  std::erase_if(programs_, [&](const auto& entry) {
    const auto& [writer, program] = entry;
    if (std::ranges::find(writers, writer) != writers.end()) return false;
    bridged_.release(program.number);
    if (crtk_) crtk_->leave(program.called);
    say(program.called + " has left");
    return true;
  });
}

RosDiagnosis RosDevice::diagnosis() {
  using Level = RosDiagnosis::Level;
  RosDiagnosis d{
      .level = Level::kOk, .name = "tendon: " + config_.name, .message = {}, .hardware_id = {}, .values = {}};
  const auto complain = [&d](Level level, const std::string& sentence) {
    d.level = std::max(d.level, level);
    d.message += (d.message.empty() ? "" : "; ") + sentence;
  };
  const auto add = [&d](std::string key, std::string value) {
    d.values.emplace_back(std::move(key), std::move(value));
  };
  if (bridged_.welcome()) add("server", bridged_.welcome()->server);
  if (bridged_.description()) d.hardware_id = bridged_.description()->model;
  add("states", std::to_string(bridged_.states() - std::exchange(states_told_, bridged_.states())));
  add("forces sent", std::to_string(bridged_.forces() - std::exchange(forces_told_, bridged_.forces())));
  add("commands of other programs", std::to_string(bridged_.forces_dropped()));
  add("commands refused", std::to_string(refused_));
  if (bridged_.lost() || !bridged_.state()) {
    complain(Level::kError, "no session with the server");
  } else {
    const DeviceState& state = *bridged_.state();
    const Reasons reasons = Reasons::from_bits(state.reasons);
    add("round trip ms", number(ms(bridged_.link().smoothed_round_trip)));
    add("datagrams lost", std::to_string(bridged_.link().lost));
    add("force", std::string(words(state.mode)));
    add("limited by", reasons.empty() ? "nothing" : to_string(reasons));
    add("permitted force N", number(state.permitted_force));
    add("energy J", number(state.energy));
    if (reasons.has(Reason::kFault)) complain(Level::kError, "the force is zero because of a fault");
    if (reasons.has(Reason::kDisarmed)) complain(Level::kWarn, "the device was disarmed by the operator");
    if (const auto device = bridged_.device_report()) {
      add("safety", std::string(words(device->safety)));
      if (device->safety != Safety::kArmed && device->safety != Safety::kUnguarded) {
        complain(device->safety == Safety::kFault ? Level::kError : Level::kWarn, std::string(words(device->safety)));
      }
      if (!device->fault.empty()) complain(Level::kError, device->fault);
      if (!device->degraded.empty()) complain(Level::kWarn, device->degraded);
    }
    if (const auto report = bridged_.report()) {
      add("late forces", std::to_string(report->late_server + report->late_network + report->late_engine));
      if (!report->words.empty()) complain(Level::kWarn, report->words);
    }
  }
  if (crtk_ && !crtk_->warning().empty()) complain(Level::kWarn, crtk_->warning());
  if (!refusal_.empty()) complain(Level::kWarn, std::exchange(refusal_, {}));
  if (d.message.empty()) d.message = bridged_.pushes() ? "the hand feels a program's force" : "ready";
  return d;
}

void RosDevice::say(std::string sentence) {
  sentences_.push_back(std::move(sentence));
  if (sentences_.size() > kMaxSentences) sentences_.pop_front();
}

std::optional<std::string> RosDevice::next_sentence() {
  if (sentences_.empty()) return {};
  std::string sentence = std::move(sentences_.front());
  sentences_.pop_front();
  return sentence;
}

}  // namespace tendon::bridge
