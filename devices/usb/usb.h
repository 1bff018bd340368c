// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "devices/usb/pipe.h"

/// Real USB devices, by libusb. A build without libusb has these functions too; they say what it lacks.
namespace tendon::usb {

/// Something that is plugged in.
struct PluggedIn {
  Id id;
  std::string port;       ///< as the kernel names it: "1-2.3" is port 3 of the hub at port 2 of bus 1
  std::string node;       ///< "/dev/bus/usb/001/007"
  bool has_node = true;   ///< false in a container that has not been given it: there is nothing to open
  bool may_open = false;  ///< this process may read and write the node
};

/// All that is plugged in. Throws std::runtime_error with a sentence when this machine has no USB, or this build no
/// libusb.
std::vector<PluggedIn> plugged_in();

struct PipeConfig {
  std::vector<Id> ids{};   ///< of these one is opened
  std::string port{};      ///< that of `PluggedIn`; empty: the first of these that nobody uses
  std::uint8_t in = 0x81;  ///< endpoints, of interface 0
  std::uint8_t out = 0x02;
  enum class Transfers : std::uint8_t { kBulk, kInterrupt };
  Transfers transfers = Transfers::kBulk;  ///< of both endpoints

  /// What the pipe's own thread does first: ask for a real-time priority above that of the thread that uses the pipe.
  std::function<void()> on_start{};
  /// Hears, from that thread, a sentence each time when there is a new reason why no device is open.
  std::function<void(const std::string&)> tell{};
  /// Hears, from that thread, the descriptor of the node once its interface is claimed, and -1 before it is given back:
  /// who guards the device is told so.
  std::function<void(int)> opened{};
  /// Instead of looking at the plugs, whose ids then do not count: gives the descriptor of an open usbfs
  /// node, which stays the caller's; below 0 while there is none. Called from that thread, five times a second.
  std::function<int()> node{};
};

/// A pipe that opens the device as soon as it is there, and again when it comes back. Throws std::runtime_error like
/// `plugged_in`.
///
/// A thread of its own does all that libusb is needed for; it wakes for each transfer. 4 IN transfers are always
/// queued, 4 OUT transfers take turns, each fails after 100 ms. What passes between it and the user of the pipe are two
/// rings and a wake-up (one `write` to an eventfd): no lock, no heap.
///
/// Its end sends what was accepted, waits until the device has it or the transfers have failed, cancels the others,
/// waits for each, and closes the device.
std::unique_ptr<Pipe> open_pipe(const PipeConfig& config);

}  // namespace tendon::usb
