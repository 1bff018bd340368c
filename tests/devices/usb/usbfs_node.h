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

/// A usbfs node (/dev/bus/usb/…) for the real libusb: the part of the kernel that libusb uses, through ioctl, read and
/// lseek in usbfs_node.cc, which pass calls for other files to the kernel. The derived class is the other end of the
/// cable. The node is the slave end of a pseudo-terminal, because poll() must work as in usbfs: no POLLOUT (stopped
/// output) until a transfer can be fetched, and POLLERR (closed master end) when the device is unplugged.
///
/// One per process. Thread-safe.
class UsbfsNode {
 public:
  UsbfsNode();
  virtual ~UsbfsNode();
  UsbfsNode(const UsbfsNode&) = delete;
  UsbfsNode& operator=(const UsbfsNode&) = delete;

  struct Counts {
    std::uint64_t in = 0;               ///< IN transfers with data
    std::uint64_t out = 0;              ///< accepted OUT transfers
    std::uint64_t interrupt = 0;        ///< submitted interrupt transfers
    std::uint64_t bulk = 0;             ///< submitted bulk transfers
    std::uint64_t fetched_nothing = 0;  ///< number of times that libusb was woken without a transfer
    int open_transfers = 0;             ///< submitted and not yet reaped
    int most_in = 0;                    ///< largest number of waiting IN transfers
    bool claimed = false;
  };
  Counts counts() const;

  static UsbfsNode* of(int file);
  int control(unsigned long request, void* argument);
  ssize_t read(void* to, std::size_t size);
  off_t seek(off_t to);

 protected:
  enum class Taken : std::uint8_t { kYes, kRefused, kHangs };

  // Called with mutex_ held.
  virtual bool gone() const = 0;
  virtual std::span<const std::uint8_t> descriptors() const = 0;
  virtual bool request(std::uint8_t request, std::uint16_t value) = 0;
  virtual Taken write(std::span<const std::uint8_t> bytes) = 0;
  virtual void awaited() = 0;
  /// Called when libusb has called poll, but no transfer has ended.
  virtual void look() {}

  // Must be called with mutex_ held. This takes ownership of the slave end and closes the previous one.
  void set_file(int slave);
  int file() const { return file_; }
  void finish(usbdevfs_urb* urb, int status, int size);
  void bring(std::span<const std::uint8_t> packet);
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
