// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <libusb.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdio>
#include <stdexcept>
#include <system_error>
#include <thread>

#include "core/exchange/spsc_ring.h"
#include "devices/late_library.h"
#include "devices/usb/usb.h"

namespace tendon::usb {
namespace {

constexpr std::size_t kInTransfers = 4;
constexpr std::size_t kOutTransfers = 4;
constexpr unsigned kTransferTimeout_ms = 100;
constexpr int kLookAgain_ms = 200;
/// Emptied in each haptic period. Large enough for a quarter of a second of an idle FTDI chip's packets.
constexpr std::size_t kInPackets = 256;
constexpr std::size_t kOutPackets = 16;

struct Libusb {
  LateLibrary file{"libusb-1.0.so.0"};
  decltype(&::libusb_alloc_transfer) alloc_transfer = file["libusb_alloc_transfer"];
  decltype(&::libusb_cancel_transfer) cancel_transfer = file["libusb_cancel_transfer"];
  decltype(&::libusb_claim_interface) claim_interface = file["libusb_claim_interface"];
  decltype(&::libusb_close) close = file["libusb_close"];
  decltype(&::libusb_exit) exit = file["libusb_exit"];
  decltype(&::libusb_free_device_list) free_device_list = file["libusb_free_device_list"];
  decltype(&::libusb_free_pollfds) free_pollfds = file["libusb_free_pollfds"];
  decltype(&::libusb_free_transfer) free_transfer = file["libusb_free_transfer"];
  decltype(&::libusb_get_bus_number) get_bus_number = file["libusb_get_bus_number"];
  decltype(&::libusb_get_device_address) get_device_address = file["libusb_get_device_address"];
  decltype(&::libusb_get_device_descriptor) get_device_descriptor = file["libusb_get_device_descriptor"];
  decltype(&::libusb_get_device_list) get_device_list = file["libusb_get_device_list"];
  decltype(&::libusb_get_next_timeout) get_next_timeout = file["libusb_get_next_timeout"];
  decltype(&::libusb_get_pollfds) get_pollfds = file["libusb_get_pollfds"];
  decltype(&::libusb_get_port_numbers) get_port_numbers = file["libusb_get_port_numbers"];
  decltype(&::libusb_handle_events_timeout_completed) handle_events_timeout_completed =
      file["libusb_handle_events_timeout_completed"];
  decltype(&::libusb_init) init = file["libusb_init"];
  decltype(&::libusb_release_interface) release_interface = file["libusb_release_interface"];
  decltype(&::libusb_set_auto_detach_kernel_driver) set_auto_detach_kernel_driver =
      file["libusb_set_auto_detach_kernel_driver"];
  decltype(&::libusb_set_option) set_option = file["libusb_set_option"];
  decltype(&::libusb_strerror) strerror = file["libusb_strerror"];
  decltype(&::libusb_submit_transfer) submit_transfer = file["libusb_submit_transfer"];
  decltype(&::libusb_wrap_sys_device) wrap_sys_device = file["libusb_wrap_sys_device"];
};

const Libusb& libusb() {
  static const Libusb kLoaded;
  return kLoaded;
}

struct Free {
  void operator()(libusb_context* context) const { libusb().exit(context); }
  void operator()(libusb_transfer* transfer) const { libusb().free_transfer(transfer); }
  void operator()(libusb_device_handle* handle) const { libusb().close(handle); }
};
using Context = std::unique_ptr<libusb_context, Free>;
using Transfer = std::unique_ptr<libusb_transfer, Free>;
using Handle = std::unique_ptr<libusb_device_handle, Free>;

Context make_context() {
  libusb_context* context = nullptr;
  if (const int error = libusb().init(&context); error != LIBUSB_SUCCESS) {
    throw std::runtime_error(std::string("cannot use USB on this machine: ") + libusb().strerror(error));
  }
  return Context(context);
}

class List {
 public:
  explicit List(libusb_context* context) { size_ = std::max<ssize_t>(0, libusb().get_device_list(context, &devices_)); }
  ~List() {
    if (devices_ != nullptr) libusb().free_device_list(devices_, 1);
  }
  List(const List&) = delete;
  List& operator=(const List&) = delete;
  libusb_device** begin() const { return devices_; }
  libusb_device** end() const { return devices_ + size_; }

