// SPDX-License-Identifier: Apache-2.0
#include "server/haptic_loop.h"

#include <array>
#include <stdexcept>
#include <utility>

#include "core/base/arithmetic.h"
#include "core/base/rotation.h"

namespace tendon {

namespace {

void put_handle(DeviceState& state, const StepRecord& record, const DeviceInfo& info) noexcept {
  state.turning.reset();
  state.torque_applied.reset();
  state.grip.reset();
  state.grip_applied.reset();
  if (const TurnStep* const turn = record.turn()) {
    state.turning = turn->hand;
    if (info.max_torque > 0) state.torque_applied = turn->applied;
  }
  if (const GripStep* const grip = record.grip()) {
    state.grip = grip->hand;
    if (info.gripper && info.gripper->max_force > 0) state.grip_applied = grip->applied;
  }
  state.joints.reset();
  if (const Joints* const joints = record.joints()) state.joints = *joints;
}

void put_state(DeviceState& state, std::uint32_t device, const StepRecord& record) noexcept {
  state.device = device;
  state.channel = record.channel;
  state.tick = record.tick;
  state.sampled = PeerTime(record.hand.at.time_since_epoch());  // our clock is the peer clock of the client
  state.position = record.hand.position;
  state.velocity = record.hand.velocity;
  state.force_applied = record.applied;
  state.energy = record.energy;
  state.permitted_force = record.permitted;
  state.reasons = record.reasons.bits();
  state.force_sequence = record.force_sequence;
  state.force_age = record.force_age;
  state.mode = record.mode;
  state.force_wanted = record.wanted;
  state.stiffness_wanted = record.stiffness;
  state.buttons = record.buttons;
  state.hand_force = record.hand_force;
  if (const auto& field = record.field) {
    state.field = {.generation = field->generation, .depth = field->depth, .proxy = field->proxy};
  } else {
    state.field.reset();
  }
}

/// Loads a slot of the queue into the cache while the law is computed. The queue is larger than the cache.
void load_ahead(StepRecord* slot) noexcept {
  constexpr std::size_t kLine = 64;  // bytes
  if (slot == nullptr) return;
  for (std::size_t at = 0; at < sizeof *slot; at += kLine) {
    __builtin_prefetch(reinterpret_cast<const char*>(slot) + at, 1);
  }
}

Coupling* coupling_of(HapticController& controller, std::uint32_t number) noexcept {
  Couplings* const couplings = controller.couplings();
  return couplings != nullptr && number < couplings->size() ? &(*couplings)[number] : nullptr;
}

}  // namespace

HapticLoop::HapticLoop(const Config& config, Device& device, Mailboxes& mail, Heartbeat* heart)
    : config_(config),
      device_(device),
      mail_(mail),
      heart_(heart),
      controller_(config.control),
      velocity_(device.info().position_resolution),
      force_rounding_squared_(device.info().force_resolution * device.info().force_resolution),
      has_more_motors_(device.info().max_torque > 0 || (device.info().gripper && device.info().gripper->max_force > 0)),
      has_outputs_(!device.info().outputs.empty()),
      meter_(config.period) {
  if (config.control.channels.size() > limits::kMaxChannels) throw std::invalid_argument("too many channels");
  if (!device.info().position_only()) rest_.emplace(device.info());
}

HapticLoop::Rest::Rest(const DeviceInfo& info)
    : turns_or_grips(info.measures_orientation || info.gripper),
      has_joints(!info.joints.empty()),
      turning(info.angular_resolution),
      opening(0) {}

void HapticLoop::take_mail(LocalTime now) noexcept {
  if (has_outputs_) set_outputs(now);
  struct Released {
    std::uint32_t source;
    std::uint32_t channel;
  };
  std::array<Released, Mailboxes::kOrders> released;
  std::size_t releases = 0;
  for (std::size_t i = 0; i < Mailboxes::kOrders; ++i) {
    const HapticOrder* const order = mail_.orders.front();
    if (order == nullptr) break;
    Coupling* const coupling = coupling_of(controller_, order->coupling);
    switch (order->kind) {
      case HapticOrder::Kind::kRelease:
        if (controller_.field(order->channel) != 0) {
          note({.kind = FieldInput::Kind::kRelease, .channel = order->channel, .source = order->source}, now);
        }
        controller_.release(now, order->source, order->channel);
        released[releases++] = {.source = order->source, .channel = order->channel};
        break;
      case HapticOrder::Kind::kDisarm:
        disarmed_ = true;
        controller_.disarm();
        device_.disarm();
        break;
      case HapticOrder::Kind::kRearm:
        disarmed_ = false;
        rearm();
        device_.arm();
        break;
      case HapticOrder::Kind::kEngage:
        if (coupling != nullptr) coupling->engage();
        break;
      case HapticOrder::Kind::kDisengage:
        if (coupling != nullptr) coupling->disengage();
        break;
      case HapticOrder::Kind::kSetScale:
        if (coupling != nullptr) coupling->set_scale(order->scales[0], order->scales[1]);
        break;
      case HapticOrder::Kind::kRenew:
        if (coupling != nullptr) coupling->renew();
        peer_numbers_.at(order->coupling) = order->source;
        break;
      case HapticOrder::Kind::kShare:
        if (coupling != nullptr) controller_.couplings()->set_share(order->coupling, order->share);
        break;
    }
    mail_.orders.pop();
  }
  for (std::size_t channel = 0; channel < config_.control.channels.size(); ++channel) {
    const RemoteForce* const force = mail_.forces[channel].take();
    if (force == nullptr) continue;
    if (controller_.observe(*force, channel) && force->field != 0) {
      note({.kind = FieldInput::Kind::kTruth,
            .channel = static_cast<std::uint32_t>(channel),
            .source = force->source,
            .generation = force->field,
            .answers_tick = force->answers_tick,
            .received = force->received,
            .truth = force->force},
           now);
    }
  }
  if (mail_.fields) take_fields(now);
  if (Couplings* const couplings = controller_.couplings()) take_ports(*couplings, now);
  // The last force of a released source may still have been in its mailbox and must not count as fresh. Releasing twice
  // is harmless because source numbers are never reused.
  for (std::size_t i = 0; i < releases; ++i) {
    if (controller_.field(released[i].channel) != 0) {
      note({.kind = FieldInput::Kind::kRelease, .channel = released[i].channel, .source = released[i].source}, now);
    }
    controller_.release(now, released[i].source, released[i].channel);
  }
}

/// Adds a message for a field to the recording.
void HapticLoop::note(FieldInput input, LocalTime now) noexcept {
  if (!mail_.field_tape || !config_.record) return;
  input.tick = tick_ + 1;
  input.at = now;
  if (!mail_.field_tape->inputs.try_push(input)) {
    mail_.field_tape->inputs_lost.fetch_add(1, std::memory_order_relaxed);
  }
}

void HapticLoop::take_fields(LocalTime now) noexcept {
  for (std::size_t channel = 0; channel < config_.control.channels.size(); ++channel) {
    FieldBox& box = (*mail_.fields)[channel];
    if (const PostedField* const posted = box.use.take()) {
      controller_.use(posted->use, now, channel);
      note({.kind = posted->use.field != nullptr ? FieldInput::Kind::kUse : FieldInput::Kind::kStop,
            .channel = static_cast<std::uint32_t>(channel),
            .source = posted->use.source,
            .generation = posted->use.generation},
           now);
      field_sources_[channel] = posted->use.source;
      box.taken.store(posted->number, std::memory_order_release);
    }
    const ArrivedPose* const pose = box.pose.take();
    if (pose == nullptr || pose->source != field_sources_[channel]) continue;
    controller_.observe(pose->pose, channel);
    note({.kind = FieldInput::Kind::kPose,
          .channel = static_cast<std::uint32_t>(channel),
          .source = pose->source,
          .pose = pose->pose},
         now);
  }
}

void HapticLoop::take_ports(Couplings& couplings, LocalTime now) noexcept {
  for (std::size_t i = 0; i < couplings.size(); ++i) {
    peers_[i].reset();
    const ArrivedPort* const peer = mail_.port_in[i].take();
    if (peer != nullptr && peer->peer == peer_numbers_[i]) {
      couplings[i].receive(peer->state, now);
      peers_[i] = *peer;
    }
  }
}

void HapticLoop::set_outputs(LocalTime now) noexcept {
  const OutputSettings* const wanted = mail_.outputs.take();
  if (wanted == nullptr) return;
  for (std::uint32_t i = 0; i < kMostOutputs; ++i) {
    const OutputSettings::One& one = wanted->of[i];
    if (one.number != std::exchange(outputs_set_[i], one.number)) device_.set_output(now, i, one.setting);
  }
}

HandleSample HapticLoop::handle_in(const PositionSample& sample) noexcept {
  HandleSample handle{.torque = applied_.torque, .grip_force = applied_.grip};
  if (sample.orientation) {
    const Quat& orientation = *sample.orientation;
    if (is_rotation(orientation)) {
      if (rest_->last) rest_->turned += turn_between(*rest_->last, orientation);
      rest_->last = orientation;
    }
    handle.turning = {.orientation = orientation, .angular_velocity = rest_->turning.observe(sample.at, rest_->turned)};
  }
  if (sample.opening) {
    const double velocity = rest_->opening.observe(sample.at, Vec<1>(*sample.opening))[0];
    handle.grip = {.opening = *sample.opening, .velocity = velocity};
  }
  return handle;
}

void HapticLoop::take_step(LocalTime now, StepRecord& record) noexcept {
  const auto sample = device_.read(now);
  if (controller_.couplings() != nullptr) controller_.notice(sample ? sample->buttons : buttons_, device_.armed());
  if (!sample) {
    const HandleSample handle{.torque = applied_.torque, .grip_force = applied_.grip};
    const bool whole = rest_ && rest_->turns_or_grips;
    static_cast<Step&>(record) = controller_.step_unseen(now, applied_.force, whole ? &handle : nullptr);
    return;
  }
  const Motion hand{sample->at, sample->position, velocity_.observe(sample->at, sample->position)};
  buttons_ = sample->buttons;
  if (rest_) {
    take_rest(*sample, hand, record);
  } else {
    controller_.step_into(record, hand, applied_.force, sample->hand_force);
  }
}

void HapticLoop::take_rest(const PositionSample& sample, const Motion& hand, StepRecord& record) noexcept {
  if (rest_->turns_or_grips) {
    const HandleSample handle = handle_in(sample);
    controller_.step_into(record, hand, applied_.force, sample.hand_force, &handle);
  } else {
    controller_.step_into(record, hand, applied_.force, sample.hand_force);
  }
  if (!rest_->has_joints) return;
  if (!record.handle) record.handle.emplace();
  record.handle->joints = device_.joints(hand);
}

void HapticLoop::command(StepRecord& record) noexcept {
  if (has_more_motors_) {
    command_all(record);
  } else {
    applied_.force = device_.apply(record.force);
  }
  if ((applied_.force - record.force).squaredNorm() > force_rounding_squared_) record.reasons |= Reason::kDeviceClamp;
  record.applied = applied_.force;
}

void HapticLoop::beat() noexcept {
  if (heart_ != nullptr) heart_->beat(applied_ != Effort{});
}

void HapticLoop::command_all(StepRecord& record) noexcept {
  TurnStep* const turn = record.turn();
  GripStep* const grip = record.grip();
  Effort effort{.force = record.force};
  if (turn != nullptr) effort.torque = turn->torque;
  if (grip != nullptr) effort.grip = grip->force;
  applied_ = device_.apply_all(effort);
  if (applied_.torque != effort.torque || applied_.grip != effort.grip) record.reasons |= Reason::kDeviceClamp;
  if (turn != nullptr) turn->applied = applied_.torque;
  if (grip != nullptr) grip->applied = applied_.grip;
}

LocalTime HapticLoop::step(LocalTime now) noexcept {
  const DenormalsOff off;
  if (tick_ == 0) due_ = now;
  if (config_.record) load_ahead(mail_.steps.back());
  take_mail(now);

  StepRecord record;
  take_step(now, record);
  command(record);
  beat();
  record.tick = ++tick_;
  record.scheduled = due_;
  record.rearmed = std::exchange(rearmed_, false);
  record.disarmed = disarmed_;
  record.buttons = buttons_;
  watch_device();
  if (controller_.couplings() != nullptr) publish_ports(record);
  publish(record);

  due_ += config_.period;
  if (due_ <= now) due_ = now + config_.period;
  return due_;
}

void HapticLoop::watch_device() noexcept {
  homed_once_ = homed_once_ || device_.state() == Device::State::kHomed;
  const std::uint32_t times_armed = device_.times_armed();
  // If the device has not been homed yet, it cannot provide positions. This is not a fault.
  if (!homed_once_ || times_armed != times_armed_) rearm();
  times_armed_ = times_armed;
}

void HapticLoop::rearm() noexcept {
  controller_.rearm();
  if (disarmed_) controller_.disarm();  // an automatic rearm must not override the operator's disarm
  rearmed_ = true;
}

void HapticLoop::publish(const StepRecord& record) noexcept {
  put_state(mail_.state.back(), config_.device, record);
  if (rest_) put_handle(mail_.state.back(), record, device_.info());
  mail_.state.put();
  if (config_.record && !mail_.steps.try_push(record)) mail_.steps_lost.fetch_add(1, std::memory_order_relaxed);
  mail_.flight.record(record);

  const auto fault = controller_.fault();
  if (fault != HapticController::Fault::kNone && fault_.load(std::memory_order_relaxed) != fault) mail_.flight.freeze();
  const std::uint32_t device_faults = device_.faults();
  if (device_faults != std::exchange(device_faults_, device_faults)) mail_.flight.freeze();
  fault_.store(fault, std::memory_order_relaxed);
  meter_.observe(record);
  force_.store(record.applied.norm(), std::memory_order_relaxed);
  if (record.held.count() > longest_interval_ns_.load(std::memory_order_relaxed)) {
    longest_interval_ns_.store(record.held.count(), std::memory_order_relaxed);
  }
}

void HapticLoop::publish_ports(const StepRecord& record) noexcept {
  Couplings& couplings = *controller_.couplings();
  const auto& leaders = config_.control.leaders;
  for (std::size_t i = 0; i < couplings.size(); ++i) {
    Coupling& coupling = couplings[i];
    coupling.conclude(record.applied, record.hand_force, applied_.torque, applied_.grip);
    PortRecord port{
        .tick = record.tick,
        .channel = leaders.empty() ? 0 : leaders[i].channel,
        .at = record.hand.at,
        .settled = couplings.settled(i),
        .grip_settled = controller_.grip_settled(),
        .stiffness = coupling.stiffness(),
        .round_trip = coupling.round_trip(),
        .sent = coupling.message(),
    };
    if (peers_[i]) {
      port.peer = peers_[i]->state;
      port.peer_arrived = peers_[i]->at;
    }
    mail_.port_out[i].put(port.sent);
    if (!mail_.ports.try_push(port)) mail_.ports_lost.fetch_add(1, std::memory_order_relaxed);
  }
}

void HapticLoop::stop() noexcept {
  if (has_more_motors_) {
    applied_ = device_.apply_all({});
  } else {
    applied_.force = device_.apply(Vec3::Zero());
  }
  beat();
  force_.store(applied_.force.norm(), std::memory_order_relaxed);
}

HapticLoop::Stats HapticLoop::stats() const noexcept {
  const Health counted = health();
  return {counted.steps,
          counted.overruns,
          counted.unseen,
          Duration(longest_interval_ns_.load(std::memory_order_relaxed)),
          fault_.load(std::memory_order_relaxed),
          device_.state(),
          force_.load(std::memory_order_relaxed)};
}

}  // namespace tendon
