// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdlib>
#include <numbers>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>

#include "core/base/expect.h"

namespace tendon {
namespace {

using namespace std::chrono_literals;
using woodenhaptics::Counts;
using woodenhaptics::Currents;
using woodenhaptics::Model;
using woodenhaptics::Report;

constexpr Currents kNoCurrent{};

/// After power-on, the lamps flash for a second. The board only accepts one report then. A second one would time out.
constexpr usb::Dialogue::Patience kWhileItStarts{.most_under_way = 1, .answer = 1500ms};
/// An answer takes 2 ms, because a frame is required for each direction.
constexpr usb::Dialogue::Patience kPatience{.most_under_way = 2, .answer = 5ms};

/// If the board still requests calibration, command 1 was replaced by a newer report.
constexpr Duration kCalibrateAgain = 20ms;

/// rad/s: 5 m/s at 0.1 m from the axis of the column, more at the end of each link; no released handle is as fast.
constexpr double kMostSpeed = 50;
constexpr double kStillSpeed = 2;     ///< rad/s, while the arm is held in its calibration pose
constexpr double kMoreCounts = 30;    ///< for reports that arrive at irregular intervals
constexpr double kMostStep = 16'384;  ///< a quarter turn of a 16-bit counter, beyond which the direction is ambiguous

const Model& checked(const Model* model) {
  if (model == nullptr) throw std::invalid_argument("woodenhaptics.model = none: expected one of models()");
  return *model;
}

Vec3 counts_per_radian(const Model& model) {
  const Vec3 one = woodenhaptics::angles_at(model, {1, 1, 1});
  return one.cwiseAbs().cwiseInverse();
}

}  // namespace

DeviceInfo WoodenHapticsDevice::info_of(const Model& model) {
  const auto centre = woodenhaptics::pose_at(model, Vec3::Zero());
  const Vec3 radians = counts_per_radian(model).cwiseInverse();
  double force = 0;  // 1 mA for each motor, worst case
  for (const Currents& one : {Currents{1, 0, 0}, Currents{0, 1, 0}, Currents{0, 0, 1}}) {
    force += woodenhaptics::force_of(model, *centre, one)->norm();
  }
  return {.name = std::string(model.name),
          .max_force = model.max_force,
          .position_resolution = (centre->jacobian * radians.asDiagonal()).colwise().norm().maxCoeff(),
          .force_resolution = force,
          .joints = {"A", "B", "C"},  // kinematics.h
          .watchdog = kWatchdog};
}

WoodenHapticsDevice::WoodenHapticsDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe)
    : model_(checked(config.model)),
      most_ma_(1e3 * config.max_current),
      counts_per_radian_(counts_per_radian(model_)),
      info_(info_of(model_)),
      dialogue_(std::move(pipe), kWatchdog) {
  expect(config.max_current > 0 && config.max_current <= model_.full_scale, "woodenhaptics.max_current",
         config.max_current, "above 0 A, at most " + shortest(model_.full_scale) + " A, the amplifiers' full scale");
}

void WoodenHapticsDevice::enter(State state) noexcept {
  state_.store(state, std::memory_order_relaxed);
  switch (state) {
    case State::kOpening:
      dialogue_.restart(kWhileItStarts);
      newest_.reset();
      break;
    case State::kUnhomed:
      dialogue_.set_patience(kPatience);
      asking_replies_ = 0;
      set_replies_ = 0;
      calibrated_.reset();
      break;
    case State::kAbsent:
    case State::kFirmware:
    case State::kHomed:
      break;
  }
}

std::optional<PositionSample> WoodenHapticsDevice::read(LocalTime now) noexcept {
  fresh_ = false;
  if (dialogue_.begin(now)) enter(dialogue_.connected() ? State::kOpening : State::kAbsent);
  if (state() == State::kAbsent) return std::nullopt;
  receive();
  advance();
  if (state() != State::kHomed || !fresh_) return std::nullopt;
  return PositionSample{.at = now,
                        .position = pose_.position,
                        .hand_force = std::nullopt,
                        .buttons = woodenhaptics::switch_is_closed(*newest_) ? 1U : 0U};
}

Joints WoodenHapticsDevice::joints(const Motion& hand) const noexcept {
  return Joints::three(pose_.angles, pose_.jacobian.inverse() * hand.velocity);
}

void WoodenHapticsDevice::receive() noexcept {
  dialogue_.receive([this](std::span<const std::uint8_t> packet) {
    if (const auto report = woodenhaptics::parse(packet)) {
      believe(*report);
    } else {
      dialogue_.counters().add(DeviceCount::kUnreadable);
    }
  });
}

Counts WoodenHapticsDevice::steps_to(const Report& report) const noexcept {
  Counts steps{};
  if (!newest_) return steps;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const int step = int{report.counters[i]} - int{newest_->counters[i]};
    steps[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(step));  // shorter way around
  }
  return steps;
}

bool WoodenHapticsDevice::plausible(const Counts& steps) const noexcept {
  const double passed = seconds(dialogue_.since_heard());
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double most = kMoreCounts + kMostSpeed * counts_per_radian_[static_cast<Eigen::Index>(i)] * passed;
    if (std::abs(steps[i]) > std::min(most, kMostStep)) return false;
  }
  return true;
}

