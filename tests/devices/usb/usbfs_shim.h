// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/usbdevice_fs.h>
#include <sys/types.h>

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <mutex>
#include <thread>

#include "core/time.h"
#include "tests/devices/falcon/fake_falcon.h"

namespace tendon {

/// A FakeFalcon behind a usbfs node that the real libusb takes for one: the kernel's part of USB, in this process and
/// in real time. usbfs_shim.cc defines ioctl, read and lseek; libusb's calls of them end there when they name the node,
/// and in the kernel when not.
///
/// The node is the slave end of a pseudo-terminal, because poll() has to work on it: its output is stopped while no
/// transfer waits to be fetched (no POLLOUT), and the master end is closed when the device is unplugged (POLLERR), as
/// usbfs does.
///
/// Thread-safe.
class UsbfsShim {
 public:
  explicit UsbfsShim(const FakeFalcon::Options& options);
  ~UsbfsShim();
  UsbfsShim(const UsbfsShim&) = delete;
  UsbfsShim& operator=(const UsbfsShim&) = delete;

  /// The open node; below 0 while nothing is plugged in.
  int node() const;

  void unplug();
  void plug();

  /// Trouble below the device's own: how transfers end.
  enum class Trouble {
    kNone,
    kOverflow,  ///< IN: the device sends more than it was asked for
    kStall,     ///< IN: the endpoint is halted
    kMute,      ///< IN: brings nothing, not even the chip's status
    kHang,      ///< OUT: takes nothing, and says nothing
  };
  void set_trouble(Trouble trouble);

  /// Calls `act(falcon)` while nobody else touches it.
  template <class Act>
  auto with(const Act& act) const {
    const std::lock_guard lock(mutex_);
    return act(falcon_);
  }

  struct Counts {
    std::uint64_t in = 0;               ///< IN transfers that brought something
    std::uint64_t out = 0;              ///< OUT transfers that were taken
    std::uint64_t interrupt = 0;        ///< transfers of interrupt type, of those that were begun,
    std::uint64_t bulk = 0;             ///< and of bulk type
    std::uint64_t fetched_nothing = 0;  ///< times when libusb was woken for nothing
    int open_transfers = 0;             ///< given to us, not fetched back yet
    int most_in = 0;                    ///< IN transfers that waited at one time
    bool claimed = false;
  };
  Counts counts() const;

  // What the three functions call.
  static UsbfsShim* of(int node);
  int control(unsigned long request, void* argument);
  ssize_t read(void* to, std::size_t size);
  off_t seek(off_t to);

 private:
  void run();
  void finish(usbdevfs_urb* urb, int status, int size);
  void let_in(LocalTime now);
  int submit(usbdevfs_urb* urb);
  void gate(bool open) const;
  void make_node();

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  mutable FakeFalcon falcon_;
  Trouble trouble_ = Trouble::kNone;
  int master_ = -1;
  std::atomic<int> slave_{-1};
  off_t position_ = 0;
  std::deque<usbdevfs_urb*> waiting_;  ///< IN
  std::deque<usbdevfs_urb*> hanging_;  ///< OUT
  std::deque<usbdevfs_urb*> done_;
  Counts counts_;
  bool stop_ = false;
  std::thread thread_;
};

}  // namespace tendon
