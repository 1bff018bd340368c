// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <gtest/gtest.h>

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <span>

#include "devices/woodenhaptics/woodenhaptics_device.h"
#include "tests/devices/driver_bench.h"
#include "tests/devices/model_pipe.h"
#include "tests/devices/woodenhaptics/fake_woodenhaptics.h"

namespace tendon {

inline constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
inline const Vec3 kForce(1, -0.5, 1);

class Cable final : public usb::Pipe {
 public:
  Cable(FakeWoodenHaptics& arm, const LocalTime& now, const bool& full) : pipe_(arm, now), full_(full) {}
  std::uint32_t connection() noexcept override { return pipe_.connection(); }
  bool request(const usb::Request& request) noexcept override { return pipe_.request(request); }
  bool write(std::span<const std::uint8_t> bytes) noexcept override { return !full_ && pipe_.write(bytes); }
  bool settled() const noexcept override { return pipe_.settled(); }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override { return pipe_.read(packet); }
  void reopen() noexcept override { pipe_.reopen(); }

 private:
  ModelPipe<FakeWoodenHaptics> pipe_;
  const bool& full_;
};

/// The motors may only get current after the counters are set.
struct WoodenHapticsBench : DriverBench<WoodenHapticsBench> {
  explicit WoodenHapticsBench(const FakeWoodenHaptics::Options& options = {}, double max_current = 2)
      : arm(options),
        device({.model = woodenhaptics::find_model(options.model), .max_current = max_current},
               std::make_unique<Cable>(arm, now, full)) {}

  void step(const Vec3& force = Vec3::Zero()) {
    now += std::chrono::milliseconds(1);
    arm.advance(now);
    drive(device, force);
    look(arm.pushes(), arm.calibrated());
    for (std::size_t motor = 0; motor < 3; ++motor) {
      EXPECT_GE(arm.pulse_width(motor), 0.1);
      EXPECT_LE(arm.pulse_width(motor), 0.9);
    }
  }

  /// Moves at 2 m/s to a position relative to the center.
  void move_to(const Vec3& place, const Vec3& force = Vec3::Zero()) {
    const Vec3 from = arm.position();
    const int turns = static_cast<int>((place - from).norm() / 0.002) + 1;
    for (int turn = 1; turn <= turns; ++turn) {
      arm.move_to(from + (place - from) * turn / turns);
      step(force);
    }
  }

  /// Moves to the calibration pose, presses the button and then returns to the center, as the operator would do.
  void home(const Vec3& force = Vec3::Zero()) {
    const Vec3 counts = arm.arm().calibration();
    arm.turn_to(counts.cwiseProduct(arm.arm().per_count()));
    run(std::chrono::milliseconds(20), force);
    if (device.state() != Device::State::kHomed) arm.press_calibrate();
    run(std::chrono::milliseconds(60), force);
    // Interpolates joint angles: a straight line out of a folded arm would be faster than a hand.
    const Vec3 from = counts.cwiseProduct(arm.arm().per_count());
    const Vec3 to = arm.arm().angles_at(Vec3::Zero());
    for (int turn = 1; turn <= 100; ++turn) {
      arm.turn_to(from + (to - from) * turn / 100);
      step(force);
    }
  }

  bool full = false;
  FakeWoodenHaptics arm;
  WoodenHapticsDevice device;
};

}  // namespace tendon
