// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/time.h"

namespace tendon {

inline LocalTime real_now() {
  return LocalTime(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

/// A full-speed device with one interface, for the adapters of all tiers (tests/devices/README.md). A model reports the
/// bus at the given time without waiting or reading a clock, so it behaves identically behind a memory pipe, the real
/// libusb and a real kernel.
class UsbModel {
 public:
  virtual ~UsbModel() = default;

  /// The device descriptor of 18 bytes, followed by the complete configuration (USB 2.0, 9.6).
  virtual std::span<const std::uint8_t> descriptors() const = 0;
  /// HID report descriptor (HID 1.11, 6.2.2).
  virtual std::span<const std::uint8_t> report_descriptor() const { return {}; }

  virtual void plug() = 0;
  virtual void unplug() = 0;

  /// Handles a vendor request without data. Returns false for a stall.
  virtual bool request(LocalTime now, std::uint8_t request, std::uint16_t value) = 0;
  virtual bool write(LocalTime now, std::span<const std::uint8_t> bytes) = 0;
  /// Returns when a waiting IN transfer ends if there is no other event. LocalTime::max() means never.
  virtual LocalTime next_in() const = 0;
  virtual std::vector<std::uint8_t> take_in(LocalTime now) = 0;

 protected:
  UsbModel() = default;
  UsbModel(const UsbModel&) = default;
  UsbModel& operator=(const UsbModel&) = default;
};

inline constexpr std::size_t kDeviceDescriptor = 18;

}  // namespace tendon
