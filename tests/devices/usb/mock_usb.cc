// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/mock_usb.h"

#include <dlfcn.h>
#include <linux/usbdevice_fs.h>
#include <pty.h>
#include <sys/stat.h>
#include <termios.h>
#include <umockdev.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <deque>
#include <span>
#include <sstream>
#include <stdexcept>
#include <thread>
#include <utility>

namespace tendon {
namespace {

constexpr const char* kBus = "/devices/pci0000:00/0000:00:14.0/usb1";
constexpr std::uint8_t kDirectionIn = 0x80;

std::string in_hex(std::span<const std::uint8_t> bytes) {
  std::string text;
  for (const std::uint8_t byte : bytes) {
    std::array<char, 3> digits{};
    std::snprintf(digits.data(), digits.size(), "%02X", unsigned{byte});
    text += digits.data();
  }
  return text;
}

std::string node_of(int address) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "/dev/bus/usb/001/%03d", address);
  return text.data();
}

void check(bool done, GError* error) {
  if (!done) throw std::runtime_error(error != nullptr ? error->message : "umockdev refuses");
}

struct Unref {
  void operator()(UMockdevIoctlData* data) const { umockdev_ioctl_data_unref(data); }
};
/// A copy of the memory of the ioctl's caller. Changes of this copy are visible to the caller when the ioctl ends.
using Data = std::unique_ptr<UMockdevIoctlData, Unref>;

Data resolve(UMockdevIoctlData* in, std::size_t at, std::size_t size) {
  return Data(umockdev_ioctl_data_resolve(in, at, size, nullptr));
}

template <class T>
T& as(UMockdevIoctlData* data) {
  return *reinterpret_cast<T*>(data->data);
}

}  // namespace

struct MockUsb::Testbed {
  UMockdevTestbed* bed = nullptr;
  int addresses = 1;  ///< the root hub has address 1

  void add(const std::string& path, int address, std::span<const std::uint8_t> descriptors) {
    const std::string node = node_of(address);
    std::ostringstream text;
    text << "P: " << path << "\nN: " << node.substr(5) << "\nE: SUBSYSTEM=usb\nE: DRIVER=usb\nE: DEVTYPE=usb_device"
         << "\nE: DEVNAME=" << node << "\nE: BUSNUM=001\nE: DEVNUM=" << node.substr(node.size() - 3)
         << "\nA: bConfigurationValue=1\\n\nA: busnum=1\\n\nA: devnum=" << address << "\\n\nA: speed=12\\n"
         << "\nH: descriptors=" << in_hex(descriptors) << '\n';
    GError* error = nullptr;
    const bool added = umockdev_testbed_add_from_string(bed, text.str().c_str(), &error) != 0;
    check(added, error);
  }
};

MockUsb::MockUsb() : testbed_(std::make_unique<Testbed>()) {
  testbed_->bed = umockdev_testbed_new();
  if (umockdev_in_mock_environment() == 0) throw std::runtime_error("this program is not linked with umockdev-preload");
  // Root hub: full speed, one configuration, one interrupt endpoint.
  constexpr std::array<std::uint8_t, 43> kHub = {18, 1, 0x10, 1, 9, 0, 0,  64,   0x6B, 0x1D, 1, 0, 0, 1, 0, 0, 0, 1,  //
                                                 9,  2, 25,   0, 1, 1, 0,  0xE0, 0,                                   //
                                                 9,  4, 0,    0, 1, 9, 0,  0,    0,                                   //
                                                 7,  5, 0x81, 3, 4, 0, 255};
  testbed_->add(kBus, 1, kHub);
}

MockUsb::~MockUsb() { g_object_unref(testbed_->bed); }

std::string MockUsb::really(const std::string& path) const {
  gchar* const root = umockdev_testbed_get_root_dir(testbed_->bed);
  std::string real(root);
  real += path;
  g_free(root);
  return real;
}

/// All members require the lock of the port.
struct MockPort::Inside {
  struct Urb {
    Data urb;
    Data buffer;
    usbdevfs_urb& fields() const { return as<usbdevfs_urb>(urb.get()); }
  };