 private:
  libusb_device** devices_ = nullptr;
  ssize_t size_ = 0;
};

PluggedIn describe(libusb_device* device) {
  PluggedIn plugged;
  libusb_device_descriptor descriptor{};
  if (libusb().get_device_descriptor(device, &descriptor) == LIBUSB_SUCCESS) {
    plugged.id = {descriptor.idVendor, descriptor.idProduct};
  }
  std::array<std::uint8_t, 7> ports{};  // maximum depth (USB 3.0, 8.9)
  const int count = libusb().get_port_numbers(device, ports.data(), static_cast<int>(ports.size()));
  plugged.port = std::to_string(libusb().get_bus_number(device));
  for (int i = 0; i < count; ++i) {
    plugged.port += (i == 0 ? "-" : ".") + std::to_string(ports.at(static_cast<std::size_t>(i)));
  }
  std::array<char, 32> node{};
  std::snprintf(node.data(), node.size(), "/dev/bus/usb/%03u/%03u", unsigned{libusb().get_bus_number(device)},
                unsigned{libusb().get_device_address(device)});
  plugged.node = node.data();
  plugged.has_node = access(node.data(), F_OK) == 0;
  plugged.may_open = access(node.data(), R_OK | W_OK) == 0;
  return plugged;
}

class LibusbPipe final : public Pipe {
 public:
  explicit LibusbPipe(const PipeConfig& config);
  ~LibusbPipe() override;
  LibusbPipe(const LibusbPipe&) = delete;
  LibusbPipe& operator=(const LibusbPipe&) = delete;

  std::uint32_t connection() noexcept override {
    seen_ = connection_.load(std::memory_order_acquire);
    return seen_;
  }
  bool request(const Request& request) noexcept override;
  bool write(std::span<const std::uint8_t> bytes) noexcept override;
  bool settled() const noexcept override { return done_.load(std::memory_order_acquire) == accepted_; }
  std::size_t read(std::span<std::uint8_t, kPacketSize> packet) noexcept override;
  void reopen() noexcept override {
    to_end_.store(seen_, std::memory_order_release);
    wake();
  }

 private:
  struct Packet {
    std::uint32_t connection = 0;
    std::size_t size = 0;
    std::array<std::uint8_t, kPacketSize> bytes{};
  };
  struct Order {
    bool is_request = false;
    Request request{};
    Packet packet{};
  };
  struct Slot {
    LibusbPipe* pipe = nullptr;
    Transfer transfer{libusb().alloc_transfer(0)};
    std::array<std::uint8_t, kPacketSize> bytes{};
    bool under_way = false;
  };

  // Called by the user's thread
  void wake() noexcept;

  // Called by the pipe's thread
  void run();
  bool open();
  int open_node();
  void close_node();
  void close();
  void tell(const std::string& why);
  void obey();
  void discard();
  void look_at_descriptors();
  void wait(int most_ms);
  void fill(Slot& slot, std::uint8_t endpoint, std::size_t size, libusb_transfer_cb_fn then, unsigned timeout) noexcept;
  void submit(Slot& slot) noexcept;
  bool sending() const noexcept;
  bool under_way() const noexcept;
  static void LIBUSB_CALL came_in(libusb_transfer* transfer) noexcept;
  static void LIBUSB_CALL went_out(libusb_transfer* transfer) noexcept;

  PipeConfig config_;
  Context context_;
  int bell_;

  SpscRing<Order> orders_{kOutPackets};
  SpscRing<Packet> packets_{kInPackets};
  std::atomic<std::uint32_t> connection_{0};
  std::atomic<std::uint32_t> to_end_{0};  ///< requested by the user
  std::atomic<std::uint64_t> done_{0};    ///< completed or failed
  std::atomic<bool> stop_{false};

