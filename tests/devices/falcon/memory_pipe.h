// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstring>

#include "devices/usb/pipe.h"
#include "tests/devices/falcon/fake_falcon.h"

namespace tendon {

/// The cable between a driver and a FakeFalcon in one thread and in simulated time: `now` is the caller's clock.
class MemoryPipe final : public usb::Pipe {
 public:
  MemoryPipe(FakeFalcon& falcon, const LocalTime& now) : falcon_(falcon), now_(now) {}

  std::uint32_t connection() noexcept override {
    if (falcon_.plugged() && plugged_ != falcon_.times_plugged()) open();
    const bool open = falcon_.plugged() && now_ >= opens_;
    return open ? number_ : 0;
  }

  bool request(const usb::Request& request) noexcept override {
    if (connection() == 0) return false;
    settles_ = now_ + std::chrono::milliseconds(1);
    if (!falcon_.request(now_, request.request, request.value)) reopen();
    return true;
  }

  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (connection() == 0 || bytes.size() > usb::kPacketSize) return false;
    if (!falcon_.write(now_, bytes)) reopen();
    return true;
  }

  bool settled() const noexcept override { return now_ >= settles_; }

  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    if (connection() == 0 || falcon_.next_in() > now_) return 0;
    const auto bytes = falcon_.take_in(now_);
    std::copy(bytes.begin(), bytes.end(), packet.begin());
    return bytes.size();
  }

  void reopen() noexcept override { open(); }

 private:
  void open() noexcept {
    plugged_ = falcon_.times_plugged();
    ++number_;
    opens_ = now_ + std::chrono::milliseconds(20);
  }

  FakeFalcon& falcon_;
  const LocalTime& now_;
  std::uint32_t number_ = 0;
  int plugged_ = 0;
  LocalTime opens_{};
  LocalTime settles_{};
};

}  // namespace tendon
