// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tendon::usb {

/// A vendor request without data (bmRequestType 0x40), used to set up serial chips.
struct Request {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  friend bool operator==(const Request&, const Request&) = default;
};

/// Vendor and product id of a USB device.
struct Id {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  friend bool operator==(const Id&, const Id&) = default;
};

/// Size of the largest full-speed packet, bulk or interrupt (USB 2.0, 5.8.3 and 5.7.3). It limits IN transfers and
/// `write`.
inline constexpr std::size_t kPacketSize = 64;

/// One USB device with an endpoint in each direction. No call blocks. Drivers use it through `Dialogue`; the
/// implementation is libusb (`usb.h`) or a model in memory.
///
/// A transfer that fails ends the connection, and the next device that is plugged in is a new connection. A driver
/// handles no other error: unplugging, a stall and babble look the same.
///
/// Thread-safe: no; one thread uses it. Realtime-safe: every function.
class Pipe {
 public:
  virtual ~Pipe() = default;

  /// Returns 0 while there is no device, otherwise a number that differs for each opening. A packet that was accepted
  /// for another connection than the one last returned here is dropped, so that a force never reaches the wrong device.
  virtual std::uint32_t connection() noexcept = 0;

  /// Sends `request` after everything accepted before it. Returns false, and sends nothing, if there is no room or no
  /// device.
  virtual bool request(const Request& request) noexcept = 0;

  /// Sends at most `kPacketSize` bytes to the OUT endpoint, under the same conditions. Larger packets are refused.
  virtual bool write(std::span<const std::uint8_t> bytes) noexcept = 0;

  /// Returns true if the device has received everything that was accepted.
  virtual bool settled() const noexcept = 0;

  /// Copies the next packet of the IN endpoint, unchanged. Returns its size, or 0 if there is none.
  virtual std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept = 0;

  /// Closes the device, and opens it again if it is still plugged in.
  virtual void reopen() noexcept = 0;
};

}  // namespace tendon::usb
