// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <linux/ioctl.h>
#include <linux/usbdevice_fs.h>
#include <sys/types.h>

#include <atomic>
#include <cstdint>
#include <deque>
#include <mutex>
#include <span>

namespace tendon {

/// A node of usbfs (/dev/bus/usb/…) that the real libusb takes for one: the kernel's part of USB, as far as libusb asks
/// for it. What is at the other end of the cable, a derived class says. usbfs_node.cc defines ioctl, read and lseek;
/// libusb's calls of them end there when they name the node, and in the kernel when not.
///
/// The node is the slave end of a pseudo-terminal, because poll() has to work on it: its output is stopped while no
/// transfer waits to be fetched (no POLLOUT), and the master end is closed when the device is unplugged (POLLERR), as
/// usbfs does.
///
/// One at a time in a process. Thread-safe.
class UsbfsNode {
 public:
  UsbfsNode();
  virtual ~UsbfsNode();
  UsbfsNode(const UsbfsNode&) = delete;
  UsbfsNode& operator=(const UsbfsNode&) = delete;

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
  static UsbfsNode* of(int file);
  int control(unsigned long request, void* argument);
  ssize_t read(void* to, std::size_t size);
  off_t seek(off_t to);

 protected:
  enum class Taken : std::uint8_t { kYes, kRefused, kHangs };

  // The cable. All are called with mutex_ held.
  virtual bool gone() const = 0;
  virtual std::span<const std::uint8_t> descriptors() const = 0;
  virtual bool request(std::uint8_t request, std::uint16_t value) = 0;
  virtual Taken write(std::span<const std::uint8_t> bytes) = 0;
  /// An IN transfer has begun to wait.
  virtual void awaited() = 0;
  /// libusb looks whether a transfer has ended, and none has yet.
  virtual void look() {}

  // For the derived class, with mutex_ held.
  /// The slave end: ours from now on, closed with the node before it.
  void set_file(int slave);
  int file() const { return file_; }
  void finish(usbdevfs_urb* urb, int status, int size);
  /// The oldest waiting IN transfer brings `packet`.
  void bring(std::span<const std::uint8_t> packet);
  /// All that wait end, as at the end of a device.
  void finish_all();
  void gate(bool open) const;

  mutable std::mutex mutex_;
  std::deque<usbdevfs_urb*> waiting_;  ///< IN
  std::deque<usbdevfs_urb*> hanging_;  ///< OUT
  std::deque<usbdevfs_urb*> done_;
  Counts counts_;

 private:
  int submit(usbdevfs_urb* urb);
  int discard(const void* urb);
  int fetch(void** urb);

  std::atomic<int> file_{-1};
  off_t position_ = 0;
};

}  // namespace tendon
