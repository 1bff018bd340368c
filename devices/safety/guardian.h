// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>

#include "devices/safety/heartbeat.h"

namespace tendon {

class ZeroPacket {
 public:
  static constexpr std::size_t kMost = 64;  ///< full-speed bulk transfer, or HID report

  /// For an open usbfs node (/dev/bus/usb/…) with a claimed interface, using ioctl USBDEVFS_BULK on a bulk or interrupt
  /// endpoint. Claims belong to the open file, so any process that shares it can write.
  static ZeroPacket usb(std::uint8_t endpoint, std::span<const std::byte> bytes);
  /// For all descriptors that support write(2): a serial line, hidraw, a socket.
  static ZeroPacket written(std::span<const std::byte> bytes);

  /// Retries for up to about 50 ms if the device is busy. Returns false if the packet was not accepted.
  bool send(int fd) const noexcept;

 private:
  ZeroPacket(bool usb, std::uint8_t endpoint, std::span<const std::byte> bytes);
  bool send_once(int fd) const noexcept;

  std::array<std::byte, kMost> bytes_{};
  std::uint8_t size_ = 0;
  std::uint8_t endpoint_ = 0;
  bool usb_ = false;
};

/// A process that sets the forces to zero if this process is killed or its haptic thread does not run, for example
/// because of SIGKILL, the kernel's out-of-memory killer, a crash, SIGSTOP, a debugger, a busy machine or a deadlock.
/// Motors keep rendering the last command, and the watchdog of a device may be missing or undocumented (Novint Falcon).
///
/// The guardian shares the open files of the devices, and a socket pair, with this process. It is started by a thread
/// that only waits. If that thread dies, the guardian receives a signal from the kernel (PR_SET_PDEATHSIG, prctl(2)),
/// possibly more than once, and writes the zero packets. The socket is closed after the last thread has died and the
/// memory was freed, which can take tens of milliseconds. The guardian then writes the packets again, since a dying
/// thread may have sent another command, and exits. It also does so after a clean exit, to test this.
///
/// Every haptic step increments the Heartbeat of its device. If a force is applied and the heartbeat stops for
/// Heartbeat::kStill, the guardian writes the zero packet twice, in case another thread has just sent a force. This is
/// checked every 2 ms, so that the first packet is written 20 to 24 ms after the last step.
///
/// The guardian blocks all signals and uses its own session, so signals to the process group of the server do not
/// affect it. It is also killed by SIGKILL (sent by systemd to all processes of a unit after TimeoutStopSec) or a power
/// failure, and frozen by `docker pause`. The force must then be ended by the watchdog of the device.
///
/// Measured with usbfs in an emulated machine (deploy/test-usb-kernel, commit 916cd72, n = 20): the device received the
/// zero packet 2.9 ms (p50), 5.5 ms (p90) and at most 7.4 ms after the SIGKILL, while a packet and its reply took 0.6
/// ms (p50). See devices/falcon/README.md for the server, tests/e2e/guardian_test.cc for the time between processes.
/// Thread-safe: yes. Realtime-safe: no.
class Guardian {
 public:
  static constexpr std::size_t kDevices = 16;

  /// Forks; the child only calls async-signal-safe functions. `on_start` is called by the parent thread before the
  /// fork. It should set the priority, which is inherited by the guardian and determines its delay on a busy machine.
  /// Throws std::system_error on failure.
  explicit Guardian(const std::function<void()>& on_start = {});
  ~Guardian();  ///< waits until the packets have been written
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Registers the zero packet of `device` (below kDevices) and a copy of `fd`. Returns false if the guardian is dead.
  bool guard(std::size_t device, int fd, const ZeroPacket& zero) noexcept;
  bool forget(std::size_t device) noexcept;  ///< must be called when `device` is closed

  /// Must only be used by the thread that steps `device` (less than kDevices).
  Heartbeat& heartbeat(std::size_t device) noexcept { return hearts_[device]; }

  pid_t pid() const noexcept { return pid_; }

  /// False if the guardian is dead or stopped, so that it cannot end the forces. Realtime-safe; for any thread.
  const std::atomic<bool>& stands() const noexcept { return stands_; }

 private:
  std::atomic<bool> stands_{true};
  std::thread parent_;
  pid_t pid_ = -1;
  int socket_ = -1;
  Heartbeat* hearts_ = nullptr;
};

}  // namespace tendon
