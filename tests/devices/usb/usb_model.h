// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// For the adapters whose other side lives in real time.
inline LocalTime real_now() {
  return LocalTime(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

/// Full-speed device with one interface, as seen from its cable. The adapters of all tiers use this interface
/// (tests/devices/README.md). A model reports the state of the bus at the given time without waiting or reading a
/// clock, so it behaves identically behind a memory pipe, the real libusb and a real kernel.
class UsbModel {
 public:
  virtual ~UsbModel() = default;

  /// Contents of the usbfs node (USB 2.0, 9.6): device descriptor of 18 bytes, then the complete configuration.
  virtual std::span<const std::uint8_t> descriptors() const = 0;
  /// HID report descriptor (HID 1.11, 6.2.2).
  virtual std::span<const std::uint8_t> report_descriptor() const { return {}; }

  virtual void plug() = 0;
  virtual void unplug() = 0;

  /// Vendor request without data. Returns false for a stall.
  virtual bool request(LocalTime now, std::uint8_t request, std::uint16_t value) = 0;
  /// OUT transfer. Returns false for a stall.
  virtual bool write(LocalTime now, std::span<const std::uint8_t> bytes) = 0;
  /// The time when a waiting IN transfer ends without another event. This is LocalTime::max() if it can only be ended
  /// by an event.
  virtual LocalTime next_in() const = 0;
  virtual std::vector<std::uint8_t> take_in(LocalTime now) = 0;

 protected:
  UsbModel() = default;
  UsbModel(const UsbModel&) = default;
  UsbModel& operator=(const UsbModel&) = default;
};

/// Length of the device descriptor at the start of `descriptors`.
inline constexpr std::size_t kDeviceDescriptor = 18;

}  // namespace tendon
