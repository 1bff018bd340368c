// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <thread>

namespace tendon {

/// How a device is told that it is to give no force: the bytes, and the way they go.
class ZeroPacket {
 public:
  static constexpr std::size_t kMost = 64;  ///< bytes: one full-speed bulk transfer, one HID report

  /// Through an open usbfs node (/dev/bus/usb/…) whose interface has been claimed: ioctl USBDEVFS_BULK, to a bulk or
  /// interrupt endpoint. The claim belongs to the open file, not to the process: whoever shares it may write.
  static ZeroPacket usb(std::uint8_t endpoint, std::span<const std::byte> bytes);
  /// Through anything that write(2) writes to: a serial line, hidraw, a socket.
  static ZeroPacket written(std::span<const std::byte> bytes);

  /// Writes it to `fd`. Tries a few times, for some 50 ms, when the device is busy; false when it did not take it.
  bool send(int fd) const noexcept;

 private:
  ZeroPacket(bool usb, std::uint8_t endpoint, std::span<const std::byte> bytes);
  bool send_once(int fd) const noexcept;

  std::array<std::byte, kMost> bytes_{};
  std::uint8_t size_ = 0;
  std::uint8_t endpoint_ = 0;
  bool usb_ = false;
};

/// A process of its own that ends the forces when this one dies, however it dies: also by SIGKILL, the kernel's
/// out-of-memory killer or a crash, of which no handler is told. Worth having because motors hold their last command:
/// the Novint Falcon documents no watchdog.
///
/// It shares with this process the open files of the devices, and one end of a socket. Its parent is a thread that does
/// nothing but wait for its end; when that thread dies, which takes no more than that the kernel runs it once more, the
/// kernel tells the guardian (PR_SET_PDEATHSIG, prctl(2)), and it writes each device's zero packet; and again for each
/// thread that inherits it and dies. When the last thread is dead and the memory given back, which under load takes
/// tens of milliseconds, the other end of the socket closes: then it writes them once more, after anything that a dying
/// thread may still have sent, and is gone. It does the same when this process ends well: one zero more hurts nobody,
/// and what only happens in disasters is never tried.
///
/// It blocks all signals and has a session of its own, so that what is sent to the process group of the server does not
/// reach it. What ends it too: SIGKILL to itself (as systemd does to a whole unit, after TimeoutStopSec), and power.
///
/// Measured with a real kernel's usbfs, in an emulated machine (deploy/test-usb-kernel, commit 916cd72, n = 20): the
/// device had the zero packet 2.9 ms (p50), 5.5 ms (p90), at most 7.4 ms after the SIGKILL, where a bare packet and its
/// reply took 0.6 ms (p50). The whole server: see devices/falcon/README.md. From process to process:
/// tests/e2e/guardian_test.cc prints it.
///
/// Thread-safe: yes. Realtime-safe: no.
class Guardian {
 public:
  static constexpr std::size_t kDevices = 16;

  /// Forks; the new process calls nothing that threads of the old one could stand in the way of. `on_start` is called
  /// first, by the thread that is to be the parent: the priority it asks for is the guardian's too, and decides how
  /// soon both run on a busy machine. Throws std::system_error when the system refuses.
  explicit Guardian(const std::function<void()>& on_start = {});
  /// Waits until it has written and is gone.
  ~Guardian();
  Guardian(const Guardian&) = delete;
  Guardian& operator=(const Guardian&) = delete;

  /// From now on `device` (below kDevices) is `fd`, and `zero` what ends its force; until the next call for it. The
  /// guardian gets a descriptor of its own. False when it is dead.
  bool guard(std::size_t device, int fd, const ZeroPacket& zero) noexcept;
  /// `device` is gone: nothing is written to it any more.
  bool forget(std::size_t device) noexcept;

  pid_t pid() const noexcept { return pid_; }

 private:
  std::thread parent_;
  pid_t pid_ = -1;
  int socket_ = -1;
};

}  // namespace tendon
