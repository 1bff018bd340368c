// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "tests/devices/usb/usb_model.h"

namespace tendon {

/// The USB of a machine simulated by umockdev: the real libusb finds devices in its sysfs, gets its udev events, and
/// reaches nodes whose ioctls end in this process. umockdev-preload, which the program must be linked with, redirects
/// the paths of this process and its children.
///
/// One per process, constructed before other threads. Not for timing: each ioctl sends messages through a socket.
class MockUsb {
 public:
  MockUsb();
  /// All devices must be closed.
  ~MockUsb();
  MockUsb(const MockUsb&) = delete;
  MockUsb& operator=(const MockUsb&) = delete;

  /// Returns the path in the real file system of a path of the simulated machine.
  std::string really(const std::string& path) const;

 private:
  friend class MockPort;
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
};

/// One port of the machine and its device model, in real time. Thread-safe.
class MockPort {
 public:
  /// Port `number` of bus 1, 1 to 9, initially empty. `usb` and `model` must outlive it.
  MockPort(MockUsb& usb, int number, UsbModel& model);
  ~MockPort();
  MockPort(const MockPort&) = delete;
  MockPort& operator=(const MockPort&) = delete;

  /// Uses a new address each time, like the kernel.
  void plug();
  /// Like the kernel: transfers end, the node fails, the device leaves sysfs, and udev sends an event.
  void unplug();

  std::string node() const;       ///< of the plugged device: "/dev/bus/usb/001/002"
  int open_transfers() const;     ///< submitted and not yet reaped
  int woken_for_nothing() const;  ///< wake-ups of libusb without a transfer

  template <class Act>
  auto with(const Act& act) const {
    const std::lock_guard lock(mutex_);
    return act();
  }

  struct Inside;

 private:
  mutable std::mutex mutex_;
  std::unique_ptr<Inside> inside_;
};

}  // namespace tendon
