// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace tendon::usb {

/// A vendor request to the device, without data (bmRequestType 0x40): what sets up serial chips.
struct Request {
  std::uint8_t request = 0;
  std::uint16_t value = 0;
  std::uint16_t index = 0;
  friend bool operator==(const Request&, const Request&) = default;
};

/// What a device says it is: its maker's number and the maker's for it.
struct Id {
  std::uint16_t vendor = 0;
  std::uint16_t product = 0;
  friend bool operator==(const Id&, const Id&) = default;
};

/// The largest full-speed packet, bulk or interrupt (USB 2.0, 5.8.3 and 5.7.3): what one IN transfer brings at most,
/// and one `write` takes.
inline constexpr std::size_t kPacketSize = 64;

/// One USB device with an endpoint each way, of which nothing ever waits: what a device driver of ours runs over.
/// Behind it is libusb (`usb.h`), or a model in memory.
///
/// A transfer that fails ends the connection, and whatever is plugged in next is another one. There is no other error
/// to handle: unplugging, a stall, a device that babbles all look the same.
///
/// Thread-safe: no; one thread uses it. Realtime-safe: every function.
class Pipe {
 public:
  virtual ~Pipe() = default;

  /// 0 while there is no device; else a number that no two openings share. What was accepted for another connection
  /// than the one this function told last is thrown away: a force never reaches a device it was not meant for.
  virtual std::uint32_t connection() noexcept = 0;

  /// Sends `request` after all that was accepted before. False, and nothing is sent, while there is no room or no
  /// device.
  virtual bool request(const Request& request) noexcept = 0;

  /// The same for at most `kPacketSize` bytes to the OUT endpoint; more are refused.
  virtual bool write(std::span<const std::uint8_t> bytes) noexcept = 0;

  /// All that was accepted has reached the device.
  virtual bool settled() const noexcept = 0;

  /// The next packet of the IN endpoint, as it came: its size, 0 when there is none.
  virtual std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept = 0;

  /// Ends this connection from our side: the device is closed, and opened anew when it is still there.
  virtual void reopen() noexcept = 0;
};

}  // namespace tendon::usb
