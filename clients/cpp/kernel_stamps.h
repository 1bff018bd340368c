// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <sys/socket.h>

#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstring>
#include <ctime>
#include <optional>
#include <utility>

#include "protocol/link.h"

namespace tendon {

/// Computes the time at which a datagram has reached this machine, from the time stamp of the kernel (SO_TIMESTAMPNS,
/// socket(7)). The thread that reads the datagram must first wake up, which often takes longer than the network.
///
/// The time stamps are Unix times (CLOCK_REALTIME), which can be set, unlike the local time. Both clocks are read after
/// the datagram was received:
///     reached = now − (unix_now − stamp)
/// The kernel changes the rates of both clocks together, so the difference only changes if the Unix time is set, or if
/// the thread is interrupted between the two readings. A time stamp is refused if the difference has changed by more
/// than kSteady since the previous datagram, if the stamp is in the future, or if it is older than kMostWait. The time
/// of the reading is then used instead.
///
/// The result is late by the time between the two readings. It is early by at most kSteady, and only if the Unix time
/// was set, so that a round trip does not become too short. Thread-safe: only refused(). Realtime-safe: yes.
class KernelStamps {
 public:
  static constexpr std::size_t kControlBytes = CMSG_SPACE(sizeof(timespec));
  /// The limit of now − reached. It is longer than the pauses of virtual machines, which were up to 36 ms in our tests.
  static constexpr Duration kMostWait = std::chrono::milliseconds(100);
  static constexpr Duration kSteady = std::chrono::microseconds(2);

  /// Enables the time stamps of a UDP or Unix socket. This is only useful for a thread that sleeps: a thread that polls
  /// reads each datagram at once, and its round trips would be 0.7 µs longer. Failures are ignored, because the socket
  /// also works without time stamps.
  static void ask(int fd) noexcept {
    const int on = 1;
    [[maybe_unused]] const int refused = ::setsockopt(fd, SOL_SOCKET, SO_TIMESTAMPNS, &on, sizeof on);
  }

  /// Returns the time stamp in the control messages of recvmsg(), if there is one.
  static std::optional<Duration> find(msghdr& header) noexcept {
    for (cmsghdr* said = CMSG_FIRSTHDR(&header); said != nullptr; said = CMSG_NXTHDR(&header, said)) {
      if (said->cmsg_level != SOL_SOCKET || said->cmsg_type != SCM_TIMESTAMPNS) continue;
      timespec time{};
      std::memcpy(&time, CMSG_DATA(said), sizeof time);
      return std::chrono::seconds(time.tv_sec) + Duration(time.tv_nsec);
    }
    return std::nullopt;
  }

  /// Must be called for each datagram without a time stamp.
  void observe(LocalTime now) noexcept { read_ = reached_ = now; }
  /// Must be called for each datagram with a time stamp. Read `unix_now` after receiving the datagram, and then `now`.
  void observe(Duration stamp, Duration unix_now, LocalTime now) noexcept {
    observe(now);
    const Duration difference = unix_now - now.time_since_epoch();
    const auto before = std::exchange(difference_, difference);
    if (!before) return;
    const bool steady = std::chrono::abs(difference - *before) <= kSteady;
    const Duration waited = unix_now - stamp;
    if (steady && waited >= Duration::zero() && waited <= kMostWait) {
      reached_ = now - waited;
    } else {
      refused_.store(refused() + 1, std::memory_order_relaxed);  // there is only one writer
    }
  }

  LocalTime read() const noexcept { return read_; }  ///< when the newest datagram was read
  LocalTime reached() const noexcept { return reached_; }
  /// The number of time stamps that were not used.
  std::uint64_t refused() const noexcept { return refused_.load(std::memory_order_relaxed); }

 private:
  std::optional<Duration> difference_;  ///< Unix time − local time
  LocalTime read_{};
  LocalTime reached_{};
  std::atomic<std::uint64_t> refused_{0};
};

}  // namespace tendon
