// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>

#include "core/base/time.h"
#include "devices/usb/pipe.h"

namespace tendon {

/// Connects a driver to a device model in the same thread. `now` is the caller's simulated clock.
template <class Model>
class ModelPipe final : public usb::Pipe {
 public:
  ModelPipe(Model& device, const LocalTime& now) : device_(device), now_(now) {}

  std::uint32_t connection() noexcept override {
    if (device_.plugged() && plugged_ != device_.times_plugged()) open();
    const bool open = device_.plugged() && now_ >= opens_;
    return open ? number_ : 0;
  }

  bool request(const usb::Request& request) noexcept override {
    if (connection() == 0) return false;
    settles_ = now_ + std::chrono::milliseconds(1);
    if (!device_.request(now_, request.request, request.value)) reopen();
    return true;
  }

  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (connection() == 0 || bytes.size() > usb::kPacketSize) return false;
    if (!device_.write(now_, bytes)) reopen();
    return true;
  }

  bool settled() const noexcept override { return now_ >= settles_; }

  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    if (connection() == 0 || device_.next_in() > now_) return 0;
    const auto bytes = device_.take_in(now_);
    std::copy(bytes.begin(), bytes.end(), packet.begin());
    return bytes.size();
  }

  void reopen() noexcept override {
    if constexpr (requires { device_.cancel(); }) device_.cancel();
    open();
  }

 private:
  void open() noexcept {
    plugged_ = device_.times_plugged();
    ++number_;
    opens_ = now_ + std::chrono::milliseconds(20);
  }

  Model& device_;
  const LocalTime& now_;
  std::uint32_t number_ = 0;
  int plugged_ = 0;
  LocalTime opens_{};
  LocalTime settles_{};
};

}  // namespace tendon
