// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <memory>
#include <optional>
#include <thread>
#include <utility>

#include "devices/falcon/falcon_device.h"
#include "devices/safety/safe_device.h"
#include "devices/usb/pipe.h"
#include "tests/devices/falcon/fake_firmware.h"
#include "tests/devices/usb/usb_model.h"

namespace tendon {

template <class Holds>
bool comes_true(const Holds& holds) {
  for (int i = 0; i < 10'000 && !holds(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return holds();
}

/// This must be called at 1 kHz in real time, like the haptic thread does.
struct FalconDriver {
  explicit FalconDriver(std::unique_ptr<usb::Pipe> pipe) : device({.firmware = fake_firmware(4096)}, std::move(pipe)) {}

  void step(const Vec3& force) {
    sample = turned->read(real_now());
    written = turned->apply(force);
    std::this_thread::sleep_until(due += std::chrono::milliseconds(1));
    const auto now = std::chrono::steady_clock::now();
    if (due < now - std::chrono::milliseconds(1)) due = now;
  }

  template <class Until>
  bool turns_until(const Until& until, const Vec3& force, Duration most = std::chrono::seconds(10)) {
    for (const LocalTime end = real_now() + most; real_now() < end;) {
      step(force);
      if (until()) return true;
    }
    return false;
  }

  bool reaches(Device::State state, const Vec3& force = Vec3::Zero()) {
    return turns_until([&] { return device.state() == state; }, force);
  }

  /// Repeats the steps until `pushes()` returns true, because the device leaves these states if the machine stalls.
  template <class Home, class Pushes>
  bool comes_to_push(SafeDevice& safe, const Vec3& force, const Home& home, const Pushes& pushes) {
    const LocalTime end = real_now() + std::chrono::seconds(30);
    for (turned = &safe; real_now() < end && !pushes();) {
      const SafetyState state = safe.status().state;
      if (state == SafetyState::kUnhomed) home();
      if (state == SafetyState::kHomed || state == SafetyState::kFault) safe.arm();
      step(state == SafetyState::kArmed ? force : Vec3::Zero());
    }
    return pushes();
  }

  FalconDevice device;
  Device* turned = &device;  ///< the device, or a wrapper
  std::optional<PositionSample> sample;
  Vec3 written = Vec3::Zero();
  std::chrono::steady_clock::time_point due = std::chrono::steady_clock::now();
};

}  // namespace tendon
