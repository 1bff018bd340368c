// SPDX-License-Identifier: Apache-2.0
#include "devices/safety/guardian.h"

#include <fcntl.h>
#include <linux/usbdevice_fs.h>
#include <poll.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/timerfd.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <future>
#include <new>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>

namespace tendon {

namespace {

constexpr int kTries = 5;
constexpr unsigned kTryTime_ms = 10;

/// Sent by the server with a file descriptor. If there is no descriptor, the device is unregistered.
struct Order {
  std::size_t device;
  ZeroPacket zero;
};
static_assert(std::is_trivially_copyable_v<Order>);

bool send_order(int socket, const Order& order, int fd) noexcept {
  iovec part{.iov_base = const_cast<Order*>(&order), .iov_len = sizeof(order)};  // NOLINT: sendmsg only reads it
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  if (fd >= 0) {
    message.msg_control = control.data();
    message.msg_controllen = control.size();
    cmsghdr* header = CMSG_FIRSTHDR(&message);
    header->cmsg_level = SOL_SOCKET;
    header->cmsg_type = SCM_RIGHTS;
    header->cmsg_len = CMSG_LEN(sizeof(fd));
    std::memcpy(CMSG_DATA(header), &fd, sizeof(fd));
  }
  return sendmsg(socket, &message, MSG_NOSIGNAL) == static_cast<ssize_t>(sizeof(order));
}

constexpr Duration kLook = std::chrono::milliseconds(2);
constexpr std::uint64_t kStillLooks = Heartbeat::kStill / kLook;

struct Charge {
  int fd = -1;
  std::optional<ZeroPacket> zero;
  Heartbeat::Beat beat{};
  std::uint64_t looks = 0;  ///< since `beat` has changed
};

/// Waits for the next order, unless `flags` has MSG_DONTWAIT. Returns false if the server has exited.
bool take_order(int socket, std::array<Charge, Guardian::kDevices>& charges, int flags = 0) noexcept {
  alignas(Order) std::array<std::byte, sizeof(Order)> bytes{};
  iovec part{.iov_base = bytes.data(), .iov_len = bytes.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  ssize_t size = 0;
  do {
    size = recvmsg(socket, &message, MSG_CMSG_CLOEXEC | flags);
  } while (size < 0 && errno == EINTR);
  if (size != static_cast<ssize_t>(bytes.size())) return false;

  int fd = -1;
  if (const cmsghdr* header = CMSG_FIRSTHDR(&message); header != nullptr && header->cmsg_type == SCM_RIGHTS) {
    std::memcpy(&fd, CMSG_DATA(header), sizeof(fd));
  }
  const auto* order = reinterpret_cast<const Order*>(bytes.data());
  Charge& charge = charges[order->device];
  if (charge.fd >= 0) close(charge.fd);
  charge = {.fd = fd, .zero = order->zero};
  return true;
}

void end_forces(const std::array<Charge, Guardian::kDevices>& charges) noexcept {
  for (const Charge& charge : charges) {
    if (charge.fd >= 0) charge.zero->send(charge.fd);
  }
}

/// Sends the zero packet to devices whose heartbeat has stopped. `looks` counts timer ticks since the last call.
void watch_hearts(const Heartbeat* hearts, std::array<Charge, Guardian::kDevices>& charges,
                  std::uint64_t looks) noexcept {
  for (std::size_t i = 0; i < charges.size(); ++i) {
    Charge& charge = charges[i];
    if (charge.fd < 0) continue;
    const Heartbeat::Beat beat = hearts[i].last();
    if (beat != std::exchange(charge.beat, beat)) {
      charge.looks = 0;
      continue;
    }
    const std::uint64_t before = std::exchange(charge.looks, charge.looks + looks);
    const auto passes = [&](std::uint64_t limit) { return before < limit && charge.looks >= limit; };
    if (beat.holds_force && (passes(kStillLooks) || passes(2 * kStillLooks))) charge.zero->send(charge.fd);
  }
}

void set_timer(int timer, const std::array<Charge, Guardian::kDevices>& charges) noexcept {
  const bool any = std::ranges::any_of(charges, [](const Charge& charge) { return charge.fd >= 0; });
  const timespec period{.tv_sec = 0, .tv_nsec = any ? kLook.count() : 0};
  const itimerspec times{.it_interval = period, .it_value = period};
  timerfd_settime(timer, 0, &times, nullptr);
}

/// Blocks all signals of the calling thread, and of all threads and processes that it creates in the meantime.
class NoSignals {
 public:
  NoSignals() noexcept {
    sigset_t all;
    sigfillset(&all);
    pthread_sigmask(SIG_SETMASK, &all, &before_);
  }
  ~NoSignals() { pthread_sigmask(SIG_SETMASK, &before_, nullptr); }
  NoSignals(const NoSignals&) = delete;
  NoSignals& operator=(const NoSignals&) = delete;

 private:
  sigset_t before_;
};

constexpr int kParentDied = SIGUSR1;  ///< sent by the kernel if the parent thread dies
constexpr char kStandsGuard = 'g';    ///< sent when the guardian is sure to receive that signal

// All signals must be blocked.
[[noreturn]] void stand_guard(int socket, const Heartbeat* hearts) noexcept {
  setsid();
  prctl(PR_SET_PDEATHSIG, kParentDied);
  prctl(PR_SET_NAME, "tendon-guardian", 0UL, 0UL, 0UL);
  // Readers of the server's output must not have to wait for the guardian, and it must not keep other files open.
  if (const int null = open("/dev/null", O_RDWR | O_CLOEXEC); null >= 0) {
    for (const int standard : {0, 1, 2}) dup2(null, standard);
  }
  if (socket > 3) close_range(3, static_cast<unsigned>(socket) - 1, 0);
  close_range(static_cast<unsigned>(socket) + 1, ~0U, 0);

  sigset_t death;
  sigemptyset(&death);
  sigaddset(&death, kParentDied);
  pollfd order{.fd = socket, .events = POLLIN, .revents = 0};
  pollfd parent{.fd = signalfd(-1, &death, SFD_CLOEXEC), .events = POLLIN, .revents = 0};
  pollfd look{.fd = timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC), .events = POLLIN, .revents = 0};
  std::array<Charge, Guardian::kDevices> charges;
  bool server_lives = send(socket, &kStandsGuard, 1, MSG_NOSIGNAL) == 1;
  while (server_lives) {
    std::array<pollfd, 3> told = {order, parent, look};
    poll(told.data(), told.size(), -1);
    if (signalfd_siginfo info{}; told[1].revents != 0 && read(parent.fd, &info, sizeof info) > 0) {
      while (take_order(socket, charges, MSG_DONTWAIT)) {
      }
      // The packets are sent again after all threads have ended, because they may still have sent a last command.
      end_forces(charges);
    } else if (told[0].revents != 0) {
      server_lives = take_order(socket, charges);
      set_timer(look.fd, charges);
    } else if (std::uint64_t looks = 0; told[2].revents != 0 && read(look.fd, &looks, sizeof looks) > 0) {
      watch_hearts(hearts, charges, looks);
    }
  }
  end_forces(charges);
  _exit(0);
}

}  // namespace

ZeroPacket::ZeroPacket(bool usb, std::uint8_t endpoint, std::span<const std::byte> bytes)
    : size_(static_cast<std::uint8_t>(bytes.size())), endpoint_(endpoint), usb_(usb) {
  if (bytes.empty() || bytes.size() > kMost) {
    throw std::invalid_argument("zero packet: expected 1 to 64 bytes, got " + std::to_string(bytes.size()));
  }
  std::copy(bytes.begin(), bytes.end(), bytes_.begin());
}

ZeroPacket ZeroPacket::usb(std::uint8_t endpoint, std::span<const std::byte> bytes) { return {true, endpoint, bytes}; }

ZeroPacket ZeroPacket::written(std::span<const std::byte> bytes) { return {false, 0, bytes}; }

bool ZeroPacket::send_once(int fd) const noexcept {
  std::array<std::byte, kMost> bytes = bytes_;
  if (!usb_) return write(fd, bytes.data(), size_) == size_;
  usbdevfs_bulktransfer transfer{.ep = endpoint_, .len = size_, .timeout = kTryTime_ms, .data = bytes.data()};
  return ioctl(fd, USBDEVFS_BULK, &transfer) == size_;
}

bool ZeroPacket::send(int fd) const noexcept {
  for (int i = 0; i < kTries; ++i) {
    if (send_once(fd)) return true;
    if (errno == ENODEV || errno == EBADF || errno == EPIPE) return false;  // the device was unplugged
    if (errno != ETIMEDOUT) usleep(kTryTime_ms * 1000);
  }
  return false;
}

Guardian::Guardian(const std::function<void()>& on_start) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw std::system_error(errno, std::generic_category(), "cannot create a socket for the guardian process");
  }
  void* const shared =
      mmap(nullptr, kDevices * sizeof(Heartbeat), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (shared == MAP_FAILED) {
    const int error = errno;
    for (const int end : ends) close(end);
    throw std::system_error(error, std::generic_category(), "cannot allocate memory for the guardian process");
  }
  hearts_ = new (shared) Heartbeat[kDevices];
  std::promise<pid_t> forked;
  const auto watch = [this, &on_start, &forked, ends] {
    if (on_start) on_start();
    const pid_t guardian = fork();
    if (guardian == 0) {
      close(ends[0]);
      stand_guard(ends[1], hearts_);
    }
    const int error = errno;
    close(ends[1]);
    // the constructor's variables may be destroyed after this
    forked.set_value(guardian > 0 ? guardian : -error);
    while (guardian > 0) {
      int status = 0;
      if (waitpid(guardian, &status, WUNTRACED | WCONTINUED) < 0 && errno == EINTR) continue;
      stands_ = WIFCONTINUED(status);
      if (!WIFCONTINUED(status) && !WIFSTOPPED(status)) return;
    }
  };
  {
    const NoSignals blocked;
    parent_ = std::thread(watch);
  }
  pid_ = forked.get_future().get();
  char said = 0;
  const bool stands = pid_ > 0 && read(ends[0], &said, 1) == 1;
  if (!stands) {
    close(ends[0]);
    parent_.join();
    munmap(hearts_, kDevices * sizeof(Heartbeat));
    throw std::system_error(pid_ < 0 ? -pid_ : ECHILD, std::generic_category(), "cannot start the guardian process");
  }
  socket_ = ends[0];
}

Guardian::~Guardian() {
  close(socket_);
  parent_.join();
  munmap(hearts_, kDevices * sizeof(Heartbeat));
}

bool Guardian::guard(std::size_t device, int fd, const ZeroPacket& zero) noexcept {
  return device < kDevices && fd >= 0 && send_order(socket_, {device, zero}, fd);
}

bool Guardian::forget(std::size_t device) noexcept {
  static const std::byte kNothing{};
  return device < kDevices && send_order(socket_, {device, ZeroPacket::written({&kNothing, 1})}, -1);
}

}  // namespace tendon
