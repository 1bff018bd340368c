// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>
#include <mutex>
#include <string>

#include "tests/devices/usb/usb_model.h"

namespace tendon {

/// A machine's USB as umockdev makes it up: the real libusb finds what is plugged in in its sysfs, hears of it by its
/// udev, and reaches it through nodes whose ioctls end in this process. The paths of this process, and of those that it
/// forks, are turned to it by umockdev-preload, which the program has to be linked with.
///
/// One in a process, made before there are other threads. No use for times: each ioctl is messages through a socket.
class MockUsb {
 public:
  MockUsb();
  /// Nobody may have a device open any more.
  ~MockUsb();
  MockUsb(const MockUsb&) = delete;
  MockUsb& operator=(const MockUsb&) = delete;

  /// Where a path of that machine is in the file system of this one.
  std::string really(const std::string& path) const;

 private:
  friend class MockPort;
  struct Testbed;
  std::unique_ptr<Testbed> testbed_;
};

/// One of its plugs, and the model that belongs there, in real time. Thread-safe.
class MockPort {
 public:
  /// Port `number` of bus 1, 1 to 9. Nothing is plugged in. Both must outlive it.
  MockPort(MockUsb& usb, int number, UsbModel& model);
  ~MockPort();
  MockPort(const MockPort&) = delete;
  MockPort& operator=(const MockPort&) = delete;

  /// Each time at another address, as a kernel does.
  void plug();
  /// As a kernel does: transfers end, the node is dead, then the device is gone from sysfs, and udev says so.
  void unplug();

  std::string node() const;       ///< of what is plugged in: "/dev/bus/usb/001/002"
  int open_transfers() const;     ///< given to us, not fetched back yet
  int woken_for_nothing() const;  ///< how often libusb was

  /// Calls `act()` while nobody else touches the model.
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
