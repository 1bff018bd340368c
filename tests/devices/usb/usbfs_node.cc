// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/usbfs_node.h"

#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstring>

namespace tendon {
namespace {

constexpr unsigned kOut = 0x02;

constinit std::atomic<UsbfsNode*> the_node{nullptr};

int refuse(int error) {
  errno = error;
  return -1;
}

/// A guardian can only use the inherited node. Its data is sent to the master end with the endpoint and the size.
int bulk_through(int file, const usbdevfs_bulktransfer& transfer) {
  std::array<std::uint8_t, 66> frame{};
  if (transfer.len > frame.size() - 2) return refuse(EINVAL);
  frame[0] = static_cast<std::uint8_t>(transfer.ep);
  frame[1] = static_cast<std::uint8_t>(transfer.len);
  std::memcpy(frame.data() + 2, transfer.data, transfer.len);
  tcflow(file, TCOON);  // NOLINT(concurrency-mt-unsafe): nobody else writes to it
  const ssize_t written = ::write(file, frame.data(), transfer.len + 2);
  if (written == static_cast<ssize_t>(transfer.len) + 2) return static_cast<int>(transfer.len);
  return errno == EIO ? refuse(ENODEV) : -1;  // EIO means that the master end was closed
}

}  // namespace

UsbfsNode::UsbfsNode() { the_node.store(this); }

UsbfsNode::~UsbfsNode() {
  the_node.store(nullptr);
  if (file_ >= 0) ::close(file_);
}

UsbfsNode* UsbfsNode::of(int file) {
  UsbfsNode* const node = the_node.load();
  return node != nullptr && file >= 0 && node->file_ == file ? node : nullptr;
}

UsbfsNode::Counts UsbfsNode::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

void UsbfsNode::set_file(int slave) {
  if (file_ >= 0) ::close(file_);
  file_ = slave;
  position_ = 0;
  done_.clear();
  gate(false);
}

// tcflow() is not thread-safe if several threads write to the terminal, but nothing else is written to it while this
// process has the node.
// NOLINTNEXTLINE(concurrency-mt-unsafe)
void UsbfsNode::gate(bool open) const { tcflow(file_, open ? TCOON : TCOOFF); }

void UsbfsNode::finish(usbdevfs_urb* urb, int status, int size) {
  urb->status = status;
  urb->actual_length = size;
  done_.push_back(urb);
  gate(true);
}

void UsbfsNode::finish_all() {
  for (auto* const list : {&waiting_, &hanging_}) {
    for (usbdevfs_urb* urb : *list) finish(urb, -ESHUTDOWN, 0);
    list->clear();
  }
  gate(true);
}

void UsbfsNode::bring(std::span<const std::uint8_t> packet) {
  usbdevfs_urb* const urb = waiting_.front();
  waiting_.pop_front();
  const auto size = std::min<std::size_t>(packet.size(), static_cast<std::size_t>(urb->buffer_length));
  std::memcpy(urb->buffer, packet.data(), size);
  ++counts_.in;
  finish(urb, size < packet.size() ? -EOVERFLOW : 0, static_cast<int>(size));
}

int UsbfsNode::submit(usbdevfs_urb* urb) {
  const auto* const bytes = static_cast<const std::uint8_t*>(urb->buffer);
  const auto size = static_cast<std::size_t>(urb->buffer_length);
  ++counts_.open_transfers;
  if (urb->type == USBDEVFS_URB_TYPE_INTERRUPT) ++counts_.interrupt;
  if (urb->type == USBDEVFS_URB_TYPE_BULK) ++counts_.bulk;
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
    const auto value = static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8);
    finish(urb, bytes[0] == 0x40 && request(bytes[1], value) ? 0 : -EPIPE, 0);
  } else if (urb->endpoint == kOut) {
    const Taken taken = write({bytes, size});
    if (taken == Taken::kHangs) {
      hanging_.push_back(urb);
      return 0;
    }
    ++counts_.out;
    finish(urb, taken == Taken::kYes ? 0 : -EPIPE, taken == Taken::kYes ? urb->buffer_length : 0);
  } else {
    waiting_.push_back(urb);
    counts_.most_in = std::max(counts_.most_in, static_cast<int>(waiting_.size()));
    awaited();
  }
  return 0;
}