  // Only used by the user's thread
  std::uint32_t seen_ = 0;
  std::uint64_t accepted_ = 0;

  // Only used by the pipe's thread
  int node_ = -1;
  Handle handle_;
  std::uint32_t number_ = 0;  ///< of the current or last connection
  bool broken_ = false;
  bool closing_ = false;
  std::string told_;
  std::vector<pollfd> descriptors_;
  std::array<Slot, kInTransfers> in_;
  std::array<Slot, kOutTransfers> out_;
  Slot control_;

  std::thread thread_;
};

LibusbPipe::LibusbPipe(const PipeConfig& config) : config_(config) {
  // This can be used without /dev/bus/usb because the node is opened elsewhere.
  if (config_.node) libusb().set_option(nullptr, LIBUSB_OPTION_NO_DEVICE_DISCOVERY);
  context_ = make_context();
  bell_ = eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK);
  if (bell_ < 0) throw std::system_error(errno, std::generic_category(), "eventfd");
  const auto each = [this](auto&& slots) {
    for (Slot& slot : slots) {
      slot.pipe = this;
      if (!slot.transfer) throw std::bad_alloc();
    }
  };
  each(in_);
  each(out_);
  each(std::span(&control_, 1));
  thread_ = std::thread([this] { run(); });
}

LibusbPipe::~LibusbPipe() {
  stop_.store(true, std::memory_order_release);
  wake();
  thread_.join();
  ::close(bell_);
}

// --- The user's thread ----------------------------------------------------------------------------------------------

void LibusbPipe::wake() noexcept {
  const std::uint64_t one = 1;
  // Can only fail after 2^64 - 2 calls.
  [[maybe_unused]] const ssize_t rung = ::write(bell_, &one, sizeof one);
}

bool LibusbPipe::request(const Request& request) noexcept {
  Order* const order = seen_ != 0 ? orders_.back() : nullptr;
  if (order == nullptr) return false;
  order->is_request = true;
  order->request = request;
  order->packet.connection = seen_;
  ++accepted_;
  orders_.push();
  wake();
  return true;
}

bool LibusbPipe::write(std::span<const std::uint8_t> bytes) noexcept {
  Order* const order = seen_ != 0 && bytes.size() <= kPacketSize ? orders_.back() : nullptr;
  if (order == nullptr) return false;
  order->is_request = false;
  order->packet.connection = seen_;
  order->packet.size = bytes.size();
  std::copy(bytes.begin(), bytes.end(), order->packet.bytes.begin());
  ++accepted_;
  orders_.push();
  wake();
  return true;
}

std::size_t LibusbPipe::read(std::span<std::uint8_t, kPacketSize> packet) noexcept {
  while (const Packet* next = packets_.front()) {
    const bool ours = next->connection == seen_;
    const std::size_t size = next->size;
    std::copy_n(next->bytes.begin(), size, packet.begin());
    packets_.pop();
    if (ours) return size;
  }
  return 0;
}

// --- The pipe's thread ----------------------------------------------------------------------------------------------

void LibusbPipe::run() {
  if (config_.on_start) config_.on_start();
  look_at_descriptors();
  while (!stop_.load(std::memory_order_acquire)) {
    if (!handle_ && !open()) {
      discard();
      wait(kLookAgain_ms);
      continue;
    }
    obey();
    wait(-1);
    if (broken_ || to_end_.load(std::memory_order_acquire) == number_) close();
  }
  if (handle_) close();
}

void LibusbPipe::tell(const std::string& why) {
  if (why != told_ && !why.empty() && config_.tell) config_.tell(why);
  told_ = why;
}

int LibusbPipe::open_node() {
  if (config_.node) return config_.node();
  // Use a new context for each attempt. Existing ones find new devices by udevd, which containers may lack.
  libusb_context* looking = nullptr;
  if (libusb().init(&looking) != LIBUSB_SUCCESS) return -1;
  const Context look(looking);
  std::string why;  // empty if the device is not plugged in
  for (libusb_device* device : List(look.get())) {
    const PluggedIn plugged = describe(device);
    if (std::ranges::find(config_.ids, plugged.id) == config_.ids.end()) continue;
    if (!config_.port.empty() && plugged.port != config_.port) continue;
    const int node = ::open(plugged.node.c_str(), O_RDWR | O_CLOEXEC);
    if (node >= 0) return node;
    why = plugged.node + " cannot be opened: " + std::generic_category().message(errno) + "; see `tendond devices`";
  }
  tell(why);
  return -1;
}

bool LibusbPipe::open() {
  node_ = open_node();
  if (node_ < 0) return false;
  libusb_device_handle* handle = nullptr;
  int error = libusb().wrap_sys_device(context_.get(), node_, &handle);
  handle_.reset(handle);
  if (error == LIBUSB_SUCCESS) {
    // usbhid uses the SpaceMouse. FTDI's driver uses the Falcon only if a user has added its id.
    libusb().set_auto_detach_kernel_driver(handle, 1);
    error = libusb().claim_interface(handle, 0);
  }
  if (error != LIBUSB_SUCCESS) {
    tell(std::string("cannot use the USB device; is another program using it? ") + libusb().strerror(error));
    close_node();
    return false;
  }

  told_.clear();
  broken_ = closing_ = false;
  ++number_;
  for (Slot& slot : in_) {
    fill(slot, config_.in, slot.bytes.size(), came_in, 0);
    submit(slot);
  }
  look_at_descriptors();
  if (config_.opened) config_.opened(node_);
  connection_.store(number_, std::memory_order_release);
  return true;
}

void LibusbPipe::close_node() {
  handle_.reset();
  if (!config_.node) ::close(node_);
}

void LibusbPipe::fill(Slot& slot, std::uint8_t endpoint, std::size_t size, libusb_transfer_cb_fn then,
                      unsigned timeout) noexcept {
  libusb_fill_bulk_transfer(slot.transfer.get(), handle_.get(), endpoint, slot.bytes.data(), static_cast<int>(size),
                            then, &slot, timeout);
  if (config_.transfers == PipeConfig::Transfers::kInterrupt) slot.transfer->type = LIBUSB_TRANSFER_TYPE_INTERRUPT;
}

void LibusbPipe::submit(Slot& slot) noexcept {
  slot.under_way = libusb().submit_transfer(slot.transfer.get()) == LIBUSB_SUCCESS;
  if (!slot.under_way) broken_ = true;
}

bool LibusbPipe::sending() const noexcept { return control_.under_way || std::ranges::any_of(out_, &Slot::under_way); }

bool LibusbPipe::under_way() const noexcept { return sending() || std::ranges::any_of(in_, &Slot::under_way); }

// Control and bulk transfers are not ordered relative to each other, so they must not overlap.
void LibusbPipe::obey() {
  while (const Order* order = orders_.front()) {
    if (broken_ || order->packet.connection != number_) {
      orders_.pop();
      done_.fetch_add(1, std::memory_order_release);
      continue;
    }
    if (control_.under_way) return;
    if (order->is_request) {
      if (sending()) return;
      libusb_fill_control_setup(control_.bytes.data(), LIBUSB_REQUEST_TYPE_VENDOR, order->request.request,
                                order->request.value, order->request.index, 0);
      libusb_fill_control_transfer(control_.transfer.get(), handle_.get(), control_.bytes.data(), went_out, &control_,
                                   kTransferTimeout_ms);
      submit(control_);
    } else {
      const auto slot = std::ranges::find(out_, false, &Slot::under_way);
      if (slot == out_.end()) return;
      slot->bytes = order->packet.bytes;
      fill(*slot, config_.out, order->packet.size, went_out, kTransferTimeout_ms);
      submit(*slot);
    }
    orders_.pop();
    if (broken_) done_.fetch_add(1, std::memory_order_release);  // not counted by a callback
  }
}

void LibusbPipe::discard() {
  while (orders_.front() != nullptr) {
    orders_.pop();
    done_.fetch_add(1, std::memory_order_release);
  }
}

void LibusbPipe::close() {
  connection_.store(0, std::memory_order_release);
  closing_ = true;
  // The last packet may contain the zero force.
  while (!broken_ && (orders_.front() != nullptr || sending())) {
    obey();
    if (!broken_ && sending()) wait(-1);
  }
  const auto cancel = [](Slot& slot) {
    if (slot.under_way) libusb().cancel_transfer(slot.transfer.get());
  };
  std::ranges::for_each(in_, cancel);
  std::ranges::for_each(out_, cancel);
  cancel(control_);
  while (under_way()) wait(kLookAgain_ms);
  discard();
  if (config_.opened) config_.opened(-1);
  libusb().release_interface(handle_.get(), 0);
  close_node();
  look_at_descriptors();
}

void LibusbPipe::look_at_descriptors() {
  descriptors_.assign(1, {bell_, POLLIN, 0});
  const libusb_pollfd** const all = libusb().get_pollfds(context_.get());
  for (const libusb_pollfd** one = all; one != nullptr && *one != nullptr; ++one) {
    descriptors_.push_back({(*one)->fd, (*one)->events, 0});
  }
  libusb().free_pollfds(all);
}

// Also waits for the eventfd, unlike libusb's own function.
void LibusbPipe::wait(int most_ms) {
  timeval due{};
  if (libusb().get_next_timeout(context_.get(), &due) == 1) {
    const int due_ms = static_cast<int>(due.tv_sec * 1000 + (due.tv_usec + 999) / 1000);
    most_ms = most_ms < 0 ? due_ms : std::min(most_ms, due_ms);
  }
  poll(descriptors_.data(), descriptors_.size(), most_ms);
  std::uint64_t rung = 0;
  [[maybe_unused]] const ssize_t heard = ::read(bell_, &rung, sizeof rung);
  timeval at_once{};
  libusb().handle_events_timeout_completed(context_.get(), &at_once, nullptr);
}

void LibusbPipe::came_in(libusb_transfer* transfer) noexcept {
  auto& slot = *static_cast<Slot*>(transfer->user_data);
  LibusbPipe& pipe = *slot.pipe;
  slot.under_way = false;
  if (transfer->status == LIBUSB_TRANSFER_CANCELLED) return;
  if (transfer->status != LIBUSB_TRANSFER_COMPLETED) {
    pipe.broken_ = true;
    return;
  }
  if (Packet* const packet = pipe.packets_.back(); packet != nullptr && !pipe.closing_) {
    packet->connection = pipe.number_;
    packet->size = static_cast<std::size_t>(transfer->actual_length);
    packet->bytes = slot.bytes;
    pipe.packets_.push();
  }
  if (!pipe.closing_) pipe.submit(slot);
}

void LibusbPipe::went_out(libusb_transfer* transfer) noexcept {
  auto& slot = *static_cast<Slot*>(transfer->user_data);
  slot.under_way = false;
  const int wanted = transfer->type == LIBUSB_TRANSFER_TYPE_CONTROL ? 0 : transfer->length;
  const bool good = transfer->status == LIBUSB_TRANSFER_COMPLETED && transfer->actual_length == wanted;
  if (!good && transfer->status != LIBUSB_TRANSFER_CANCELLED) slot.pipe->broken_ = true;
  slot.pipe->done_.fetch_add(1, std::memory_order_release);
}

}  // namespace

std::vector<PluggedIn> plugged_in() {
  const Context context = make_context();
  std::vector<PluggedIn> all;
  for (libusb_device* device : List(context.get())) all.push_back(describe(device));
  return all;
}

std::unique_ptr<Pipe> open_pipe(const PipeConfig& config) { return std::make_unique<LibusbPipe>(config); }

}  // namespace tendon::usb
