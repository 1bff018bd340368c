// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "devices/usb/pipe.h"

/// Real USB devices, through libusb. In a build without libusb these functions throw, and the message says so.
namespace tendon::usb {

/// A device that is plugged in.
struct PluggedIn {
  Id id;
  std::string port;       ///< as the kernel names it: "1-2.3" is port 3 of the hub at port 2 of bus 1
  std::string node;       ///< "/dev/bus/usb/001/007"
  bool has_node = true;   ///< false in a container that was not given the node: nothing can be opened
  bool may_open = false;  ///< this process may read and write the node
};

/// All devices that are plugged in. Throws std::runtime_error with a sentence when this machine has no USB, or this
/// build no libusb.
std::vector<PluggedIn> plugged_in();

struct PipeConfig {
  std::vector<Id> ids{};   ///< a device with any of these ids is opened
  std::string port{};      ///< as in `PluggedIn`; empty: the first matching device that is free
  std::uint8_t in = 0x81;  ///< endpoints, of interface 0
  std::uint8_t out = 0x02;
  enum class Transfers : std::uint8_t { kBulk, kInterrupt };
  Transfers transfers = Transfers::kBulk;  ///< of both endpoints

  /// The pipe's own thread calls this first. It is the place to ask for a real-time priority, above that of the thread
  /// that uses the pipe.
  std::function<void()> on_start{};
  /// Called from that thread with a sentence, each time there is a new reason why no device is open.
  std::function<void(const std::string&)> tell{};
  /// Called from that thread with the descriptor of the node once its interface is claimed, and with -1 before the
  /// interface is released. The server forwards this to the guardian.
  std::function<void(int)> opened{};
  /// If set, replaces enumeration (`ids` is ignored): returns an open usbfs descriptor owned by the caller, or -1 if
  /// there is none yet. Called from that thread, five times a second.
  std::function<int()> node{};
};

/// A pipe that opens the device as soon as it is plugged in, and again when it comes back. Throws std::runtime_error
/// like `plugged_in`.
///
/// A separate thread makes all calls to libusb; it wakes for each transfer. 4 IN transfers are always queued, 4 OUT
/// transfers take turns, and each fails after 100 ms. That thread and the user of the pipe share two rings and a
/// wake-up (one `write` to an eventfd): no lock, no heap.
///
/// The destructor sends all packets that were accepted, waits until the device has them or the transfers have failed,
/// cancels and awaits the other transfers, and closes the device.
std::unique_ptr<Pipe> open_pipe(const PipeConfig& config);

}  // namespace tendon::usb