int UsbfsNode::discard(const void* urb) {
  for (auto* const list : {&waiting_, &hanging_}) {
    const auto found = std::ranges::find(*list, urb);
    if (found == list->end()) continue;
    finish(*found, -ENOENT, 0);
    list->erase(found);
    return 0;
  }
  return refuse(EINVAL);
}

int UsbfsNode::fetch(void** urb) {
  if (done_.empty()) look();
  if (done_.empty()) {
    ++counts_.fetched_nothing;
    if (!gone()) gate(false);
    look();  // data from before the gate was closed
  }
  if (done_.empty()) return refuse(gone() ? ENODEV : EAGAIN);
  *urb = done_.front();
  done_.pop_front();
  --counts_.open_transfers;
  return 0;
}

int UsbfsNode::control(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  if (gone() && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_DISCARDURB) return refuse(ENODEV);
  switch (request) {
    case USBDEVFS_GET_CAPABILITIES:
      *static_cast<std::uint32_t*>(argument) = USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION |
                                               USBDEVFS_CAP_NO_PACKET_SIZE_LIM | USBDEVFS_CAP_BULK_SCATTER_GATHER |
                                               USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
      return 0;
    case USBDEVFS_CONNECTINFO:
      *static_cast<usbdevfs_connectinfo*>(argument) = {.devnum = 7, .slow = 0};
      return 0;
    case USBDEVFS_GET_SPEED:
      return 2;  // full speed
    case USBDEVFS_CONTROL: {
      auto& transfer = *static_cast<usbdevfs_ctrltransfer*>(argument);
      if (transfer.bRequest != 8) return refuse(EPIPE);  // libusb sends only GET_CONFIGURATION
      *static_cast<std::uint8_t*>(transfer.data) = 1;
      return 1;
    }
    case USBDEVFS_CLAIMINTERFACE:
    case USBDEVFS_DISCONNECT_CLAIM:
      counts_.claimed = true;
      return 0;
    case USBDEVFS_RELEASEINTERFACE:
      counts_.claimed = false;
      return 0;
    case USBDEVFS_GETDRIVER:
    case USBDEVFS_IOCTL:  // no kernel driver is bound
      return refuse(ENODATA);
    case USBDEVFS_SUBMITURB:
      return submit(static_cast<usbdevfs_urb*>(argument));
    case USBDEVFS_BULK: {
      const auto& transfer = *static_cast<usbdevfs_bulktransfer*>(argument);
      const std::span bytes(static_cast<const std::uint8_t*>(transfer.data), transfer.len);
      if (transfer.ep != kOut || write(bytes) != Taken::kYes) return refuse(EPIPE);
      return static_cast<int>(transfer.len);
    }
    case USBDEVFS_DISCARDURB:
      return discard(argument);
    case USBDEVFS_REAPURBNDELAY:
      return fetch(static_cast<void**>(argument));
    default:
      return refuse(ENOTTY);
  }
}

ssize_t UsbfsNode::read(void* to, std::size_t size) {
  const std::lock_guard lock(mutex_);
  const auto left = descriptors().subspan(static_cast<std::size_t>(position_));
  const std::size_t count = std::min(size, left.size());
  std::memcpy(to, left.data(), count);
  position_ += static_cast<off_t>(count);
  return static_cast<ssize_t>(count);
}

off_t UsbfsNode::seek(off_t to) {
  const std::lock_guard lock(mutex_);
  return position_ = std::clamp<off_t>(to, 0, static_cast<off_t>(descriptors().size()));
}

}  // namespace tendon

// libusb uses these functions instead of those of the C library, because they are exported or preloaded.
extern "C" {

int ioctl(int file, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  auto* const node = tendon::UsbfsNode::of(file);
  constexpr unsigned long kLetter = 'U';
  if (node != nullptr && ((request >> 8) & 0xFF) == kLetter) return node->control(request, argument);
  if (request == USBDEVFS_BULK) return tendon::bulk_through(file, *static_cast<usbdevfs_bulktransfer*>(argument));
  return static_cast<int>(syscall(SYS_ioctl, file, request, argument));
}

ssize_t read(int file, void* to, std::size_t size) {
  if (auto* const node = tendon::UsbfsNode::of(file)) return node->read(to, size);
  return syscall(SYS_read, file, to, size);
}

off_t lseek(int file, off_t to, int from) noexcept {
  if (auto* const node = tendon::UsbfsNode::of(file)) return node->seek(to);
  return syscall(SYS_lseek, file, to, from);
}
}
