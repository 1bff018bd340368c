// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tendon::usb {

/// A vendor request without data (bmRequestType 0x40), used for setting up serial chips.
struct Request {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  friend bool operator==(const Request&, const Request&) = default;
};

struct Id {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  friend bool operator==(const Id&, const Id&) = default;
};

inline constexpr std::size_t kPacketSize = 64;  ///< full-speed bulk and interrupt packets (USB 2.0, 5.8.3 and 5.7.3)

/// A USB device with one endpoint in each direction: libusb (`usb.h`) or a model. Drivers use it through `Dialogue`.
///
/// If a transfer fails, for example because the device was unplugged, the connection is closed. If the device is
/// plugged in again, a new connection is opened. There are no other errors.
/// Thread-safe: no. It must be used by a single thread. Realtime-safe: every function. Never blocks.
class Pipe {
 public:
  virtual ~Pipe() = default;

  /// Returns a different number for each opening, or 0 if there is no device. Packets accepted for a different
  /// connection than the last one returned here are dropped, so forces are never sent to the wrong device.
  virtual std::uint32_t connection() noexcept = 0;

  /// Sends `request` after everything that was already accepted. Returns false if there is no device, or no room.
  virtual bool request(const Request& request) noexcept = 0;

  /// Same for the OUT endpoint. Also returns false for more than `kPacketSize` bytes.
  virtual bool write(std::span<const std::uint8_t> bytes) noexcept = 0;

  virtual bool settled() const noexcept = 0;  ///< true if everything that was accepted has reached the device

  /// Copies the next IN packet and returns its size, or 0.
  virtual std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept = 0;

  virtual void reopen() noexcept = 0;  ///< closes the device, and opens it again if it is still plugged in
};

}  // namespace tendon::usb
