// SPDX-License-Identifier: Apache-2.0
// This program is used by loop_proof_test.cc. A line is printed for each case. Callgrind counts within `step_in_turn`
// (with the argument `record`: within `record_in_turn`) and writes a file each time the function returns.
#include <iostream>
#include <memory>
#include <string_view>

#include "core/base/rotation.h"
#include "devices/falcon/kinematics.h"
#include "server/haptic_loop.h"
#include "server/recording/recorder.h"

using namespace tendon;

namespace {

/// The motion of the hand does not use libm, because its instruction count depends on the processor.
double swing(std::uint64_t tick, std::uint64_t period) {
  const double u = 2.0 * static_cast<double>(tick % period) / static_cast<double>(period) - 1;
  return u * (1 - u * u);
}

class Handle final : public Device {
 public:
  Handle(bool whole, bool jointed) : whole_(whole) {
    info_.max_force = 8;
    if (jointed) info_.joints = {"thigh 1", "thigh 2", "thigh 3"};
    if (!whole) return;
    info_.measures_orientation = true;
    info_.max_torque = 0.3;
    info_.gripper = DeviceInfo::Gripper{.open = 1, .arm = 0.05, .max_force = 5};
  }
  const DeviceInfo& info() const noexcept override { return info_; }
  std::optional<PositionSample> read(LocalTime now) noexcept override {
    ++tick_;
    PositionSample sample{.at = now, .position = {0.02 * swing(tick_, 700), 0.004 * swing(tick_, 900), 0}};
    if (whole_) {
      const double x = 0.3 * swing(tick_, 800);
      const double y = 0.2 * swing(tick_, 1100);
      sample.orientation = unit({1, x, y, x * y});
      sample.opening = 0.3 + 0.2 * swing(tick_, 600);
    }
    return sample;
  }
  /// The Falcon driver computes the pose in `read`.
  Joints joints(const Motion& hand) const noexcept override {
    return Joints::three(pose_->angles, pose_->jacobian * hand.velocity);
  }
  Vec3 apply(const Vec3& force) noexcept override { return force; }
  Effort apply_all(const Effort& effort) noexcept override { return effort; }

 private:
  DeviceInfo info_;
  bool whole_;
  std::optional<falcon::Pose> pose_ = falcon::pose_at(falcon::kCentre);
  std::uint64_t tick_ = 0;
};

HapticLoop::Config config_of(bool whole) {
  HapticLoop::Config config;
  HapticController::Config& control = config.control;
  control.limiter.friction = {0.02, 0.26};
  control.limiter.longest_hold = std::chrono::milliseconds(2);
  control.limiter.parts.energy_cap.emplace();
  control.limiter.parts.knee.emplace();
  control.limiter.parts.robust_ledger = AolPlus<1, 3>::Robust{.encoder_step = {1e-5}};
  control.max_force = 8;
  control.max_slew = 1000;
  if (whole) {
    control.rotation =
        RotationLimits{.friction = {1e-4, 1e-3}, .max_torque = 0.3, .max_slew = 100, .encoder_step = 1e-4};
    control.grip = GripLimits{.friction = {0.02, 0.26}, .arm = 0.05, .max_force = 5};
  }
  return config;
}

RemoteForce answer(std::uint64_t sequence, LocalTime now, bool whole) {
  RemoteForce force;
  force.sequence = sequence;
  force.received = force.answers = now;
  force.valid_for = std::chrono::milliseconds(50);
  force.force = {-2, 0.1, 0};
  force.model = LocalModel{.at = {0.005, 0, 0}, .stiffness = Mat3::Identity() * 500};
  if (whole) {
    force.torque = RemoteTorque{.torque = {0, 0.02, 0}, .model = RotationModel{{}, Mat3::Identity() * 0.2}};
    force.grip_force = 1;
  }
  return force;
}

class NoSink final : public ByteSink {
 public:
  bool append(std::span<const std::byte> /*bytes*/) override { return true; }
  std::string error() const override { return {}; }
};

}  // namespace

// These functions are neither inlined nor mangled, so callgrind can find them.

extern "C" [[gnu::noinline]] void step_in_turn(HapticLoop& loop, Mailboxes& mail, bool whole, LocalTime& now,
                                               std::uint64_t steps) {
  for (std::uint64_t i = 0; i < steps; ++i) {
    if (i % 10 == 0) mail.forces[0].put(answer(i + 1, now, whole));
    now = loop.step(now);
    while (mail.steps.front() != nullptr) mail.steps.pop();
  }
}

/// Records all steps that are in the mailbox.
extern "C" [[gnu::noinline]] void record_in_turn(Recorder& recorder, Mailboxes& mail) {
  for (; const StepRecord* step = mail.steps.front(); mail.steps.pop()) recorder.record(*step);
}

int main(int count, char** arguments) {
  if (count > 1 && arguments[1] == std::string_view("record")) {
    Handle device(false, false);
    const auto mail = std::make_unique<Mailboxes>();
    HapticLoop loop(config_of(false), device, *mail);
    NoSink sink;
    Recorder recorder({.scene = {}, .started = {}}, sink);
    LocalTime now{};
    for (const int steps : {1000, 3000}) {
      for (int i = 0; i < steps; ++i) {
        if (i % 10 == 0) mail->forces[0].put(answer(static_cast<std::uint64_t>(i) + 1, now, false));
        now = loop.step(now);
      }
      record_in_turn(recorder, *mail);
    }
    std::cout << "record\n";
    return 0;
  }
  for (const std::string_view kind : {"point", "handle", "joints"}) {
    const bool whole = kind == "handle";
    Handle device(whole, kind == "joints");
    const auto mail = std::make_unique<Mailboxes>();
    HapticLoop loop(config_of(whole), device, *mail);
    LocalTime now{};
    step_in_turn(loop, *mail, whole, now, 1000);
    step_in_turn(loop, *mail, whole, now, 3000);
    std::cout << kind << '\n';
  }
}
