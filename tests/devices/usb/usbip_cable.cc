// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/usbip_cable.h"

#include <arpa/inet.h>
#include <fcntl.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <stdexcept>
#include <string>
#include <system_error>

namespace tendon {
namespace {

using namespace std::chrono_literals;

// Big-endian, 48 bytes: five common fields, five fields of the command, and the setup packet of a control transfer.
constexpr std::uint32_t kSubmit = 1;
constexpr std::uint32_t kUnlink = 2;
constexpr std::uint32_t kSubmitted = 3;
constexpr std::uint32_t kUnlinked = 4;

/// Bus 1, device 1 on the remote side. The kernel requires these numbers but ignores them.
constexpr std::uint32_t kFarId = 0x10001;
constexpr int kFullSpeed = 2;
constexpr int kPorts = 8;

// Standard requests of the kernel (USB 2.0, 9.4; HID 1.11, 7).
constexpr std::uint8_t kVendorRequest = 0x40;
constexpr std::uint8_t kFromDevice = 0x80;
constexpr std::uint8_t kFromInterface = 0x81;
constexpr std::uint8_t kGetStatus = 0;
constexpr std::uint8_t kGetDescriptor = 6;
constexpr std::uint8_t kDescribeDevice = 1;
constexpr std::uint8_t kDescribeConfiguration = 2;
constexpr std::uint8_t kDescribeReports = 0x22;

struct UsbipHeader {
  std::array<std::uint32_t, 10> numbers{};
  std::array<std::uint8_t, 8> setup{};
};
static_assert(sizeof(UsbipHeader) == 48);

bool receive(int end, void* to, std::size_t size) {
  return recv(end, to, size, MSG_WAITALL) == static_cast<ssize_t>(size);
}

/// The kernel rejects ports that are in use. A port becomes free some time after the device is detached.
bool attach(int socket) {
  for (int tries = 0; tries < 500; ++tries) {
    for (int port = 0; port < kPorts; ++port) {
      const int file = open("/sys/devices/platform/vhci_hcd.0/attach", O_WRONLY | O_CLOEXEC);
      if (file < 0) return false;
      const std::string order = std::to_string(port) + ' ' + std::to_string(socket) + ' ' + std::to_string(kFarId) +
                                ' ' + std::to_string(kFullSpeed);
      const bool taken = ::write(file, order.data(), order.size()) == static_cast<ssize_t>(order.size());
      ::close(file);
      if (taken) return true;
    }
    std::this_thread::sleep_for(10ms);
  }
  return false;
}

}  // namespace

struct UsbIpCable::Order {
  std::uint32_t command = 0;
  std::uint32_t number = 0;
  bool in = false;
  std::uint32_t endpoint = 0;
  std::uint32_t unlinked = 0;  ///< number of the transfer to cancel
  std::size_t size = 0;
  std::array<std::uint8_t, 8> setup{};
};

UsbIpCable::UsbIpCable(UsbModel& model, Watch watch) : model_(model), watch_(std::move(watch)) { plug(); }

UsbIpCable::~UsbIpCable() {
  if (end_ >= 0) unplug();
}

void UsbIpCable::plug() {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) {
    throw std::system_error(errno, std::generic_category(), "no socket for USB/IP");
  }
  end_ = ends[0];
  with([this] { model_.plug(); });
  stop_ = false;
  thread_ = std::thread([this] { run(); });
  const bool attached = attach(ends[1]);
  ::close(ends[1]);
  if (!attached) {
    unplug();
    throw std::runtime_error("the kernel takes no USB/IP device: is vhci_hcd loaded, and this process root's?");
  }
}

void UsbIpCable::unplug() {
  shutdown(end_, SHUT_RDWR);
  stop_ = true;
  thread_.join();
  ::close(end_);
  end_ = -1;
  const std::lock_guard lock(mutex_);
  waiting_.clear();
  model_.unplug();
}

void UsbIpCable::run() {
  while (!stop_) {
    Duration most = 5ms;  // the model may have changed
    {
      const std::lock_guard lock(mutex_);
      let_in(real_now());
      if (!waiting_.empty()) most = std::clamp<Duration>(model_.next_in() - real_now(), Duration::zero(), most);
    }
    const timespec wait{.tv_sec = 0, .tv_nsec = most.count()};
    pollfd heard{.fd = end_, .events = POLLIN, .revents = 0};
    if (ppoll(&heard, 1, &wait, nullptr) > 0 && !take_order()) return;
  }
}

