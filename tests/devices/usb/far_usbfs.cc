// SPDX-License-Identifier: Apache-2.0
// A library for LD_PRELOAD that is used with programs that use libusb, such as an unmodified tendond. It replaces the
// USB of the kernel by a single Falcon, which FarFalcon simulates in another process. It also replaces device
// enumeration, because there may be neither udev nor sysfs on a test machine. It has no thread: FarFalcon wakes libusb
// by opening the gate of the node after sending.
#include <dlfcn.h>
#include <fcntl.h>
#include <libusb.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdarg>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string_view>
#include <utility>
#include <vector>

#include "tests/devices/falcon/socket_cable.h"
#include "tests/devices/usb/usbfs_node.h"

namespace tendon {
namespace {

/// The name that libusb gives to a wrapped node (bus 0), consistent with USBDEVFS_CONNECTINFO.
constexpr std::string_view kNode = "/dev/bus/usb/000/007";

int connect_to_falcon() {
  const char* const path = std::getenv("TENDON_FAR_FALCON");  // NOLINT(concurrency-mt-unsafe): nobody sets it
  if (path == nullptr) return -1;
  sockaddr_un address{.sun_family = AF_UNIX, .sun_path = {}};
  std::strncpy(address.sun_path, path, sizeof address.sun_path - 1);
  const int cable = socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0);
  if (cable >= 0 && connect(cable, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
    ::close(cable);
    return -1;
  }
  return cable;
}

/// Receives the node and its descriptors. If the result is negative, nothing is plugged in.
int take_node(int cable, std::vector<std::uint8_t>& descriptors) {
  descriptors.resize(1024);
  iovec part{.iov_base = descriptors.data(), .iov_len = descriptors.size()};
  alignas(cmsghdr) std::array<std::byte, CMSG_SPACE(sizeof(int))> control{};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control.data();
  message.msg_controllen = control.size();
  const ssize_t size = recvmsg(cable, &message, MSG_CMSG_CLOEXEC);
  if (size <= 0) return -1;
  descriptors.resize(static_cast<std::size_t>(size));
  const cmsghdr* const header = CMSG_FIRSTHDR(&message);
  if (header == nullptr || header->cmsg_type != SCM_RIGHTS) return -1;
  int node = -1;
  std::memcpy(&node, CMSG_DATA(header), sizeof node);
  return node;
}

class FarNode final : public UsbfsNode {
 public:
  FarNode(int cable, int node, std::vector<std::uint8_t> descriptors)
      : cable_(cable), descriptors_(std::move(descriptors)) {
    const std::lock_guard lock(mutex_);
    set_file(node);
  }
  ~FarNode() override { ::close(cable_); }
  FarNode(const FarNode&) = delete;
  FarNode& operator=(const FarNode&) = delete;

 private:
  bool gone() const override { return gone_; }
  std::span<const std::uint8_t> descriptors() const override { return descriptors_; }
  bool request(std::uint8_t request, std::uint16_t value) override {
    const std::array<std::uint8_t, 4> message = {socket_cable::kRequest, request, static_cast<std::uint8_t>(value),
                                                 static_cast<std::uint8_t>(value >> 8)};
    return send(cable_, message.data(), message.size(), MSG_NOSIGNAL) > 0;
  }
  Taken write(std::span<const std::uint8_t> bytes) override {
    std::array<std::uint8_t, 1 + usb::kPacketSize> message{socket_cable::kOut};
    if (bytes.size() > usb::kPacketSize) return Taken::kRefused;
    std::ranges::copy(bytes, message.begin() + 1);
    return send(cable_, message.data(), 1 + bytes.size(), MSG_NOSIGNAL) > 0 ? Taken::kYes : Taken::kRefused;
  }
  void awaited() override { look(); }
  void look() override {
    std::array<std::uint8_t, usb::kPacketSize> packet;
    while (!gone_ && !waiting_.empty()) {
      const ssize_t size = recv(cable_, packet.data(), packet.size(), MSG_DONTWAIT);
      if (size > 0) {
        bring(std::span(packet).first(static_cast<std::size_t>(size)));
      } else if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
        return;
      } else {
        gone_ = true;
        finish_all();
      }
    }
  }

  int cable_;
  std::vector<std::uint8_t> descriptors_;
  bool gone_ = false;
};

/// Used only by the thread of the pipe.
std::unique_ptr<FarNode>& the_node() {
  static std::unique_ptr<FarNode> node;
  return node;
}

int open_node() {
  const int cable = the_node() ? -1 : connect_to_falcon();
  std::vector<std::uint8_t> descriptors;
  const int node = cable >= 0 ? take_node(cable, descriptors) : -1;
  if (node < 0) {
    if (cable >= 0) ::close(cable);
    errno = the_node() ? EBUSY : ENOENT;
    return -1;
  }
  the_node() = std::make_unique<FarNode>(cable, node, std::move(descriptors));
  return node;
}

template <class Function>
Function* next(const char* name, Function* /*like*/) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

}  // namespace
}  // namespace tendon

extern "C" {

int open(const char* path, int flags, ...) {
  std::va_list arguments;
  va_start(arguments, flags);
  const int mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(arguments, int) : 0;
  va_end(arguments);
  if (path == tendon::kNode) return tendon::open_node();
  return static_cast<int>(syscall(SYS_openat, AT_FDCWD, path, flags, mode));
}

int close(int file) {
  if (tendon::UsbfsNode::of(file) != nullptr) {
    tendon::the_node().reset();
    return 0;
  }
  return static_cast<int>(syscall(SYS_close, file));
}

/// A process that has access to the socket also has access to the node.
int access(const char* path, int mode) noexcept {
  return path == tendon::kNode ? 0 : static_cast<int>(syscall(SYS_faccessat, AT_FDCWD, path, mode));
}

int libusb_init(libusb_context** context) {
  libusb_set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
  return tendon::next("libusb_init", &libusb_init)(context);
}

ssize_t libusb_get_device_list(libusb_context* context, libusb_device*** list) {
  auto** const devices = static_cast<libusb_device**>(std::calloc(2, sizeof(libusb_device*)));  // libusb frees it
  *list = devices;
  const int node = tendon::open_node();
  if (node < 0) return 0;
  libusb_device_handle* handle = nullptr;
  if (libusb_wrap_sys_device(context, node, &handle) == LIBUSB_SUCCESS) {
    devices[0] = libusb_ref_device(libusb_get_device(handle));
    libusb_close(handle);
  }
  close(node);
  return devices[0] != nullptr ? 1 : 0;
}
}
