// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tendon::usb {

/// A vendor request to the device, without data (bmRequestType 0x40); serial chips are set up by these.
struct Request {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  friend bool operator==(const Request&, const Request&) = default;
};

/// The identity of a USB device: the number of its maker, and the maker's number for it.
struct Id {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  friend bool operator==(const Id&, const Id&) = default;
};

/// The largest full-speed packet, bulk or interrupt (USB 2.0, 5.8.3 and 5.7.3). An IN transfer brings at most this
/// much, and a `write` takes at most this much.
inline constexpr std::size_t kPacketSize = 64;

/// One USB device with an endpoint each way. No call waits. Drivers use it through `Dialogue`; behind it is libusb
/// (`usb.h`), or a model in memory.
///
/// A transfer that fails ends the connection; the next device that is plugged in is a new connection. A driver has no
/// other error to handle: unplugging, a stall and a device that babbles all look the same.
///
/// Thread-safe: no; one thread uses it. Realtime-safe: every function.
class Pipe {
 public:
  virtual ~Pipe() = default;

  /// 0 while there is no device; otherwise a number that is different for each opening. A packet accepted for any
  /// connection but the one that this function returned last is dropped: a force never reaches the wrong device.
  virtual std::uint32_t connection() noexcept = 0;

  /// Sends `request` after everything accepted before it. False, and nothing is sent, when there is no room or no
  /// device.
  virtual bool request(const Request& request) noexcept = 0;

  /// Sends at most `kPacketSize` bytes to the OUT endpoint, likewise; more are refused.
  virtual bool write(std::span<const std::uint8_t> bytes) noexcept = 0;

  /// Whether everything accepted has reached the device.
  virtual bool settled() const noexcept = 0;

  /// Copies the next packet of the IN endpoint, unchanged. Returns its size, 0 when there is none.
  virtual std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept = 0;

  /// Ends this connection from our side: the device is closed, and opened again if it is still plugged in.
  virtual void reopen() noexcept = 0;
};

}  // namespace tendon::usb