  Inside(MockUsb& the_usb, std::mutex& the_mutex, int number, UsbModel& the_model)
      : usb(the_usb), mutex(the_mutex), model(the_model), path(kBus), handler(umockdev_ioctl_base_new()) {
    path += "/1-";
    path += std::to_string(number);
    g_signal_connect(handler, "handle-ioctl", G_CALLBACK(&Inside::on_ioctl), this);
    thread = std::thread([this] { run(); });
  }
  ~Inside() {
    {
      const std::lock_guard lock(mutex);
      stop = true;
    }
    changed.notify_all();
    thread.join();
    g_object_unref(handler);
    close_node();
  }
  Inside(const Inside&) = delete;
  Inside& operator=(const Inside&) = delete;

  // poll() never blocks on umockdev's file, so libusb's thread would spin. The node therefore leads to the slave end of
  // a pseudo-terminal: its output stops while no transfer can be fetched (no POLLOUT), and its master end closes on
  // unplug (POLLERR), as in usbfs. Reading descriptors from the node is emulated below.
  void open_node() {
    std::array<char, 64> name{};
    if (openpty(&master, &slave, name.data(), nullptr, nullptr) != 0) throw std::runtime_error("no pseudo-terminal");
    struct stat status {};
    fstat(slave, &status);
    terminal = status.st_rdev;
    position = 0;
    termios raw{};
    tcgetattr(slave, &raw);
    cfmakeraw(&raw);
    tcsetattr(slave, TCSANOW, &raw);
    gate(false);
    const std::string real = usb.really(node_of(address));
    ::unlink(real.c_str());
    if (symlink(name.data(), real.c_str()) != 0) throw std::runtime_error("no link to a pseudo-terminal");
  }
  void close_node() {
    for (int* const end : {&slave, &master}) {
      if (*end >= 0) ::close(*end);
      *end = -1;
    }
  }
  // No thread writes to this terminal.
  // NOLINTNEXTLINE(concurrency-mt-unsafe)
  void gate(bool open) const { tcflow(slave, open ? TCOON : TCOOFF); }

  void run() {
    std::unique_lock lock(mutex);
    while (!stop) {
      const LocalTime at = real_now();
      while (plugged && !waiting.empty() && model.next_in() <= at) let_in(at);
      // The model can be changed without a notification.
      changed.wait_for(lock, std::clamp<Duration>(plugged && !waiting.empty() ? model.next_in() - at : Duration::max(),
                                                  std::chrono::microseconds(10), std::chrono::milliseconds(5)));
    }
  }
  void let_in(LocalTime at) {
    Urb urb = std::move(waiting.front());
    waiting.pop_front();
    const auto packet = model.take_in(at);
    const auto size = std::min<std::size_t>(packet.size(), static_cast<std::size_t>(urb.fields().buffer_length));
    std::memcpy(urb.buffer->data, packet.data(), size);
    finish(std::move(urb), size < packet.size() ? -EOVERFLOW : 0, static_cast<int>(size));
  }
  void finish(Urb urb, int status, int size) {
    urb.fields().status = status;
    urb.fields().actual_length = size;
    done.push_back(std::move(urb));
    gate(true);
  }