void WoodenHapticsDevice::believe(const Report& report) noexcept {
  // The reports may be old if no request was sent yet.
  if (state() == State::kOpening && !dialogue_.awaits_answer()) return;
  const Counts steps = steps_to(report);
  const bool in_step = plausible(steps);
  dialogue_.hear();
  if (state() == State::kHomed && !report.calibrate && !in_step) {
    dialogue_.counters().add(DeviceCount::kImplausible);
    return;
  }
  dialogue_.believe();
  newest_ = report;
  if (state() == State::kOpening || (state() == State::kHomed && report.calibrate)) enter(State::kUnhomed);
  if (state() == State::kUnhomed) {
    home(report);
  } else {
    for (std::size_t i = 0; i < steps.size(); ++i) counts_[i] += steps[i];
  }
  if (state() == State::kHomed) {
    pose_ = woodenhaptics::pose_with(model_, woodenhaptics::angles_at(model_, counts_));
    fresh_ = true;
  }
}

bool WoodenHapticsDevice::near_calibration(const Report& report) const noexcept {
  const double passed = seconds(dialogue_.now() - *calibrated_);
  for (std::size_t i = 0; i < model_.joints.size(); ++i) {
    const double most = kMoreCounts + kStillSpeed * counts_per_radian_[static_cast<Eigen::Index>(i)] * passed;
    if (std::abs(report.counters[i] - model_.joints[i].calibration) > most) return false;
  }
  return true;
}

void WoodenHapticsDevice::home(const Report& report) noexcept {
  if (report.calibrate) {
    ++asking_replies_;
    set_replies_ = 0;
    return;
  }
  asking_replies_ = 0;
  if (!calibrated_) return;
  if (!near_calibration(report)) {
    dialogue_.counters().add(DeviceCount::kFailedSetups);
    calibrated_.reset();
    set_replies_ = 0;
    return;
  }
  if (++set_replies_ < usb::Dialogue::kSure) return;
  std::copy_n(report.counters.begin(), counts_.size(), counts_.begin());
  enter(State::kHomed);
}

void WoodenHapticsDevice::advance() noexcept {
  if (state() != State::kUnhomed && state() != State::kHomed) return;
  if (dialogue_.silent()) {
    dialogue_.counters().add(DeviceCount::kSilences);
    dialogue_.reopen();
    enter(State::kAbsent);
  } else if (state() == State::kHomed && dialogue_.lost_count()) {
    dialogue_.counters().add(DeviceCount::kLostCounts);
    enter(State::kUnhomed);
  }
}

void WoodenHapticsDevice::write(const Currents& wanted) noexcept {
  const bool calibrate = state() == State::kUnhomed && asking_replies_ >= usb::Dialogue::kSure &&
                         (!calibrated_ || dialogue_.now() - *calibrated_ >= kCalibrateAgain);
  const auto& [a, b, c] = model_.joints;
  const auto report = calibrate ? woodenhaptics::encode_calibration({a.calibration, b.calibration, c.calibration})
                                : woodenhaptics::encode(wanted);
  if (!dialogue_.send(report, wanted != kNoCurrent)) return;
  if (calibrate) {
    calibrated_ = dialogue_.now();
    asking_replies_ = 0;
  }
  held_ = wanted;
}

Vec3 WoodenHapticsDevice::apply(const Vec3& force) noexcept {
  if (state() == State::kAbsent) return Vec3::Zero();
  const bool ready = state() == State::kHomed && dialogue_.trusted();
  const Currents wanted = ready ? woodenhaptics::currents_for(model_, pose_, force, most_ma_) : kNoCurrent;
  if (dialogue_.may_send(wanted != kNoCurrent)) write(wanted);
  if (!dialogue_.holds_force()) return Vec3::Zero();
  // Use the last known force if the pose is singular.
  held_force_ = woodenhaptics::force_of(model_, pose_, held_).value_or(held_force_);
  return held_force_;
}

namespace woodenhaptics {

const Driver& driver(const Config& /*config*/) {
  static constexpr std::array kIds{WoodenHapticsDevice::kId};
  static const Driver kRow = [] {
    const auto zero = encode({});
    return Driver{.kind = "woodenhaptics",
                  .name = "WoodenHaptics, or another HID gadget of mbed",
                  .moves_a_hand = true,
                  .axes = "right=-y up=z user=-x",
                  .buttons = {"tip"},
                  .buttons_in_words = "0, the switch at its tip",
                  .watchdog = WoodenHapticsDevice::kWatchdog,
                  .homing =
                      "calibrated: hold the arm in its calibration pose (devices/woodenhaptics) and press the "
                      "board's button",
                  .ids = kIds,
                  .in = WoodenHapticsDevice::kIn,
                  .out = WoodenHapticsDevice::kOut,
                  .transfers = usb::PipeConfig::Transfers::kInterrupt,
                  .zero_packet = {zero.begin(), zero.end()}};
  }();
  return kRow;
}

SimulatedDevice::Config stand_in(const Config& config) {
  SimulatedDevice::Config device = plain_stand_in("woodenhaptics");
  const DeviceInfo info = WoodenHapticsDevice::info_of(checked(config.drive.model));
  device.watchdog = info.watchdog;
  device.max_force = info.max_force;
  device.encoder_step = info.position_resolution;
  return device;
}

std::unique_ptr<Device> make(const Config& config, FromOutside outside) {
  return std::make_unique<WoodenHapticsDevice>(config.drive, std::move(outside.pipe));
}

}  // namespace woodenhaptics

}  // namespace tendon
