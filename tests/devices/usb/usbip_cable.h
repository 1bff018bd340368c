// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <atomic>
#include <cstdint>
#include <deque>
#include <functional>
#include <mutex>
#include <span>
#include <thread>
#include <vector>

#include "tests/devices/usb/usb_model.h"

namespace tendon {

/// A model at the end of a cable to the real kernel, in real time: it speaks USB/IP (Linux,
/// Documentation/usb/usbip_protocol.rst) over one end of a pair of sockets, and the other end is given to the kernel's
/// virtual host controller, vhci_hcd. Enumeration, usbfs, usbhid, disconnection are then the kernel's own.
///
/// Wants root, and vhci_hcd loaded: deploy/test-usb-kernel runs it in a machine of its own.
///
/// Thread-safe.
class UsbIpCable {
 public:
  /// After each OUT transfer that the model took: when that was. Nobody else touches the model meanwhile.
  using Watch = std::function<void(LocalTime)>;

  /// Plugs it in. Throws std::runtime_error, with a sentence, when the kernel does not take it.
  explicit UsbIpCable(UsbModel& model, Watch watch = {});
  ~UsbIpCable();
  UsbIpCable(const UsbIpCable&) = delete;
  UsbIpCable& operator=(const UsbIpCable&) = delete;

  void plug();
  void unplug();

  /// Calls `act()` while nobody else touches the model.
  template <class Act>
  auto with(const Act& act) const {
    const std::lock_guard lock(mutex_);
    return act();
  }

 private:
  /// A transfer of the kernel's, or its wish to have one back, as it came.
  struct Order;
  /// An IN transfer that waits for the device.
  struct Waiting {
    std::uint32_t number = 0;
    std::size_t size = 0;
  };

  void run();
  bool take_order();
  void obey(const Order& order, std::span<const std::uint8_t> bytes);
  void obey_control(const Order& order);
  void let_in(LocalTime now);
  void answer(std::uint32_t number, int status, std::size_t size, std::span<const std::uint8_t> bytes = {});
  void answer_unlink(std::uint32_t number, std::uint32_t unlinked);
  void send(std::span<const std::uint8_t> bytes);

  UsbModel& model_;
  Watch watch_;
  mutable std::mutex mutex_;
  int end_ = -1;
  std::deque<Waiting> waiting_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace tendon
