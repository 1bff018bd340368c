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

/// Connects a model to the real kernel in real time, by USB/IP (Linux, Documentation/usb/usbip_protocol.rst) over a
/// socket pair, whose other end is the virtual host controller vhci_hcd. Enumeration, usbfs, usbhid and disconnection
/// are those of the kernel. Requires root and vhci_hcd; deploy/test-usb-kernel runs it in a separate machine.
///
/// Thread-safe.
class UsbIpCable {
 public:
  /// This is called with the time of each accepted OUT transfer, while the model is locked.
  using Watch = std::function<void(LocalTime)>;

  /// Plugs the device in. Throws std::runtime_error if the kernel rejects it.
  explicit UsbIpCable(UsbModel& model, Watch watch = {});
  ~UsbIpCable();
  UsbIpCable(const UsbIpCable&) = delete;
  UsbIpCable& operator=(const UsbIpCable&) = delete;

  void plug();
  void unplug();

  template <class Act>
  auto with(const Act& act) const {
    const std::lock_guard lock(mutex_);
    return act();
  }

 private:
  struct Order;
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
