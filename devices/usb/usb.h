// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "devices/usb/pipe.h"

/// USB devices, using libusb. Without libusb, all functions throw std::runtime_error.
namespace tendon::usb {

struct PluggedIn {
  Id id;
  std::string port;       ///< "1-2.3" is port 3 of the hub at port 2 of bus 1
  std::string node;       ///< "/dev/bus/usb/001/007"
  bool has_node = true;   ///< may be false in a container
  bool may_open = false;  ///< with read and write permission
};

/// Throws std::runtime_error if USB is not available.
std::vector<PluggedIn> plugged_in();

struct PipeConfig {
  std::vector<Id> ids{};
  std::string port{};      ///< if empty, the first available device is used
  std::uint8_t in = 0x81;  ///< interface 0
  std::uint8_t out = 0x02;
  enum class Transfers : std::uint8_t { kBulk, kInterrupt };
  Transfers transfers = Transfers::kBulk;

  /// Called first by the pipe's thread, for requesting a realtime priority higher than that of the user's thread.
  std::function<void()> on_start{};
  /// Called by the pipe's thread if the device cannot be opened for a different reason than before.
  std::function<void(const std::string&)> tell{};
  /// Called by the pipe's thread with the descriptor after claiming the interface, and with -1 before releasing it.
  /// Used for the guardian.
  std::function<void(int)> opened{};
  /// Used instead of `ids` if set. Called by the pipe's thread five times per second; must return an open usbfs
  /// descriptor, which the caller owns, or -1.
  std::function<int()> node{};
};

/// Opens the device when it is plugged in, even repeatedly. Throws std::runtime_error if USB is not available.
///
/// A separate thread calls libusb, and wakes up for each transfer. It queues 4 IN transfers and up to 4 OUT transfers,
/// with a timeout of 100 ms. The threads share two rings and an eventfd, without locks or memory allocation.
///
/// The destructor sends all accepted packets, waits for these transfers, cancels all others, and closes the device.
std::unique_ptr<Pipe> open_pipe(const PipeConfig& config);

}  // namespace tendon::usb
