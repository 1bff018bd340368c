// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "devices/usb/pipe.h"

/// Access to real USB devices through libusb. In a build without libusb, these functions throw a std::runtime_error
/// that says so.
namespace tendon::usb {

struct PluggedIn {
  Id id;
  std::string port;       ///< the kernel's name: "1-2.3" is port 3 of the hub at port 2 of bus 1
  std::string node;       ///< "/dev/bus/usb/001/007"
  bool has_node = true;   ///< false in a container without the node, where nothing can be opened
  bool may_open = false;  ///< this process has read and write permission for the node
};

/// Lists all connected devices. Throws std::runtime_error if this machine has no USB or this build has no libusb.
std::vector<PluggedIn> plugged_in();

struct PipeConfig {
  std::vector<Id> ids{};   ///< any of these ids matches
  std::string port{};      ///< see `PluggedIn`; empty: the first matching device that is free
  std::uint8_t in = 0x81;  ///< endpoints of interface 0
  std::uint8_t out = 0x02;
  enum class Transfers : std::uint8_t { kBulk, kInterrupt };
  Transfers transfers = Transfers::kBulk;  ///< for both endpoints

  /// Called first by the thread of the pipe. It should request a realtime priority above that of the thread that uses
  /// the pipe.
  std::function<void()> on_start{};
  /// Called by that thread with a sentence each time there is a new reason for which no device is open.
  std::function<void(const std::string&)> tell{};
  /// Called by that thread with the descriptor of the node after its interface was claimed, and with -1 before the
  /// interface is released. The server passes it on to the guardian.
  std::function<void(int)> opened{};
  /// If set, replaces enumeration, and `ids` is ignored. Returns an open usbfs descriptor that the caller owns, or -1
  /// if there is none yet. Called by that thread five times a second.
  std::function<int()> node{};
};

/// Returns a pipe that opens the device as soon as it is plugged in, also after it was unplugged. Throws
/// std::runtime_error like `plugged_in`.
///
/// A separate thread makes all libusb calls and wakes up for each transfer. 4 IN transfers are always queued, 4 OUT
/// transfers are used in turn, and each one fails after 100 ms. That thread and the user of the pipe share two rings
/// and a wake-up (one `write` to an eventfd), without locks or heap.
///
/// The destructor sends all packets that were accepted, waits until the device has received them or the transfers have
/// failed, cancels the other transfers, waits for them, and closes the device.
std::unique_ptr<Pipe> open_pipe(const PipeConfig& config);

}  // namespace tendon::usb
