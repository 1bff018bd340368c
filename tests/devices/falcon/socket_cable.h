// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <vector>

#include "devices/usb/pipe.h"
#include "tests/devices/falcon/fake_falcon.h"

/// A pair of SOCK_SEQPACKET sockets that connects two processes. The driver sends the endpoint number and the data of
/// an OUT transfer, or 0 and a vendor request. The Falcon sends the data of an IN transfer.
namespace tendon::socket_cable {

inline constexpr std::uint8_t kRequest = 0;
inline constexpr std::uint8_t kOut = 0x02;

class Pipe final : public usb::Pipe {
 public:
  explicit Pipe(int end) : end_(end) {}

  std::uint32_t connection() noexcept override { return connection_; }
  bool request(const usb::Request& request) noexcept override {
    const std::array<std::uint8_t, 4> message = {kRequest, request.request, static_cast<std::uint8_t>(request.value),
                                                 static_cast<std::uint8_t>(request.value >> 8)};
    return send(end_, message.data(), message.size(), MSG_NOSIGNAL) > 0;
  }
  bool write(std::span<const std::uint8_t> bytes) noexcept override {
    if (bytes.size() > usb::kPacketSize) return false;
    std::array<std::uint8_t, 1 + usb::kPacketSize> message{kOut};
    std::ranges::copy(bytes, message.begin() + 1);
    return send(end_, message.data(), 1 + bytes.size(), MSG_NOSIGNAL) > 0;
  }
  bool settled() const noexcept override { return true; }
  std::size_t read(std::span<std::uint8_t, usb::kPacketSize> packet) noexcept override {
    const ssize_t size = recv(end_, packet.data(), packet.size(), MSG_DONTWAIT);
    return size > 0 ? static_cast<std::size_t>(size) : 0;
  }
  void reopen() noexcept override { ++connection_; }

 private:
  int end_;
  std::uint32_t connection_ = 1;
};

class Plug {
 public:
  Plug(FakeFalcon& falcon, int end) : falcon_(falcon), end_(end) {}

  bool turn(LocalTime now) {
    std::array<std::uint8_t, 128> message;
    for (;;) {
      const ssize_t size = recv(end_, message.data(), message.size(), MSG_DONTWAIT);
      if (size == 0) return false;
      if (size < 0 && errno == ECONNRESET) continue;  // the peer closed with unread data; its messages remain readable
      if (size < 0) break;
      const auto bytes = std::span(message).first(static_cast<std::size_t>(size));
      if (bytes[0] == kRequest) {
        falcon_.request(now, bytes[1], static_cast<std::uint16_t>(bytes[2] | bytes[3] << 8));
      } else {
        last_.assign(bytes.begin(), bytes.end());
        falcon_.write(now, bytes.subspan(1));
      }
    }
    while (falcon_.next_in() <= now) {
      const auto packet = falcon_.take_in(now);
      send(end_, packet.data(), packet.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
      ++said_;
    }
    return true;
  }

  /// Endpoint number and data of the last OUT transfer.
  const std::vector<std::uint8_t>& last() const { return last_; }
  std::uint64_t said() const { return said_; }

 private:
  FakeFalcon& falcon_;
  int end_;
  std::uint64_t said_ = 0;
  std::vector<std::uint8_t> last_;
};

}  // namespace tendon::socket_cable
