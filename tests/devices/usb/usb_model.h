// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/base/time.h"

namespace tendon {

/// A full-speed device with one interface, as far as its cable shows it: what the adapters of all tiers are written for
/// (tests/devices/README.md). A model says what the wire would say at the time it is asked; nothing in it waits or
/// reads a clock, so it is the same behind a pipe in memory, the real libusb and a real kernel.
class UsbModel {
 public:
  virtual ~UsbModel() = default;

  /// As a usbfs node reads (USB 2.0, 9.6): 18 bytes of the device, then its one configuration with all that is in it.
  virtual std::span<const std::uint8_t> descriptors() const = 0;
  /// What an HID device says its reports mean (HID 1.11, 6.2.2).
  virtual std::span<const std::uint8_t> report_descriptor() const { return {}; }

  virtual void plug() = 0;
  virtual void unplug() = 0;

  /// A vendor request without data; false: stalled.
  virtual bool request(LocalTime now, std::uint8_t request, std::uint16_t value) = 0;
  /// One OUT transfer; false: stalled.
  virtual bool write(LocalTime now, std::span<const std::uint8_t> bytes) = 0;
  /// When an IN transfer that waits would end, unless something else happens before; LocalTime::max(): then only.
  virtual LocalTime next_in() const = 0;
  /// What it would bring.
  virtual std::vector<std::uint8_t> take_in(LocalTime now) = 0;

 protected:
  UsbModel() = default;
  UsbModel(const UsbModel&) = default;
  UsbModel& operator=(const UsbModel&) = default;
};

/// Bytes of `descriptors` that are the device's; the rest is the configuration's.
inline constexpr std::size_t kDeviceDescriptor = 18;

}  // namespace tendon
