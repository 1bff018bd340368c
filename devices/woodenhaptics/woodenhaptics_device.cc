// SPDX-License-Identifier: Apache-2.0
#include "devices/woodenhaptics/woodenhaptics_device.h"

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

/// A board that was just switched on flashes its lamps for a second before it listens, and has room for one report
/// until then: a second one would wait for it until its transfer fails.
constexpr Duration kAskAgain = 1500ms;
/// An answer takes 2 ms: a frame of the bus each way.
constexpr Duration kAnswerTime = 5ms;
constexpr int kMostUnderWay = 2;
/// No force on a device that nobody has heard of for so long: ten periods.
constexpr Duration kQuiet = 10ms;
/// After this it is as good as unplugged.
constexpr Duration kLost = 100ms;

constexpr int kSureReplies = 10;
/// When the request is still there so long after command 1, it was lost: a newer report had overtaken it.
constexpr Duration kCalibrateAgain = 20ms;

/// rad/s, of a body: 5 m/s at 0.1 m from the column's axis, and more than that at either link's end. A handle that
/// nobody holds does not get there within the workspace.
constexpr double kMostSpeed = 50;
/// … and while the operator holds the arm in its calibration pose.
constexpr double kStillSpeed = 2;
/// For reports that come closer together than they were taken.
constexpr double kMoreCounts = 30;
/// Of a difference of 16 bits nobody knows more.
constexpr double kMostStep = 16'384;

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
  double force = 0;  // a mA of each motor, however they add up
  for (const Currents& one : {Currents{1, 0, 0}, Currents{0, 1, 0}, Currents{0, 0, 1}}) {
    force += woodenhaptics::force_of(model, *centre, one)->norm();
  }
  return {.name = std::string(model.name),
          .max_force = model.max_force,
          .position_resolution = (centre->jacobian * radians.asDiagonal()).colwise().norm().maxCoeff(),
          .force_resolution = force,
          .watchdog = kWatchdog};
}

WoodenHapticsDevice::WoodenHapticsDevice(const Config& config, std::unique_ptr<usb::Pipe> pipe)
    : model_(checked(config.model)),
      most_ma_(1e3 * config.max_current),
      counts_per_radian_(counts_per_radian(model_)),
      info_(info_of(model_)),
      pipe_(std::move(pipe)) {
  expect(config.max_current > 0 && config.max_current <= model_.full_scale, "woodenhaptics.max_current",
         config.max_current, "above 0 A, at most " + shortest(model_.full_scale) + " A, the amplifiers' full scale");
}

void WoodenHapticsDevice::enter(State state) noexcept {
  state_.store(state, std::memory_order_relaxed);
  switch (state) {
    case State::kOpening:
      under_way_ = 0;
      newest_.reset();
      held_ = kNoCurrent;
      break;
    case State::kUnhomed:
      heard_ = now_;
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

void WoodenHapticsDevice::follow_connection() noexcept {
  const std::uint32_t connection = pipe_->connection();
  if (connection == connection_) return;
  connection_ = connection;
  enter(connection == 0 ? State::kAbsent : State::kOpening);
}

void WoodenHapticsDevice::give_up() noexcept {
  pipe_->reopen();
  enter(State::kAbsent);
}

std::optional<PositionSample> WoodenHapticsDevice::read(LocalTime now) noexcept {
  now_ = now;
  fresh_ = false;
  follow_connection();
  if (state() == State::kAbsent) return std::nullopt;
  receive();
  advance();
  if (state() != State::kHomed || !fresh_) return std::nullopt;
  return PositionSample{.at = now,
                        .position = pose_.position,
                        .hand_force = std::nullopt,
                        .buttons = woodenhaptics::switch_is_closed(*newest_) ? 1U : 0U};
}

void WoodenHapticsDevice::receive() noexcept {
  std::array<std::uint8_t, usb::kPacketSize> packet;
  while (const std::size_t size = pipe_->read(packet)) {
    if (const auto report = woodenhaptics::parse(std::span(packet).first(size))) {
      believe(*report);
    } else {
      unknown_.add();
    }
  }
}

Counts WoodenHapticsDevice::steps_to(const Report& report) const noexcept {
  Counts steps{};
  if (!newest_) return steps;
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const int step = int{report.counters[i]} - int{newest_->counters[i]};
    steps[i] = static_cast<std::int16_t>(static_cast<std::uint16_t>(step));  // the nearer way round
  }
  return steps;
}

bool WoodenHapticsDevice::plausible(const Counts& steps) const noexcept {
  const double passed = seconds(now_ - heard_);
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const double most = kMoreCounts + kMostSpeed * counts_per_radian_[static_cast<Eigen::Index>(i)] * passed;
    if (std::abs(steps[i]) > std::min(most, kMostStep)) return false;
  }
  return true;
}

