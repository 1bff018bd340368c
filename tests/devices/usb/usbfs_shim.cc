// SPDX-License-Identifier: Apache-2.0
#include "tests/devices/usb/usbfs_shim.h"

#include <pty.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstdlib>

namespace tendon {
namespace {

LocalTime now() {
  return LocalTime(std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
}

}  // namespace

UsbfsShim::UsbfsShim(const FakeFalcon::Options& options) : falcon_(options) {
  make_node();
  thread_ = std::thread([this] { run(); });
}

UsbfsShim::~UsbfsShim() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  thread_.join();
  if (master_ >= 0) ::close(master_);
}

void UsbfsShim::make_node() {
  int slave = -1;
  if (openpty(&master_, &slave, nullptr, nullptr, nullptr) != 0) std::abort();
  termios raw{};
  tcgetattr(slave, &raw);
  cfmakeraw(&raw);
  tcsetattr(slave, TCSANOW, &raw);
  set_file(slave);
}

int UsbfsShim::node() const {
  const std::lock_guard lock(mutex_);
  return falcon_.plugged() ? file() : -1;
}

void UsbfsShim::unplug() {
  const std::lock_guard lock(mutex_);
  falcon_.unplug();
  finish_all();
  ::close(master_);
  master_ = -1;
}

void UsbfsShim::plug() {
  const std::lock_guard lock(mutex_);
  make_node();
  falcon_.plug();
}

void UsbfsShim::set_trouble(Trouble trouble) {
  const std::lock_guard lock(mutex_);
  trouble_ = trouble;
  changed_.notify_all();
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
    bring(falcon_.take_in(at));
  }
}

bool UsbfsShim::request(std::uint8_t request, std::uint16_t value) { return falcon_.request(now(), request, value); }

UsbfsNode::Taken UsbfsShim::write(std::span<const std::uint8_t> bytes) {
  if (trouble_ == Trouble::kHang) return Taken::kHangs;
  const bool taken = falcon_.write(now(), bytes);
  changed_.notify_all();
  return taken ? Taken::kYes : Taken::kRefused;
}

}  // namespace tendon
