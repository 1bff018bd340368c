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

/// The packet that ends the force of a device, and the system call for sending it.
class ZeroPacket {
 public:
  static constexpr std::size_t kMost = 64;  ///< bytes: one full-speed bulk transfer, one HID report

  /// A packet for an open usbfs node (/dev/bus/usb/…) whose interface has been claimed. It is sent by ioctl
  /// USBDEVFS_BULK to a bulk or interrupt endpoint. The claim belongs to the open file and not to the process, so every
  /// process that shares the file may write.
  static ZeroPacket usb(std::uint8_t endpoint, std::span<const std::byte> bytes);
  /// A packet for any descriptor that supports write(2): a serial line, hidraw, a socket.
  static ZeroPacket written(std::span<const std::byte> bytes);

  /// Writes the packet to `fd`. Retries for up to about 50 ms while the device is busy. Returns false if the device did
  /// not accept it.
  bool send(int fd) const noexcept;

 private:
  ZeroPacket(bool usb, std::uint8_t endpoint, std::span<const std::byte> bytes);
  bool send_once(int fd) const noexcept;

  std::array<std::byte, kMost> bytes_{};
  std::uint8_t size_ = 0;
  std::uint8_t endpoint_ = 0;
  bool usb_ = false;
};

/// A separate process that sets the forces to zero if this process is killed or its haptic thread does not run.
/// Possible causes are SIGKILL, the kernel's out-of-memory killer, a crash, SIGSTOP, a debugger, a busy machine or a
/// deadlock. It is needed because motors hold their last command: the Novint Falcon has no documented watchdog.
///
/// The guardian shares the open files of the devices with this process, and one end of a socket pair. Its parent is a
/// thread that only waits. When that thread dies, the kernel signals the guardian (PR_SET_PDEATHSIG, prctl(2)), which
/// writes the zero packet of each device. The kernel may deliver this signal once for each parent thread that dies; the
/// packets are written each time. When the last thread has died and the memory has been freed, which takes tens of
/// milliseconds under load, the other end of the socket closes. The guardian then writes the packets once more, because
/// a dying thread may have sent a last command, and exits. It also does this after a clean exit: an extra zero is
/// harmless, and the code that is needed after a crash is then tested on every exit.
///
/// Each haptic step increments the Heartbeat of its device. If the force is not zero and there was no step for
/// Heartbeat::kStill, the guardian writes the zero packet. It writes it again after the same time, in case another
/// thread has just sent a force. Heartbeats are read every 2 ms, so the first packet is sent 20 to 24 ms after the last
/// step.
///
/// The guardian blocks all signals and has its own session, so it does not receive signals to the process group of the
/// server. It does not survive SIGKILL (systemd sends it to a whole unit after TimeoutStopSec) or a power failure.
/// Freezing the control group (`docker pause`) also freezes the guardian. In these cases, only the watchdog of the
/// device ends the force.
///
/// Measured with the usbfs of a real kernel in an emulated machine (deploy/test-usb-kernel, commit 916cd72, n = 20):
/// the device received the zero packet 2.9 ms (p50), 5.5 ms (p90) and at most 7.4 ms after the SIGKILL. On the same
/// machine, one packet and its reply took 0.6 ms (p50). devices/falcon/README.md has the figures for the whole server,
/// and tests/e2e/guardian_test.cc prints the time between the processes.
///
/// Thread-safe: yes. Realtime-safe: no.
class Guardian {
 public:
  static constexpr std::size_t kDevices = 16;

  /// Forks. The child calls only async-signal-safe functions. The parent thread calls `on_start` before the fork: the
  /// guardian inherits the priority set there, which determines how soon both run on a busy machine. Throws
  /// std::system_error on failure.
  explicit Guardian(const std::function<void()>& on_start = {});
  /// Waits until the guardian has written the packets and exited.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// Registers `zero` to be written to `fd` when the forces must end, until the next call for the same `device` (below
  /// kDevices). The guardian receives its own copy of the descriptor. Returns false if the guardian is dead.
  bool guard(std::size_t device, int fd, const ZeroPacket& zero) noexcept;
  /// Unregisters `device`, to which nothing more is written.
  bool forget(std::size_t device) noexcept;

  /// Returns the heartbeat for the thread that steps `device` (below kDevices).
  Heartbeat& heartbeat(std::size_t device) noexcept { return hearts_[device]; }

  pid_t pid() const noexcept { return pid_; }

  /// False if the guardian is dead or stopped. Nothing then ends the forces if this process is killed.
  ///
  /// Realtime-safe; may be read from any thread.
  const std::atomic<bool>& stands() const noexcept { return stands_; }

 private:
  std::atomic<bool> stands_{true};  ///< written by the thread `parent_`
  std::thread parent_;
  pid_t pid_ = -1;
  int socket_ = -1;
  Heartbeat* hearts_ = nullptr;  ///< array of kDevices in memory shared with the guardian
};

}  // namespace tendon
