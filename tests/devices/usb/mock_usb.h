// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "tests/devices/usb/usb_model.h"

namespace tendon {

/// The USB of a simulated machine. The real libusb finds the devices in the sysfs of umockdev and receives its udev
/// events; the ioctls of the nodes end in this process. umockdev-preload, which must be linked to the program,
/// redirects the paths of this process and of its children. One per process, before any other thread. Not for measuring
/// times, because each ioctl sends messages through a socket.
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

/// A port of the machine and the model of its device, in real time. Thread-safe.
class MockPort {
 public:
  /// Creates port `number` (1 to 9) of bus 1 without a device. `usb` and `model` must outlive this object.
  MockPort(MockUsb& usb, int number, UsbModel& model);
  ~MockPort();
  MockPort(const MockPort&) = delete;
  MockPort& operator=(const MockPort&) = delete;

  /// Uses a new address each time, like the kernel.
  void plug();
  /// As with the kernel, transfers end, the node fails, the device is removed from sysfs, and udev sends an event.
  void unplug();

  std::string node() const;       ///< of the plugged device: "/dev/bus/usb/001/002"
  int open_transfers() const;     ///< submitted and not yet reaped
  int woken_for_nothing() const;  ///< number of times that libusb was woken without a transfer

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
