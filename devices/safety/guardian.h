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

/// The packet that ends the force of a device, and the system call that sends it.
class ZeroPacket {
 public:
  static constexpr std::size_t kMost = 64;  ///< bytes: one full-speed bulk transfer, one HID report

  /// A packet for an open usbfs node (/dev/bus/usb/…) whose interface has been claimed. It is sent with ioctl
  /// USBDEVFS_BULK to a bulk or interrupt endpoint. The claim belongs to the open file, not to the process: every
  /// process that shares the file may write.
  static ZeroPacket usb(std::uint8_t endpoint, std::span<const std::byte> bytes);
  /// A packet for any descriptor that write(2) accepts: a serial line, hidraw, a socket.
  static ZeroPacket written(std::span<const std::byte> bytes);

  /// Writes the packet to `fd`. While the device is busy it tries again, for up to about 50 ms. False when the device
  /// did not take it.
  bool send(int fd) const noexcept;

 private:
  ZeroPacket(bool usb, std::uint8_t endpoint, std::span<const std::byte> bytes);
  bool send_once(int fd) const noexcept;

  std::array<std::byte, kMost> bytes_{};
  std::uint8_t size_ = 0;
  std::uint8_t endpoint_ = 0;
  bool usb_ = false;
};

/// A process that sets the forces to zero if this process has been killed or if its haptic thread does not run. This can
/// be caused by SIGKILL, the kernel's out-of-memory killer, a crash, SIGSTOP, a debugger, a busy machine or a deadlock.
/// The guardian is needed because motors hold their last command: the Novint Falcon documents no watchdog.
///
/// The guardian shares the open files of the devices with this process, and holds one end of a socket pair. Its parent
/// is a thread that only waits. When that thread dies, the kernel signals the guardian (PR_SET_PDEATHSIG, prctl(2)),
/// and the guardian writes the zero packet of each device. The kernel may deliver this signal once per dying parent
/// thread; the packets are written each time. When the last thread is dead and the memory is freed, which takes tens of
/// milliseconds under load, the other end of the socket closes. Then the guardian writes the packets once more, after
/// anything that a dying thread may still have sent, and exits. It also does this on a clean exit: an extra zero is
/// harmless, and a path that runs only in a disaster is a path that nobody has tested.
///
/// The Heartbeat of a device is incremented in each haptic step. If the force is not zero and there is no step for
/// Heartbeat::kStill, the guardian writes the zero packet. It is written again after the same time, in case a different
/// thread has just sent a force. The heartbeats are read every 2 ms, so the first packet is sent 20 to 24 ms after the last
/// step.
///
/// The guardian blocks all signals and has its own session, so signals to the process group of the server do not reach
/// it. It cannot survive SIGKILL to itself (systemd sends it to a whole unit after TimeoutStopSec), or a power cut. A
/// control group that is frozen (`docker pause`) freezes the guardian too. Then only the device's own watchdog ends the
/// force.
///
/// Measured with a real kernel's usbfs, in an emulated machine (deploy/test-usb-kernel, commit 916cd72, n = 20): the
/// device had the zero packet 2.9 ms (p50), 5.5 ms (p90), at most 7.4 ms after the SIGKILL. On the same machine one
/// packet and its reply took 0.6 ms (p50). devices/falcon/README.md has the figures of the whole server;
/// tests/e2e/guardian_test.cc prints the time from process to process.
///
/// Thread-safe: yes. Realtime-safe: no.
class Guardian {
 public:
  static constexpr std::size_t kDevices = 16;

  /// Forks. After the fork the child calls only async-signal-safe functions. Before the fork the parent thread calls
  /// `on_start`: the guardian inherits the priority that `on_start` asks for, and this priority decides how soon both
  /// run on a busy machine. Throws std::system_error when the system refuses.
  explicit Guardian(const std::function<void()>& on_start = {});
  /// Waits until the guardian has written the packets and exited.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// From now on, until the next call for the same `device` (below kDevices), the guardian writes `zero` to `fd` when
  /// the forces have to end. It gets its own copy of the descriptor. False when the guardian is dead.
  bool guard(std::size_t device, int fd, const ZeroPacket& zero) noexcept;
  /// `device` is gone: nothing more is written to it.
  bool forget(std::size_t device) noexcept;

  /// Returns the heartbeat for the thread that steps `device` (below kDevices).
  Heartbeat& heartbeat(std::size_t device) noexcept { return hearts_[device]; }

  pid_t pid() const noexcept { return pid_; }

  /// False if the guardian is dead or stopped. Then nothing ends the forces if this process is killed.
  ///
  /// Realtime-safe, and may be read from any thread.
  const std::atomic<bool>& stands() const noexcept { return stands_; }

 private:
  std::atomic<bool> stands_{true};  ///< written by `parent_`
  std::thread parent_;
  pid_t pid_ = -1;
  int socket_ = -1;
  Heartbeat* hearts_ = nullptr;  ///< an array of kDevices in memory that the guardian shares
};

}  // namespace tendon
