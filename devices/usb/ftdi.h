// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "devices/usb/pipe.h"

/// Vendor requests and packets of FTDI's serial chips (FT232R), from libftdi's `ftdi.h` and Linux' `ftdi_sio.h`.
namespace tendon::usb::ftdi {

/// The modem and line status at the start of each IN packet. When idle, it is sent alone, once per latency period.
inline constexpr std::size_t kStatusBytes = 2;

constexpr std::span<const std::uint8_t> payload(std::span<const std::uint8_t> packet) noexcept {
  return packet.size() > kStatusBytes ? packet.subspan(kStatusBytes) : std::span<const std::uint8_t>{};
}

/// Clear the buffers for both directions. Always use both, because older documents confuse them.
inline constexpr Request kPurgeOne{0, 1};
inline constexpr Request kPurgeOther{0, 2};
inline constexpr Request kDtrLow{1, 0x0100};
inline constexpr Request kDtrHigh{1, 0x0101};
inline constexpr Request kRtsLow{1, 0x0200};
inline constexpr Request kNoFlowControl{2, 0};
inline constexpr Request k8N1{4, 8};

/// Sets the rate to 3 MHz / divisor. The upper two bits are eighths (0x4138 is 312.5: 9600 baud).
constexpr Request divisor(std::uint16_t divisor) noexcept { return {3, divisor}; }

/// Sends the buffer immediately after receiving `character`, instead of waiting for the latency timer.
constexpr Request flush_at(std::uint8_t character) noexcept {
  return {6, static_cast<std::uint16_t>(0x100U | character)};
}

/// Sends the buffer, even if empty, `ms` ms after the previous packet.
constexpr Request latency(std::uint8_t ms) noexcept { return {9, ms}; }

class Setup {
 public:
  explicit Setup(std::span<const Request> requests) noexcept : left_(requests) {}

  /// Returns true if all requests were sent.
  bool step(Pipe& pipe) noexcept {
    while (!left_.empty() && pipe.request(left_.front())) left_ = left_.subspan(1);
    return left_.empty() && pipe.settled();
  }

 private:
  std::span<const Request> left_;
};

}  // namespace tendon::usb::ftdi