  void submit(UMockdevIoctlData* argument) {
    Urb urb;
    urb.urb = resolve(argument, 0, sizeof(usbdevfs_urb));
    const usbdevfs_urb& fields = urb.fields();
    const auto size = static_cast<std::size_t>(fields.buffer_length);
    urb.buffer = resolve(urb.urb.get(), offsetof(usbdevfs_urb, buffer), size);
    ++open_transfers;
    const std::span<const std::uint8_t> bytes(urb.buffer->data, size);
    if (fields.type == USBDEVFS_URB_TYPE_CONTROL) {
      const auto value = static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8);
      const bool taken = bytes[0] == 0x40 && model.request(real_now(), bytes[1], value);
      finish(std::move(urb), taken ? 0 : -EPIPE, 0);
    } else if ((fields.endpoint & kDirectionIn) == 0) {
      const bool taken = model.write(real_now(), bytes);
      finish(std::move(urb), taken ? 0 : -EPIPE, taken ? static_cast<int>(size) : 0);
    } else {
      waiting.push_back(std::move(urb));
    }
    changed.notify_all();
  }

  ssize_t read(void* to, std::size_t size) {
    const std::lock_guard lock(mutex);
    const auto left = model.descriptors().subspan(position);
    const std::size_t count = std::min(size, left.size());
    std::memcpy(to, left.data(), count);
    position += count;
    return static_cast<ssize_t>(count);
  }
  off_t seek(off_t to) {
    const std::lock_guard lock(mutex);
    position = static_cast<std::size_t>(std::clamp<off_t>(to, 0, static_cast<off_t>(model.descriptors().size())));
    return static_cast<off_t>(position);
  }

  std::pair<int, int> obey(unsigned long request, UMockdevIoctlData* argument) {
    if (!plugged && request != USBDEVFS_REAPURBNDELAY && request != USBDEVFS_DISCARDURB) return {-1, ENODEV};
    switch (request) {
      case USBDEVFS_GET_CAPABILITIES:
        as<std::uint32_t>(resolve(argument, 0, sizeof(std::uint32_t)).get()) =
            USBDEVFS_CAP_ZERO_PACKET | USBDEVFS_CAP_BULK_CONTINUATION | USBDEVFS_CAP_NO_PACKET_SIZE_LIM |
            USBDEVFS_CAP_BULK_SCATTER_GATHER | USBDEVFS_CAP_REAP_AFTER_DISCONNECT;
        return {0, 0};
      case USBDEVFS_CONNECTINFO:
        as<usbdevfs_connectinfo>(resolve(argument, 0, sizeof(usbdevfs_connectinfo)).get()) = {
            .devnum = static_cast<unsigned>(address), .slow = 0};
        return {0, 0};
      case USBDEVFS_GET_SPEED:
        return {2, 0};  // full speed
      case USBDEVFS_CONTROL: {
        const Data transfer = resolve(argument, 0, sizeof(usbdevfs_ctrltransfer));
        if (as<usbdevfs_ctrltransfer>(transfer.get()).bRequest != 8) return {-1, EPIPE};
        as<std::uint8_t>(resolve(transfer.get(), offsetof(usbdevfs_ctrltransfer, data), 1).get()) = 1;
        return {1, 0};
      }
      case USBDEVFS_CLAIMINTERFACE:
      case USBDEVFS_DISCONNECT_CLAIM:
      case USBDEVFS_RELEASEINTERFACE:
        return {0, 0};
      case USBDEVFS_GETDRIVER:
      case USBDEVFS_IOCTL:  // no kernel driver is bound
        return {-1, ENODATA};
      case USBDEVFS_SUBMITURB:
        submit(argument);
        return {0, 0};
      case USBDEVFS_DISCARDURB: {
        const auto wanted = as<unsigned long>(argument);
        const auto found =
            std::ranges::find_if(waiting, [&](const Urb& one) { return one.urb->client_addr == wanted; });
        if (found == waiting.end()) return {-1, EINVAL};
        Urb urb = std::move(*found);
        waiting.erase(found);
        finish(std::move(urb), -ENOENT, 0);
        return {0, 0};
      }
      case USBDEVFS_REAPURBNDELAY: {
        if (done.empty()) {
          ++woken_for_nothing;
          if (plugged) gate(false);
          return {-1, plugged ? EAGAIN : ENODEV};
        }
        const Urb urb = std::move(done.front());
        done.pop_front();
        --open_transfers;
        umockdev_ioctl_data_set_ptr(resolve(argument, 0, sizeof(void*)).get(), 0, urb.urb.get());
        return {0, 0};
      }
      default:
        return {-1, ENOTTY};
    }
  }

  static gboolean on_ioctl(UMockdevIoctlBase*, UMockdevIoctlClient* client, Inside* inside) {
    std::pair<int, int> result;
    {
      const std::lock_guard lock(inside->mutex);
      result = inside->obey(umockdev_ioctl_client_get_request(client), umockdev_ioctl_client_get_arg(client));
    }
    umockdev_ioctl_client_complete(client, result.first, result.second);
    return TRUE;
  }

  static std::array<std::atomic<Inside*>, 10> all;  ///< indexed by port number
  static Inside* of(int file);

  MockUsb& usb;
  std::mutex& mutex;
  UsbModel& model;
  std::string path;
  UMockdevIoctlBase* handler;
  std::condition_variable changed;
  int address = 0;
  bool plugged = false;
  int master = -1;
  int slave = -1;
  std::atomic<dev_t> terminal{0};
  std::size_t position = 0;  ///< read position in the descriptors
  std::deque<Urb> waiting;   ///< IN
  std::deque<Urb> done;
  int open_transfers = 0;
  int woken_for_nothing = 0;
  bool stop = false;
  std::thread thread;
};