void WoodenHapticsDevice::believe(const Report& report) noexcept {
  if (state() == State::kOpening && under_way_ == 0) return;  // nobody has asked yet: it may be as old as the last host
  const Counts steps = steps_to(report);
  const bool in_step = plausible(steps);
  under_way_ = 0;
  heard_ = now_;
  if (state() == State::kHomed && !report.calibrate && !in_step) {
    implausible_.add();
    return;
  }
  reports_.add();
  believed_ = now_;
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
  const double passed = seconds(now_ - *calibrated_);
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
    failed_calibrations_.add();
    calibrated_.reset();
    set_replies_ = 0;
    return;
  }
  if (++set_replies_ < kSureReplies) return;
  std::copy_n(report.counters.begin(), counts_.size(), counts_.begin());
  enter(State::kHomed);
}

void WoodenHapticsDevice::advance() noexcept {
  if (state() != State::kUnhomed && state() != State::kHomed) return;
  if (now_ - heard_ >= kLost) {
    silences_.add();
    give_up();
  } else if (state() == State::kHomed && now_ - believed_ >= kLost) {
    lost_counts_.add();
    enter(State::kUnhomed);
  }
}

bool WoodenHapticsDevice::may_write() const noexcept {
  if (under_way_ == 0) return true;
  if (state() == State::kOpening) return now_ - asked_ >= kAskAgain;
  return under_way_ < kMostUnderWay || now_ - asked_ >= kAnswerTime;
}

void WoodenHapticsDevice::write(const Currents& wanted) noexcept {
  const bool calibrate = state() == State::kUnhomed && asking_replies_ >= kSureReplies &&
                         (!calibrated_ || now_ - *calibrated_ >= kCalibrateAgain);
  const auto& [a, b, c] = model_.joints;
  if (!pipe_->write(calibrate ? woodenhaptics::encode_calibration({a.calibration, b.calibration, c.calibration})
                              : woodenhaptics::encode(wanted))) {
    return;
  }
  if (calibrate) {
    calibrated_ = now_;
    asking_replies_ = 0;  // only what is heard from now on asks for it again
  }
  const bool late = under_way_ > 0 && now_ - asked_ >= kAnswerTime;
  if (late) unanswered_.add();
  if (late || under_way_ == 0) {
    asked_ = now_;
    under_way_ = 0;
  }
  ++under_way_;
  told_ = now_;
  held_ = wanted;
}

Vec3 WoodenHapticsDevice::apply(const Vec3& force) noexcept {
  if (state() == State::kAbsent) return Vec3::Zero();
  if (now_ - told_ >= kWatchdog) held_ = kNoCurrent;
  const bool ready = state() == State::kHomed && now_ - believed_ < kQuiet;
  const Currents wanted = ready ? woodenhaptics::currents_for(model_, pose_, force, most_ma_) : kNoCurrent;
  const bool let_go = wanted == kNoCurrent && held_ != kNoCurrent;
  if (may_write() || let_go) write(wanted);
  if (held_ == kNoCurrent) return Vec3::Zero();
  // In a singular pose nobody knows; it was on its way there.
  held_force_ = woodenhaptics::force_of(model_, pose_, held_).value_or(held_force_);
  return held_force_;
}

WoodenHapticsDevice::Stats WoodenHapticsDevice::stats() const noexcept {
  return {.reports = reports_.value(),
          .unknown = unknown_.value(),
          .implausible = implausible_.value(),
          .unanswered = unanswered_.value(),
          .silences = silences_.value(),
          .lost_counts = lost_counts_.value(),
          .failed_calibrations = failed_calibrations_.value()};
}

namespace woodenhaptics {

const Driver& driver(const Config& /*config*/) {
  static constexpr std::array kIds{WoodenHapticsDevice::kId};
  static const Driver kRow = [] {
    const auto zero = encode({});
    return Driver{.kind = "woodenhaptics",
                  .name = "WoodenHaptics, or another HID gadget of mbed",
                  .moves_a_hand = true,
                  .buttons = 1,
                  .buttons_in_words = "0, the switch at its tip",
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