bool UsbIpCable::take_order() {
  UsbipHeader header;
  if (!receive(end_, &header, sizeof header)) return false;
  std::ranges::transform(header.numbers, header.numbers.begin(), ntohl);
  const auto& numbers = header.numbers;
  const Order order{.command = numbers[0],
                    .number = numbers[1],
                    .in = numbers[3] == 1,
                    .endpoint = numbers[4],
                    .unlinked = numbers[5],
                    .size = numbers[6],
                    .setup = header.setup};
  std::vector<std::uint8_t> bytes(order.command == kSubmit && !order.in ? order.size : 0);
  if (!bytes.empty() && !receive(end_, bytes.data(), bytes.size())) return false;
  const std::lock_guard lock(mutex_);
  obey(order, bytes);
  return true;
}

void UsbIpCable::obey(const Order& order, std::span<const std::uint8_t> bytes) {
  if (order.command == kUnlink) {
    answer_unlink(order.number, order.unlinked);
  } else if (order.endpoint == 0) {
    obey_control(order);
  } else if (order.in) {
    waiting_.push_back({order.number, order.size});
  } else {
    const LocalTime at = real_now();
    const bool taken = model_.write(at, bytes);
    if (taken && watch_) watch_(at);
    answer(order.number, taken ? 0 : -EPIPE, taken ? bytes.size() : 0);
  }
}

void UsbIpCable::obey_control(const Order& order) {
  const auto [type, request, low, high, index_low, index_high, size_low, size_high] = order.setup;
  const auto all = model_.descriptors();
  const auto give = [&](std::span<const std::uint8_t> bytes) {
    const auto given = bytes.first(std::min(bytes.size(), order.size));
    answer(order.number, bytes.empty() ? -EPIPE : 0, given.size(), given);
  };
  if (type == kVendorRequest) {
    const bool taken = model_.request(real_now(), request, static_cast<std::uint16_t>(low | high << 8));
    answer(order.number, taken ? 0 : -EPIPE, 0);
  } else if (type == kFromDevice && request == kGetDescriptor && high == kDescribeDevice) {
    give(all.first(kDeviceDescriptor));
  } else if (type == kFromDevice && request == kGetDescriptor && high == kDescribeConfiguration) {
    give(all.subspan(kDeviceDescriptor));
  } else if (type == kFromInterface && request == kGetDescriptor && high == kDescribeReports) {
    give(model_.report_descriptor());
  } else if (type == kFromDevice && request == kGetStatus) {
    give(std::array<std::uint8_t, 2>{1, 0});  // self-powered
  } else if (!order.in && type <= 1) {
    answer(order.number, 0, 0);  // configuration, alternate setting, features
  } else {
    answer(order.number, -EPIPE, 0);
  }
}

void UsbIpCable::let_in(LocalTime at) {
  while (!waiting_.empty() && model_.next_in() <= at) {
    const Waiting next = waiting_.front();
    waiting_.pop_front();
    const auto packet = model_.take_in(at);
    const auto brought = std::span(packet).first(std::min(packet.size(), next.size));
    answer(next.number, packet.size() > next.size ? -EOVERFLOW : 0, brought.size(), brought);
  }
}

void UsbIpCable::answer(std::uint32_t number, int status, std::size_t size, std::span<const std::uint8_t> bytes) {
  UsbipHeader header;
  header.numbers = {kSubmitted, number, 0, 0, 0, static_cast<std::uint32_t>(status), static_cast<std::uint32_t>(size)};
  std::ranges::transform(header.numbers, header.numbers.begin(), htonl);
  std::vector<std::uint8_t> message(sizeof header + bytes.size());
  std::memcpy(message.data(), &header, sizeof header);
  std::ranges::copy(bytes, message.begin() + sizeof header);
  send(message);
}

void UsbIpCable::answer_unlink(std::uint32_t number, std::uint32_t unlinked) {
  const auto erased = std::erase_if(waiting_, [&](const Waiting& one) { return one.number == unlinked; });
  UsbipHeader header;
  header.numbers = {kUnlinked, number, 0, 0, 0, static_cast<std::uint32_t>(erased > 0 ? -ECONNRESET : 0)};
  std::ranges::transform(header.numbers, header.numbers.begin(), htonl);
  std::array<std::uint8_t, sizeof header> message{};
  std::memcpy(message.data(), &header, sizeof header);
  send(message);
}

void UsbIpCable::send(std::span<const std::uint8_t> bytes) {
  [[maybe_unused]] const ssize_t sent = ::send(end_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
}

}  // namespace tendon
