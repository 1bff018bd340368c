// SPDX-License-Identifier: Apache-2.0
// These tests use models of the kernel and a Falcon in real time. The speed of the machine does not matter.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <ctime>
#include <memory>
#include <span>
#include <string>
#include <thread>
#include <vector>

#include "devices/falcon/falcon_device.h"
#include "devices/falcon/packet.h"
#include "devices/safety/guardian.h"
#include "devices/usb/usb.h"
#include "tests/devices/usb/falcon_driver.h"
#include "tests/devices/usb/usbfs_shim.h"

namespace tendon::libusb_pipe_test {
namespace {

using namespace std::chrono_literals;
using State = Device::State;
using Clock = std::chrono::steady_clock;

std::unique_ptr<usb::Pipe> pipe_to(UsbfsShim& shim) {
  return usb::open_pipe({.node = [&shim] { return shim.node(); }});
}

struct Loop : FalconDriver {
  explicit Loop(UsbfsShim& shim) : FalconDriver(pipe_to(shim)) {}
};

const Vec3 kForce(1, -2, 2);
constexpr FakeFalcon::Options kReady = {.has_firmware = true, .is_homed = true, .firmware_bytes = 4096};

bool pushes(const UsbfsShim& shim) {
  return shim.with([](FakeFalcon& falcon) { return falcon.pushes(); });
}

TEST(LibusbPipe, FromThePlugToTheForceThroughTheRealLibrary) {
  UsbfsShim shim({.has_firmware = false, .firmware_bytes = 4096});
  Loop loop(shim);
  ASSERT_TRUE(loop.reaches(State::kFirmware, kForce));
  ASSERT_TRUE(loop.reaches(State::kUnhomed, kForce));
  EXPECT_EQ(shim.with([](FakeFalcon& falcon) { return falcon.image(); }), fake_firmware(4096));
  EXPECT_FALSE(pushes(shim));
  shim.with([](FakeFalcon& falcon) { falcon.pull_through(); });
  ASSERT_TRUE(loop.reaches(State::kHomed, kForce));
  ASSERT_TRUE(loop.turns_until([&] { return pushes(shim); }, kForce));
  EXPECT_LT((shim.with([](FakeFalcon& falcon) { return falcon.force(); }) - kForce).norm(), 0.02);
  EXPECT_GE(shim.counts().most_in, 2) << "IN transfers have to be queued";
}

TEST(LibusbPipe, ItsEndIsZeroForceTakenByTheDeviceAndNothingLeftOpen) {
  UsbfsShim shim(kReady);
  {
    Loop loop(shim);
    ASSERT_TRUE(loop.reaches(State::kHomed, kForce));
    ASSERT_TRUE(loop.turns_until([&] { return pushes(shim); }, kForce));
    EXPECT_TRUE(shim.counts().claimed);
    loop.device.apply(Vec3::Zero());  // followed directly by the end
  }
  EXPECT_FALSE(pushes(shim));
  EXPECT_EQ(shim.counts().open_transfers, 0);
  EXPECT_FALSE(shim.counts().claimed);
}

TEST(LibusbPipe, TheGuardiansNodeTakesTheZeroPacketOfADeadDriver) {
  UsbfsShim shim(kReady);
  std::vector<int> told;
  {
    std::atomic<int> node = -1;
    FalconDevice device({.firmware = fake_firmware(4096)}, usb::open_pipe({.opened =
                                                                               [&](int opened) {
                                                                                 told.push_back(opened);
                                                                                 node = opened;
                                                                               },
                                                                           .node = [&] { return shim.node(); }}));
    for (const LocalTime end = real_now() + 10s; !pushes(shim) && real_now() < end; std::this_thread::sleep_for(1ms)) {
      device.read(real_now());
      device.apply(kForce);
    }
    ASSERT_TRUE(pushes(shim));
    const auto bytes = falcon::encode(falcon::kLastCommand);
    EXPECT_TRUE(ZeroPacket::usb(usb::PipeConfig{}.out, std::as_bytes(std::span(bytes))).send(node));
    EXPECT_FALSE(pushes(shim));
  }
  EXPECT_EQ(told, (std::vector<int>{shim.node(), -1}));
}

TEST(LibusbPipe, UnpluggedInMidTransferItIsAbsentAndComesBackWithZeroForce) {
  UsbfsShim shim({.has_firmware = true, .is_homed = true, .own_supply = true});
  Loop loop(shim);
  for (int i = 0; i < 3; ++i) {
    ASSERT_TRUE(loop.turns_until([&] { return pushes(shim); }, kForce));
    shim.unplug();
    ASSERT_TRUE(loop.reaches(State::kAbsent, kForce));
    EXPECT_EQ(loop.written, Vec3::Zero());
    ASSERT_TRUE(loop.turns_until([&] { return shim.counts().open_transfers == 0; }, kForce));
    EXPECT_TRUE(pushes(shim)) << "its own supply is on, and nobody can tell it";
    shim.plug();
    ASSERT_TRUE(loop.reaches(State::kUnhomed, kForce));
    EXPECT_FALSE(pushes(shim)) << "the first thing it is told";
  }
}

const std::vector<std::uint8_t> kPacket(16, 'A');

TEST(LibusbPipe, ATransferThatFailsEndsTheConnectionWhateverTheReason) {
  using enum UsbfsShim::Trouble;
  for (const auto trouble : {kOverflow, kStall, kHang}) {
    SCOPED_TRACE(static_cast<int>(trouble));
    UsbfsShim shim(kReady);
    const auto pipe = pipe_to(shim);
    ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
    const auto first = pipe->connection();
    shim.set_trouble(trouble);
    EXPECT_TRUE(pipe->write(kPacket));
    ASSERT_TRUE(comes_true([&] { return pipe->connection() != first; }));
    shim.set_trouble(kNone);
    ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
    EXPECT_TRUE(pipe->write(kPacket));
    EXPECT_TRUE(comes_true([&] { return pipe->settled(); }));
  }
}

TEST(LibusbPipe, IsOpenedAnewOnRequest) {
  UsbfsShim shim(kReady);
  const auto pipe = pipe_to(shim);
  ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
  const auto first = pipe->connection();
  pipe->reopen();
  EXPECT_TRUE(comes_true([&] { return pipe->connection() > first; }));
}

TEST(LibusbPipe, ItsThreadWakesForAnOrderAndSleepsWithout) {
  UsbfsShim shim(kReady);
  const auto pipe = pipe_to(shim);
  ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
  shim.set_trouble(UsbfsShim::Trouble::kMute);
  std::this_thread::sleep_for(20ms);  // no incoming data can wake it
  const auto before = shim.counts().out;
  EXPECT_TRUE(pipe->write(kPacket));
  EXPECT_TRUE(comes_true([&] { return shim.counts().out == before + 1; }));

  const auto processor = std::clock();
  const auto begin = Clock::now();
  std::this_thread::sleep_for(300ms);
  const double share = static_cast<double>(std::clock() - processor) / CLOCKS_PER_SEC /
                       std::chrono::duration<double>(Clock::now() - begin).count();
  EXPECT_LT(share, 0.3) << "it spins";
}

TEST(LibusbPipe, AnInterruptEndpointGetsInterruptTransfersAndNoOther) {
  using enum usb::PipeConfig::Transfers;
  for (const auto transfers : {kBulk, kInterrupt}) {
    UsbfsShim shim(kReady);
    const auto pipe = usb::open_pipe({.transfers = transfers, .node = [&shim] { return shim.node(); }});
    std::array<std::uint8_t, usb::kPacketSize> packet{};
    bool written = false;
    const LocalTime end = real_now() + 10s;
    while ((!written || shim.counts().in == 0 || shim.counts().out == 0) && real_now() < end) {
      written = written || (pipe->connection() != 0 && pipe->write(std::array<std::uint8_t, 1>{'<'}));
      pipe->read(packet);
      std::this_thread::sleep_for(1ms);
    }
    const auto counts = shim.counts();
    EXPECT_GT(counts.in, 0U);
    EXPECT_GT(counts.out, 0U);
    EXPECT_EQ(counts.interrupt > 0, transfers == kInterrupt);
    EXPECT_EQ(counts.bulk > 0, transfers == kBulk);
  }
}

TEST(LibusbPipe, EndsWhileTransfersHang) {
  for (const auto trouble : {UsbfsShim::Trouble::kHang, UsbfsShim::Trouble::kMute}) {
    UsbfsShim shim(kReady);
    {
      Loop loop(shim);
      ASSERT_TRUE(loop.reaches(State::kHomed));
      shim.set_trouble(trouble);
      for (int i = 0; i < 20; ++i) loop.step(kForce);
    }
    EXPECT_EQ(shim.counts().open_transfers, 0);
  }
}

TEST(LibusbPipe, EndsWhileNothingIsPluggedIn) {
  UsbfsShim shim(kReady);
  shim.unplug();
  Loop loop(shim);
  for (int i = 0; i < 20; ++i) loop.step(kForce);
  EXPECT_EQ(loop.device.state(), State::kAbsent);
}

TEST(LibusbPipe, OrdersForAnOlderConnectionAreThrownAway) {
  UsbfsShim shim(kReady);
  const auto pipe = pipe_to(shim);
  ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
  const auto first = pipe->connection();
  shim.unplug();
  ASSERT_TRUE(comes_true([&] { return shim.counts().open_transfers == 0; }));
  shim.plug();
  ASSERT_TRUE(comes_true([&] { return shim.counts().open_transfers > 0; }));  // resubmitted, and not yet read
  EXPECT_TRUE(pipe->write(kPacket));
  EXPECT_TRUE(comes_true([&] { return pipe->settled(); }));
  EXPECT_EQ(shim.counts().out, 0U);
  EXPECT_GT(pipe->connection(), first);
  EXPECT_TRUE(pipe->write(kPacket));
  EXPECT_TRUE(comes_true([&] { return shim.counts().out == 1; }));
  shim.unplug();
  ASSERT_TRUE(comes_true([&] { return pipe->connection() == 0; }));
  EXPECT_FALSE(pipe->write(kPacket));
}

TEST(LibusbPipe, RequestsAndDataReachTheDeviceInOrder) {
  UsbfsShim shim({.has_firmware = false, .firmware_bytes = 4096});
  const auto pipe = pipe_to(shim);
  ASSERT_TRUE(comes_true([&] { return pipe->connection() != 0; }));
  // The order of the greeting and the requests is important, because the greeting is only valid at 9600 baud.
  const std::vector<std::uint8_t> greeting = {0x0A, 0x43, 0x0D};
  EXPECT_TRUE(pipe->request(usb::ftdi::divisor(2)));
  EXPECT_TRUE(pipe->request(usb::ftdi::divisor(0x4138)));
  EXPECT_TRUE(pipe->write(greeting));
  EXPECT_TRUE(pipe->request(usb::ftdi::divisor(2)));
  ASSERT_TRUE(comes_true([&] { return pipe->settled(); }));
  EXPECT_FALSE(shim.with([](FakeFalcon& falcon) { return falcon.heard_garbage(); }));
  std::vector<std::uint8_t> heard;
  std::array<std::uint8_t, usb::kPacketSize> bytes{};
  ASSERT_TRUE(comes_true([&] {
    const auto payload = usb::ftdi::payload(std::span(bytes).first(pipe->read(bytes)));
    heard.insert(heard.end(), payload.begin(), payload.end());
    return heard.size() >= 4;
  }));
  EXPECT_EQ(heard, (std::vector<std::uint8_t>{0x0A, 0x44, 0x2C, 0x0D}));
}

double quantile(std::vector<double> values, double share) {
  std::ranges::sort(values);
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
}

// There is a sample in almost every period. The limit depends on the wake-up latency of this machine.
TEST(LibusbPipe, KeepsUpWithAKilohertz) {
  UsbfsShim shim(kReady);
  Loop loop(shim);
  ASSERT_TRUE(loop.reaches(State::kHomed));
  int seen = 0;
  constexpr int kTurns = 1000;
  std::vector<double> late_ms;
  const auto idle = shim.counts().fetched_nothing;
  for (int i = 0; i < kTurns; ++i) {
    loop.step(kForce);
    seen += loop.sample ? 1 : 0;
    late_ms.push_back(std::chrono::duration<double, std::milli>(Clock::now() - loop.due).count());
  }
  const double woken_for_nothing = static_cast<double>(shim.counts().fetched_nothing - idle) / kTurns;
  std::printf(
      "samples in %.1f %% of periods; thread late by p50 %.3f, p99 %.3f ms; woken for nothing %.2f per period\n",
      100.0 * seen / kTurns, quantile(late_ms, 0.5), quantile(late_ms, 0.99), woken_for_nothing);
  const double on_time = static_cast<double>(std::ranges::count_if(late_ms, [](double late) { return late < 0.3; }));
  EXPECT_GE(seen, 0.5 * on_time);
  EXPECT_LT(woken_for_nothing, 20) << "libusb's thread spins";
}

}  // namespace
}  // namespace tendon::libusb_pipe_test
