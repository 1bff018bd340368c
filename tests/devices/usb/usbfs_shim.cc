// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/usbfs_shim.h"

#include <pty.h>
#include <sys/syscall.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdarg>
#include <cstring>
#include <span>

namespace tendon {
namespace {

/// One at a time: a test has one device.
std::atomic<UsbfsShim*> the_shim{nullptr};

LocalTime now() {
  return LocalTime(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

int refuse(int error) {
  errno = error;
  return -1;
}

}  // namespace

UsbfsShim::UsbfsShim(const FakeFalcon::Options& options) : falcon_(options) {
  make_node();
  the_shim.store(this);
  thread_ = std::thread([this] { run(); });
}

UsbfsShim::~UsbfsShim() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
  the_shim.store(nullptr);
  if (slave_ >= 0) ::close(slave_);
  if (master_ >= 0) ::close(master_);
}

void UsbfsShim::make_node() {
  int slave = -1;
  if (openpty(&master_, &slave, nullptr, nullptr, nullptr) != 0) std::abort();
  termios raw{};
  tcgetattr(slave, &raw);
  cfmakeraw(&raw);
  tcsetattr(slave, TCSANOW, &raw);
  slave_ = slave;
  position_ = 0;
  gate(false);
}

// Unsafe for threads that write to one terminal: nothing is written to this one.
// NOLINTNEXTLINE(concurrency-mt-unsafe)
void UsbfsShim::gate(bool open) const { tcflow(slave_, open ? TCOON : TCOOFF); }

int UsbfsShim::node() const {
  const std::lock_guard lock(mutex_);
  return falcon_.plugged() ? slave_.load() : -1;
}

void UsbfsShim::unplug() {
  const std::lock_guard lock(mutex_);
  falcon_.unplug();
  for (auto* const list : {&waiting_, &hanging_}) {
    for (usbdevfs_urb* urb : *list) finish(urb, -ESHUTDOWN, 0);
    list->clear();
  }
  gate(true);
  ::close(master_);
  master_ = -1;
}

void UsbfsShim::plug() {
  const std::lock_guard lock(mutex_);
  if (slave_ >= 0) ::close(slave_);
  make_node();
  done_.clear();
  falcon_.plug();
}

void UsbfsShim::set_trouble(Trouble trouble) {
  const std::lock_guard lock(mutex_);
  trouble_ = trouble;
  changed_.notify_all();
}

UsbfsShim::Counts UsbfsShim::counts() const {
  const std::lock_guard lock(mutex_);
  return counts_;
}

UsbfsShim* UsbfsShim::of(int node) {
  UsbfsShim* const shim = the_shim.load();
  return shim != nullptr && node >= 0 && shim->slave_ == node ? shim : nullptr;
}

void UsbfsShim::run() {
  std::unique_lock lock(mutex_);
  while (!stop_) {
    const LocalTime at = now();
    let_in(at);
    if (waiting_.empty() || trouble_ == Trouble::kMute) {
      changed_.wait(lock);
    } else {
      changed_.wait_for(lock, std::max<Duration>(falcon_.next_in() - at, std::chrono::microseconds(10)));
    }
  }
}

void UsbfsShim::let_in(LocalTime at) {
  while (!waiting_.empty() && falcon_.plugged()) {
    if (trouble_ == Trouble::kOverflow || trouble_ == Trouble::kStall) {
      finish(waiting_.front(), trouble_ == Trouble::kStall ? -EPIPE : -EOVERFLOW, 0);
      waiting_.pop_front();
      continue;
    }
    if (trouble_ == Trouble::kMute || falcon_.next_in() > at) return;
    usbdevfs_urb* const urb = waiting_.front();
    waiting_.pop_front();
    const auto packet = falcon_.take_in(at);
    const auto size = std::min<std::size_t>(packet.size(), static_cast<std::size_t>(urb->buffer_length));
    std::memcpy(urb->buffer, packet.data(), size);
    ++counts_.in;
    finish(urb, size < packet.size() ? -EOVERFLOW : 0, static_cast<int>(size));
  }
}

void UsbfsShim::finish(usbdevfs_urb* urb, int status, int size) {
  urb->status = status;
  urb->actual_length = size;
  done_.push_back(urb);
  gate(true);
}

int UsbfsShim::submit(usbdevfs_urb* urb) {
  const auto* const bytes = static_cast<const std::uint8_t*>(urb->buffer);
  const auto size = static_cast<std::size_t>(urb->buffer_length);
  ++counts_.open_transfers;
  if (urb->type == USBDEVFS_URB_TYPE_INTERRUPT) ++counts_.interrupt;
  if (urb->type == USBDEVFS_URB_TYPE_BULK) ++counts_.bulk;
  if (urb->type == USBDEVFS_URB_TYPE_CONTROL) {
    const auto value = static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8);
    const bool taken = bytes[0] == 0x40 && falcon_.request(now(), bytes[1], value);
    finish(urb, taken ? 0 : -EPIPE, 0);
  } else if (urb->endpoint == 0x02) {
    if (trouble_ == Trouble::kHang) {
      hanging_.push_back(urb);
      return 0;
    }
    const bool taken = falcon_.write(now(), {bytes, size});
    ++counts_.out;
    finish(urb, taken ? 0 : -EPIPE, taken ? urb->buffer_length : 0);
    changed_.notify_all();
  } else {
    waiting_.push_back(urb);
    counts_.most_in = std::max(counts_.most_in, static_cast<int>(waiting_.size()));
    changed_.notify_all();
  }
  return 0;
}

int UsbfsShim::control(unsigned long request, void* argument) {
  const std::lock_guard lock(mutex_);
  const bool gone = !falcon_.plugged();
  if (gone && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_DISCARDURB) return refuse(ENODEV);
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
      return 2;  // full
    case USBDEVFS_CONTROL: {
      auto& transfer = *static_cast<usbdevfs_ctrltransfer*>(argument);
      if (transfer.bRequest != 8) return refuse(EPIPE);  // GET_CONFIGURATION is all that libusb asks for
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
    case USBDEVFS_IOCTL:  // is a driver of the kernel bound? None is
      return refuse(ENODATA);
    case USBDEVFS_SUBMITURB:
      return submit(static_cast<usbdevfs_urb*>(argument));
    case USBDEVFS_BULK: {
      const auto& transfer = *static_cast<usbdevfs_bulktransfer*>(argument);
      const std::span bytes(static_cast<const std::uint8_t*>(transfer.data), transfer.len);
      if (transfer.ep != 0x02 || !falcon_.write(now(), bytes)) return refuse(EPIPE);
      return static_cast<int>(transfer.len);
    }
    case USBDEVFS_DISCARDURB:
      for (auto* const list : {&waiting_, &hanging_}) {
        const auto found = std::ranges::find(*list, argument);
        if (found == list->end()) continue;
        finish(*found, -ENOENT, 0);
        list->erase(found);
        return 0;
      }
      return refuse(EINVAL);
    case USBDEVFS_REAPURBNDELAY:
      if (done_.empty()) {
        ++counts_.fetched_nothing;
        if (!gone) gate(false);
        return refuse(gone ? ENODEV : EAGAIN);
      }
      *static_cast<void**>(argument) = done_.front();
      done_.pop_front();
      --counts_.open_transfers;
      return 0;
    default:
      return refuse(ENOTTY);
  }
}

ssize_t UsbfsShim::read(void* to, std::size_t size) {
  const std::lock_guard lock(mutex_);
  const auto left = falcon_.descriptors().subspan(static_cast<std::size_t>(position_));
  const std::size_t count = std::min(size, left.size());
  std::memcpy(to, left.data(), count);
  position_ += static_cast<off_t>(count);
  return static_cast<ssize_t>(count);
}

off_t UsbfsShim::seek(off_t to) {
  const std::lock_guard lock(mutex_);
  return position_ = std::clamp<off_t>(to, 0, static_cast<off_t>(falcon_.descriptors().size()));
}

}  // namespace tendon

// libusb's calls find these before those of the C library, because the program exports them.
extern "C" {

int ioctl(int file, unsigned long request, ...) noexcept {
  std::va_list arguments;
  va_start(arguments, request);
  void* const argument = va_arg(arguments, void*);
  va_end(arguments);
  auto* const shim = tendon::UsbfsShim::of(file);
  constexpr unsigned long kLetter = 'U';
  if (shim != nullptr && ((request >> 8) & 0xFF) == kLetter) return shim->control(request, argument);
  return static_cast<int>(syscall(SYS_ioctl, file, request, argument));
}

ssize_t read(int file, void* to, std::size_t size) {
  if (auto* const shim = tendon::UsbfsShim::of(file)) return shim->read(to, size);
  return syscall(SYS_read, file, to, size);
}

off_t lseek(int file, off_t to, int from) noexcept {
  if (auto* const shim = tendon::UsbfsShim::of(file)) return shim->seek(to);
  return syscall(SYS_lseek, file, to, from);
}
}