std::array<std::atomic<MockPort::Inside*>, 10> MockPort::Inside::all{};

MockPort::Inside* MockPort::Inside::of(int file) {
  struct stat status {};
  if (std::ranges::all_of(all, [](const auto& one) { return one.load() == nullptr; })) return nullptr;
  if (fstat(file, &status) != 0 || !S_ISCHR(status.st_mode)) return nullptr;
  for (const auto& one : all) {
    Inside* const inside = one.load();
    if (inside != nullptr && inside->terminal == status.st_rdev) return inside;
  }
  return nullptr;
}

MockPort::MockPort(MockUsb& usb, int number, UsbModel& model)
    : inside_(std::make_unique<Inside>(usb, mutex_, number, model)) {
  Inside::all.at(static_cast<std::size_t>(number)) = inside_.get();
}

MockPort::~MockPort() {
  if (inside_->plugged) unplug();
  for (auto& one : Inside::all) {
    Inside* mine = inside_.get();
    one.compare_exchange_strong(mine, nullptr);
  }
}

void MockPort::plug() {
  MockUsb::Testbed& testbed = *inside_->usb.testbed_;
  {
    const std::lock_guard lock(mutex_);
    inside_->close_node();
    inside_->done.clear();
    inside_->open_transfers = 0;
    inside_->address = ++testbed.addresses;
    inside_->model.plug();
    inside_->plugged = true;
  }
  GError* error = nullptr;
  const bool attached = umockdev_testbed_attach_ioctl(testbed.bed, node().c_str(), inside_->handler, &error) != 0;
  check(attached, error);
  testbed.add(inside_->path, inside_->address, inside_->model.descriptors());
  const std::lock_guard lock(mutex_);
  inside_->open_node();
}

void MockPort::unplug() {
  UMockdevTestbed* const bed = inside_->usb.testbed_->bed;
  {
    const std::lock_guard lock(mutex_);
    inside_->plugged = false;
    inside_->model.unplug();
    for (auto& urb : inside_->waiting) inside_->finish(std::move(urb), -ESHUTDOWN, 0);
    inside_->waiting.clear();
    inside_->gate(true);
    ::close(std::exchange(inside_->master, -1));
  }
  const std::string path = "/sys" + inside_->path;
  umockdev_testbed_uevent(bed, path.c_str(), "remove");
  umockdev_testbed_remove_device(bed, path.c_str());
}

std::string MockPort::node() const {
  return with([this] { return node_of(inside_->address); });
}

int MockPort::open_transfers() const {
  return with([this] { return inside_->open_transfers; });
}

int MockPort::woken_for_nothing() const {
  return with([this] { return inside_->woken_for_nothing; });
}

}  // namespace tendon

// libusb's calls resolve to the program's exported functions before the preload and the C library.
extern "C" {

ssize_t read(int file, void* to, std::size_t size) {
  if (auto* const port = tendon::MockPort::Inside::of(file)) return port->read(to, size);
  static const auto others = reinterpret_cast<decltype(&read)>(dlsym(RTLD_NEXT, "read"));
  return others(file, to, size);
}

off_t lseek(int file, off_t to, int from) noexcept {
  if (auto* const port = tendon::MockPort::Inside::of(file)) return port->seek(to);
  static const auto others = reinterpret_cast<decltype(&lseek)>(dlsym(RTLD_NEXT, "lseek"));
  return others(file, to, from);
}
}
