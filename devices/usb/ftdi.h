// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "devices/usb/pipe.h"

/// The vendor requests and the packets of FTDI's serial chips (FT232R). The numbers are those of libftdi's `ftdi.h` and
/// of Linux' `ftdi_sio.h`.
namespace tendon::usb::ftdi {

/// Every IN packet begins with two bytes of modem and line status. An idle chip sends them alone, once per latency
/// period.
inline constexpr std::size_t kStatusBytes = 2;

/// The serial data of an IN packet.
constexpr std::span<const std::uint8_t> payload(std::span<const std::uint8_t> packet) noexcept {
  return packet.size() > kStatusBytes ? packet.subspan(kStatusBytes) : std::span<const std::uint8_t>{};
}

/// Each empties the chip's buffer of one direction. Older documents confuse the two, so always send both.
inline constexpr Request kPurgeOne{0, 1};
inline constexpr Request kPurgeOther{0, 2};
inline constexpr Request kDtrLow{1, 0x0100};
inline constexpr Request kDtrHigh{1, 0x0101};
inline constexpr Request kRtsLow{1, 0x0200};
inline constexpr Request kNoFlowControl{2, 0};
inline constexpr Request k8N1{4, 8};

/// Sets the rate to 3 MHz / divisor; the two upper bits are eighths (0x4138 is 312.5: 9600 baud).
constexpr Request divisor(std::uint16_t divisor) noexcept { return {3, divisor}; }

/// When the chip receives `character`, it sends its buffer at once and does not wait for the latency timer.
constexpr Request flush_at(std::uint8_t character) noexcept {
  return {6, static_cast<std::uint16_t>(0x100U | character)};
}

/// The chip sends its buffer, even an empty one, when `ms` ms have passed since it last did.
constexpr Request latency(std::uint8_t ms) noexcept { return {9, ms}; }

/// Sends a list of requests as fast as the pipe takes them.
class Setup {
 public:
  explicit Setup(std::span<const Request> requests) noexcept : left_(requests) {}

  /// True when the device has all of them.
  bool step(Pipe& pipe) noexcept {
    while (!left_.empty() && pipe.request(left_.front())) left_ = left_.subspan(1);
    return left_.empty() && pipe.settled();
  }

 private:
  std::span<const Request> left_;
};

}  // namespace tendon::usb::ftdi
