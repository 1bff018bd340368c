// SPDX-License-Identifier: Apache-2.0
// Uses the real libusb in this process, so that the heap calls of a step can be counted.
// tests/e2e/falcon_server_test.cc runs the complete server.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <numbers>

#include "devices/falcon/falcon_device.h"
#include "devices/usb/usb.h"
#include "server/haptic_loop.h"
#include "server/machine/clock.h"
#include "tests/devices/usb/usbfs_shim.h"
#include "tests/realtime/heap_guard.h"

namespace tendon::falcon_loop_test {
namespace {

using namespace std::chrono_literals;

constexpr double kWall = 500;  // N/m

RemoteForce answer(const DeviceState& state, std::uint64_t number, LocalTime now) {
  RemoteForce force;
  force.sequence = number;
  force.received = force.answers = now;
  const bool inside = state.position.x() > 0;
  force.force = Vec3(inside ? -kWall * state.position.x() : 0, 0, 0);
  force.model = LocalModel{state.position, Mat3(Vec3(inside ? kWall : 0, 0, 0).asDiagonal())};
  force.valid_for = 30ms;
  return force;
}

bool near(const Vec3& felt, const Vec3& written) { return (felt - written).norm() <= 0.1 + 0.2 * written.norm(); }

// There is no limiter. It would remove most of the wall, with good reason, if the machine stalls for several periods.
TEST(FalconLoop, AWallIsFeltThroughTheRealLibraryWithoutAHeapCallInTheLoop) {
  UsbfsShim shim({.has_firmware = true, .is_homed = true});
  FalconDevice device({}, usb::open_pipe({.node = [&shim] { return shim.node(); }}));
  while (device.state() != Device::State::kHomed) {
    device.read(clock::now());
    device.apply(Vec3::Zero());
    clock::sleep_until(clock::now() + 1ms);
  }
  HapticLoop::Config config;
  config.control.limiter.law = Law::kNone;
  config.control.limiter.friction = {.coulomb = 0.3, .viscous = 0.5};
  config.control.limiter.longest_hold = 2ms;
  config.control.max_force = 8;
  config.control.max_slew = 1000;
  const auto mail = std::make_unique<Mailboxes>();
  HapticLoop loop(config, device, *mail);

  const HeapGuard guard;
  std::uint64_t heap_calls = 0;
  std::uint64_t steps = 0;
  std::uint64_t at_odds = 0;
  std::uint64_t pushed = 0;
  bool seen = false;
  Vec3 written = Vec3::Zero();
  const LocalTime begin = clock::now();
  for (LocalTime due = begin; due < begin + 1500ms;) {
    clock::sleep_until(due);
    const LocalTime now = clock::now();
    const double x = 0.02 * std::sin(std::numbers::pi * seconds(now - begin));
    shim.with([x](FakeFalcon& falcon) { falcon.move_to(falcon::kCentre + Vec3(x, 0, 0)); });
    const std::uint64_t before = guard.calls();
    due = loop.step(now);
    heap_calls += guard.calls() - before;
    const bool seen_before = seen;
    const Vec3 written_before = written;
    while (const StepRecord* step = mail->steps.front()) {
      seen = !step->reasons.has(Reason::kUnseen);
      written = step->applied;
      mail->steps.pop();
    }
    if (++steps % 10 == 0) {
      if (const DeviceState* state = mail->state.take()) mail->forces[0].put(answer(*state, steps, now));
    }
    // Two new positions in a row are inside the wall: the motors have the command of one of these steps.
    if (x > 0.005 && seen && seen_before) {
      const Vec3 felt = shim.with([](FakeFalcon& falcon) { return falcon.force(); });
      if (!near(felt, written) && !near(felt, written_before)) ++at_odds;
      if (felt.x() < -1) ++pushed;
    }
  }
  loop.stop();
  EXPECT_EQ(heap_calls, 0U);
  EXPECT_GT(pushed, 0U);  // a sign error would pull
  // After a late step, the hand has moved. If a reply has timed out, it answers the next request.
  EXPECT_LE(at_odds, loop.stats().overruns + loop.stats().unseen);
}

}  // namespace
}  // namespace tendon::falcon_loop_test
